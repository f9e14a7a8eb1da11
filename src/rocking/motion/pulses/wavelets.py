"""Pulses with an envelope: Ricker's, and that of Mavroeidis and Papageorgiou."""

import math
from typing import Final, Literal

import numpy as np

from rocking import checks
from rocking.errors import InvalidMotion
from rocking.motion.description import Description
from rocking.motion.motion import Motion
from rocking.motion.pulses.angles import exact_product, exact_quotient, sine_and_cosine, sum_of_angles
from rocking.motion.pulses.parameters import MOST_CYCLES, checked_frequency
from rocking.motion.pulses.series import (
    ERROR,
    GAUSSIAN_PIECE,
    PIECES_PER_CYCLE,
    about_starts,
    gaussian_derivative,
    middles,
    sine_series,
    whole_pieces,
)

# Where Ricker pulses fall below 1e-16 of their peak, in standard deviations of their Gaussian.
_SYMMETRIC_REACH: Final = 9.1
_ANTISYMMETRIC_REACH: Final = 9.3


def ricker(
    amplitude: float,
    frequency: float,
    *,
    kind: Literal["symmetric", "antisymmetric"] = "symmetric",
    duration: float | None = None,
) -> Motion:
    """Return a symmetric or antisymmetric Ricker pulse (Vassiliou and Makris 2011).

    With t counted from the middle of the motion and f the frequency, the symmetric pulse is
    ``amplitude (1 - x^2) exp(-x^2 / 2)``, ``x = sqrt(2) pi f t``, and the antisymmetric one
    ``(amplitude / beta) (x^2 - 3) x exp(-x^2 / 2)``, ``x = 2 pi f t / sqrt(3)``, where beta = 1.3801... makes
    its peak (before the middle) equal to `amplitude`.

    Parameters
    ----------
    amplitude : float
        Peak acceleration, m/s^2.
    frequency : float
        Dominant frequency 1/T_p, Hz.
    kind : {"symmetric", "antisymmetric"}
        Second or third derivative of a Gaussian.
    duration : float, optional
        Length of the motion, s, if the pulse is to be cut on both sides before it falls below 1e-16 of its
        peak.

    Raises
    ------
    InvalidMotion
        If a number is not finite, `frequency` or `duration` is not positive, `duration` is longer than the
        pulse, or `kind` is neither.

    References
    ----------
    Vassiliou, M. F. and Makris, N. (2011). Estimating time scales and length scales in pulselike earthquake
    acceleration records with wavelet analysis. Bulletin of the Seismological Society of America 101(2),
    596-618.

    Examples
    --------
    >>> pulse = ricker(2.0, 1.0, kind="antisymmetric")
    >>> round(pulse.pga, 12), abs(pulse.velocity(pulse.duration)) < 1e-15
    (2.0, True)
    """
    amplitude, frequency = checks.finite(amplitude, "amplitude", InvalidMotion), checked_frequency(frequency)
    kinds = ("symmetric", "antisymmetric")
    symmetric = checks.one_of(kind, "kind of a Ricker pulse", InvalidMotion, kinds) == "symmetric"
    rate = math.sqrt(2.0) * math.pi * frequency if symmetric else 2.0 * math.pi * frequency / math.sqrt(3.0)
    longest = 2.0 * (_SYMMETRIC_REACH if symmetric else _ANTISYMMETRIC_REACH) / rate
    length = longest if duration is None else checks.positive(duration, "duration", InvalidMotion, "s")
    if length > longest:
        raise InvalidMotion(f"a Ricker pulse of {frequency:.6g} Hz lasts only {longest:.6g} s: give no longer duration")
    breakpoints = np.linspace(0.0, length, whole_pieces(rate * length / GAUSSIAN_PIECE))
    series = -gaussian_derivative(2 if symmetric else 3, middles(breakpoints) - 0.5 * length, rate)
    peak = 1.0 if symmetric else _antisymmetric_peak()
    formula = (
        "amplitude (1 - x^2) exp(-x^2/2), x = sqrt(2) pi frequency (t - duration/2)"
        if symmetric
        else "(amplitude/1.3801) (x^2 - 3) x exp(-x^2/2), x = 2 pi frequency (t - duration/2)/sqrt(3)"
    )
    parameters = {"amplitude": amplitude, "frequency": frequency, "duration": length}
    return Motion(
        breakpoints,
        about_starts(breakpoints, series * (amplitude / peak)),
        name=f"{kind} Ricker",
        description=Description(f"{kind} Ricker", parameters, formula),
        error=ERROR * abs(amplitude),
    )


