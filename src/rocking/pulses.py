"""Analytic ground motions: rectangles and triangles, sines, lobes, Ricker and Mavroeidis-Papageorgiou pulses.

The pieces of each `Motion` approximate the formula to 1e-15 of the largest acceleration (`Motion.error`). Straight
lines are exact. Pulses start at time 0, are zero after their end, and can be added with ``+``.

A piece is a Taylor series about its midpoint, moved to its start, and so short that the first neglected term is below
1e-16 of the amplitude. Large angles are not rounded, because products and quotients include their errors and whole
turns are subtracted exactly. Numbers that are not finite or out of range raise `MotionError`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.polynomial import hermite_e
from numpy.typing import NDArray

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import MotionError
from rocking.motion import piecewise
from rocking.motion.description import Description
from rocking.motion.motion import Motion
from rocking.motion.piecewise import divide_exactly, multiply_exactly

__all__ = [
    "half_sine",
    "mavroeidis_papageorgiou",
    "n_lobe",
    "one_cosine",
    "one_sine",
    "rectangular",
    "ricker",
    "sine",
    "triangular",
]

#: Error relative to the amplitude, which a cut pulse need not reach. It covers the neglected terms and the rounding of
#: the coefficients, which are multiples of the amplitude.
_RELATIVE_ERROR: Final = 1e-15

#: Pieces per cycle of a sine: half a piece is pi/8 = 0.39 rad, and 0.39**14 / 14! = 2.4e-17.
_PIECES_PER_CYCLE: Final = 8
_SINE_DEGREE: Final = 13
_MAX_CYCLES: Final = 100_000

#: Piece of a derivative of a Gaussian in standard deviations: by Cramer's inequality (|He_n(x)| exp(-x^2/4) is at most
#: 1.09 sqrt(n!)) the first neglected term is below 6 e-17 of the peak.
_GAUSSIAN_PIECE_LENGTH: Final = 0.4
_GAUSSIAN_DEGREE: Final = 15


def rectangular(amplitude: float, duration: float) -> Motion:
    """Return a constant acceleration (exact).

    Parameters
    ----------
    amplitude, duration : float
        Acceleration, m/s^2, and duration, s.

    Returns
    -------
    Motion
        Motion of one piece.

    See Also
    --------
    rocking.pulses.triangular : Triangular pulse.

    Examples
    --------
    >>> rectangular(2.0, 0.5).pgv
    1.0
    """
    parameters = _check_parameters(amplitude=amplitude, duration=duration)
    description = Description("rectangular", parameters, "constant")
    pieces = np.array([0.0, parameters["duration"]]), np.array([[parameters["amplitude"]]])
    return Motion(*pieces, name="rectangular", description=description)


def triangular(amplitude: float, duration: float) -> Motion:
    """Return an acceleration that rises linearly to its amplitude and falls to zero in equal times (exact).

    Parameters
    ----------
    amplitude, duration : float
        Peak acceleration, m/s^2, and duration, s.

    Returns
    -------
    Motion
        Motion of two pieces.

    See Also
    --------
    rocking.pulses.rectangular : Constant acceleration.

    Examples
    --------
    >>> triangular(2.0, 0.5).pgv
    0.5
    """
    parameters = _check_parameters(amplitude=amplitude, duration=duration)
    description = Description("triangular", parameters, "linear from 0 to amplitude at duration/2 and back to 0")
    points = [0.0, 0.5 * parameters["duration"], parameters["duration"]], [0.0, parameters["amplitude"], 0.0]
    return Motion.from_points(*points, name="triangular", description=description)


def sine(amplitude: float, frequency: float, *, cycles: float, phase: float = 0.0) -> Motion:
    """Return ``amplitude * sin(2 pi frequency t + phase)`` over a number of cycles.

    Parameters
    ----------
    amplitude, frequency : float
        Amplitude, m/s^2, and frequency, Hz.
    cycles : float
        Number of cycles (duration times frequency), at most 100,000 and not necessarily whole.
    phase : float
        Phase, rad.

    Returns
    -------
    Motion
        Motion of family "sine", as `rocking.AsymptoticTime` requires.

    See Also
    --------
    rocking.pulses.n_lobe : Half cycles with different amplitudes.

    Examples
    --------
    >>> motion = sine(3.0, 2.0, cycles=5)
    >>> motion.duration, round(motion.pga, 12), round(motion.acceleration(0.0625), 9)
    (2.5, 3.0, 2.121320344)
    """
    return _create_sine("sine", amplitude, frequency, cycles, phase)


def half_sine(amplitude: float, frequency: float) -> Motion:
    """Return one lobe, ``amplitude * sin(2 pi frequency t)`` for half a cycle.

    Parameters
    ----------
    amplitude, frequency : float
        Amplitude, m/s^2, and frequency of the whole sine, Hz.

    Returns
    -------
    Motion
        Motion of duration ``1 / (2 frequency)``.

    See Also
    --------
    rocking.pulses.one_sine : One cycle.

    Examples
    --------
    >>> round(half_sine(2.0, 0.5).pgv * math.pi, 12)
    4.0
    """
    return _create_sine("half sine", amplitude, frequency, 0.5, 0.0)


def one_sine(amplitude: float, frequency: float) -> Motion:
    """Return a one-sine acceleration pulse (Zhang and Makris 2001): one cycle of a sine.

    Parameters
    ----------
    amplitude, frequency : float
        Amplitude, m/s^2, and frequency, Hz.

    Returns
    -------
    Motion
        Motion with zero final velocity.

    See Also
    --------
    rocking.pulses.one_cosine : One cycle of a cosine.

    Examples
    --------
    >>> abs(one_sine(2.0, 0.5).velocity(2.0)) < 1e-15
    True
    """
    return _create_sine("one-sine", amplitude, frequency, 1.0, 0.0)


def one_cosine(amplitude: float, frequency: float) -> Motion:
    """Return a one-cosine acceleration pulse (Zhang and Makris 2001): one cycle of a cosine.

    Parameters
    ----------
    amplitude, frequency : float
        Amplitude, m/s^2, and frequency, Hz.

    Returns
    -------
    Motion
        Motion with a jump at both ends.

    See Also
    --------
    rocking.pulses.one_sine : One cycle of a sine.

    Examples
    --------
    >>> round(one_cosine(2.0, 0.5).acceleration(0.0), 12)
    2.0
    """
    return _create_sine("one-cosine", amplitude, frequency, 1.0, 0.5 * math.pi)


def n_lobe(amplitude: float | Sequence[float], frequency: float, *, lobes: int | None = None) -> Motion:
    """Return half cycles of a sine with individual amplitudes.

    Lobe k (k = 0, 1, ...) is ``amplitude[k] * sin(2 pi frequency t)`` for ``k <= 2 frequency t <= k + 1``, so that
    equal amplitudes yield a sine.

    Parameters
    ----------
    amplitude : float or sequence of float
        Amplitude of each lobe, or of all `lobes`, m/s^2.
    frequency : float
        Frequency of the sine, Hz. A lobe lasts ``1 / (2 frequency)``.
    lobes : int, optional
        Number of lobes, for a single `amplitude`.

    Returns
    -------
    Motion
        Motion without a jump at its ends.

    See Also
    --------
    rocking.pulses.sine : Sine of constant amplitude.

    Examples
    --------
    >>> motion = n_lobe([1.0, 3.0, 2.0], 0.5)
    >>> motion.acceleration([0.5, 1.5, 2.5]).round(12)
    array([ 1., -3.,  2.])
    """
    amplitudes = _expand_amplitudes(amplitude, lobes)
    frequency = _check_parameters(frequency=frequency)["frequency"]
    pieces_per_lobe = _PIECES_PER_CYCLE // 2
    breakpoints = np.arange(len(amplitudes) * pieces_per_lobe + 1.0) / (_PIECES_PER_CYCLE * frequency)
    unit_series = _compute_sine_pieces(breakpoints, frequency, 0.0)
    is_single = np.ndim(amplitude) == 0
    parameters = {"amplitude" if is_single else f"amplitude_{k}": value for k, value in enumerate(amplitudes)}
    formula = "amplitude sin(2 pi frequency t), an amplitude for each half cycle"
    description = Description("n-lobe", parameters | {"frequency": frequency, "lobes": len(amplitudes)}, formula)
    series = unit_series * np.repeat(amplitudes, pieces_per_lobe)[:, np.newaxis]
    return _create_motion(breakpoints, series, max(map(abs, amplitudes)), description, f"{len(amplitudes)} lobes")


def _check_parameters(**numbers: float) -> dict[str, float]:
    """Validate parameters: any amplitude and phase, positive duration, frequency in the range of a pulse."""
    checked = {}
    for name, value in numbers.items():
        if name in ("amplitude", "phase"):
            checked[name] = checks.finite(value, name, MotionError)
        elif name == "duration":
            checked[name] = checks.positive(value, name, MotionError, "s")
        else:
            positive = checks.positive(value, name, MotionError, "Hz")
            checked[name] = checks.between(positive, "frequency of a pulse", MotionError, 1e-9, 1e6, "Hz")
    return checked


def _create_motion(
    breakpoints: Floats, series: Floats, peak: float, description: Description, name: str = ""
) -> Motion:
    """Create a motion from pieces with an error proportional to the peak acceleration."""
    error = _RELATIVE_ERROR * abs(peak)
    return Motion(breakpoints, series, name=name or description.family, description=description, error=error)


def _create_sine(family: str, amplitude: float, frequency: float, cycles: float, phase: float) -> Motion:
    parameters = _check_parameters(amplitude=amplitude, frequency=frequency, phase=phase)
    cycles = checks.positive(cycles, "number of cycles", MotionError, "cycles")
    if cycles > _MAX_CYCLES:
        raise MotionError(f"the {{}} of a sine must be at most {_MAX_CYCLES}, not {cycles:g}", "cycles", value=cycles)
    amplitude, frequency, phase = parameters.values()
    breakpoints = np.linspace(0.0, cycles / frequency, _count_breakpoints(_PIECES_PER_CYCLE * cycles))
    parameters = {"amplitude": amplitude, "frequency": frequency, "cycles": cycles, "phase": phase}
    description = Description(family, parameters, "amplitude sin(2 pi frequency t + phase) over the given cycles")
    series = amplitude * _compute_sine_pieces(breakpoints, frequency, phase)
    return _create_motion(breakpoints, series, amplitude, description)


def _expand_amplitudes(amplitude: float | Sequence[float], lobes: int | None) -> list[float]:
    if np.ndim(amplitude) > 1:
        raise MotionError("the amplitudes of the lobes must be one number or a flat sequence of numbers")
    values = np.atleast_1d(np.asarray(amplitude, dtype=object))
    amplitudes = [checks.finite(value, "amplitude of a lobe", MotionError) for value in values]
    count = None if lobes is None else checks.integer(lobes, "number of lobes", MotionError, 1, 2 * _MAX_CYCLES)
    if np.ndim(amplitude) == 0 and count is not None:
        return amplitudes * count
    if np.ndim(amplitude) == 0 or not amplitudes or count not in (None, len(amplitudes)):
        message = "give one amplitude and the number of lobes, or a sequence with one amplitude for each lobe"
        raise MotionError(message)
    return amplitudes


def ricker(
    amplitude: float,
    frequency: float,
    *,
    kind: Literal["symmetric", "antisymmetric"] = "symmetric",
    duration: float | None = None,
) -> Motion:
    """Return a symmetric or antisymmetric Ricker pulse (Vassiliou and Makris 2011).

    With t measured from the middle of the motion and f the frequency, the symmetric pulse is ``amplitude (1 - x^2)
    exp(-x^2 / 2)``, ``x = sqrt(2) pi f t``, and the antisymmetric one ``(amplitude / beta) (x^2 - 3) x exp(-x^2 / 2)``,
    ``x = 2 pi f t / sqrt(3)``, in which beta = 1.3801... scales its peak (before the middle) to `amplitude`.

    Parameters
    ----------
    amplitude, frequency : float
        Peak acceleration, m/s^2, and dominant frequency 1/T_p, Hz.
    kind : {"symmetric", "antisymmetric"}
        Second or third derivative of a Gaussian.
    duration : float, optional
        Length of the motion, s. By default the pulse ends on both sides at 1e-16 of its peak.

    Returns
    -------
    Motion
        Motion with one peak in its middle, or a peak on each side of the middle.

    See Also
    --------
    rocking.pulses.mavroeidis_papageorgiou : Near-fault velocity pulse.

    References
    ----------
    Vassiliou, M. F. and Makris, N. (2011). Estimating time scales and length scales in pulselike earthquake
    acceleration records with wavelet analysis. Bulletin of the Seismological Society of America 101(2), 596-618.

    Examples
    --------
    >>> pulse = ricker(2.0, 1.0, kind="antisymmetric")
    >>> round(pulse.pga, 12), abs(pulse.velocity(pulse.duration)) < 1e-15
    (2.0, True)
    """
    amplitude, frequency = _check_parameters(amplitude=amplitude, frequency=frequency).values()
    kinds = ("symmetric", "antisymmetric")
    symmetric = checks.choice(kind, "kind of a Ricker pulse", MotionError, kinds) == "symmetric"
    rate = math.sqrt(2.0) * math.pi * frequency if symmetric else 2.0 * math.pi * frequency / math.sqrt(3.0)
    limit = 2.0 * (9.1 if symmetric else 9.3) / rate  # limit at 1e-16 of the peak
    span = limit if duration is None else checks.positive(duration, "duration", MotionError, "s")
    if span > limit:
        message = f"a Ricker pulse of {frequency:.6g} Hz lasts {limit:.6g} s; give a duration of at most this value"
        raise MotionError(message)
    breakpoints = np.linspace(0.0, span, _count_breakpoints(rate * span / _GAUSSIAN_PIECE_LENGTH))
    series = -_compute_gaussian_series(2 if symmetric else 3, _compute_midpoints(breakpoints) - 0.5 * span, rate)
    # (x^2 - 3) x exp(-x^2 / 2) is stationary at x^4 - 6 x^2 + 3 = 0.
    x_squared = 3.0 - math.sqrt(6.0)
    peak = 1.0 if symmetric else (3.0 - x_squared) * math.sqrt(x_squared) * math.exp(-0.5 * x_squared)
    formula = "(amplitude/1.3801) (x^2 - 3) x exp(-x^2/2), x = 2 pi frequency (t - duration/2)/sqrt(3)"
    if symmetric:
        formula = "amplitude (1 - x^2) exp(-x^2/2), x = sqrt(2) pi frequency (t - duration/2)"
    parameters = {"amplitude": amplitude, "frequency": frequency, "duration": span}
    description = Description(f"{kind} Ricker", parameters, formula)
    series = _shift_to_starts(breakpoints, series * (amplitude / peak))
    return _create_motion(breakpoints, series, amplitude, description)


def mavroeidis_papageorgiou(amplitude: float, frequency: float, *, phase: float, gamma: float) -> Motion:
    """Return the near-fault pulse of Mavroeidis and Papageorgiou (2003).

    The ground velocity is ``v(t) = (amplitude / 2) [1 + cos(2 pi f s / gamma)] cos(2 pi f s + phase)``, with f the
    frequency and ``s = t - gamma / (2 f)`` measured from the middle. The motion is its derivative::

        -(amplitude pi f / gamma) [ sin(2 pi f s / gamma) cos(2 pi f s + phase)
                                    + gamma sin(2 pi f s + phase) (1 + cos(2 pi f s / gamma)) ].

    The `amplitude` is a velocity. Use ``.scaled_to(level)`` for a given acceleration. The velocity v(t) is zero at both
    ends.

    Parameters
    ----------
    amplitude, frequency : float
        Amplitude A of the velocity pulse, m/s, and prevailing frequency f_p, Hz.
    phase : float
        Phase nu, rad: 0 yields a symmetric and pi/2 an antisymmetric velocity pulse.
    gamma : float
        Oscillatory character, at least 1.

    Returns
    -------
    Motion
        Motion of duration ``gamma / frequency``.

    See Also
    --------
    rocking.pulses.ricker : Ricker pulse.

    References
    ----------
    Mavroeidis, G. P. and Papageorgiou, A. S. (2003). A mathematical representation of near-fault ground
    motions. Bulletin of the Seismological Society of America 93(3), 1099-1131, Eqs 3 and 4.

    Examples
    --------
    >>> pulse = mavroeidis_papageorgiou(0.8, 0.5, phase=0.0, gamma=2.0)
    >>> pulse.duration, round(pulse.pgv, 12)
    (4.0, 0.8)
    """
    parameters = _check_parameters(amplitude=amplitude, frequency=frequency, phase=phase)
    amplitude, frequency, phase = parameters.values()
    gamma = checks.positive(gamma, "gamma", MotionError, "cycles")
    if not 1.0 <= gamma <= _MAX_CYCLES:
        message = f"{{}} of a Mavroeidis-Papageorgiou pulse must be from 1 to {_MAX_CYCLES}, not {gamma}"
        raise MotionError(message, "gamma", value=gamma)
    breakpoints = np.linspace(0.0, gamma / frequency, _count_breakpoints(_PIECES_PER_CYCLE * (gamma + 1.0)))
    turns, low_part = multiply_exactly(frequency, _compute_midpoints(breakpoints))
    carrier = _compute_angle(turns, low_part - 0.5 * math.fmod(gamma, 2.0), phase)
    quotient, quotient_low_part = divide_exactly(turns, low_part, gamma)
    envelope = _compute_angle(quotient, quotient_low_part - 0.5, 0.0)
    # The product of cosines is the sum of three with a half, a quarter and a quarter of the amplitude.
    rate, shift = 2.0 * math.pi * frequency, 1.0 / gamma
    series = (
        0.5 * _compute_sine_series(carrier, rate)
        + 0.25 * (1.0 + shift) * _compute_sine_series(_add_angles(carrier, envelope, 1.0), rate * (1.0 + shift))
        + 0.25 * (1.0 - shift) * _compute_sine_series(_add_angles(carrier, envelope, -1.0), rate * (1.0 - shift))
    )
    peak = rate * amplitude
    formula = "derivative of amplitude/2 [1 + cos(2 pi frequency s/gamma)] cos(2 pi frequency s + phase), "
    formula += "s = t - gamma/(2 frequency); amplitude is a velocity, m/s"
    description = Description("Mavroeidis-Papageorgiou", parameters | {"gamma": gamma}, formula)
    return _create_motion(breakpoints, _shift_to_starts(breakpoints, -peak * series), peak, description)


class _Angle(NamedTuple):
    """Sines and cosines of angles."""

    sine: Floats
    cosine: Floats


def _compute_angle(turns: Floats, low_part: Floats, phase: float) -> _Angle:
    """Compute ``2 pi (turns + low_part) + phase`` without the rounding of a large angle; `low_part` is small."""
    fraction = (turns - np.rint(turns)) + low_part
    quarters = np.rint(4.0 * fraction)
    angle = _Angle(*piecewise.sine_cosine_from_quarters(quarters, 2.0 * np.pi * (fraction - 0.25 * quarters)))
    return _add_angles(angle, _Angle(np.sin(phase), np.cos(phase)), 1.0)


def _add_angles(first: _Angle, second: _Angle, sign: float) -> _Angle:
    """Add two angles, or subtract them for sign -1."""
    return _Angle(
        first.sine * second.cosine + sign * first.cosine * second.sine,
        first.cosine * second.cosine - sign * first.sine * second.sine,
    )


def _count_breakpoints(pieces: float) -> int:
    """Return the number of breakpoints of at least `pieces` equal pieces."""
    return math.ceil(pieces - 1e-9) + 1


def _compute_midpoints(breakpoints: Floats) -> Floats:
    """Compute the midpoint of each piece, s."""
    return breakpoints[:-1] + 0.5 * np.diff(breakpoints)


def _shift_to_starts(breakpoints: Floats, midpoint_series: Floats) -> Floats:
    """Convert coefficients about the middle of each piece to coefficients about its start."""
    return piecewise.shift_origin(midpoint_series, breakpoints[:-1] - _compute_midpoints(breakpoints))


def _compute_sine_pieces(breakpoints: Floats, frequency: float, phase: float) -> Floats:
    """Compute the coefficients of ``sin(2 pi frequency t + phase)`` on each piece."""
    turns, low_part = multiply_exactly(frequency, _compute_midpoints(breakpoints))
    angle = _compute_angle(turns, low_part, phase)
    return _shift_to_starts(breakpoints, _compute_sine_series(angle, 2.0 * math.pi * frequency))


def _compute_sine_series(angle: _Angle, rate: float) -> Floats:
    """Compute the Taylor coefficients of ``sin(angle + rate t)`` about ``t = 0``, shape (angles, degree + 1)."""
    powers = np.arange(_SINE_DEGREE + 1)
    derivatives = np.column_stack([angle.sine, angle.cosine, -angle.sine, -angle.cosine])[:, powers % 4]
    return derivatives * _compute_taylor_factors(rate, powers)


def _compute_gaussian_series(order: int, times: Floats, rate: float) -> Floats:
    """Compute Taylor coefficients in t of ``(-1)^n He_n(x) exp(-x^2/2)``, ``x = rate t``, n the order."""
    x = rate * times
    powers = np.arange(_GAUSSIAN_DEGREE + 1)
    hermite = hermite_e.hermevander(x, order + _GAUSSIAN_DEGREE)[:, order:]
    derivatives = hermite * np.exp(-0.5 * x * x)[:, np.newaxis]
    return (-1.0) ** (order + powers) * derivatives * _compute_taylor_factors(rate, powers)


def _compute_taylor_factors(rate: float, powers: NDArray[np.int_]) -> Floats:
    """Return ``rate**n / n!``."""
    return rate ** powers.astype(np.float64) / np.array([math.factorial(n) for n in powers], dtype=np.float64)
