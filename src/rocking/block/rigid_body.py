"""Mechanics of rigid bodies on two pivots: the body behind p and alpha, its restitution, its contact forces."""

from __future__ import annotations

import math
from typing import Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Floats

Number = TypeVar("Number", float, Floats)

#: Decimal digits that numbers were given to: a number of fewer is taken for one of three, one of more for exact.
_FEWEST_DIGITS: Final = 3
_MOST_DIGITS: Final = 12

#: A number is given to some digits if it is this near, relative, to one of so many.
_NEAR: Final = 1e-14

#: A restitution less certain than this is none.
_UNCERTAIN: Final = 0.05

#: How the sides may be corrected; "{}" stands for the name of the argument.
_GIVE_RESTITUTION: Final = "or give {} a value or a pair in (0, 1]"


class RigidBodies(NamedTuple):
    """Rigid bodies that have the p and alpha of their sides; of n.

    Attributes
    ----------
    restitution : ndarray, shape (n, 2)
        On leaving side + and side -, by angular momentum about the new pivot; NaN where no body fits.
    depth, uncertainty : ndarray, shape (n,)
        Height of the centre of mass above the pivots over gravity, s^2; how far the restitution may be off, since p and
        alpha have only the digits that they were given to.
    differing, most, margin : ndarray, shape (n,)
        By how much the p of the sides differ, by how much those of a body may, and by how much either may be off by the
        digits of p and alpha; logarithms of ratios.
    alike : ndarray of bool, shape (n,)
        Whether the sides are equal to the digits that they were given to: then the body is the rectangle.
    """

    restitution: Floats
    depth: Floats
    uncertainty: Floats
    differing: Floats
    most: Floats
    margin: Floats
    alike: NDArray[np.bool_]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether a restitution follows from p and alpha, shape (n,)."""
        return self.alike | ((self.differing < self.most) & (self.uncertainty <= _UNCERTAIN))


def rigid_bodies(p: Floats, alpha: Floats) -> RigidBodies:
    """Find the rigid bodies whose sides have these parameters, arrays of shape (n, 2).

    With depth h and radius of gyration k, R_i = h/cos(alpha_i) and g R_i/p_i^2 = k^2 + R_i^2. The difference of both
    sides gives h, and angular momentum e_i = 1 - (h p_j^2/g) sin(alpha_j) (tan(alpha_+) + tan(alpha_-)), j the other
    side. A body with positive h and k exists where |ln(p_+/p_-)| < |ln(cos(alpha_+)/cos(alpha_-))|/2 (derived in the
    documentation).
    """
    cosine, tangent = np.cos(alpha), np.tan(alpha)
    quotient = 1.0 / (cosine * p**2)  # (k^2 + R^2)/(g h)
    off_p, off_alpha = _half_a_digit(p), _half_a_digit(alpha)
    alike = np.all(
        [abs(values[:, 0] - values[:, 1]) <= off.sum(axis=1) for values, off in ((p, off_p), (alpha, off_alpha))],
        axis=0,
    )
    differing: Floats = np.abs(np.log(p[:, 0] / p[:, 1]))
    most: Floats = 0.5 * np.abs(np.log(cosine[:, 0] / cosine[:, 1]))
    with np.errstate(divide="ignore", invalid="ignore"):
        numerator, denominator = quotient[:, 0] - quotient[:, 1], tangent[:, 0] - tangent[:, 1]
        slope = numerator / denominator
        kept = 1.0 - np.sin(alpha[:, ::-1]) * p[:, ::-1] ** 2 * slope[:, None]
        off_quotient = quotient * (2.0 * off_p / p + tangent * off_alpha)
        off = off_quotient.sum(axis=1) / abs(numerator) + (off_alpha / cosine**2).sum(axis=1) / abs(denominator)
        uncertainty = off * np.max(1.0 - kept, axis=1)
        depth = slope / tangent.sum(axis=1)
    kept[differing >= most] = np.nan
    return RigidBodies(
        np.where(alike[:, None], 1.0 - 1.5 * np.sin(alpha) ** 2, kept),
        np.where(alike, 0.75 * np.mean(cosine / p**2, axis=1), depth),
        np.where(alike, 0.0, uncertainty),
        differing,
        most,
        (off_p / p + 0.5 * tangent * off_alpha).sum(axis=1),
        alike,
    )


def refusal(found: RigidBodies, p: Floats, alpha: Floats, index: int = 0) -> str:
    """Say why a restitution does not follow from p and alpha, arrays of shape (n, 2); nothing where it does."""
    if found.known[index]:
        return ""
    (p_plus, p_minus), (plus, minus) = p[index].tolist(), alpha[index].tolist()
    if plus == minus:
        return (
            f"no rigid body has p = {p_plus:g} and {p_minus:g} rad/s on sides of one slenderness, {plus:g} rad; "
            f"correct p, {_GIVE_RESTITUTION}"
        )
    fits = bool(found.differing[index] < found.most[index])
    if not fits and found.differing[index] > found.most[index] + found.margin[index]:
        differ, most = (math.expm1(value[index]) * 100.0 for value in (found.differing, found.most))
        return (
            f"no rigid body has p = {p_plus:g} and {p_minus:g} rad/s on sides of alpha = {plus:g} and {minus:g} rad: "
            f"its p would differ by less than {most:.2g} %, not by {differ:.2g} %; correct p, {_GIVE_RESTITUTION}"
        )
    best = f" better than to +-{found.uncertainty[index]:.1g}" if fits else ""
    return (
        f"p = {p_plus:g} and {p_minus:g} rad/s on sides of alpha = {plus:g} and {minus:g} rad have too few digits to "
        f"tell the restitution{best}: give more of them, {_GIVE_RESTITUTION}"
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


def _half_a_digit(values: Floats) -> Floats:
    """Half a unit in the last decimal digit that positive numbers were given to."""
    digits = np.arange(_FEWEST_DIGITS, _MOST_DIGITS + 1)
    unit = 10.0 ** (np.floor(np.log10(values))[..., None] - (digits - 1.0))
    given_to = abs(values[..., None] - np.rint(values[..., None] / unit) * unit) <= _NEAR * values[..., None]
    given_to[..., -1] = True
    fewest = np.argmax(given_to, axis=-1)
    return 0.5 * np.take_along_axis(unit, fewest[..., None], axis=-1)[..., 0]
