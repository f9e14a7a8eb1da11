"""Mechanics of rigid bodies on two pivots: the body behind p and alpha, its restitution, its contact forces."""

from __future__ import annotations

import math
from typing import Final, TypeVar

import numpy as np

from rocking.core.arrays import Floats

Number = TypeVar("Number", float, Floats)

#: Sides whose parameters differ by so little, relative, are equal but for rounding.
_ROUNDING: Final = 1e-12


def rigid_bodies(p: Floats, alpha: Floats) -> tuple[Floats, Floats]:
    """Find the rigid bodies whose sides have these parameters, arrays of shape (n, 2).

    Returned are the restitution on leaving each side by angular momentum, NaN where there is no such body, and the
    height of the centre of mass above the pivots over gravity, s^2, shape (n,); NaN where the sides are equal, which
    are those of a rectangle.

    With depth h and radius of gyration k, R_i = h/cos(alpha_i) and g R_i/p_i^2 = k^2 + R_i^2. The difference of both
    sides gives h, and angular momentum e_i = 1 - (h p_j^2/g) sin(alpha_j) (tan(alpha_+) + tan(alpha_-)), j the other
    side. A body with positive h and k exists where |ln(p_+/p_-)| < |ln(cos(alpha_+)/cos(alpha_-))|/2 (derived in the
    documentation).
    """
    cosine, tangent = np.cos(alpha), np.tan(alpha)
    quotient = 1.0 / (cosine * p**2)  # (k^2 + R^2)/(g h)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (quotient[:, 0] - quotient[:, 1]) / (tangent[:, 0] - tangent[:, 1])
        kept: Floats = 1.0 - np.sin(alpha[:, ::-1]) * p[:, ::-1] ** 2 * slope[:, None]
        depth = slope / tangent.sum(axis=1)
    differing, most = _differences(p, cosine)
    kept[differing >= most] = np.nan
    equal = np.all([abs(each[:, 0] - each[:, 1]) <= _ROUNDING * each[:, 0] for each in (p, alpha)], axis=0)
    kept[equal] = 1.0 - 1.5 * np.sin(alpha[equal]) ** 2
    depth[equal] = np.nan
    return kept, depth


def _differences(p: Floats, cosine: Floats) -> tuple[Floats, Floats]:
    """By how much the p of both sides differ, and by how much those of a body may: logarithms of ratios."""
    return np.abs(np.log(p[:, 0] / p[:, 1])), 0.5 * np.abs(np.log(cosine[:, 0] / cosine[:, 1]))


def no_body(p: Floats, alpha: Floats) -> str:
    """Say why there is no rigid body with the p and alpha of two sides."""
    differ, most = (100.0 * math.expm1(float(each[0])) for each in _differences(p[None], np.cos(alpha)[None]))
    return (
        f"no rigid body has p = {p[0]:g} and {p[1]:g} rad/s on sides of alpha = {alpha[0]:g} and {alpha[1]:g} rad: its "
        f"p would differ by less than {most:.2g} %, not by {differ:.2g} %; correct p, or give {{}} a value or a pair "
        "in (0, 1]"
    )


def eccentric_rectangles(alpha: Floats) -> tuple[Floats, Floats]:
    """Rectangles whose centre of mass is so far off the middle that their sides have these slendernesses, shape (n, 2).

    Returned are p of each side over that of the rectangle with its centre of mass in the middle, and the factor on
    leaving each side, by angular momentum.
    """
    distances = np.tan(alpha)  # over the height of the centre of mass
    half_width, offset = 0.5 * distances.sum(axis=1), 0.5 * (distances[:, 1] - distances[:, 0])
    squared = gyration_squared(half_width, 1.0, offset)[:, None]
    radius = np.hypot(distances, 1.0)
    inertia = squared + radius**2
    p = np.sqrt(radius / inertia * (4.0 / 3.0) * np.hypot(half_width, 1.0)[:, None])
    kept = squared + 1.0 - np.prod(distances, axis=1, keepdims=True)
    return p, kept / inertia[:, ::-1]


def gyration_squared(half_width: Number, half_height: float, offset: Number) -> Number:
    """Square of the radius of gyration, m^2, of a rectangle whose centre of mass is off the middle of its width."""
    return (half_width * half_width + half_height * half_height) / 3.0 - offset * offset


def contact_forces(
    motion: tuple[Floats, Floats, Floats],
    ground_over_g: tuple[Floats, Floats],
    side: Floats,
    slenderness: Floats,
    radius_over_g: Floats,
) -> tuple[Floats, Floats]:
    """Horizontal and vertical force on the block over its weight, all arrays of one shape.

    The motion is theta and its two rates, the ground acceleration in units of g, horizontal and vertical, and the side
    +1 or -1, 0 at rest; slenderness and R/g (s^2) are those of that side. On side i, with psi = alpha - |theta|, the
    centre of mass is at x = -i R sin(psi), y = R cos(psi) from the pivot; forces are m (a + x'') and m (g + a_v + y'').
    At rest they are (a/g, 1 + a_v/g).
    """
    rotation, velocity, acceleration = motion
    psi = slenderness - np.abs(rotation)
    towards_pivot = side * acceleration
    speed = np.abs(side) * velocity**2
    horizontal = side * radius_over_g * (np.cos(psi) * towards_pivot + np.sin(psi) * speed)
    vertical = radius_over_g * (np.sin(psi) * towards_pivot - np.cos(psi) * speed)
    push, lift = ground_over_g
    return push + horizontal, 1.0 + lift + vertical
