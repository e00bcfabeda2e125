# %% [markdown]
# # The reduced model and its certificate
#
# The heat equation on the grid has 81,826 states; the controller's model has six. How well do they agree, and what is
# proved?

# %%
import matplotlib.pyplot as plt
import numpy as np

import photocoag as pc

config = pc.Config()
model = pc.reduce(config)
full = pc.FullOrderModel(config)
full, model

# %% [markdown]
# The error is measured with constant and random on/off power over the absorption factors, relative to the largest value of
# each output:

# %%
error = model.error
figure, axes = plt.subplots(layout="constrained")
for output in ("peak", "volume"):
    axes.plot(error["absorption_factor"], 100 * error[f"{output}_relative"], ".-", label=output)
axes.set(xlabel="absorption factor", ylabel="measured error, %", ylim=(0, None))
axes.legend()

# %% [markdown]
# The certificate is a bound for any power from 0 to the largest, from cold, relative to what the largest power reaches in the
# end; the measured error is relative to the largest value of its own responses.

# %%
for output in ("peak", "volume"):
    proved = model.certificate[f"{output}_relative_max"]
    print(f"{output:6} measured {100 * error[f'{output}_relative_max']:.2f} %, proved {100 * proved:.2f} %")

# %% [markdown]
# Six modes, from half a millisecond to a third of a second, stand for a sparse matrix that SciPy can take apart:

# %%
print("time constants, ms:", np.sort(-1e3 / np.linalg.eigvals(model.A).real).round(2))
print(f"full order: {full.A.shape[0]} states, {full.A.nnz} entries, symmetric: {abs(full.A - full.A.T).max() == 0}")

# %% [markdown]
# The same numbers in python-control, and against the full order:

# %%
import control

alpha = 1.1
times = np.linspace(0.001, 0.2, 200)
system = model.to_control(alpha)
theirs = control.forced_response(system, np.r_[0, times], np.full(201, 0.02)).outputs[1, 1:]
exact = pc.response(config.set("plant.absorption_factor", alpha), 0.02, times)["peak_K"]
print(f"largest difference {abs(theirs - exact).max():.3f} K of {exact.max():.2f} K")

# %% [markdown]
# `model.save("model.json")` writes the file that the program and a C++ controller read; `pc.ReducedModel.load` reads and
# verifies it.
