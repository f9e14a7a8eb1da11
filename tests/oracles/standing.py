"""Random bodies as they stand, of each kind: for the package, and for the integration of forces on their points.

`body(kind, rng)` draws one of a kind, `shaking` what shakes it. `lanes_and_single` simulates many of one kind both as
an ensemble and one by one, `single_and_integrated` one by one and by DOP853, and both count what differs.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import rocking
from oracles.restrained import Held, integrated
from rocking import (
    Block,
    Damper,
    Load,
    Motion,
    Restitution,
    RestrainedBlock,
    Restraint,
    Solid,
    Spring,
    Tendon,
    Thrust,
)

GRAVITY = 9.81
ULP = 2.0**-52
TOLERANCE = 1e-9
"""Of peaks, and of times over the duration: ensembles against single simulations."""
PEAKS = 1e-8
"""Of peaks against an integration."""
EXPLAINED = 0.05
"""A difference is the problem's own where a neighbour, the motion changed by few ulps, differs by this share of it."""

#: What each kind of body has, beside two pivots: kinds of restraints, laws of restitution and places of tendons.
KINDS = (
    *("two-sided", "wall", "elastic tendon", "prestress at the centre", "prestress at the toe", "spring and damper"),
    *("thrust, load and lean", "yielding tendon", "falling restitution", "random restitution", "from a mesh"),
)
#: Those that differ for an ensemble: a body from a mesh is a block of two sides.
OF_ENSEMBLES = KINDS[:-1]

Drawn = np.random.Generator


