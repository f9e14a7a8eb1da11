"""What the ground must supply: friction and normal force at the pivot, from the rotation alone."""

from __future__ import annotations

from typing import Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidOption

#: Coefficients of friction beyond those of any two materials.
_ROUGHEST: Final = 3.0


def friction_coefficient(value: object) -> float:
    """Return a coefficient of friction.

    Raises
    ------
    InvalidOption
        If it is not positive, or larger than that of any two materials.
    """
    coefficient = checks.positive(value, "friction", InvalidOption)
    if coefficient > _ROUGHEST:
        raise InvalidOption(
            "{} must be a coefficient (friction over normal force, about 0.6 of stone on stone) of at most "
            f"{_ROUGHEST:g}, not {coefficient:g}; of an angle of friction take the tangent",
            "friction",
            value=value,
        )
    return coefficient


def contact_forces(
    motion: tuple[Floats, Floats, Floats],
    ground_over_g: tuple[Floats, Floats],
    side: Floats,
    slenderness: Floats,
    radius_over_g: Floats,
) -> tuple[Floats, Floats]:
    """Horizontal and vertical force on the block over its weight, all arrays of one shape.

    Parameters
    ----------
    motion : tuple of ndarray
        theta (rad), and its first and second rate.
    ground_over_g : tuple of ndarray
        Ground acceleration in units of g, horizontal and vertical.
    side : ndarray
        +1 or -1, the side that the block leans to; 0 at rest.
    slenderness, radius_over_g : ndarray
        alpha (rad) and R/g (s^2) of that side.

    Notes
    -----
    On side i = +-1, with psi = alpha - |theta|, the centre of mass is at x = -i R sin(psi), y = R cos(psi) from the
    pivot; forces are m (a + x'') and m (g + a_v + y''). At rest they are (a/g, 1 + a_v/g).
    """
    rotation, velocity, acceleration = motion
    psi = slenderness - np.abs(rotation)
    towards_pivot = side * acceleration
    speed = np.abs(side) * velocity**2
    horizontal = side * radius_over_g * (np.cos(psi) * towards_pivot + np.sin(psi) * speed)
    vertical = radius_over_g * (np.sin(psi) * towards_pivot - np.cos(psi) * speed)
    push, lift = ground_over_g
    return push + horizontal, 1.0 + lift + vertical


def friction_demand(horizontal: Floats, vertical: Floats) -> Floats:
    """Friction coefficient that sticking needs: |H|/N, infinite where the block would leave the ground, NaN of NaN."""
    demand = np.where(np.isnan(vertical), np.nan, np.inf)
    np.divide(np.abs(horizontal), vertical, out=demand, where=vertical > 0.0)
    return demand
