"""One treatment: simulate, inspect and save it."""

from __future__ import annotations

import json
import os
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from . import _core
from ._config import Config
from ._errors import refuse

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

Outputs = tuple[float, float]


@runtime_checkable
class ControllerLike(Protocol):
    """A user's controller. Optional methods: ``start() -> float``, the power of the first period, W
    (default: ``step(0.0, 0.0)``, tissue at ambient), and ``outputs() -> (volume_K, peak_K)``, its
    own estimate (default: that of the configured estimator), recorded and supervised."""

    def step(self, volume_temperature: float, applied_power: float, /) -> float:
        """Power of the coming period, W, from the sample at the end of the last one, K (NaN: none),
        and the power applied in it, W."""


@runtime_checkable
class EstimatorLike(Protocol):
    """A user's estimator for the configured controller. Attributes after each `update`:
    ``state`` (order,), ``absorption_factor``; optional ``covariance``, ``absorption_sigma``."""

    def update(self, volume_temperature: float, applied_power: float, /) -> object:
        """Measurement update with the sample at the end of a period, K (NaN: none), and the power
        applied in it, W."""


@runtime_checkable
class PlantLike(Protocol):
    """A user's simulated tissue."""

    def step(self, power: float, /) -> object:
        """Advances by one control period of constant power, W."""

    def outputs(self) -> Outputs:
        """(volume_K, peak_K): temperature rises over ambient at the end of the period, K."""


