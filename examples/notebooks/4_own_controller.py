# %% [markdown]
# # Your own controller against the predictive one
#
# `simulate` takes any object with `step(volume_temperature, applied_power)`. Eye, noise, delay and supervisor stay the
# same, so that two controllers meet the same random numbers.

# %%
import control
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import photocoag as pc

config = pc.Config()
model = pc.reduce(config)
REFERENCE = config.control.peak_reference_K
POWER_MAX = config.control.power_max_W

# %% [markdown]
# **PI** on the estimated peak. It stops integrating while the laser saturates, or it would overshoot:

# %%
class ProportionalIntegral:
    def __init__(self):
        self.estimator = pc.Estimator(model, config)
        self.integral = 0.0

    def step(self, volume_temperature, applied_power):
        self.estimator.update(volume_temperature, applied_power)
        error = REFERENCE - self.estimator.outputs()[1]
        power = 0.002 * error + self.integral
        if 0.0 < power < POWER_MAX:
            self.integral += 0.0005 * error
        return power


# %% [markdown]
# **LQR** with an integrator: state feedback for the nominal absorption, on the state of the same estimator:

# %%
order = model.order
nominal = config.estimator.absorption_initial
A = np.block([[model.A_d, np.zeros((order, 1))], [-model.C_peak, np.ones(1)]])
B = np.r_[model.B_d(nominal), 0.0][:, None]
Q = np.zeros((order + 1, order + 1))
Q[:order, :order] = np.outer(model.C_peak, model.C_peak)
Q[order, order] = 0.2
GAIN = control.dlqr(A, B, Q, [[2e4]])[0].ravel()


class LinearQuadratic:
    def __init__(self):
        self.estimator = pc.Estimator(model, config)
        self.integral = 0.0

    def step(self, volume_temperature, applied_power):
        self.estimator.update(volume_temperature, applied_power)
        power = -GAIN @ np.r_[self.estimator.state, self.integral]
        if 0.0 < power < POWER_MAX:
            self.integral += REFERENCE - self.estimator.outputs()[1]
        return power


# %% [markdown]
# The same four eyes and noises for each. The supervisor is off: it would step in before a bad controller shows.

# %%
rows = []
for alpha in (0.5, 0.8, 1.1, 1.4):
    eye = config.update({"plant.absorption_factor": alpha, "safety.supervisor": "off"})
    for name, part in (("MPC", None), ("PI", ProportionalIntegral()), ("LQR", LinearQuadratic())):
        summary = pc.simulate(eye, seed=3, controller=part).summary
        rows.append({
            "alpha": alpha,
            "controller": name,
            "peak_K": summary["peak_true_max_K"],
            "cycles above limit": summary["limit_violations"],
            "ms to 95 %": 1e3 * summary["time_to_95_percent_s"] if summary["time_to_95_percent_s"] else None,
            "RMS after 50 ms, K": summary["rms_error_after_50_ms_K"],
        })
pd.DataFrame(rows).set_index(["alpha", "controller"]).round(2)

# %% [markdown]
# The weakest eye, cycle by cycle:

# %%
weak = config.update({"plant.absorption_factor": 0.5, "safety.supervisor": "off"})
figure, axes = plt.subplots(layout="constrained")
for name, part in (("MPC", None), ("PI", ProportionalIntegral()), ("LQR", LinearQuadratic())):
    cycles = pc.simulate(weak, seed=3, controller=part).cycles
    axes.plot(1e3 * cycles["time_s"], cycles["peak_true_K"], label=name)
axes.axhline(config.control.peak_max_K, color="#b3261e", linewidth=1)
axes.set(xlabel="time, ms", ylabel="true peak, K")
axes.legend()

# %% [markdown]
# Both have gains that were chosen for one absorption factor and know no limit. Tune them: the comparison is as fair as the
# tuning. How long does a run take?

# %%
import time

begin = time.perf_counter()
pc.simulate(config, controller=ProportionalIntegral())
print(f"250 cycles, full-order eye, PI in Python: {1e3 * (time.perf_counter() - begin):.1f} ms")
