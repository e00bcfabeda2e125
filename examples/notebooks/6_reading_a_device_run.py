# %% [markdown]
# # Reading the run of a device
#
# `./photocoag treat --device ...` drives an eye in another process, or a vendor's driver, and leaves a run folder. Here it
# is the simulated eye's process, which answers each laser pulse with a pressure transient.

# %%
import os
import subprocess
import tempfile

import matplotlib.pyplot as plt

import photocoag as pc

program = os.environ.get("PHOTOCOAG_PROGRAM", "./photocoag")
folder = os.path.join(tempfile.mkdtemp(), "run")
subprocess.run([program, "treat", "--device", "eye", "--set", "run.duration_ms=100", "--out", folder], check=True, capture_output=True)
run = pc.Run.load(folder)
run

# %% [markdown]
# A device run has two columns more: what was written, and what the device says it had in force. Units are in the names and
# in `units`:

# %%
table = run.to_pandas()
table[["time_s", "power_W", "power_command_W", "device_command_W", "volume_measured_K", "overrun"]].head()

# %% [markdown]
# Did anything go wrong? Every intervention has a reason, every refused sample a verdict:

# %%
print(table["safety_reason"].value_counts().to_string())
print(table["sample_verdict"].value_counts().to_string())
print(f"overruns: {table['overrun'].sum()}, stopped for: {run.summary['stopped_for']}")

# %% [markdown]
# Does the estimate follow what was measured? Without a bias, the samples scatter around it by the sensor's noise:

# %%
residual = table["volume_measured_K"] - table["volume_estimate_K"]
figure, axes = plt.subplots(layout="constrained")
axes.plot(1e3 * table["time_s"], residual, ".", markersize=3)
axes.axhline(0.0, color="#8a8f98", linewidth=1)
axes.set(xlabel="time, ms", ylabel="sample minus estimate, K")
print(f"mean {residual[20:].mean():.3f} K, standard deviation {residual[20:].std():.3f} K")