def between(rng: Drawn, low: float, high: float) -> float:
    """Draw a number whose logarithm is even."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def body(kind: str, rng: Drawn) -> tuple[RestrainedBlock, Held]:
    """Draw a body of a kind that stands, 0.3 m to 5 m from its base to the centre of mass."""
    while True:
        try:
            return _body(kind, rng)
        except rocking.errors.BlockError as refused:
            if "does not stand" not in str(refused):
                raise


def _body(kind: str, rng: Drawn) -> tuple[RestrainedBlock, Held]:
    if kind == "from a mesh":
        return _from_a_mesh(rng)
    size, wall = between(rng, 0.3, 5.0), kind == "wall" or (kind == "thrust, load and lean" and rng.random() < 0.5)
    distances = tuple((size * rng.uniform(0.08, 0.4, 2)).tolist())
    if rng.random() < 0.5:
        distances = distances[:1] * 2
    height, gyration, mass = size, size * rng.uniform(0.5, 0.9), between(rng, 10.0, 1e5)
    e = tuple(rng.uniform(0.2 if wall else 0.5, 0.7 if wall else 0.97, 2).tolist())
    held = Held(distances, height, gyration, mass, GRAVITY, e, one_sided=wall)
    weight = mass * GRAVITY
    restraints, law, lean = _RESTRAINTS.get(kind, _none)(rng, held, weight, size)
    held.lean = lean
    block = Block.from_pivots(distances, height, gyration, restitution=e, mass=mass, gravity=GRAVITY)
    return RestrainedBlock(
        block, *restraints, one_sided=wall, lean=lean, restitution=law or (e[0] if wall else e)
    ), held


Made = tuple[list[Restraint], Any, float]


def _none(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    return [], None, 0.0


def _tendon(held: Held, stiffness: float, prestress: float, offset: float) -> Made:
    held.tendons.append((stiffness, prestress, offset))
    return [Tendon(stiffness, prestress, offset)], None, 0.0


def _elastic(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    plus, minus = held.distances
    return _tendon(held, weight / size * between(rng, 0.1, 30.0), 0.0, rng.uniform(-minus, plus))


def _at_the_centre(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    return _tendon(held, weight / size * between(rng, 0.1, 30.0), weight * rng.uniform(0.05, 1.0), 0.0)


def _at_the_toe(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    toe = float(rng.choice([held.distances[0], -held.distances[1]]))
    return _tendon(held, weight / size * between(rng, 0.1, 30.0), weight * rng.uniform(0.05, 1.0), toe)


def _couples(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    held.spring, held.damper = weight * size * rng.uniform(0.01, 1.0), weight * size * between(rng, 1e-3, 0.3)
    return [Spring(held.spring), Damper(held.damper)], None, 0.0


def _pushed(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    least = min(held.distances)
    held.thrusts.append((rng.uniform(-0.3, 0.3) * weight * least / size, rng.uniform(0.5, 2.0) * size, 0.0))
    held.loads.append((held.mass * rng.uniform(0.05, 1.0), 2.0 * size, rng.uniform(-0.3, 0.3) * least))
    return (
        [Thrust(*held.thrusts[0]), Load(*held.loads[0], moves_with_block=False)],
        None,
        rng.uniform(-0.2, 0.2) * least / size,
    )


def _yielding(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    prestress = weight * float(rng.choice([0.0, rng.uniform(0.0, 0.5)]))
    offset = float(rng.choice([0.0, 0.9 * held.distances[0], -0.5 * held.distances[1]]))
    strength = prestress + weight * between(rng, 0.03, 1.0)
    held.yielding = weight / size * between(rng, 1.0, 100.0), prestress, offset, strength
    return [Tendon(*held.yielding)], None, 0.0


def _falling(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    largest, least = rng.uniform(0.8, 0.99, 2), rng.uniform(0.3, 0.7, 2)
    slope = [between(rng, 0.02, 1.0) for _ in range(2)]
    law = Restitution(largest.tolist(), least.tolist(), slope=slope)
    held.law = lambda j, speed, number: max(float(least[j]), float(largest[j]) - slope[j] * speed)
    return [], law, 0.0


def _random(rng: Drawn, held: Held, weight: float, size: float) -> Made:
    least, seed = rng.uniform(0.4, 0.7, 2), int(rng.integers(2**53))
    largest = least + rng.uniform(0.05, 0.25, 2)
    held.law = lambda j, speed, number: float(least[j] + (largest[j] - least[j]) * philox(number, seed))
    return [], Restitution(largest.tolist(), least.tolist(), seed=seed), 0.0


def _from_a_mesh(rng: Drawn) -> tuple[RestrainedBlock, Held]:
    """Two boxes, one on the other and aside, of two densities: closed forms of both, in the plane of any azimuth."""
    import trimesh

    size, azimuth = between(rng, 0.3, 3.0), float(rng.uniform(0.0, 360.0))
    sizes = size * np.array(
        [rng.uniform((0.3, 0.3, 0.2), (0.6, 0.6, 0.6)), rng.uniform((0.2, 0.2, 0.6), (0.4, 0.4, 1.2))]
    )
    densities, aside = rng.uniform(1500.0, 2700.0, 2), size * rng.uniform(-0.05, 0.05, 2)
    middles = np.array([[0.0, 0.0, 0.5 * sizes[0, 2]], [*aside, sizes[0, 2] + 0.5 * sizes[1, 2]]])
    masses = densities * np.prod(sizes, axis=1)
    centre = masses @ middles / masses.sum()
    angle = math.radians(azimuth)
    along = np.array([math.sin(angle), math.cos(angle), 0.0])
    # Mean square of the distance from the horizontal axis across the plane: along the plane, and up.
    spread = np.sum((sizes**2 / 12.0 + (middles - centre) ** 2)[:, 2] * masses)
    spread += masses @ ((sizes**2 / 12.0) @ along**2 + ((middles - centre) @ along) ** 2)
    gyration = math.sqrt(spread / masses.sum())
    reach = 0.5 * float(np.abs(sizes[0]) @ np.abs(along))
    distances = reach - float(centre @ along), reach + float(centre @ along)
    kept = gyration**2 + centre[2] ** 2 - distances[0] * distances[1]
    plus, minus = (gyration**2 + centre[2] ** 2 + d * d for d in distances)
    scene = trimesh.Scene()
    for name, box, middle in zip(("low", "high"), sizes, middles, strict=True):
        mesh = trimesh.creation.box(box)
        mesh.apply_translation(middle)
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    solid = Solid.from_mesh(scene, density=dict(zip(("low", "high"), densities, strict=True)), gravity=GRAVITY)
    block = RestrainedBlock(solid.block(azimuth))
    mass = float(masses.sum())
    return block, Held(distances, float(centre[2]), gyration, mass, GRAVITY, (kept / minus, kept / plus))


def philox(number: int, seed: int) -> float:
    """Philox 2x32-10 in whole numbers: of a number and the upper half of a seed, by its lower half, in [0, 1)."""
    low, high, key = number, seed >> 32, seed % 2**32
    for turn in range(10):
        upper, lower = divmod(0xD256D193 * low, 2**32)
        low, high = upper ^ high ^ ((key + turn * 0x9E3779B9) % 2**32), lower
    return ((low >> 5) * 2**26 + (high >> 6)) / 2**53


_RESTRAINTS = {
    "elastic tendon": _elastic,
    "prestress at the centre": _at_the_centre,
    "prestress at the toe": _at_the_toe,
    "spring and damper": _couples,
    "thrust, load and lean": _pushed,
    "yielding tendon": _yielding,
    "falling restitution": _falling,
    "random restitution": _random,
}


# --- what shakes them -----------------------------------------------------------------------------------------


def record(rng: Drawn, peak: float, seconds: float) -> Motion:
    """Smooth noise of a peak, m/s^2, sampled each 5 ms to 20 ms."""
    dt = float(rng.choice([0.005, 0.01, 0.02]))
    count, width = int(seconds / dt), int(rng.integers(3, 40))
    samples = np.convolve(rng.normal(size=count + width), np.ones(width), mode="valid")[:count]
    return Motion.from_samples(samples * (peak / np.max(np.abs(samples))), dt)


def shaking(rng: Drawn, threshold: float, rate: float) -> tuple[str, Motion]:
    """A record or a pulse that passes a threshold, m/s^2, for bodies of a frequency parameter; or its vertical one."""
    peak = threshold * between(rng, 1.05, 8.0)
    if rng.random() < 0.5:
        name, motion = "record", record(rng, peak, rng.uniform(3.0, 12.0))
    else:
        cycles = int(rng.integers(1, 5))
        period = between(rng, 0.2, 4.0) / rate
        name, motion = "pulse", rocking.pulses.sine(peak, 1.0 / period, cycles=cycles, phase=rng.uniform(0.0, 6.0))
    if rng.random() < 0.5:
        up = record(rng, rng.uniform(0.5, 9.0), rng.uniform(2.0, 10.0))
        name, motion = f"{name}, vertical", motion.with_vertical(up)
    return name, motion


# --- an ensemble against single simulations -------------------------------------------------------------------


@dataclass
class Count:
    """Pairs of one kind, and what became of them."""

    pairs: int = 0
    overturned: int = 0
    still: int = 0
    ambiguous: int = 0
    explained: int = 0
    worst: float = 0.0
    worst_explained: float = 0.0
    worst_ambiguous: float = 0.0
    by_motion: Counter[str] = field(default_factory=Counter)
    different: list[str] = field(default_factory=list)


def lanes_and_single(kind: str, seed: int, pairs: int, most: int = 50) -> Count:
    """Compare verdicts, peaks, and numbers of uplifts and rests of random bodies under random motions."""
    found = Count()
    for number in _numbers(pairs, most):
        rng = np.random.default_rng([seed, KINDS.index(kind), number])
        bodies = [body(kind, rng)[0] for _ in range(most)]
        model = str(rng.choice(["linear", "nonlinear"]))
        nearest = float(np.median([min(each.uplift_thresholds(model)) for each in bodies]))
        name, motion = shaking(rng, nearest, float(np.median([each.sides[0].p for each in bodies])))
        # Springs and tendons may hold a body at a rotation for ever.
        end = motion.end + 20.0
        together = rocking.simulate_many(bodies, motion, model=model, duration=end)
        columns = {each: together[each].values.ravel() for each in ("overturned", "peak_rotation", "uplifts", "rests")}
        for k, one in enumerate(bodies):
            lanes = {each: values[k].item() for each, values in columns.items()}
            _judge(
                found,
                one,
                (motion, model, end),
                lanes,
                f"{kind}, seed {seed}, batch {number}, {name}, {model}, body {k}",
            )
        found.by_motion[f"{name}, {model}"] += most
    return found


def _numbers(pairs: int, most: int) -> Iterator[int]:
    return iter(range(-(-pairs // most)))


def _outcomes(response: rocking.Response) -> dict[str, float]:
    kinds = response.events["kind"]
    return {
        "overturned": float(response.overturned),
        "peak_rotation": response.peak_rotation,
        "uplifts": float(np.sum(kinds == "uplift")),
        "rests": float(np.sum(kinds == "rest")),
    }


def _apart(one: dict[str, float], other: dict[str, float]) -> float:
    """How far two outcomes are apart, of the peak; infinite where they are not of one kind."""
    if one["overturned"] != other["overturned"]:
        return math.inf
    if not one["overturned"] and (one["uplifts"], one["rests"]) != (other["uplifts"], other["rests"]):
        return math.inf
    return abs(one["peak_rotation"] - other["peak_rotation"]) / max(other["peak_rotation"], 1e-300)


def _judge(
    found: Count, one: RestrainedBlock, shaken: tuple[Motion, str, float], lanes: dict[str, Any], where: str
) -> None:
    motion, model, end = shaken
    response = rocking.simulate(one, motion, model=model, duration=end)
    alone = _outcomes(response)
    found.pairs += 1
    found.overturned += response.overturned
    found.still += response.peak_rotation == 0.0
    apart = _apart(lanes, alone)
    if response.ambiguous:
        found.ambiguous += 1
        found.worst_ambiguous = max(found.worst_ambiguous, apart)
        return
    if apart <= TOLERANCE:
        found.worst = max(found.worst, apart)
        return
    for ulps in (-16, -4, -1, 1, 4, 16):
        near = _outcomes(rocking.simulate(one, motion.scaled(1.0 + ulps * ULP), model=model, duration=end))
        gap = _apart(near, alone)
        if gap >= EXPLAINED * apart or gap == math.inf:
            found.explained += 1
            found.worst_explained = max(found.worst_explained, apart)
            return
    found.different.append(f"{where}: {lanes} together, {alone} alone")


# --- single simulations against an integration ----------------------------------------------------------------


@dataclass
class Judged:
    """Cases of one kind, and what became of them; ill-conditioned ones change as much with the motion's tenth digit."""

    cases: int = 0
    impacts: int = 0
    peaks: int = 0
    overturned: int = 0
    rested: int = 0
    ill: int = 0
    worst: float = 0.0
    different: list[str] = field(default_factory=list)


