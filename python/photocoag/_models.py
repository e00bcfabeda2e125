"""Full-order and reduced models."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._config import Config
from ._errors import refuse
from ._run import check_config

if TYPE_CHECKING:
    import control
    import scipy.sparse

Array = npt.NDArray[np.float64]


class ReducedModel:
    """``x' = A x + B(p) u``, ``volume = C_volume(p) x``, ``peak = C_peak x``.

    ``u`` is the commanded power in W, outputs are rises over ambient in K, and ``p`` is the
    absorption factor alpha, with two parameters also the choroid factor beta.

    Attributes
    ----------
    A : numpy.ndarray
        Shape (order, order), 1/s.
    A_d : numpy.ndarray
        A of the discrete-time model, for `period` and `discretization`, 1.
    C_peak : numpy.ndarray
        Shape (order,), K.

    Examples
    --------
    >>> import photocoag as pc
    >>> model = pc.reduce(pc.Config())
    >>> model.A.shape, model.B(1.1).shape
    ((6, 6), (6,))
    """

    def __init__(self, core: _core.ReducedModel) -> None:
        self._core = core

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ReducedModel:
        """Read and verify a model file.

        Raises
        ------
        ConfigError
            Not a model file, altered (checksum), of another version, or not valid for a controller.
        """
        file = os.fspath(path)
        if not isinstance(file, str) or "\0" in file:
            raise refuse("path", path, "the name of a model file")
        return cls(_core.load_model(file))

    @classmethod
    def from_json(cls, text: str) -> ReducedModel:
        """Read and verify the text of a model file."""
        if not isinstance(text, str):
            raise refuse("text", text, "the text of a model file")
        try:
            text.encode()
        except UnicodeEncodeError:
            raise refuse("text", text, "text in Unicode") from None
        return cls(_core.model_from_json(text, "model text"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model file that the program and C++ read."""
        self._core.save(os.fspath(path))

    def to_json(self) -> str:
        """The text of the model file."""
        return self._core.to_json()

    A = property(lambda self: self._core.A, doc="Shape (order, order), 1/s.")
    A_d = property(lambda self: self._core.A_d, doc="Discrete-time A, shape (order, order), 1.")
    C_peak = property(lambda self: self._core.C_peak, doc="Shape (order,), K.")
    order = property(lambda self: self._core.order, doc="Number of states.")
    period = property(lambda self: self._core.period, doc="Control period, s.")
    parameters = property(lambda self: self._core.parameters, doc="1: alpha; 2: alpha and beta.")
    method = property(lambda self: self._core.method, doc="Reduction method.")
    discretization = property(lambda self: self._core.discretization, doc="Of the discrete matrices.")
    full_order_states = property(lambda self: self._core.full_order_states, doc="States before the reduction.")
    absorption_range = property(
        lambda self: self._core.absorption_range, doc="Range of alpha of the measured error, 1."
    )
    error = property(
        lambda self: self._core.error,
        doc="Measured error of each output relative to its largest value, by absorption factor.",
    )
    certificate = property(
        lambda self: self._core.certificate, doc="Certified error bounds relative to the gain, or None."
    )

    def B(self, absorption_factor: float, choroid_factor: float = 1.0) -> Array:
        """Continuous-time input matrix, shape (order,), per watt and second."""
        return self._core.B(absorption_factor, choroid_factor)

    def B_d(self, absorption_factor: float, choroid_factor: float = 1.0) -> Array:
        """Discrete-time input matrix, shape (order,), per watt."""
        return self._core.B_d(absorption_factor, choroid_factor)

    def C_volume(self, absorption_factor: float, choroid_factor: float = 1.0) -> Array:
        """Output matrix of the volume temperature, shape (order,), K."""
        return self._core.C_volume(absorption_factor, choroid_factor)

    def to_control(
        self, absorption_factor: float, choroid_factor: float = 1.0, *, discrete: bool = False
    ) -> control.StateSpace:
        """python-control ``StateSpace``: input power (W), outputs volume and peak (K).

        Parameters
        ----------
        absorption_factor, choroid_factor : float
            Alpha and beta, 1.
        discrete : bool
            Discrete time with sampling time `period`.
        """
        import control

        a, b = (self.A_d, self.B_d) if discrete else (self.A, self.B)
        c = np.vstack([self.C_volume(absorption_factor, choroid_factor), self.C_peak])
        step = {"dt": self.period} if discrete else {}
        return control.StateSpace(
            a, b(absorption_factor, choroid_factor)[:, None], c, np.zeros((2, 1)),
            inputs=["power_W"], outputs=["volume_K", "peak_K"], name="photocoag", **step,
        )

    def plant(self, absorption_factor: float, choroid_factor: float = 1.0) -> _core.ReducedPlant:
        """A simulated eye of this model, initially at ambient: ``step(power)``, ``outputs()``."""
        return _core.reduced_plant(self._core, absorption_factor, choroid_factor)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ReducedModel) and self.to_json() == other.to_json()

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[object, ...]:
        return ReducedModel.from_json, (self.to_json(),)

    def __repr__(self) -> str:
        error = self.error
        return (
            f"ReducedModel(order {self.order}, {self.method}, {self.period * 1e3:g} ms, error "
            f"{100 * error['peak_relative_max']:.2f} % peak, {100 * error['volume_relative_max']:.2f} % volume)"
        )


