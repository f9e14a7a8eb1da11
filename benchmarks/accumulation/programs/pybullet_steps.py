"""Bullet through PyBullet: a sphere between planes that are the stops."""

# requires: pybullet==3.2.7 numpy==2.4.6

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pybullet as bullet
from loop import Case, answer, seen_in_steps

STEP = 2e-5
RADIUS = 0.5

SETTINGS = (
    f"steps of {STEP:g} s; restitution without a threshold on speed; contacts 1e-9 m ahead, since those further ahead "
    "take from the restitution; no correction of penetration, which adds speed; blocks are left out"
)


def solve(case: Case) -> dict[str, Any] | None:
    if case.is_block:
        return None
    return seen_in_steps(case, steps(case))


def steps(case: Case) -> Iterator[tuple[float, float]]:
    bullet.resetSimulation()
    bullet.setPhysicsEngineParameter(
        fixedTimeStep=STEP, numSubSteps=0, restitutionVelocityThreshold=0.0, contactBreakingThreshold=1e-9,
        contactSlop=0.0, erp=0.0, contactERP=0.0, numSolverIterations=50,
    )  # fmt: skip
    ball = bullet.createMultiBody(
        1.0, bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=RADIUS), basePosition=[0, 0, case.given["start"][0]]
    )
    bullet.changeDynamics(
        ball, -1, restitution=case.e, linearDamping=0.0, angularDamping=0.0, lateralFriction=0.0, rollingFriction=0.0
    )
    for position, normal in ((case.low, 1), (case.high, -1)):
        if position is not None:
            plane = bullet.createMultiBody(
                0.0, bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=[0, 0, normal]),
                basePosition=[0, 0, position - normal * RADIUS],
            )  # fmt: skip
            bullet.changeDynamics(plane, -1, restitution=1.0, lateralFriction=0.0)
    t, x, v, n = 0.0, case.given["start"][0], 0.0, 0
    for piece, end in enumerate(case.ends):
        push, shift = case.push(piece, 1), case.stiffness
        while t < end - 0.5 * STEP:
            force = shift * (x - case.low) - case.damping * v - push(t)
            bullet.applyExternalForce(ball, -1, [0, 0, force], [0, 0, x], bullet.WORLD_FRAME)
            bullet.stepSimulation()
            n += 1
            t, x, v = n * STEP, bullet.getBasePositionAndOrientation(ball)[0][2], bullet.getBaseVelocity(ball)[0][2]
            yield t, x


if __name__ == "__main__":
    bullet.connect(bullet.DIRECT)
    answer("pybullet", SETTINGS, solve)