def case(kind: str, seed: int, number: int) -> tuple[RestrainedBlock, Held, Motion, float, float]:
    """Draw a body of a kind, for the package and for the integration, a sine, the end and an initial rotation."""
    rng = np.random.default_rng([seed, KINDS.index(kind), number, 1])
    ours, held = body(kind, rng)
    plus, rate = ours.uplift_thresholds()[0], ours.sides[0].p
    frequency, cycles = rate / between(rng, 0.4, 4.0), int(rng.integers(1, 4))
    motion = rocking.pulses.sine(plus * between(rng, 1.05, 4.0), frequency, cycles=cycles, phase=rng.uniform(0, 6))
    if number % 3 == 0:
        up = rocking.pulses.sine(rng.uniform(0.5, 6.0), frequency * rng.uniform(1.0, 3.0), cycles=cycles)
        motion = motion.with_vertical(up)
    tendon = ours._terms[0]
    near = min(0.3 * min(*ours.balance, 0.5), 0.1, 0.8 * tendon.yield_elongation / max(tendon.lever_arm, 1e-9))
    return ours, held, motion, 1.2 * motion.end + 0.5, near if number % 2 else 0.0


def drawn(seed: int) -> tuple[RestrainedBlock, Motion, float]:
    """Draw a body, each kind in turn, a motion of 1.3 times what lifts it, and an initial rotation."""
    number, kind = divmod(seed, len(OF_ENSEMBLES))
    ours, _, motion, _, start = case(OF_ENSEMBLES[kind], 3, number)
    return ours, motion * (1.3 * min(ours.uplift_thresholds()) / motion.pga), start or 1e-3