class FullOrderModel:
    """The heat equation on the grid: ``E T' = A T + E b(p) u``, ``peak = c_peak T``.

    Parameters
    ----------
    config : Config
    plant : bool
        Tissue of the simulated eye instead of the controller's nominal tissue.

    Attributes
    ----------
    E : scipy.sparse.dia_array
        Cell volumes, m3, diagonal; shape (states, states).
    A : scipy.sparse.csc_array
        Symmetric, negative definite, m3/s; the radial index runs fastest.

    Examples
    --------
    >>> import photocoag as pc
    >>> full = pc.FullOrderModel(pc.Config())
    >>> full.A.shape == (full.states, full.states)
    True
    """

    def __init__(self, config: Config, *, plant: bool = False) -> None:
        self._config = check_config(config)
        self._core = _core.full_order_model(config._core, bool(plant))
        self._sparse: tuple[Any, Any] | None = None

    def _matrices(self) -> tuple[Any, Any]:
        if self._sparse is None:
            import scipy.sparse

            volumes, values, rows, starts = self._core.sparse()
            size = len(volumes)
            self._sparse = (
                scipy.sparse.diags_array(volumes),
                scipy.sparse.csc_array((values, rows, starts), shape=(size, size)),
            )
        return self._sparse

    @property
    def E(self) -> scipy.sparse.dia_array:
        return self._matrices()[0]

    @property
    def A(self) -> scipy.sparse.csc_array:
        return self._matrices()[1]

    @property
    def states(self) -> int:
        """Grid cells."""
        return self._core.states

    @property
    def radial_edges_m(self) -> Array:
        """Radial cell faces, m."""
        return self._core.radial_edges_m

    @property
    def axial_edges_m(self) -> Array:
        """Axial cell faces, m, from the front of the first layer."""
        return self._core.axial_edges_m

    @property
    def c_peak(self) -> Array:
        """Output matrix of the peak temperature, shape (states,), 1."""
        return self._core.c_peak()

    def b(self, absorption_factor: float, choroid_factor: float = 1.0) -> Array:
        """Heating rate of each cell per watt, shape (states,), K/(W s)."""
        return self._core.b(absorption_factor, choroid_factor)

    def c_volume(self, absorption_factor: float, choroid_factor: float = 1.0) -> Array:
        """Output matrix of the volume temperature, shape (states,), 1."""
        return self._core.c_volume(absorption_factor, choroid_factor)

    def plant(self) -> _core.FullOrderPlant:
        """The configured simulated eye, initially at ambient: ``step(power)``, ``outputs()``."""
        return _core.full_order_plant(self._config._core, True)

    def __reduce__(self) -> tuple[object, ...]:
        return FullOrderModel, (self._config,)

    def __repr__(self) -> str:
        return f"FullOrderModel({self.states} states)"


class Controller(_core.Controller):
    """The model predictive controller with its estimator: sample in, power out.

    Parameters
    ----------
    model : ReducedModel
        Made for ``control.period_ms``.
    config : Config

    Raises
    ------
    ConfigError
        Bad settings, or a model for another period.

    Examples
    --------
    >>> import photocoag as pc
    >>> config = pc.Config()
    >>> controller = pc.Controller(pc.reduce(config), config)
    >>> power = controller.start()            # W, of the first period
    >>> power = controller.step(1.2, power)   # K and W -> W
    >>> 0.0 <= power <= config.control.power_max_W
    True
    """

    def __init__(self, model: ReducedModel, config: Config) -> None:
        super().__init__(check_model(model)._core, check_config(config)._core)


class Estimator(_core.Estimator):
    """The configured estimator of temperature and absorption factor.

    Parameters
    ----------
    model : ReducedModel
        Made for ``control.period_ms``.
    config : Config

    Examples
    --------
    >>> import photocoag as pc
    >>> config = pc.Config()
    >>> estimator = pc.Estimator(pc.reduce(config), config)
    >>> estimator.update(1.2, 0.02)
    >>> estimator.state.shape
    (6,)
    """

    def __init__(self, model: ReducedModel, config: Config) -> None:
        super().__init__(check_model(model)._core, check_config(config)._core)


def check_model(model: object) -> ReducedModel:
    if not isinstance(model, ReducedModel):
        raise refuse("model", model, "a photocoag.ReducedModel")
    return model


def reduce(config: Config, *, cache: bool = True) -> ReducedModel:
    """The reduced model of a configuration's tissue, with its measured error.

    Parameters
    ----------
    config : Config
    cache : bool
        Read and write the cache of reduced models; the result does not depend on it.
    """
    return ReducedModel(_core.reduce(check_config(config)._core, bool(cache)))


def response(
    config: Config,
    power: float,
    times: npt.ArrayLike,
    model: str | ReducedModel = "full",
    *,
    cache: bool = True,
) -> dict[str, Array]:
    """Response of the simulated eye to a power step from ambient.

    Parameters
    ----------
    config : Config
    power : float
        W, from t = 0 on.
    times : array_like
        Shape (n,), s, in any order.
    model : {"full", "reduced"} or ReducedModel

    Returns
    -------
    dict of numpy.ndarray
        ``time_s``, ``peak_K``, ``volume_K``, each of shape (n,).

    Examples
    --------
    >>> import photocoag as pc
    >>> pc.response(pc.Config(), 0.02, [0.01, 0.1])["peak_K"].shape
    (2,)
    """
    given = model._core if isinstance(model, ReducedModel) else None
    kind = "reduced" if given is not None else model
    if not isinstance(kind, str):
        raise refuse("model", model, '"full", "reduced" or a photocoag.ReducedModel')
    accepted = "one dimension of numbers, s"
    try:
        moments = np.asarray(times)
    except (ValueError, TypeError, OverflowError):
        raise refuse("times", times, accepted) from None
    if moments.ndim != 1 or moments.dtype.kind not in "iuf":
        raise refuse("times", times, accepted)
    return _core.response(check_config(config)._core, power, moments, kind, given, bool(cache))