def mavroeidis_papageorgiou(amplitude: float, frequency: float, *, phase: float, gamma: float) -> Motion:
    """Return the near-fault pulse of Mavroeidis and Papageorgiou (2003).

    Its ground velocity is ``v(t) = (amplitude / 2) [1 + cos(2 pi f s / gamma)] cos(2 pi f s + phase)``, with
    f the frequency and ``s = t - gamma / (2 f)`` counted from the middle; the motion is its derivative::

        -(amplitude pi f / gamma) [ sin(2 pi f s / gamma) cos(2 pi f s + phase)
                                    + gamma sin(2 pi f s + phase) (1 + cos(2 pi f s / gamma)) ].

    Note that `amplitude` is a velocity; use ``.scaled_to(level)`` for a given acceleration. The
    motion starts from rest, so its velocity equals v(t), which is zero at both ends.

    Parameters
    ----------
    amplitude : float
        Amplitude A of the velocity pulse, m/s.
    frequency : float
        Prevailing frequency f_p, Hz.
    phase : float
        Phase nu, rad: 0 gives a symmetric and pi/2 an antisymmetric velocity pulse.
    gamma : float
        Oscillatory character, at least 1: the motion lasts ``gamma / frequency``.

    Raises
    ------
    InvalidMotion
        If a number is not finite, `frequency` is not positive, or `gamma` is not from 1 to 100,000.

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
    amplitude, phase = (
        checks.finite(amplitude, "amplitude", InvalidMotion),
        checks.finite(phase, "phase", InvalidMotion),
    )
    frequency, gamma = checked_frequency(frequency), checks.positive(gamma, "gamma", InvalidMotion, "cycles")
    if not 1.0 <= gamma <= MOST_CYCLES:
        raise InvalidMotion(f"gamma of a Mavroeidis-Papageorgiou pulse must be from 1 to {MOST_CYCLES}, not {gamma}")
    breakpoints = np.linspace(0.0, gamma / frequency, whole_pieces(PIECES_PER_CYCLE * (gamma + 1.0)))
    turns, rest = exact_product(frequency, middles(breakpoints))
    carrier = sine_and_cosine(turns, rest - 0.5 * math.fmod(gamma, 2.0), phase)
    quotient, quotient_rest = exact_quotient(turns, rest, gamma)
    envelope = sine_and_cosine(quotient, quotient_rest - 0.5, 0.0)
    # The product of cosines is a sum of three; they have a half, a quarter and a quarter of the amplitude.
    rate, shift = 2.0 * math.pi * frequency, 1.0 / gamma
    series = (
        0.5 * sine_series(carrier, rate)
        + 0.25 * (1.0 + shift) * sine_series(sum_of_angles(carrier, envelope, 1.0), rate * (1.0 + shift))
        + 0.25 * (1.0 - shift) * sine_series(sum_of_angles(carrier, envelope, -1.0), rate * (1.0 - shift))
    )
    peak = rate * amplitude
    return Motion(
        breakpoints,
        about_starts(breakpoints, -peak * series),
        name="Mavroeidis-Papageorgiou",
        description=Description(
            "Mavroeidis-Papageorgiou",
            {"amplitude": amplitude, "frequency": frequency, "phase": phase, "gamma": gamma},
            "derivative of amplitude/2 [1 + cos(2 pi frequency s/gamma)] cos(2 pi frequency s + phase), "
            "s = t - gamma/(2 frequency); amplitude is a velocity, m/s",
        ),
        error=ERROR * abs(peak),
    )


def _antisymmetric_peak() -> float:
    """Largest value of ``(x^2 - 3) x exp(-x^2 / 2)``, which is stationary where ``x^4 - 6 x^2 + 3 = 0``."""
    squared = 3.0 - math.sqrt(6.0)
    return (3.0 - squared) * math.sqrt(squared) * math.exp(-0.5 * squared)
