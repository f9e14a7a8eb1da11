"""Energy of a block over the least that overturns it.

It is that of the equation of motion without ground motion, u'' = -V'(u): kinetic u'^2/2 and potential V(u), both times
the moment of inertia about the pivot. (Derived in the documentation.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.block import Block, RestrainedBlock
from rocking.block.body import Body
from rocking.core.arrays import Floats, Integers
from rocking.errors import InvalidOption
from rocking.kernels.state import Record

#: Points of a boundary, and how far it reaches, over the balance.
_BOUNDARY: Final = 201
_FARTHEST: Final = 1.6

#: Fields of a body's record that make its potential.
_FIELDS: Final = (
    "stiffness", "threshold_slope", "threshold", "slenderness", "added_weight", "added_push", "prestress", "spring",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Energy:
    """Energy of a body on two pivots over the least that takes it from rest to an unstable balance without shaking.

    ``record`` is the body as kernels take it. Rotations are counted in the frame of a side, u = |theta|; a side is 0,
    1, or negative at rest.
    """

    body: Block | RestrainedBlock
    record: Record
    nonlinear: bool

    @cached_property
    def _inertia(self) -> Floats:
        """Moment of inertia about the pivot of each side over the weight, m s^2: R/p^2."""
        return np.array([self.body.sides[0].radius, self.body.sides[-1].radius]) / self.p**2

    @property
    def p(self) -> Floats:
        """Frequency parameter of each side, rad/s."""
        return np.array([self.body.sides[0].p, self.body.sides[-1].p])

    @cached_property
    def balance(self) -> Floats:
        """Rotation of the unstable balance on each side in this model, rad; infinite where there is none."""
        return np.array(self.body.balance) if self.nonlinear else linear_balance(self.body)

    @cached_property
    def has_balances(self) -> bool:
        """Whether rotations can be counted in balances: each side to which the body leans has one."""
        return bool(np.all(np.isfinite(self.balance[: len(self.body.sides)])))

    @property
    def unit_of_rotation(self) -> Floats:
        """What rotations to each side are counted in, rad: the balance; one radian where they cannot be so counted."""
        return np.where(np.isfinite(self.balance), self.balance, 1.0) if self.has_balances else np.ones(2)

    @cached_property
    def highest(self) -> Floats:
        """Potential energy at the balance of each side, over inertia, 1/s^2; infinite where there is none."""
        found = np.full(2, math.inf)
        for k, at in enumerate(self.balance):
            if math.isfinite(at):
                found[k] = float(self._potential(np.array([at]), np.array([k]))[0])
        return found

    @cached_property
    def needed(self) -> Floats:
        """Energy that overturns the body to each side, over the least: 1 to the easier side."""
        return self.highest * self._inertia / self._unit

    @cached_property
    def _unit(self) -> float:
        return float(np.min(self.highest * self._inertia))

    def kinetic(self, velocity: Floats, side: Integers) -> Floats:
        """Kinetic energy at velocities, rad/s."""
        found: Floats = 0.5 * velocity**2 * (self._inertia / self._unit)[np.maximum(side, 0)]
        return found

    def potential(self, rotation: Floats, side: Integers) -> Floats:
        """Potential energy at rotations, rad: zero upright; what a motion shakes is no part of it."""
        of = np.maximum(side, 0)
        found: Floats = self._potential(np.abs(rotation), of) * (self._inertia / self._unit)[of]
        return found

    def _potential(self, u: Floats, side: Integers) -> Floats:
        """V(u) of these sides, 1/s^2, without cancellation at small rotations."""
        made = {name: self.record[name][side] for name in _FIELDS}
        weight, push = 1.0 + made["added_weight"], made["added_push"]
        if self.nonlinear:
            half = 2.0 * np.sin(0.5 * u)
            psi = made["slenderness"] - 0.5 * u
            lifted = made["stiffness"] * (weight * np.sin(psi) + push * np.cos(psi)) + made["prestress"]
            return np.asarray(half * lifted + 0.5 * made["spring"] * u * u)
        stands = made["threshold_slope"] * (made["threshold"] * weight + push) + made["prestress"]
        return np.asarray(u * (stands - 0.5 * (made["stiffness"] * weight - made["spring"]) * u))

    def boundary(self, side: int) -> tuple[Floats, Floats]:
        """Rotation over balance and |velocity| over p times balance with as much energy as at the balance of a side."""
        balance = self.balance[side]
        if not math.isfinite(balance):
            return np.empty(0), np.empty(0)
        farthest = min(_FARTHEST, 0.5 * math.pi / balance)
        u = balance * np.union1d(np.linspace(0.0, farthest, _BOUNDARY), 1.0)
        left = self.highest[side] - self._potential(u, np.full(u.shape, side))
        speed = np.sqrt(2.0 * np.maximum(left, 0.0)) / (balance * self.p[side])
        return u / balance, speed

    def sides_at(self, impacts: NDArray[np.void]) -> tuple[Integers, Integers]:
        """Sides that the body leaves and enters at impacts of a response."""
        into: Integers = np.where(impacts["side"] > 0, 0, 1)
        return (into if int(self.record["next_side"][0]) == 0 else 1 - into), into

    def losses(self, impacts: NDArray[np.void]) -> Floats:
        """Energy that each impact of a response takes."""
        left, entered = self.sides_at(impacts)
        return self.kinetic(impacts["speed_before"], left) - self.kinetic(impacts["speed_after"], entered)


def linear_balance(body: Block | RestrainedBlock) -> Floats:
    """Rotation of the unstable balance on each side in the linear model, rad; infinite where there is none.

    A tendon that yields does so for the first time: it pulls as one that is elastic or with its strength, whichever is
    less, so that the balance is the nearer one of both.
    """
    (made,) = body.alone().kernel_records("linear", np.zeros((1, 2)))
    elastic = _balance_on_a_line(made, made["added_weight"], made["added_push"], made["prestress"])
    if not made["yielding"]:
        return elastic
    pull = made["base_prestress"] + made["tendon"] * (made["yields"] - made["slack"])
    return np.minimum(elastic, _balance_on_a_line(made, made["base_weight"], made["base_push"], pull))


def _balance_on_a_line(made: Record, added_weight: Floats, added_push: Floats, prestress: Floats) -> Floats:
    """Rotation at which what brings a block back has become nothing, where it is a straight line in the rotation."""
    found, weight = np.full(2, math.inf), 1.0 + added_weight
    falls = made["stiffness"] * weight - made["spring"]
    stands = made["threshold_slope"] * (made["threshold"] * weight + added_push) + prestress
    np.divide(stands, falls, out=found, where=falls > 0.0)
    return found


def energy_of(body: Body, record: Record, *, nonlinear: bool) -> Energy:
    """Return the energy of a body; refuse what is no block, has a tendon that yields, or is held at any rotation."""
    if not isinstance(body, Block | RestrainedBlock):
        raise InvalidOption(
            f"the energy that overturns a body is known of blocks alone, not of a {type(body).__name__}"
        )
    if record["yielding"]:
        raise InvalidOption("a tendon that yields keeps no energy: leave the strength of the tendon out to see it")
    found = Energy(body, record, nonlinear)
    if not np.any(np.isfinite(found.balance)):
        raise InvalidOption("no energy overturns this block: its restraints hold it back at any rotation")
    return found
