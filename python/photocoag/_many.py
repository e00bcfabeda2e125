"""Many treatments on all cores."""

from __future__ import annotations

import itertools
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core
from ._config import Config, toml_document
from ._errors import refuse
from ._run import Run, check_config, check_seed

if TYPE_CHECKING:
    import pandas

Progress = bool | Callable[[int, int], object]


class _Bar:
    """tqdm if it is installed, else a line on standard error."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._bar: Any = None
        try:
            from tqdm.auto import tqdm

            self._tqdm: Any = tqdm
        except ImportError:
            self._tqdm = None

    def __call__(self, done: int, total: int) -> None:
        if self._tqdm is None:
            end = "\n" if done >= total else ""
            print(f"\r{self._label}: {done} of {total}", end=end, file=sys.stderr, flush=True)
            return
        if self._bar is None:
            self._bar = self._tqdm(total=total, desc=self._label)
        self._bar.update(done - self._bar.n)
        if done >= total:
            self._bar.close()


def _watcher(progress: Progress, label: str) -> Callable[[int, int], object] | None:
    if callable(progress):
        return progress
    return _Bar(label) if progress else None


def _threads(threads: object) -> int:
    if threads is None:
        return len(os.sched_getaffinity(0))
    if isinstance(threads, bool) or not isinstance(threads, int) or not 1 <= threads <= 1024:
        raise refuse("threads", threads, "an integer from 1 to 1024, or None: all cores")
    return threads


def _seeds(seeds: object) -> list[int]:
    if isinstance(seeds, Iterable) and not isinstance(seeds, (str, bytes, Mapping)):
        try:
            return [check_seed(seed) for seed in seeds]
        except TypeError:  # an array without dimensions
            pass
    raise refuse("seeds", seeds, "integers from 0 to 2^63 - 1")


def simulate_many(
    config: Config | Sequence[Config],
    seeds: Iterable[int] | None = None,
    *,
    threads: int | None = None,
    progress: Progress = False,
    cache: bool = True,
) -> list[Run]:
    """Simulate one configuration over seeds, or several configurations, on all cores.

    Parameters
    ----------
    config : Config or sequence of Config
    seeds : iterable of int, optional
        With one configuration: ``run.seed`` of each run. With several: must be None.
    threads : int, optional
        Default: all cores that the process may use.
    progress : bool or callable
        True: a progress bar; or ``progress(done, total)``, called several times a second.

    Returns
    -------
    list of Run
        In the order of the seeds or configurations; independent of `threads`.

    Examples
    --------
    >>> import photocoag as pc
    >>> runs = pc.simulate_many(pc.Config(), range(4))
    >>> max(run.summary["peak_true_max_K"] for run in runs) < 32.0
    True
    """
    watch = _watcher(progress, "simulating")
    if isinstance(config, Config):
        numbers = _seeds(seeds)
        runs = _core.simulate_seeds(config._core, numbers, _threads(threads), bool(cache), watch)
        return [Run(run, _SeededConfig.of(config, seed)) for run, seed in zip(runs, numbers)]
    if seeds is not None:
        raise refuse("seeds", seeds, "None with several configurations: each has its run.seed")
    if not isinstance(config, Sequence):
        raise refuse("config", config, "a photocoag.Config or a sequence of them")
    configs = [check_config(one) for one in config]
    runs = _core.simulate_all([one._core for one in configs], _threads(threads), bool(cache), watch)
    return [Run(run, one) for run, one in zip(runs, configs)]


class _SeededConfig(Config):
    """A configuration with another seed, created on first use."""

    __slots__ = ("_base", "_seed")

    _base: Config
    _seed: int

    @classmethod
    def of(cls, base: Config, seed: int) -> Config:
        config = cls.__new__(cls)
        config._base, config._seed, config._values = base, seed, None
        return config

    def __getattr__(self, name: str) -> Any:
        if name == "_core":
            self._core = self._base.set("run.seed", self._seed)._core
            return self._core
        return super().__getattr__(name)


class Campaign:
    """The spots of a campaign.

    Attributes
    ----------
    spots : numpy.ndarray
        One row per spot: number, noise seed, inputs, outcomes; units in `units`.
    summary : dict
        Content of the campaign's ``summary.json``.
    """

    def __init__(
        self, columns: Mapping[str, npt.NDArray[Any]], units: dict[str, str], summary: str
    ) -> None:
        dtype = [(name, values.dtype) for name, values in columns.items()]
        self.spots: npt.NDArray[np.void] = np.empty(len(columns["spot"]), dtype=dtype)
        for name, values in columns.items():
            self.spots[name] = values
        self.units = units
        self.summary: dict[str, Any] = json.loads(summary)

    def to_pandas(self) -> pandas.DataFrame:
        """The spots as a DataFrame, indexed by their number; needs pandas."""
        import pandas

        names = self.spots.dtype.names or ()
        frame = pandas.DataFrame({name: self.spots[name] for name in names}).set_index("spot")
        frame.attrs["units"] = dict(self.units)
        return frame

    def __len__(self) -> int:
        return len(self.spots)

    def __repr__(self) -> str:
        s = self.summary
        return f"Campaign({s['spots']} spots, {s['over_limit_spots']} over the limit, peak {s['peak_max_K']:.2f} K)"


def campaign(
    campaign: str | os.PathLike[str] | Mapping[str, object],
    *,
    threads: int | None = None,
    progress: Progress = False,
    cache: bool = True,
) -> Campaign:
    """Treat the random spots of a campaign on all cores and keep all results in memory.

    At most 10,000,000 spots. The program ``photocoag campaign`` has no such limit; its
    ``campaign.h5`` can be read in parts.

    Parameters
    ----------
    campaign : path or mapping
        A campaign file, or its content: ``{"spots": 1000, "seed": 1, "set": [...], "input": [...]}``.
    threads, progress
        As in `simulate_many`.

    Returns
    -------
    Campaign
        Every spot is bit-identical to the program's.
    """
    watch = _watcher(progress, "campaign")
    if isinstance(campaign, Mapping):
        plain: dict[str, object] = {}
        tables = ""
        for key, value in campaign.items():
            if isinstance(value, (list, tuple)) and value and all(isinstance(v, Mapping) for v in value):
                toml_document({key: 0})  # refuses an invalid key
                tables += "".join(f"[[{key}]]\n{toml_document(one)}" for one in value)
            else:
                plain[key] = value
        text = toml_document(plain) + tables
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "campaign.toml"
            file.write_text(text, encoding="utf-8")
            return Campaign(*_core.campaign(str(file), _threads(threads), bool(cache), watch))
    file_name = os.fspath(campaign) if isinstance(campaign, (str, os.PathLike)) else None
    if not isinstance(file_name, str) or not file_name.isprintable():
        raise refuse("campaign", campaign, "the name of a campaign file, or its content")
    return Campaign(*_core.campaign(file_name, _threads(threads), bool(cache), watch))


def sweep(
    config: Config,
    vary: Mapping[str, Sequence[object]],
    seeds: Iterable[int] | None = None,
    *,
    threads: int | None = None,
    progress: Progress = False,
    cache: bool = True,
) -> pandas.DataFrame:
    """Simulate every combination of the given values; needs pandas.

    Parameters
    ----------
    config : Config
    vary : mapping of str to sequence
        Values by full key; the last key varies fastest.
    seeds : iterable of int, optional
        Default: the configuration's own.

    Returns
    -------
    pandas.DataFrame
        One row per run: the varied keys, ``run.seed``, and the numbers of its summary.

    Examples
    --------
    >>> import photocoag as pc
    >>> table = pc.sweep(pc.Config(), {"control.horizon": [2, 5]})
    >>> len(table)
    2
    """
    import pandas

    config = check_config(config)
    if not isinstance(vary, Mapping):
        raise refuse("vary", vary, "a mapping of full keys to their values")
    numbers = [int(config.run.seed)] if seeds is None else _seeds(seeds)
    points = [
        {**dict(zip(vary, values)), "run.seed": seed}
        for values in itertools.product(*vary.values())
        for seed in numbers
    ]
    runs = simulate_many(
        [config.update(point) for point in points], threads=threads, progress=progress, cache=cache
    )
    rows = []
    for point, run in zip(points, runs):
        plain = {k: v for k, v in run.summary.items() if isinstance(v, (int, float)) or v is None}
        rows.append({**point, **plain})
    return pandas.DataFrame(rows)


class Claim(NamedTuple):
    """A claim of the paper and its verdict."""

    study: str
    claim: str
    verdict: str
    as_expected: bool


def reproduce(
    out: str | os.PathLike[str],
    *,
    quick: bool = False,
    progress: Progress = False,
    cache: bool = True,
) -> list[Claim]:
    """Reproduce every table and figure of the paper's results, with a verdict for each claim.

    Parameters
    ----------
    out : path
        Folder, new or empty: index.html, claims.json, figures.
    quick : bool
        Skip the sensitivities.
    """
    studies = Path(__file__).parent / "share" / "studies"
    watch = _watcher(progress, "reproducing")
    rows = _core.reproduce(str(studies), os.fspath(out), bool(quick), bool(cache), watch)
    return [Claim(*row) for row in rows]