def single_and_integrated(kind: str, seed: int, cases: int) -> Judged:
    """Compare verdicts, and peaks of bodies that stand, with DOP853 restarted at impacts, rests and breakpoints."""
    found = Judged()
    for number in range(cases):
        ours, held, motion, end, start = case(kind, seed, number)

        def simulated(factor: float = 1.0, ours=ours, motion=motion, end=end, start=start) -> rocking.Response:
            shaken = motion if factor == 1.0 else motion.scaled(factor)
            return rocking.simulate(ours, shaken, duration=end, initial_rotation=start)

        response = simulated()
        # Draws go on after a rest from the impacts that were resolved, of which a sequence has more the finer it is.
        rested = response.events["time"][response.events["kind"] == "rest"]
        held.resumed = np.searchsorted(response.impacts["time"], rested).tolist()
        times, _, peak, ended = integrated(held, motion, end, start, 0.0, 0, rests=True)
        found.cases += 1
        found.impacts += len(times)
        found.rested += bool(len(response.sequences))
        fell = ended == "overturned"
        found.overturned += fell
        apart = _peaks_apart(response, fell, peak)
        if not fell and apart < math.inf:
            found.peaks += 1
        if apart <= PEAKS:
            found.worst = max(found.worst, apart)
            continue
        near_ones = [simulated(1.0 + sign * 1e-10) for sign in (-1.0, 1.0)]
        if response.ambiguous or any(
            _peaks_apart(other, response.overturned, response.peak_rotation) > EXPLAINED * min(apart, 1.0)
            for other in near_ones
        ):
            found.ill += 1
        else:
            found.different.append(
                f"{kind}, seed {seed}, case {number}: {response.overturned} and {response.peak_rotation!r}, integrated "
                f"{ended} and {peak!r}"
            )
    return found


def _peaks_apart(response: rocking.Response, fell: bool, peak: float) -> float:
    """How far a peak is from another, relative; infinite where the verdicts differ, 0 where both overturn."""
    if response.overturned != fell:
        return math.inf
    return 0.0 if fell else abs(response.peak_rotation - peak) / max(peak, 1e-6)
