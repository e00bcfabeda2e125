"""Real-time model predictive control of retinal laser treatment.

Research software, not a medical device: not certified, not for use on humans.

>>> import photocoag as pc
>>> run = pc.simulate(pc.Config(), seed=1)
>>> run.summary["limit_violations"]
0
"""

from __future__ import annotations

from ._certify import certify
from ._core import FullOrderPlant, ReducedPlant
from ._core import notice as __notice__
from ._core import source_hash as __source_hash__
from ._core import version as __version__
from ._config import Config, Section
from ._errors import ConfigError
from ._many import Campaign, Claim, campaign, reproduce, simulate_many, sweep
from ._models import Controller, Estimator, FullOrderModel, ReducedModel, reduce, response
from ._run import ControllerLike, EstimatorLike, PlantLike, Run, simulate, treat

__all__ = [
    "Campaign", "Claim", "Config", "ConfigError", "Controller", "ControllerLike", "Estimator",
    "EstimatorLike", "FullOrderModel", "FullOrderPlant", "PlantLike", "ReducedModel",
    "ReducedPlant", "Run", "Section", "__notice__", "__source_hash__", "__version__", "campaign",
    "certify", "reduce", "reproduce", "response", "simulate", "simulate_many", "sweep", "treat",
]
