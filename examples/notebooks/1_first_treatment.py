# %% [markdown]
# # First treatment
#
# A laser heats one spot of the retina. The peak temperature in the tissue cannot be measured; a noisy average
# temperature can. An estimator works out the rest, and an optimisation chooses the power of the next millisecond.
#
# Research software, not a medical device.

# %%
import photocoag as pc

config = pc.Config()
config

# %% [markdown]
# A configuration has every key of the program, with its unit in the name. It never changes: `set` returns another one.
# Here the eye absorbs less than the controller assumes at first (`estimator.absorption_initial`), and the controller is
# not told.

# %%
weak = config.set("plant.absorption_factor", 0.5)
run = pc.simulate(weak, seed=7)
run

# %%
run.plot()

# %% [markdown]
# The numbers behind the figure: `summary` is what the program writes as `summary.json`, `cycles` has the columns of
# `run.csv`, as a structured array.

# %%
for key in ("peak_true_max_K", "limit_K", "time_to_95_percent_s", "rms_error_after_50_ms_K"):
    print(f"{key:26} {run.summary[key]:.4g}")

cycles = run.cycles
error = cycles["peak_estimate_K"] - cycles["peak_true_K"]
print(f"estimated peak, error after 50 ms: {error[50:].std():.3f} K")

# %% [markdown]
# How much do eyes differ? The same treatment over absorption factors, three noises each:

# %%
table = pc.sweep(config, {"plant.absorption_factor": [0.4, 0.7, 1.0, 1.3]}, seeds=[1, 2, 3])
table.groupby("plant.absorption_factor")[["peak_true_max_K", "time_to_95_percent_s"]].max()
