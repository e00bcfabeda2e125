"""Gymnasium environments; needs gymnasium.

>>> import gymnasium, photocoag.envs
>>> env = gymnasium.make("photocoag/Treatment-v0")
>>> many = gymnasium.make_vec("photocoag/Treatment-v0", num_envs=8)
"""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
import numpy.typing as npt

from .. import _core
from .._config import Config
from .._errors import refuse
from .._run import check_config

Observation = npt.NDArray[np.float64]


class TreatmentEnv(gymnasium.Env[Observation, npt.NDArray[np.float64]]):
    """One treatment of a simulated eye; a step is a control period.

    The action is the laser power of the period in W, shape (1,), from ``control.power_min_W`` to
    ``control.power_max_W``. The observation, shape (3,), is the measured volume temperature
    rise in K, the applied power in W, and the elapsed fraction of the treatment. The reward is
    ``-((peak - reference) / reference) ** 2`` of the true peak, which is not observed.
    ``info`` holds ``cost``, the excess of the true peak over ``control.peak_max_K`` in K (0 below),
    ``peak_true_K``, ``volume_true_K`` and ``absorption_factor``. An episode lasts
    ``run.duration_ms`` and is then truncated.

    Parameters
    ----------
    config : Config, optional
        Default: the paper's 1 kHz case. Its supervisor and controller are not used.
    absorption_factor : (float, float), optional
        A new eye each episode, drawn uniformly from this range; default:
        ``plant.absorption_factor``.

    Notes
    -----
    `reset` with the same seed gives the same eye and noise. A missing sample
    (``plant.zero_power_sample = "missing"``) is observed as 0.

    Examples
    --------
    >>> env = TreatmentEnv(absorption_factor=(0.35, 1.5))
    >>> observation, info = env.reset(seed=1)
    >>> observation, reward, terminated, truncated, info = env.step(np.array([0.02]))
    >>> info["cost"]
    0.0
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        config: Config | None = None,
        absorption_factor: tuple[float, float] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.config = Config() if config is None else check_config(config)
        alpha = self.config.plant.absorption_factor
        self._range = (alpha, alpha) if absorption_factor is None else _checked(absorption_factor)
        self.render_mode = render_mode
        control = self.config.control
        self._reference = float(control.peak_reference_K)
        self._limit = float(control.peak_max_K)
        self._cycles = self.config.cycles
        self._eye = _core.Eye(self.config._core, True)
        self.action_space = gymnasium.spaces.Box(
            float(control.power_min_W), float(control.power_max_W), (1,), np.float64
        )
        self.observation_space = gymnasium.spaces.Box(
            np.array([-np.inf, 0.0, 0.0]), np.array([np.inf, 1.0, 1.0]), dtype=np.float64
        )
        self._cycle = self._cycles
        self._alpha = alpha

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        super().reset(seed=seed)
        low, high = self._range
        self._alpha = float(self.np_random.uniform(low, high)) if high > low else low
        self._eye.reset(int(self.np_random.integers(2**63)), self._alpha)
        self._cycle = 0
        return np.zeros(3), self._info(0.0, 0.0)

    def step(
        self, action: npt.NDArray[np.float64]
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        if self._cycle >= self._cycles:
            raise gymnasium.error.ResetNeeded("the treatment is over: reset() comes first")
        power = np.asarray(action, dtype=np.float64).reshape(-1)
        if power.shape != (1,) or not np.isfinite(power[0]):
            raise refuse("action", action, "one finite power, W, shape (1,)")
        space = self.action_space
        assert isinstance(space, gymnasium.spaces.Box)
        measured, applied, volume, peak = self._eye.step(
            float(min(max(power[0], space.low[0]), space.high[0]))
        )
        self._cycle += 1
        seen = 0.0 if np.isnan(measured) else measured
        observation = np.array([seen, applied, self._cycle / self._cycles])
        reward = -(((peak - self._reference) / self._reference) ** 2)
        return observation, reward, False, self._cycle == self._cycles, self._info(volume, peak)

    def _info(self, volume: float, peak: float) -> dict[str, Any]:
        return {
            "cost": max(0.0, peak - self._limit),
            "peak_true_K": peak,
            "volume_true_K": volume,
            "absorption_factor": self._alpha,
        }


def _checked(values: object) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in values)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise refuse("absorption_factor", values, "(low, high), from 0.05 to 5") from None
    if not 0.05 <= low <= high <= 5.0:
        raise refuse("absorption_factor", values, "(low, high), from 0.05 to 5")
    return low, high


gymnasium.register(id="photocoag/Treatment-v0", entry_point="photocoag.envs:TreatmentEnv")
