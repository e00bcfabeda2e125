# %% [markdown]
# # Your own tissue
#
# Layers, beam and absorption are keys of the configuration. `tissue` is what the controller's model is made from;
# `plant.tissue` is the eye, and follows `tissue` unless it is set.

# %%
import matplotlib.pyplot as plt
import numpy as np

import photocoag as pc

config = pc.Config()
for layer in config.tissue.layers:
    print(f"{layer['name']:22} {layer['thickness_um']:7.1f} um, absorption {layer['absorption_per_m']:9.1f} 1/m")

# %% [markdown]
# A thinner pigment epithelium and a Gaussian beam:

# %%
mine = config.update({"tissue.layers.RPE.thickness_um": 5, "tissue.beam": "gaussian"})
times = np.geomspace(1e-4, 0.4, 60)
figure, axes = plt.subplots(layout="constrained")
for name, one in (("default", config), ("mine", mine)):
    response = pc.response(one, 0.02, times)
    axes.semilogx(response["time_s"] * 1e3, response["peak_K"], label=name)
axes.set(xlabel="time, ms", ylabel="peak at 20 mW, K")
axes.legend()

# %% [markdown]
# The controller's model is made from that tissue when it is first needed, with the error that was measured:

# %%
pc.reduce(mine)

# %%
pc.simulate(mine)

# %% [markdown]
# What if the controller does not know? The eye's spot is 90 um, the model's 100 um:

# %%
wrong = config.set("plant.tissue.spot_radius_um", 90)
pc.simulate(wrong)

# %% [markdown]
# The limit is exceeded. [docs/uncertainty.md](../../docs/uncertainty.md) has the controller that takes such eyes into
# account; it is two keys and a prior away, in `configs/uncertain-eye.toml`.
