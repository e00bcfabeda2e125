"""Proofs about the controller."""

from __future__ import annotations

from typing import Any

from . import _core
from ._config import Config
from ._run import check_config


def certify(
    config: Config,
    *,
    absorption: tuple[float, float] | None = None,
    choroid: tuple[float, float] | None = None,
    free: tuple[float, float] | None = None,
    previous: tuple[float, float] | None = None,
    boxes: int = 20_000,
    cache: bool = True,
) -> dict[str, Any]:
    """The most active-set changes that the controller's solver needs, proved over a box.

    The program's ``certify`` (docs/certify.md), for horizons from 2 to 5. Ctrl-C ends the search.

    Parameters
    ----------
    config : Config
    absorption : (float, float)
        Absorption factors, from low to high; None: the estimator's bounds.
    choroid : (float, float)
        Choroid factors, of a model with two.
    free : (float, float)
        Peak temperatures without further powers, K, at every stage by itself; None: 0 to 1.25
        times ``control.peak_max_K``.
    previous : (float, float)
        The power before, W; None: all powers.
    boxes : int
        Most boxes to look at.
    cache : bool
        Read and write the cache of reduced models.

    Returns
    -------
    dict
        ``claim``, ``changes_proved``, ``changes_seen``, ``hard_bound``, ``share_of_box`` (in which
        `changes_seen` is proved), ``covers_rounding``, ``boxes``.

    Examples
    --------
    >>> import photocoag as pc
    >>> proof = pc.certify(pc.Config().set("control.horizon", 2))
    >>> proof["changes_proved"], proof["share_of_box"]
    (1, 1.0)
    """
    core = check_config(config)._core
    return _core.certify(core, absorption, choroid, free, previous, boxes, bool(cache))
