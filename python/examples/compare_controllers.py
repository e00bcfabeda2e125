"""Compares a PI with the model predictive controller on the same eyes and noise."""

from __future__ import annotations

import photocoag as pc


class ProportionalIntegral:
    """Holds the estimated peak at the reference; the estimate is the configured filter's."""

    def __init__(self, config: pc.Config, model: pc.ReducedModel) -> None:
        self._estimator = pc.Estimator(model, config)
        self._reference: float = config.control.peak_reference_K
        self._period: float = config.control.period_ms * 1e-3
        self._integral = 0.0

    def step(self, volume_temperature: float, applied_power: float, /) -> float:
        self._estimator.update(volume_temperature, applied_power)
        error = self._reference - self._estimator.outputs()[1]
        self._integral += error * self._period
        return 0.002 * error + 0.05 * self._integral


def main() -> None:
    config = pc.Config()
    model = pc.reduce(config)
    for alpha in (0.5, 0.8, 1.1, 1.4):
        eye = config.set("plant.absorption_factor", alpha)
        ours = pc.simulate(eye)
        own = pc.simulate(eye, controller=ProportionalIntegral(eye, model))
        for name, run in (("MPC", ours), ("PI", own)):
            s = run.summary
            print(f"alpha {alpha:.1f} {name:4}: peak {s['peak_true_max_K']:.2f} K, RMS {s['rms_error_after_50_ms_K']:.3f} K")


if __name__ == "__main__":
    main()
