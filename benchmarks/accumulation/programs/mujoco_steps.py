"""MuJoCo: a slide joint whose limits are the stops, as springs with dampers that give the restitution."""

# requires: mujoco==4.0.0 numpy==2.4.6

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import mujoco
from loop import Case, answer, seen_in_steps

STEP = 2e-5

#: Steps that an impact lasts. The documentation asks for a time constant of two steps at least.
CONTACT = 25

SETTINGS = (
    f"steps of {STEP:g} s, stops as springs and dampers (solref in its direct form) with the restitution of a linear "
    f"contact that lasts {CONTACT} steps, solimp 0.9999; blocks are left out"
)
MODEL = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody><body><joint name="x" type="slide" axis="0 0 1" limited="true" range="{low} {high}" damping="{damping}"
    solreflimit="{stiffness} {drag}" solimplimit="0.9999 0.9999 0.001 0.5 2"/>
    <geom type="sphere" size="0.1" mass="1" contype="0" conaffinity="0"/></body></worldbody>
</mujoco>"""


def damping_ratio(restitution: float) -> float:
    """Damping ratio of a contact without pull (Schwager and Poeschel 2007)."""
    low, high = 0.0, 0.999
    for _ in range(60):
        z = 0.5 * (low + high)
        w = math.sqrt(1.0 - z * z)
        e = math.exp(-z / w * (math.pi - math.atan2(2.0 * z * w, 1.0 - 2.0 * z * z)))
        low, high = (z, high) if e > restitution else (low, z)
    return low


def solve(case: Case) -> dict[str, Any] | None:
    if case.is_block:
        return None
    z = damping_ratio(case.e)
    w = math.pi / (CONTACT * STEP * math.sqrt(1.0 - z * z))
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(
            step=STEP, low=case.low, high=1e3 if case.high is None else case.high, damping=case.damping,
            stiffness=-w * w, drag=-2.0 * z * w,
        )
    )  # fmt: skip
    return seen_in_steps(case, steps(case, model))


def steps(case: Case, model: Any) -> Iterator[tuple[float, float]]:
    data = mujoco.MjData(model)
    data.qpos[0] = case.given["start"][0]
    position, force = data.qpos, data.qfrc_applied
    for piece, end in enumerate(case.ends):
        push, shift = case.push(piece, 1), case.stiffness
        while (t := data.time) < end - 0.5 * STEP:
            x = float(position[0])
            force[0] = shift * (x - case.low) - push(t)
            mujoco.mj_step(model, data)
            yield data.time, float(position[0])


if __name__ == "__main__":
    answer("mujoco", SETTINGS, solve)
