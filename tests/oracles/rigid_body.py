"""A rigid body on two pivots, from its mass elements: nothing but sums over rectangles, and vectors."""

from dataclasses import dataclass

from mpmath import mp, mpf


@dataclass(frozen=True)
class Piece:
    """A rectangle of one density, from (left, bottom) to (right, top)."""

    left: object
    right: object
    bottom: object
    top: object
    density: object


@dataclass(frozen=True)
class Sides:
    """What the equation of motion takes, of side + and side -."""

    p: tuple
    alpha: tuple
    restitution: tuple


def sides_of(pieces, left, right):
    """Sides of the body made of these pieces, which stands on pivots at (left, 0) and (right, 0), to 40 digits."""
    with mp.workdps(40):
        gravity = mpf("9.80665")
        masses = [mpf(each.density) * (each.right - each.left) * (each.top - each.bottom) for each in pieces]
        middles = [((mpf(each.left) + each.right) / 2, (mpf(each.bottom) + each.top) / 2) for each in pieces]
        mass = sum(masses)
        x = sum(m * c[0] for m, c in zip(masses, middles, strict=True)) / mass
        y = sum(m * c[1] for m, c in zip(masses, middles, strict=True)) / mass

        def inertia(at):
            """Of all pieces about a point: each about its own middle, and that of its mass there."""
            return sum(
                m * ((each.right - each.left) ** 2 + (each.top - each.bottom) ** 2) / mpf(12)
                + m * ((c[0] - at[0]) ** 2 + (c[1] - at[1]) ** 2)
                for each, m, c in zip(pieces, masses, middles, strict=True)
            )

        pivots = {+1: (mpf(right), mpf(0)), -1: (mpf(left), mpf(0))}
        p, alpha, restitution = [], [], []
        for i, pivot in pivots.items():
            arm = (x - pivot[0], y - pivot[1])
            radius = mp.hypot(*arm)
            p.append(mp.sqrt(mass * gravity * radius / inertia(pivot)))
            alpha.append(mp.acos(arm[1] / radius))
            # Just before the impact every point turns about this pivot with one rad/s: v = z x r. Its momentum about
            # the other pivot, piece by piece, is what the body has of it just after.
            other = pivots[-i]
            before = mpf(0)
            for each, m, c in zip(pieces, masses, middles, strict=True):
                spin = m * ((each.right - each.left) ** 2 + (each.top - each.bottom) ** 2) / mpf(12)
                velocity = (-(c[1] - pivot[1]), c[0] - pivot[0])
                before += spin + m * ((c[0] - other[0]) * velocity[1] - (c[1] - other[1]) * velocity[0])
            restitution.append(before / inertia(other))
        return Sides(tuple(p), tuple(alpha), tuple(restitution))
