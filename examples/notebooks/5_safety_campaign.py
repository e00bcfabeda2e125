# %% [markdown]
# # A safety campaign in pandas
#
# Eyes differ in more than the absorption that is estimated. A campaign draws them at random and treats each; the result is
# a table.

# %%
import matplotlib.pyplot as plt

import photocoag as pc

eyes = {
    "spots": 200,
    "seed": 5,
    "input": [
        {"key": "plant.absorption_factor", "distribution": "normal", "mean": 0.7363, "sigma": 0.25, "low": 0.35, "high": 1.5},
        {"key": "plant.tissue.spot_radius_um", "distribution": "normal", "mean": 100, "sigma": 4, "low": 88, "high": 112},
        {"key": "plant.tissue.layers.RPE.thickness_um", "distribution": "normal", "mean": 6, "sigma": 0.5, "low": 4.5, "high": 7.5},
    ],
}
campaign = pc.campaign(eyes)
campaign

# %% [markdown]
# How often is the limit exceeded? 200 eyes tell no more than this interval of 95 %:

# %%
summary = campaign.summary
print(f"{summary['over_limit_spots']} of {summary['spots']} eyes: probability {summary['over_limit_probability']:.3f}, "
      f"from {summary['over_limit_probability_low']:.3f} to {summary['over_limit_probability_high']:.3f}")

# %% [markdown]
# What drives it? The rank correlation of the inputs with the highest peak:

# %%
table = campaign.to_pandas()
inputs = [one["key"] for one in eyes["input"]]
table[inputs].rank().corrwith(table["peak_max_K"].rank()).round(2)

# %%
figure, axes = plt.subplots(layout="constrained")
points = axes.scatter(table["plant.tissue.spot_radius_um"], table["peak_max_K"], s=9, c=table["plant.absorption_factor"])
axes.axhline(pc.Config().control.peak_max_K, color="#b3261e", linewidth=1)
axes.set(xlabel="spot radius of the eye, um (the model has 100 um)", ylabel="highest peak, K")
figure.colorbar(points, label="absorption factor")

# %% [markdown]
# The worst one again, cycle by cycle: its inputs are in the table, its noise is `noise_seed`. A campaign keeps one grid for
# all tissues, `simulate` makes one for this tissue: the last digits differ.

# %%
worst = table.loc[table["peak_max_K"].idxmax()]
again = pc.simulate(pc.Config().update({key: worst[key] for key in inputs}), seed=int(worst["noise_seed"]))
print(f"{again.summary['peak_true_max_K']:.4f} K again, {worst['peak_max_K']:.4f} K in the campaign")
