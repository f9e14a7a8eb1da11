"""Sines, and half cycles of a sine with their own amplitudes."""

import math
from collections.abc import Sequence

import numpy as np

from rocking import checks
from rocking.errors import InvalidMotion
from rocking.motion.description import Description
from rocking.motion.motion import Motion
from rocking.motion.pulses.parameters import MOST_CYCLES, checked_frequency
from rocking.motion.pulses.series import ERROR, PIECES_PER_CYCLE, sine_pieces, whole_pieces


def sine(amplitude: float, frequency: float, *, cycles: float, phase: float = 0.0) -> Motion:
    """Return ``amplitude * sin(2 pi frequency t + phase)`` over a number of cycles.

    Parameters
    ----------
    amplitude : float
        m/s^2.
    frequency : float
        Hz.
    cycles : float
        Duration times frequency; need not be whole.
    phase : float
        rad.

    Raises
    ------
    InvalidMotion
        If `frequency` or `cycles` is not positive, there are more than 100,000 cycles, or a number is not
        finite.

    Examples
    --------
    >>> motion = sine(3.0, 2.0, cycles=5)
    >>> motion.duration, round(motion.pga, 12), round(motion.acceleration(0.0625), 9)
    (2.5, 3.0, 2.121320344)
    """
    return _sine("sine", amplitude, frequency, cycles, phase)


def half_sine(amplitude: float, frequency: float) -> Motion:
    """Return one lobe, ``amplitude * sin(2 pi frequency t)`` for half a cycle.

    Parameters
    ----------
    amplitude : float
        m/s^2.
    frequency : float
        Hz, of the whole sine: the pulse lasts ``1 / (2 frequency)``.

    Raises
    ------
    InvalidMotion
        As `sine`.

    Examples
    --------
    >>> round(half_sine(2.0, 0.5).pgv * math.pi, 12)
    4.0
    """
    return _sine("half sine", amplitude, frequency, 0.5, 0.0)


def one_sine(amplitude: float, frequency: float) -> Motion:
    """Return a one-sine acceleration pulse (Zhang and Makris 2001): one cycle of a sine.

    Parameters
    ----------
    amplitude : float
        m/s^2.
    frequency : float
        Hz.

    Raises
    ------
    InvalidMotion
        As `sine`.

    Examples
    --------
    >>> abs(one_sine(2.0, 0.5).velocity(2.0)) < 1e-15
    True
    """
    return _sine("one-sine", amplitude, frequency, 1.0, 0.0)


def one_cosine(amplitude: float, frequency: float) -> Motion:
    """Return a one-cosine acceleration pulse (Zhang and Makris 2001): one cycle of a cosine, jumps included.

    Parameters
    ----------
    amplitude : float
        m/s^2.
    frequency : float
        Hz.

    Raises
    ------
    InvalidMotion
        As `sine`.

    Examples
    --------
    >>> round(one_cosine(2.0, 0.5).acceleration(0.0), 12)
    2.0
    """
    return _sine("one-cosine", amplitude, frequency, 1.0, 0.5 * math.pi)


def n_lobe(amplitude: float | Sequence[float], frequency: float, *, lobes: int | None = None) -> Motion:
    """Return half cycles of a sine, each with its own amplitude.

    Lobe k (k = 0, 1, ...) is ``amplitude[k] * sin(2 pi frequency t)`` for ``k <= 2 frequency t <= k + 1``, so
    equal amplitudes make a sine.

    Parameters
    ----------
    amplitude : float or sequence of float
        m/s^2; one for all lobes (then give `lobes`), or one for each.
    frequency : float
        Hz, of the sine: a lobe lasts ``1 / (2 frequency)``.
    lobes : int, optional
        Number of lobes, if `amplitude` is one number.

    Raises
    ------
    InvalidMotion
        If there is no lobe, `lobes` contradicts the amplitudes, or a number is not usable.

    Examples
    --------
    >>> motion = n_lobe([1.0, 3.0, 2.0], 0.5)
    >>> motion.acceleration([0.5, 1.5, 2.5]).round(12)
    array([ 1., -3.,  2.])
    """
    amplitudes = _lobe_amplitudes(amplitude, lobes)
    frequency = checked_frequency(frequency)
    per_lobe = PIECES_PER_CYCLE // 2
    breakpoints = np.arange(len(amplitudes) * per_lobe + 1.0) / (PIECES_PER_CYCLE * frequency)
    unit = sine_pieces(breakpoints, frequency, 0.0)
    one = np.ndim(amplitude) == 0
    numbers = {"amplitude" if one else f"amplitude_{k}": a for k, a in enumerate(amplitudes)}
    return Motion(
        breakpoints,
        unit * np.repeat(amplitudes, per_lobe)[:, np.newaxis],
        name=f"{len(amplitudes)} lobes",
        description=Description(
            "n-lobe",
            numbers | {"frequency": frequency, "lobes": len(amplitudes)},
            "amplitude sin(2 pi frequency t), an amplitude for each half cycle",
        ),
        error=ERROR * max(map(abs, amplitudes)),
    )


def _sine(family: str, amplitude: float, frequency: float, cycles: float, phase: float) -> Motion:
    amplitude, phase = (
        checks.finite(amplitude, "amplitude", InvalidMotion),
        checks.finite(phase, "phase", InvalidMotion),
    )
    frequency, cycles = (
        checked_frequency(frequency),
        checks.positive(cycles, "number of cycles", InvalidMotion, "cycles"),
    )
    if cycles > MOST_CYCLES:
        raise InvalidMotion(f"a sine may have at most {MOST_CYCLES} cycles, not {cycles:g}")
    breakpoints = np.linspace(0.0, cycles / frequency, whole_pieces(PIECES_PER_CYCLE * cycles))
    return Motion(
        breakpoints,
        amplitude * sine_pieces(breakpoints, frequency, phase),
        name=family,
        description=Description(
            family,
            {"amplitude": amplitude, "frequency": frequency, "cycles": cycles, "phase": phase},
            "amplitude sin(2 pi frequency t + phase) over the given cycles",
        ),
        error=ERROR * abs(amplitude),
    )


def _lobe_amplitudes(amplitude: float | Sequence[float], lobes: int | None) -> list[float]:
    if np.ndim(amplitude) > 1:
        raise InvalidMotion("the amplitudes of the lobes must be one number or a flat sequence of numbers")
    given = [
        checks.finite(a, "amplitude of a lobe", InvalidMotion)
        for a in np.atleast_1d(np.asarray(amplitude, dtype=object))
    ]
    count = None if lobes is None else checks.whole(lobes, "number of lobes", InvalidMotion, 1, 2 * MOST_CYCLES)
    if np.ndim(amplitude) == 0 and count is not None:
        return given * count
    if np.ndim(amplitude) == 0 or not given or count not in (None, len(given)):
        raise InvalidMotion(
            "give one amplitude and the number of lobes, or a sequence with one amplitude for each lobe"
        )
    return given
