"""Chattering schemes: rest by proof, or by one of the common thresholds."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar, Final, Literal, get_args

import numpy as np
from numpy.polynomial import polynomial

from rocking.block import Blocks
from rocking.block.body import Bodies
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, split_range
from rocking.core.constants import Model
from rocking.errors import OptionError, OutsideFitWarning
from rocking.kernels import state
from rocking.motion.motion import Motion

CriticalMethod = Literal["eq76", "eq77", "exact"]

#: Ranges of frequency and restitution in which the paper fitted Eqs 76 and 77.
FITTED_FREQUENCIES: Final = (0.5, 8.0)
FITTED_RESTITUTIONS: Final = (0.5, 0.97)

#: Number of critical amplitudes per call of a kernel, which takes about a third of a second.
_CRITICAL_BATCH: Final = 512

_SCHEMES: dict[str, type[ChatteringScheme]] = {}


@dataclass(frozen=True)
class ChatteringScheme(ABC):
    """Chattering scheme: the rule by which a sequence of impacts ends.

    A user-defined subclass is available by its `name` as soon as it is imported. At an impact, one of the measures of
    the kernels (`rocking.kernels.state`) is compared with its thresholds.

    See Also
    --------
    Certified : Rest proven by a certificate (default).
    VelocityThreshold : Rest below a threshold of speed.
    IntervalThreshold : Rest below a threshold of the interval between impacts.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> response = rocking.simulate(block, None, chattering="velocity=1e-6", initial_rotation=0.1)
    >>> isinstance(response.chattering, rocking.ChatteringScheme), response.chattering.label
    (True, 'velocity 1e-06')
    """

    #: Name in ``chattering=`` and on the command line.
    name: ClassVar[str]
    #: Measure that the kernels compare with the thresholds, a code of `rocking.kernels.state`.
    code: ClassVar[int]
    #: Unit of its parameter in tables: "speed" is the unit of the body, "" stands for a word.
    unit: ClassVar[str]

    def __init_subclass__(cls) -> None:
        _SCHEMES[cls.name] = cls

    def __post_init__(self) -> None:
        """Check that all parameters are positive numbers."""
        unit = "m/s, or of a block fractions of p alpha" if self.unit == "speed" else self.unit
        for parameter in fields(self):
            checks.positive(getattr(self, parameter.name), parameter.name, OptionError, unit)

    @property
    def label(self) -> str:
        """Short name with the parameter and its unit, for tables and figures."""
        values = [f" {getattr(self, parameter.name):g}" for parameter in fields(self)]
        return f"{self.name}{''.join(values)}{' s' if self.unit == 's' else ''}"

    @property
    def bracket_width(self) -> float:
        """Required width of the bracket of the time of rest, s; 0 without a proof."""
        return 0.0

    @abstractmethod
    def thresholds(self, bodies: Bodies, motion: Motion | None, model: Model, factor: float | Floats = 1.0) -> Floats:
        """Return the thresholds for the impacts of both sides of every body, shape (n, 2).

        The unit is the unit of the measure `code`. Without a motion the rocking is free; `factor` multiplies the
        motion. Raise `OptionError` if the scheme does not support such bodies or motions.
        """

    def __str__(self) -> str:
        """Format the scheme as text that `chattering_scheme` accepts."""
        values = [str(getattr(self, parameter.name)) for parameter in fields(self)]
        return "=".join([self.name, *values])

    @classmethod
    def from_text(cls, value: str) -> ChatteringScheme:
        """Create the scheme from the text after "NAME=", or raise `OptionError`."""
        if not fields(cls):
            raise OptionError(f"the chattering scheme {cls.name} has no parameter; got {value!r}")
        try:
            return cls(float(value))  # type: ignore[call-arg]
        except ValueError:
            raise OptionError(
                f"the parameter of the chattering scheme {cls.name} must be a number, not {value!r}"
            ) from None


@dataclass(frozen=True)
class AsymptoticTime(ChatteringScheme):
    """Rest once the asymptotic chattering time (paper, Eq. 65) has passed since uplift (paper, Fig. 8a).

    Only sinusoidal motions and symmetric blocks are supported. Above the critical amplitude the block never rests. If
    Eq. 65 exceeds the true time, the block rests once time no longer advances between impacts (`rests_by_rounding`).

    Parameters
    ----------
    critical : {"eq76", "eq77", "exact"}
        Critical amplitude of the scheme: a fit of the paper, or exact. For amplitudes between the two, the block rests
        although chattering is incomplete (fit above the exact value), or does not rest although chattering is complete
        (fit below it).

    Raises
    ------
    OptionError
        If `critical` is none of these.

    Warns
    -----
    OutsideFitWarning
        If a fit is used outside its range of frequencies (0.5 to 8, divided by p) and restitutions (0.5 to 0.97).

    See Also
    --------
    Certified : Rest proven by a certificate (default).

    Notes
    -----
    Amplitudes are normalised by the uplift acceleration: g alpha in the linear model, as in the paper, and g tan(alpha)
    in the nonlinear model.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> sine = rocking.pulses.sine(amplitude=2.0, frequency=1.0, cycles=1)
    >>> response = rocking.simulate(block, sine, model="linear", chattering=rocking.AsymptoticTime("exact"))
    >>> response.events["kind"][1].item(), f"{response.events['time'][1]:.4f} s"
    ('rest', '0.4593 s')
    """

    name: ClassVar[str] = "time"
    code: ClassVar[int] = state.RestRule.TIME
    unit: ClassVar[str] = ""

    critical: CriticalMethod = "eq76"

    def __post_init__(self) -> None:
        checks.choice(self.critical, "critical", OptionError, get_args(CriticalMethod))

    @property
    def label(self) -> str:
        """Name and equations."""
        return f"time (Eq. 65, {'exact a_cr' if self.critical == 'exact' else f'Eq. {self.critical[2:]}'})"

    @classmethod
    def from_text(cls, value: str) -> ChatteringScheme:
        """Create the scheme from the name of a critical amplitude."""
        return cls(value)  # type: ignore[arg-type]

    def thresholds(self, bodies: Bodies, motion: Motion | None, model: Model, factor: float | Floats = 1.0) -> Floats:
        """Return the chattering time of every side, s; infinite for incomplete chattering."""
        from rocking.kernels.sine.series import sum_eq65

        is_sine = motion is not None and motion.description.family == "sine" and motion.vertical is None
        if not (isinstance(bodies, Blocks) and not bodies.terms and bodies.is_symmetric and motion and is_sine):
            raise OptionError(
                '{} "time" requires symmetric blocks under sinusoidal motions (rocking.pulses.sine) without a '
                'vertical component; use "certified"',
                "chattering",
            )
        parameters, eta = motion.description.parameters, bodies.restitution
        threshold = bodies.alpha if model == "linear" else np.tan(bodies.alpha)
        amplitude = np.abs(np.reshape(factor, (-1, 1)) * parameters["amplitude"]) / (bodies.gravity * threshold)
        frequency = 2.0 * np.pi * parameters["frequency"] / bodies.p
        critical, lossy = np.ones(frequency.shape), eta < 1.0
        critical[lossy] = compute_critical_amplitudes(self.critical, frequency[lossy], eta[lossy])
        complete = (amplitude >= 1.0) & (amplitude < critical)
        first, third = np.reshape([sum_eq65(e) for e in eta.flat], (*eta.shape, 2)).T
        first, third = (np.where(np.isfinite(sums), sums, 0.0) for sums in (first, third))  # infinite without losses
        excess = np.where(complete, amplitude - 1.0, 0.0).T
        times = (np.sqrt(excess) * (first + excess * third) / frequency.T).T
        return np.where(complete, times / bodies.p, np.inf)


@dataclass(frozen=True)
class Certified(ChatteringScheme):
    """Rest if and only if the certificate proves complete chattering (default).

    Parameters
    ----------
    tolerance : float
        Width of the bracket of the time of rest, s, below which no further impacts are resolved.

    See Also
    --------
    VelocityThreshold : Rest below a threshold of speed.

    Examples
    --------
    >>> Certified(tolerance=1e-9)
    Certified(tolerance=1e-09)
    """

    name: ClassVar[str] = "certified"
    code: ClassVar[int] = state.RestRule.CERTIFIED
    unit: ClassVar[str] = "s"

    tolerance: float = 1e-12

    @property
    def bracket_width(self) -> float:
        """The tolerance."""
        return self.tolerance

    def thresholds(self, bodies: Bodies, motion: Motion | None, model: Model, factor: float | Floats = 1.0) -> Floats:
        """Return zeros, because there is no threshold."""
        return np.zeros((len(bodies), 2))


@dataclass(frozen=True)
class VelocityThreshold(ChatteringScheme):
    """Rest as soon as the angular speed after an impact is below a threshold (paper, Fig. 8b).

    Parameters
    ----------
    threshold : float
        VelTol/(p alpha), the threshold divided by p and alpha of the side, dimensionless.

    See Also
    --------
    GeometricBypass : Rest at the end of the remaining geometric sequence.
    Certified : Rest proven by a certificate (default).

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> response = rocking.simulate(block, None, chattering=rocking.VelocityThreshold(1e-3), initial_rotation=0.1)
    >>> f"{response.events['time'][-1]:.4f} s", len(response.impacts)
    ('9.2823 s', 65)
    """

    name: ClassVar[str] = "velocity"
    code: ClassVar[int] = state.RestRule.VELOCITY
    unit: ClassVar[str] = "speed"

    threshold: float = 5e-10

    def thresholds(self, bodies: Bodies, motion: Motion | None, model: Model, factor: float | Floats = 1.0) -> Floats:
        """Return the threshold of every side, in rad/s for a block."""
        return bodies.speed_thresholds(self.threshold)


@dataclass(frozen=True)
class GeometricBypass(VelocityThreshold):
    """Rest at the estimated end of the impacts that follow one with a speed below a threshold.

    The accelerations are assumed to remain constant after that impact. The sequence is then geometric, and lasts 2 v
    (1/g + e/g')/(1 - e e') on sides with restitutions e and e' and accelerations g and g' towards the ground. If an
    acceleration is not positive, arcs continue to be resolved.

    Parameters
    ----------
    threshold : float
        Threshold divided by p and alpha of the side, as in `VelocityThreshold`.

    See Also
    --------
    VelocityThreshold : Rest as soon as the speed is below the threshold.

    Notes
    -----
    The method is the one of :cite:t:`nordmark2009`, to first order in the speed.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> response = rocking.simulate(block, None, chattering=rocking.GeometricBypass(1e-3), initial_rotation=0.1)
    >>> f"{response.events['time'][-1]:.4f} s", len(response.impacts)
    ('9.2915 s', 65)
    """

    name: ClassVar[str] = "bypass"
    code: ClassVar[int] = state.RestRule.BYPASS

    threshold: float = 1e-3


@dataclass(frozen=True)
class IntervalThreshold(ChatteringScheme):
    """Rest as soon as the interval between two impacts is below a threshold.

    Parameters
    ----------
    threshold : float
        Shortest resolved interval between impacts, s.

    See Also
    --------
    Certified : Rest proven by a certificate (default).

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> response = rocking.simulate(block, None, chattering=rocking.IntervalThreshold(1e-3), initial_rotation=0.1)
    >>> f"{response.events['time'][-1]:.4f} s", len(response.impacts)
    ('9.2832 s', 66)
    """

    name: ClassVar[str] = "interval"
    code: ClassVar[int] = state.RestRule.INTERVAL
    unit: ClassVar[str] = "s"

    threshold: float = 1e-9

    def thresholds(self, bodies: Bodies, motion: Motion | None, model: Model, factor: float | Floats = 1.0) -> Floats:
        """Return the threshold of every side, s."""
        return np.full((len(bodies), 2), self.threshold)


def chattering_scheme(chattering: str | ChatteringScheme) -> ChatteringScheme:
    """Return the scheme with a name, or with a name and a parameter, or the given scheme itself.

    Examples
    --------
    >>> chattering_scheme("certified"), chattering_scheme("velocity=1e-6"), str(chattering_scheme("interval"))
    (Certified(tolerance=1e-12), VelocityThreshold(threshold=1e-06), 'interval=1e-09')
    """
    if isinstance(chattering, ChatteringScheme):
        return chattering
    name, separator, value = chattering.partition("=") if isinstance(chattering, str) else ("", "", "")
    if name not in _SCHEMES:
        kinds = "" if isinstance(chattering, str) else " or a scheme"
        raise OptionError(
            f"{{}} must be one of {', '.join(_SCHEMES)}{kinds}, not {chattering!r}", "chattering", value=chattering
        )
    if not separator:
        return _SCHEMES[name]()
    try:
        return _SCHEMES[name].from_text(value)
    except OptionError as error:
        sentence = f'{{}} "{chattering}": {error.message.template}'
        raise OptionError(sentence, "chattering", *error.message.arguments) from None


#: Fits of the paper for the critical amplitude: coefficient of eta^i omega^j in row i, column j.
_EQ76: Final = np.array([
    [1.079, 0.1405, -0.02818, 0.00176],
    [-0.1885, -0.1903, 0.03236, -0.00185],
    [0.6442, 0.06413, -0.003045, 0.0],
    [-0.7372, -0.0187, 0.0, 0.0],
    [0.2146, 0.0, 0.0, 0.0],
])  # fmt: skip
_EQ77: Final = np.array([[1.271], [-0.45], [0.5763], [-0.3941]])


def compute_critical_amplitudes(method: str, omega: Floats, eta: Floats) -> Floats:
    """Compute critical amplitudes, divided by g alpha, flat: "exact", or by the fits "eq76" and "eq77" of the paper."""
    from rocking.kernels.sine.sequence import write_critical_amplitudes

    if method != "exact":
        min_omega, max_omega = FITTED_FREQUENCIES
        min_eta, max_eta = FITTED_RESTITUTIONS
        outside: Flags = (omega < min_omega) | (omega > max_omega) | (eta < min_eta) | (eta > max_eta)
        if outside.any():
            k = int(np.argmax(outside))
            warnings.warn(
                f"Eq. {method[2:]} was fitted for omega from {min_omega:g} to {max_omega:g} and eta from {min_eta:g} "
                f'to {max_eta:g}, not for omega = {omega.flat[k]:g}, eta = {eta.flat[k]:g}; use "exact"',
                OutsideFitWarning,
                stacklevel=2,
            )
        fitted: Floats = polynomial.polyval2d(eta, omega, _EQ76 if method == "eq76" else _EQ77)
        return fitted
    critical = np.ones(omega.size)
    lossy = np.flatnonzero(eta < 1.0)
    for part in split_range(lossy.size, _CRITICAL_BATCH):
        amplitudes = np.zeros(lossy[part].size)
        write_critical_amplitudes(omega[lossy[part]], eta[lossy[part]], amplitudes)
        critical[lossy[part]] = amplitudes
    return critical
