"""Shapes made of straight lines, which are exact."""

import numpy as np

from rocking import checks
from rocking.errors import InvalidMotion
from rocking.motion.description import Description
from rocking.motion.motion import Motion


def rectangular(amplitude: float, duration: float) -> Motion:
    """Return a constant acceleration; exact.

    Parameters
    ----------
    amplitude : float
        m/s^2.
    duration : float
        s.

    Raises
    ------
    InvalidMotion
        If `amplitude` is not finite or `duration` is not positive.

    Examples
    --------
    >>> rectangular(2.0, 0.5).pgv
    1.0
    """
    amplitude, duration = (
        checks.finite(amplitude, "amplitude", InvalidMotion),
        checks.positive(duration, "duration", InvalidMotion, "s"),
    )
    return Motion(
        np.array([0.0, duration]),
        np.array([[amplitude]]),
        name="rectangular",
        description=Description("rectangular", {"amplitude": amplitude, "duration": duration}, "constant"),
    )


def triangular(amplitude: float, duration: float) -> Motion:
    """Return an acceleration that rises linearly to its amplitude and falls to zero in equal times; exact.

    Parameters
    ----------
    amplitude : float
        m/s^2.
    duration : float
        s.

    Raises
    ------
    InvalidMotion
        If `amplitude` is not finite or `duration` is not positive.

    Examples
    --------
    >>> triangular(2.0, 0.5).pgv
    0.5
    """
    amplitude, duration = (
        checks.finite(amplitude, "amplitude", InvalidMotion),
        checks.positive(duration, "duration", InvalidMotion, "s"),
    )
    return Motion.from_points(
        [0.0, 0.5 * duration, duration],
        [0.0, amplitude, 0.0],
        name="triangular",
        description=Description(
            "triangular",
            {"amplitude": amplitude, "duration": duration},
            "linear from 0 to amplitude at duration/2 and back to 0",
        ),
    )
