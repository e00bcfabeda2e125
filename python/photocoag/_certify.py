"""Certified number of active-set changes of the controller's solver."""

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
    """Upper bound on the active-set changes of the controller's solver, proved over a box.

    Same as the program's ``certify`` (docs/certify.md); horizons 2 to 5. Ctrl-C ends the search.

    Parameters
    ----------
    config : Config
    absorption : (float, float)
        Range of the absorption factor, 1, low and high; None: the estimator's bounds.
    choroid : (float, float)
        Range of the choroid factor, 1; only for a model with that parameter.
    free : (float, float)
        Range of the free response of the peak temperature, K, independent at each stage; None: 0 to
        1.25 times ``control.peak_max_K``.
    previous : (float, float)
        Range of the previous power, W; None: all admissible powers.
    boxes : int
        Maximum number of boxes of the search.
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