class Run:
    """A finished treatment.

    Attributes
    ----------
    config : Config
        The requested configuration.
    summary : dict
        Content of ``summary.json``.
    cycles : numpy.ndarray
        One row per control cycle, with the columns of ``run.csv`` as named fields.

    Examples
    --------
    >>> import photocoag as pc
    >>> run = pc.simulate(pc.Config())
    >>> bool(run.cycles["peak_true_K"].max() < run.summary["limit_K"])
    True
    """

    def __init__(self, core: _core.Run, config: Config) -> None:
        self._core = core
        self.config = config
        self._cycles: npt.NDArray[np.void] | None = None
        self._units: dict[str, str] = {}
        self._summary: dict[str, Any] | None = None

    @property
    def summary(self) -> dict[str, Any]:
        if self._summary is None:
            self._summary = json.loads(self._core.summary_json())
        return self._summary

    @property
    def cycles(self) -> npt.NDArray[np.void]:
        if self._cycles is None:
            self._read_columns()
        assert self._cycles is not None
        return self._cycles

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        if self._cycles is None:
            self._read_columns()
        return self._units

    def _read_columns(self) -> None:
        self._cycles, self._units = _table(self._core.columns())

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> Run:
        """Read a run folder written by the program, of a simulated eye or of a device.

        Parameters
        ----------
        folder : str or path
            Holds ``config.toml``, ``run.csv`` and ``summary.json``.

        Raises
        ------
        ConfigError
            A file is missing or damaged; `where` names it.
        """
        if not isinstance(folder, (str, os.PathLike)) or "\0" in os.fsdecode(folder):
            raise refuse("folder", folder, "the name of a run folder")
        path = Path(os.fsdecode(folder))
        config = Config.load(path / "config.toml")
        cycles, units = _table(_core.read_columns(str(path / "run.csv")))
        try:
            csv = (path / "run.csv").read_bytes().decode()
            summary = json.loads((path / "summary.json").read_bytes())
        except (OSError, ValueError) as error:
            raise refuse("summary.json", str(error), "the summary.json of a run folder") from None
        if not isinstance(summary, dict):
            raise refuse("summary.json", summary, "the summary.json of a run folder")
        return FrozenRun(config, summary, cycles, units, csv)

    def to_pandas(self) -> pandas.DataFrame:
        """The cycles as a DataFrame; needs pandas."""
        import pandas

        frame = pandas.DataFrame({name: self.cycles[name] for name in self.cycles.dtype.names or ()})
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_csv(self) -> str:
        """The text of ``run.csv``: byte-identical to the program's for this configuration."""
        return self._core.to_csv()

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write a run folder: config.toml, run.csv, summary.json, field.vtr, report.html.

        Raises
        ------
        ConfigError
            `folder` exists and is not empty, or cannot be written.
        """
        self._core.save(os.fspath(folder))

    def plot(self) -> Figure:
        """Peak, volume temperature, power and estimate over time; needs matplotlib."""
        from ._plot import plot_run

        return plot_run(self)

    @property
    def loop_seconds(self) -> float:
        """Wall-clock time of the closed loop, s."""
        return self._core.wall_seconds

    def __len__(self) -> int:
        return len(self.cycles)

    def __repr__(self) -> str:
        s = self.summary
        peak = "unknown" if s["peak_true_max_K"] is None else f"{s['peak_true_max_K']:.2f} K"
        stopped = f", stopped for {s['stopped_for']}" if s["stopped_for"] else ""
        return f"Run({s['cycles']} cycles, peak {peak}, limit {s['limit_K']:g} K{stopped})"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(key)}</th><td style='word-break:break-all'>{escape(_shown(value))}</td></tr>"
            for key, value in self.summary.items()
            if not isinstance(value, (dict, list)) and key != "notice"
        )
        return f"<table><caption>{escape(repr(self))}</caption>{rows}</table>"

    def __reduce__(self) -> tuple[object, ...]:
        return FrozenRun, (self.config, self.summary, np.array(self.cycles), dict(self.units), self.to_csv())


def _table(
    columns: list[tuple[str, str, npt.NDArray[Any], list[str] | None]],
) -> tuple[npt.NDArray[np.void], dict[str, str]]:
    """A structured array and the unit of each column."""
    values = [(name, v if words is None else np.asarray(words)[v]) for name, _, v, words in columns]
    table = np.empty(len(values[0][1]) if values else 0, dtype=[(name, v.dtype) for name, v in values])
    for name, v in values:
        table[name] = v
    table.flags.writeable = False
    return table, {name: unit for name, unit, _, _ in columns}


class FrozenRun(Run):
    """A run that was loaded or unpickled: its results without the models that `save` needs."""

    def __init__(
        self,
        config: Config,
        summary: dict[str, Any],
        cycles: npt.NDArray[np.void],
        units: dict[str, str],
        csv: str,
    ) -> None:
        self.config = config
        self._summary = summary
        self._cycles = cycles
        self._cycles.flags.writeable = False
        self._units = units
        self._csv = csv

    def to_csv(self) -> str:
        return self._csv

    def save(self, folder: str | os.PathLike[str]) -> None:
        raise refuse("run", "a run that was read or unpickled", "a run of this process: simulate its config again")

    @property
    def loop_seconds(self) -> float:
        return float(self.summary["loop_wall_s"] or 0.0)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def check_config(config: object) -> Config:
    if not isinstance(config, Config):
        raise refuse("config", config, "a photocoag.Config")
    return config


def check_seed(seed: object) -> int:
    accepted = "an integer from 0 to 2^63 - 1"
    if isinstance(seed, bool) or not hasattr(seed, "__index__"):
        raise refuse("seed", seed, accepted)
    try:
        number = int(seed.__index__())
    except TypeError:  # an array that is not a scalar
        raise refuse("seed", seed, accepted) from None
    if not 0 <= number < 2**63:
        raise refuse("seed", seed, accepted)
    return number


def simulate(
    config: Config,
    seed: int | None = None,
    controller: ControllerLike | _core.Controller | None = None,
    estimator: EstimatorLike | _core.Estimator | None = None,
    plant: PlantLike | None = None,
    *,
    cache: bool = True,
) -> Run:
    """One closed-loop treatment of a simulated eye in virtual time.

    The same configuration and seed give the same bytes as ``./photocoag simulate``. Writes no file
    except the cache of reduced models and starts no process.

    Parameters
    ----------
    config : Config
    seed : int, optional
        Seed of the measurement noise, instead of ``run.seed``.
    controller, estimator, plant : optional
        Your own parts in place of the built-in ones: `ControllerLike`, `EstimatorLike`,
        `PlantLike`. Noise, delay, watchdog, supervisor and record are the same.
    cache : bool
        Read and write the cache of reduced models.

    Returns
    -------
    Run

    Raises
    ------
    ConfigError
        The configuration cannot be simulated, or one of your own parts returns something that is
        not a finite number.

    Examples
    --------
    >>> import photocoag as pc
    >>> class Proportional:
    ...     def step(self, volume_temperature, applied_power):
    ...         return 0.004 * (12.0 - volume_temperature)
    >>> run = pc.simulate(pc.Config(), seed=2, controller=Proportional())
    >>> run.summary["cycles"]
    250
    """
    config = check_config(config)
    if seed is not None:
        config = config.set("run.seed", check_seed(seed))
    return Run(_core.simulate(config._core, controller, estimator, plant, bool(cache)), config)


def treat(config: Config, seed: int | None = None, *, cache: bool = True) -> Run:
    """The same treatment paced by the clock, with real-time scheduling if the machine grants it.

    Parameters
    ----------
    config : Config
    seed : int, optional
        Seed of the measurement noise, instead of ``run.seed``.

    Returns
    -------
    Run
        Its summary also holds ``scheduling`` and ``timing``. Ctrl-C ends the treatment at 0 W.
    """
    config = check_config(config)
    if seed is not None:
        config = config.set("run.seed", check_seed(seed))
    return Run(_core.treat(config._core, bool(cache)), config)
