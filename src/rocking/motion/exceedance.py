"""Where a motion exceeds thresholds, and the factor from which on it lifts a block."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rocking.core.arrays import Flags, Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.motion import piecewise
from rocking.motion.motion import Motion


def exceedances(motion: Motion, thresholds: tuple[float, float], gravity: float = STANDARD_GRAVITY) -> Floats:
    """Stretches of time in which a resting block would be lifted: start and end of each, s, in order, shape (n, 2).

    The thresholds (m/s^2) lift it to side + where -a passes the first, and to side - where a passes the second, as
    `Block.uplift_thresholds` gives them; a vertical acceleration adds to the gravity (m/s^2) under which they hold.
    """
    plus, minus = thresholds
    towards_plus, towards_minus = _push(motion, -plus / gravity), _push(motion, minus / gravity)
    reaching = _reaching(towards_plus, plus) | _reaching(towards_minus, minus)
    ends = towards_plus.breakpoints[np.append(reaching, False) | np.append(False, reaching)]
    crossings = [_crossings(towards_plus, -plus, reaching), _crossings(towards_minus, minus, reaching)]
    cuts = np.unique(np.concatenate([ends, *crossings]))
    middle = 0.5 * (cuts[:-1] + cuts[1:])
    beyond = (towards_minus.acceleration(middle) > minus) | (towards_plus.acceleration(middle) < -plus)
    return cuts[np.flatnonzero(np.diff(beyond, prepend=False, append=False))].reshape(-1, 2)


def lifting_factors(
    motion: Motion, thresholds: ArrayLike, gravity: float = STANDARD_GRAVITY, own: ArrayLike | None = None
) -> Floats:
    """Lowest factors on both components of a motion from which on it lifts blocks from rest, shape (n,); or infinity.

    The thresholds, pairs as `exceedances` takes one, have shape (n, 2), and so has what the weight makes of them, by
    default all: a vertical motion changes that alone. They are infinite where a block rocks to one side.
    """
    pairs = np.asarray(thresholds, dtype=np.float64)
    weighing = pairs if own is None else np.asarray(own, dtype=np.float64)
    if motion.vertical is None:
        widths = np.diff(motion.breakpoints)
        reached = np.array([[piecewise.highest(widths, sign * motion.coefficients) for sign in (-1.0, 1.0)]])
    else:
        breakpoints, (push, lift) = piecewise.together(motion, motion.vertical)
        widths = np.diff(breakpoints)

        def highest(sign: float, threshold: float) -> float:
            if np.isinf(threshold):
                return 0.0
            return piecewise.highest(widths, sign * push - threshold / gravity * lift)

        reached = np.array([[highest(-1.0, plus), highest(1.0, minus)] for plus, minus in weighing])
    with np.errstate(divide="ignore"):
        factors = np.where(reached > 0.0, pairs / np.maximum(reached, 0.0), np.inf)
    lowest: Floats = factors.min(axis=1)
    return lowest


def _push(motion: Motion, threshold_over_g: float) -> Motion:
    """Return the horizontal motion less what the vertical one adds to a threshold."""
    alone = motion.with_vertical(None)
    return alone if motion.vertical is None else alone + motion.vertical.scaled(-threshold_over_g)


def _reaching(motion: Motion, level: float) -> Flags:
    """Which pieces may be of this magnitude somewhere: of a record with few strong pulses, few."""
    bounds = piecewise.bounds(np.diff(motion.breakpoints), motion.coefficients)
    return np.asarray(bounds >= level * (1.0 - 1e-12))


def _crossings(motion: Motion, level: float, pieces: Flags) -> Floats:
    """Find times, s, among which are all those at which the motion passes a level inside one of the pieces."""
    widths = np.diff(motion.breakpoints)[pieces]
    shifted = motion.coefficients[pieces]
    shifted[:, 0] -= level
    offsets = piecewise.root_candidates(widths, shifted)
    inside = (offsets > 0.0) & (offsets < widths[:, np.newaxis])
    times: Floats = (motion.breakpoints[:-1][pieces][:, np.newaxis] + offsets)[inside]
    return times
