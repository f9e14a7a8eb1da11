"""Branch switching: from a bifurcation of periodic orbits to the branch of others that begins there."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.dynamics.branches import FLIP, SYMMETRY, Bifurcation, Branch
from rocking.dynamics.continuation import continue_orbit, range_of
from rocking.dynamics.orbit_equations import OrbitEquations
from rocking.dynamics.orbits import PeriodicOrbit
from rocking.errors import InvalidOption

#: Multiplier of the orbit at a bifurcation, along whose eigenvector other orbits lie, and by what their period is
#: longer.
LEAVING: Final = {FLIP: (-1.0, 2), SYMMETRY: (1.0, 1)}

#: Distances from a bifurcation, over the scale of states, at which an orbit of the other branch is looked for.
_AWAY: Final = (1e-3, 1e-4, 1e-5)


def switch_branch(
    branch: Branch,
    number: int,
    limits: tuple[float, float] | None = None,
    *,
    step: float = 0.05,
    most: int = 1000,
) -> Branch:
    """Follow the branch that leaves another one at a bifurcation: of orbits of twice the period, or of asymmetric ones.

    Parameters
    ----------
    branch : Branch
        Where the bifurcation was found.
    number : int
        Which of the branch's ``bifurcations``: a flip, or where symmetry breaks.
    limits : (float, float), optional
        Range of the parameter; by default that of the branch.
    step : float
        As for `continue_orbit`.
    most : int
        As for `continue_orbit`.

    Returns
    -------
    Branch
        From the bifurcation on, at which it ends on that side. Of the two branches where symmetry breaks it is one; the
        orbits of the other are the mirror images of its orbits, at the same values and with the same multipliers.

    Raises
    ------
    InvalidOption
        If there is no such bifurcation, it is of another kind, no orbit of the other branch is found near it within the
        limits, or a number is out of its range.

    Notes
    -----
    The orbits of the other branch lie along the eigenvector of the multiplier -1 (flip) or 1 (symmetry): away from the
    bifurcation as the square root of the change of the parameter. Newton's method looks for one of them in the plane
    across the eigenvector, a little way off, in which the branch that is left has no orbit; `continue_orbit` follows
    it.

    References
    ----------
    H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", in Applications of Bifurcation
    Theory, Academic Press (1977).

    Examples
    --------
    The bounces of a ball double their period at Luck and Mehta's amplitude, and double it again:

    >>> from rocking import dynamics, pulses
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> def family(amplitude):
    ...     return ball, pulses.sine(amplitude, 5.0, cycles=1)
    >>> stable = next(each for each in dynamics.periodic_orbits(*family(12.0)) if each.is_stable)
    >>> once = dynamics.continue_orbit(stable, family, 12.0, (11.0, 16.8))
    >>> twice = dynamics.switch_branch(once, 0)
    >>> print(twice.period, *(f"{each.kind} {each.value:.6f}" for each in twice.bifurcations))
    2 flip 15.268237 flip 16.671307
    """
    if not isinstance(branch, Branch):
        raise InvalidOption("{} must be one that continue_orbit or switch_branch returns", "branch", value=branch)
    bifurcation = branch.bifurcations[_number_of(branch, number)]
    if bifurcation.kind not in LEAVING:
        raise InvalidOption(
            f"{{}} must be that of a flip or of a symmetry breaking; {number} is a {bifurcation.kind}, at which no "
            "other branch begins",
            "number",
            value=number,
        )
    within = branch.limits if limits is None else range_of(limits)
    found = _orbit_beside(branch, bifurcation, within)
    if found is None:
        raise InvalidOption(
            f"no orbit of another branch was found near the {bifurcation.kind} at {bifurcation.value:g} in the range "
            f"from {within[0]:g} to {within[1]:g}; take a range that it begins in"
        )
    orbit, value = found
    return continue_orbit(orbit, branch.family, value, within, name=branch.name, unit=branch.unit, step=step, most=most)


def _number_of(branch: Branch, number: int) -> int:
    last = len(branch.bifurcations) - 1
    if last < 0:
        raise InvalidOption("the branch has no bifurcation, so that none has a {}", "number")
    return checks.whole(number, "number", InvalidOption, least=0, most=last)


def _orbit_beside(
    branch: Branch, bifurcation: Bifurcation, limits: tuple[float, float]
) -> tuple[PeriodicOrbit, float] | None:
    """Orbit of the branch that begins at a bifurcation, and its parameter; None where there is none near it."""
    multiplier, longer = LEAVING[bifurcation.kind]
    orbit, value = bifurcation.orbit, bifurcation.value
    parent = OrbitEquations.of(orbit, branch.family, value, branch.limits)
    start = np.append(orbit.state, value) / parent.sizes
    parent, start = parent.moved(start, parent.course(start))
    along = _eigenvector(parent, start, multiplier)
    kind = parent.kind._replace(impacts=longer * parent.kind.impacts)
    other = replace(parent, period=longer * parent.period, by_half=False, kind=kind)
    for away in _AWAY:
        found = other.solved(start + away * along, along)
        if found is None or other.is_parent(found.z) or other.kind_at(found.z) != kind:
            continue
        at = other.physical(found.z)[1]
        if limits[0] <= at <= limits[1]:
            return other.orbit(found.z), at
    return None


def _eigenvector(equations: OrbitEquations, z: Floats, multiplier: float) -> Floats:
    """Return the eigenvector of the multiplier of an orbit that is nearest to a number, as a direction of numbers z."""
    state, value = equations.physical(z)
    _, change = equations.strobe(value).derivative(state, equations.period)
    values, vectors = np.linalg.eig(change / equations.sizes[:2, None] * equations.sizes[:2])
    along = np.append(np.real(vectors[:, np.argmin(np.abs(values - multiplier))]), 0.0)
    return np.asarray(along / np.linalg.norm(along))
