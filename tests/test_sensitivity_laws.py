"""Derivatives of a rotation by motion, p, slenderness and restitution of each side, of a body held back in any way."""

import numpy as np
import pytest

import rocking
from rocking import Damper, Load, Restitution, RestrainedBlock, Spring, Tendon, Thrust

BLOCK = rocking.Block.from_pivots((1.0, 1.2), 3.5, 2.3, mass=2e3, restitution=(0.8, 0.75))

BODIES = {
    "free": RestrainedBlock(BLOCK),
    "load": RestrainedBlock(BLOCK, Load(400.0, 3.0, offset=0.1, moves_with_block=False)),
    "load that follows": RestrainedBlock(BLOCK, Load(400.0, 3.0, offset=0.1)),
    "prestressed tendon": RestrainedBlock(BLOCK, Tendon(1e5, prestress=2e3, offset=-0.1)),
    "yielding tendon": RestrainedBlock(BLOCK, Tendon(1e5, prestress=1e3, strength=2.5e3)),
    "spring": RestrainedBlock(BLOCK, Spring(4e3)),
    "damper": RestrainedBlock(BLOCK, Damper(3e3)),
    "thrust": RestrainedBlock(BLOCK, Thrust(900.0, height=3.0)),
    "lean": RestrainedBlock(BLOCK, lean=0.03),
    "falling restitution": RestrainedBlock(BLOCK, restitution=Restitution(0.85, 0.3, slope=0.4)),
    "everything": RestrainedBlock(
        BLOCK,
        Load(200.0, 3.0, moves_with_block=False),
        Tendon(3e4, prestress=1e3),
        Spring(1e3),
        Damper(800.0),
        lean=0.01,
    ),
    "one side": rocking.Block.one_sided(Spring(1e3), width=1.2, height=4.0, mass=2e3, restitution=0.5),
}

BY_SIDE = tuple(f"{name}_{side}" for name in ("p", "alpha", "restitution") for side in ("plus", "minus"))

#: What is proportional to p^2 where every moment over the moment of inertia is.
WITH_P = ("stiffness", "restoring_gain", "prestress", "base_prestress", "spring", "damping", "tendon_stiffness")


def change(made, name, nonlinear, strength):
    """Change what a name stands for in the records of bodies by a share of itself, and nothing else."""
    kind, _, side = name.partition("_")
    j = ("plus", "minus").index(side)
    if kind == "p":
        for field in WITH_P:
            made[field][:, j] *= (1.0 + strength) ** 2
    elif kind == "restitution":
        for field in ("restitution", "min_restitution", "restitution_slope"):
            made[field][:, j] *= 1.0 + strength
    elif np.isfinite(made["threshold"][0, j]):
        at_zero = made["restraint_threshold"][:, j] * made["restoring_gain"][:, j]
        added = [made["stiffness"][:, j] * made[f"added_{field}"][:, j] for field in ("weight", "push")]
        before = [made[field][:, j].copy() for field in ("sine", "cosine")]
        made["slenderness"][:, j] *= 1.0 + strength
        alpha = made["slenderness"][:, j]
        if nonlinear:
            made["sine"][:, j], made["cosine"][:, j] = np.sin(alpha), np.cos(alpha)
            made["threshold"][:, j], made["restoring_gain"][:, j] = (
                np.tan(alpha),
                made["stiffness"][:, j] * np.cos(alpha),
            )
            after = [made[field][:, j] for field in ("sine", "cosine")]
            at_zero += sum(each * (new - old) for each, new, old in zip(added, after, before, strict=True))
        else:
            at_zero += added[0] * (alpha - made["threshold"][:, j])
            made["threshold"][:, j] = alpha
        made["restraint_threshold"][:, j] = at_zero / made["restoring_gain"][:, j]
    return made


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("name", BODIES)
def test_rotations_impacts_and_uplifts_change_with_everything_as_differences_say(name, model, monkeypatch):
    """From rest to either side, with a vertical component and without one."""
    body, judged, h = BODIES[name], {"rotation": 0, "impact": 0, "uplift": 0}, 1e-6
    made = rocking.Blocks.create_kernel_structs
    for sign in (1.0, -1.0):
        size = sign * 1.35 * max(each for each in body.uplift_thresholds(model) if np.isfinite(each))
        motion = rocking.pulses.sine(size, 0.9, cycles=2)
        if (sign > 0.0) == (model == "linear"):
            motion = motion.with_vertical(rocking.pulses.sine(2.0, 1.7, cycles=2))

        def simulated(strength=0.0, of="motion", motion=motion):
            def create_kernel_structs(bodies, model, limits):
                return change(made(bodies, model, limits), of, model == "nonlinear", strength)

            with monkeypatch.context() as patched:
                if of == "motion":
                    motion = motion * (1.0 + strength)
                else:
                    patched.setattr(rocking.Blocks, "create_kernel_structs", create_kernel_structs)
                return rocking.simulate(body, motion, model=model, duration=motion.end)

        found = simulated()
        impacts = found.impacts["time"][:4]
        begin, end = found.events["time"][0], min(found.overturn_time, motion.end) if found.overturned else motion.end
        times = np.linspace(begin + 0.02, end - 0.1, 9)
        times = times[[np.min(np.abs(impacts - each), initial=1.0) > 1e-3 for each in times]]
        times = times[times < (found.impacts["time"][4] if len(found.impacts) > 4 else np.inf)]
        # Of a tendon that yields, what is held while slenderness changes is another thing before and after that.
        names = [each for each in BY_SIDE if name != "yielding tendon" or not each.startswith("alpha")]
        names = ("motion", *names)
        changes = found.sensitivity.rotation(times, inputs=names)
        _, by_impact, by_event = found.sensitivity._compute_changes(names)
        uplifts = np.flatnonzero(found.events["kind"] == "uplift")[:2]
        for k, of in enumerate(names):
            more, less = (simulated(strength, of) for strength in (h, -h))
            for what, values, high, low in (
                ("rotation", changes[of], more.rotation(times), less.rotation(times)),
                ("impact", by_impact[k], more.impacts["time"], less.impacts["time"]),
                ("uplift", by_event[k][uplifts], more.events["time"][uplifts], less.events["time"][uplifts]),
            ):
                n = len(impacts) if what == "impact" else len(values)
                slope = (high[:n] - low[:n]) / (2.0 * h)
                close = 2e-5 * max(0.01, np.max(np.abs(slope), initial=0.0))
                assert values[:n] == pytest.approx(slope, rel=2e-5, abs=close), (what, of, sign)
                judged[what] += int(np.count_nonzero(slope))
    assert judged["rotation"] >= (20 if body.is_one_sided else 40)
    assert judged["impact"] >= 5
    assert judged["uplift"] >= (1 if body.is_one_sided else 2) * (2 - (name == "yielding tendon"))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_peak_where_a_simulation_stops_lies_within_it_and_changes_with_the_motion(side):
    block, start = rocking.Block.from_parameters(p=2.0, alpha=0.2), side * 0.05
    motion = rocking.Motion.from_samples([0.0, 1.0, 0.3, 1.1, 0.0], 0.1).scaled(side)
    for duration in np.linspace(0.013, 0.37, 300):
        response = rocking.simulate(
            block, motion, duration=duration, initial_rotation=start, initial_velocity=0.5 * side
        )
        assert response.peak_time <= duration and response.peak_rotation > 0.0
        assert np.isfinite(response.rotation(response.peak_time)) and response.sensitivity.peak["motion"][0] != 0.0
