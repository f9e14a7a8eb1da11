"""Adversarial uplifts and impacts against exact answers in 50 digits; SciPy locates events of the same cases.

Each case asks when something first happens within a time, if it does: an uplift where the motion passes a threshold,
or an impact where an arc comes down to the ground. Each kind is as near as double precision lets it be to not
happening, to happening twice, or to nothing at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.integrate

import rocking
from promises.exact import GRAVITY, Side, impacts, lowest, mp, over_gravity, root, state
from promises.promise import OF_NO_SIMULATION, Found, Promise

#: Cases of each kind in a part.
CASES = 200

#: A passing, or a dip below the ground, by less than this share cannot be told from none; at twice that it must be.
UNDECIDED = 2.0**-47

#: Errors of times, in units in the last place of what they come from, over the slope there.
UNITS = 16.0

#: Times of SciPy count as off beyond this, s: a hundred times the tolerance that SciPy was given.
LATE = 1e-8

#: Of whatever types.
solve_ivp: Any = scipy.integrate.solve_ivp

_ULP = 2.0**-52


@dataclass(frozen=True)
class Question:
    """What is simulated, and when (times in 50 digits) the event truly happens within ``until``.

    ``margin`` is by what share of its scale the event happens, or does not; ``known`` how well doubles know its time,
    s. The last three are for SciPy: right side, initial state, and the function whose zero is the event.
    """

    block: rocking.Block
    motion: rocking.Motion
    options: dict[str, Any]
    kind: str
    true: list[Any]
    until: float
    margin: float
    known: float
    right: Callable[..., Any]
    start: tuple[float, float]
    event: Callable[[float, Any], float]


def _side(rng: np.random.Generator) -> Side:
    p = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    return Side(p, float(rng.uniform(0.02, 0.6)), float(rng.uniform(0.3, 0.95)))


def _block(side: Side) -> rocking.Block:
    return rocking.Block.from_parameters(p=side.p, alpha=side.alpha, restitution=side.restitution)


def motion_of(breakpoints: list[float], rows: list[list[float]]) -> rocking.Motion:
    """Make a motion of polynomial pieces."""
    return rocking.Motion(np.array(breakpoints), np.array(rows))


def _excess(rng: np.random.Generator) -> float:
    """Draw a share to either side of nothing, from a thousandth to a unit in the last place."""
    return float(rng.choice([-1.0, 1.0]) * 2.0 ** rng.uniform(-51.0, -10.0))


def _of_motion(
    motion: rocking.Motion, side: Side, true: Any, margin: float, slope: float, **initial: float
) -> Question:
    """Whether the motion passes the threshold of side -, from rest; ``slope`` is that of the passing, 1/s."""
    until, threshold = motion.end, GRAVITY * side.alpha
    vertical = motion.vertical

    def event(t: float, y: Any) -> float:
        lift = float(vertical.acceleration(t)) if vertical is not None else 0.0
        return float(motion.acceleration(t)) - threshold * (1.0 + lift / GRAVITY)

    known = UNITS * _ULP * (1.0 / abs(slope) + until)
    return Question(
        _block(side), motion, initial, "uplift", [] if true is None else [true], until, margin, known,
        lambda t, y, sign: (0.0, 0.0), (0.0, 0.0), event,
    )  # fmt: skip


def threshold(rng: np.random.Generator) -> Question:
    """Ask of a sample beyond the threshold, or not, by less and less down to a unit in the last place."""
    side, step = _side(rng), float(10.0 ** rng.uniform(-4.0, -1.0))
    peak = side.alpha * GRAVITY * (1.0 + _excess(rng))
    motion = rocking.Motion.from_samples([0.0, peak, 0.0], step)
    share = mp.mpf(side.alpha) / over_gravity(peak)
    true = mp.mpf(float(motion.breakpoints[1])) * share if share < 1 else None
    return _of_motion(motion, side, true, float(1 - share), 1.0 / step)


def double_root(rng: np.random.Generator) -> Question:
    """Ask of a parabola whose top is at the threshold but for less and less: two roots there, or none."""
    side, span = _side(rng), float(10.0 ** rng.uniform(-3.0, 0.0))
    top, at = side.alpha * GRAVITY * (1.0 + _excess(rng)), span * float(rng.uniform(0.2, 0.8))
    bend = side.alpha * GRAVITY * float(rng.uniform(0.3, 3.0)) / span**2
    row = [top - bend * at * at, 2.0 * bend * at, -bend]
    c0, c1, c2 = (over_gravity(c) / mp.mpf(side.alpha) for c in row)
    within = c1 * c1 - 4 * c2 * (c0 - 1)
    # Its terms cancel, and a unit in the last place of each of them counts.
    size = sum(abs(c) * mp.mpf(span) ** n for n, c in enumerate((c0, c1, c2)))
    margin = float(-within / (4 * c2) / size)
    true = (-c1 + mp.sqrt(within)) / (2 * c2) if within >= 0 else None
    true = mp.mpf(0) if c0 > 1 else true
    slope = float(mp.sqrt(abs(within)))
    return _of_motion(motion_of([0.0, span], [row]), side, true, margin, max(slope, 1e-300))


def weight(rng: np.random.Generator) -> Question:
    """Ask of a weight that falls through zero on a straight line, under a push of any size down to next to nothing."""
    side, span = _side(rng), float(10.0 ** rng.uniform(-3.0, 0.0))
    push = float(rng.choice([0.0, 10.0 ** rng.uniform(-15.0, 0.0)])) * 0.9 * side.alpha * GRAVITY
    end = -GRAVITY * float(rng.uniform(1.001, 4.0))
    motion = motion_of([0.0, span], [[push]]).with_vertical(rocking.Motion.from_points([0.0, span], [0.0, end]))
    row = motion.vertical.coefficients[0] if motion.vertical is not None else [0.0, 0.0]
    fall = -over_gravity(float(row[1]))
    true = (1 - over_gravity(push) / mp.mpf(side.alpha)) / fall
    return _of_motion(motion, side, true, 1.0, float(fall))


def after_a_subnormal_speed(rng: np.random.Generator) -> Question:
    """Ask of the uplift after a speed of a few subnormal numbers, which comes to rest at once."""
    side, step = _side(rng), float(10.0 ** rng.uniform(-4.0, -1.0))
    peak = side.alpha * GRAVITY * float(rng.uniform(1.01, 3.0))
    motion = rocking.Motion.from_samples([0.0, peak, 0.0], step)
    speed = 5e-324 * float(rng.integers(1, 1000)) * float(rng.choice([-1.0, 1.0]))
    true = mp.mpf(float(motion.breakpoints[1])) * mp.mpf(side.alpha) / over_gravity(peak)
    return _of_motion(motion, side, true, 1.0, 1.0 / step, initial_velocity=speed)


def _of_arc(
    motion: rocking.Motion, side: Side, true: list[Any], until: float, margin: float, known: float, **initial: float
) -> Question:
    """When an arc on side + comes down, the motion being one or two constant pieces."""
    p, alpha = side.p, side.alpha
    ends, levels = motion.breakpoints[1:-1], motion.coefficients[:, 0] / GRAVITY

    def right(t: float, y: Any, sign: float) -> tuple[float, float]:
        push = levels[int(np.searchsorted(ends, t, side="right"))]
        return float(y[1]), float(p * p * (y[0] - alpha - sign * push))

    start = initial.get("initial_rotation", 0.0), initial.get("initial_velocity", 0.0)
    return Question(
        _block(side), motion, initial, "impact", true, until, margin, known, right, start, lambda t, y: float(y[0])
    )


def grazing(rng: np.random.Generator) -> Question:
    """Ask of a leaning block that falls back and is caught just above the ground, or dips below by as little."""
    side = _side(rng)
    # Only where the speed over p is more than the height can a constant push catch it at the ground.
    u0 = side.alpha * float(rng.uniform(0.1, 0.6))
    height = u0 * (1.0 - 0.5 * u0 / side.alpha) * float(rng.uniform(0.2, 0.8))
    fall = float(np.arccosh((side.alpha - height) / (side.alpha - u0))) / side.p
    zero = mp.mpf(0)
    u, v = state(side, mp.mpf(u0), zero, zero, zero, mp.mpf(fall))
    # Turning at zero: x^2 - y^2 = (alpha + push)^2 with x = u - alpha - push and y = v/p.
    catching = (u * u - (v / mp.mpf(side.p)) ** 2 - 2 * u * mp.mpf(side.alpha)) / (2 * u)
    level = float(catching * mp.mpf(GRAVITY)) * (1.0 + _excess(rng))
    push = over_gravity(level)
    at, low = lowest(side, u, v, push)
    motion = motion_of([0.0, fall, fall + 2.0 * float(at)], [[0.0], [level]])
    true = []
    slope = mp.mpf(1)
    if low < 0:
        hit = root(lambda t: state(side, u, v, push, zero, t)[0], zero, at)
        true, slope = [mp.mpf(fall) + hit], state(side, u, v, push, zero, hit)[1]
    known = UNITS * _ULP * (u0 / abs(float(slope)) + fall)
    return _of_arc(motion, side, true, fall + float(at) * 1.5, float(-low / u0), known, initial_rotation=u0)


def in_one_sample(rng: np.random.Generator) -> Question:
    """Ask of many impacts within one piece of the motion."""
    side = _side(rng)
    push = float(rng.uniform(-0.9, 0.9)) * side.alpha * GRAVITY
    speed = side.p * side.alpha * float(rng.uniform(1e-3, 0.05))
    true: list[Any] = []
    for time, left in impacts((side, side), push, speed, 0):
        if left < speed * 1e-3 or len(true) == 8:
            break
        true.append(time)
    motion = motion_of([0.0, 1e3], [[push]])
    until = float(true[-1]) * (1.0 + 1e-9)
    return _of_arc(motion, side, true, until, 1.0, UNITS * _ULP * until, initial_velocity=speed)


def tiny_step(rng: np.random.Generator) -> Question:
    """Ask of samples of down to a billionth of the block's own unit of time."""
    drawn = _side(rng)
    side = Side(0.05 * drawn.p, drawn.alpha, drawn.restitution)
    step = float(10.0 ** rng.uniform(-9.0, -3.0)) / side.p
    peak = side.alpha * GRAVITY * float(rng.uniform(1.0 + 1e-6, 1.5))
    motion = rocking.Motion.from_samples([0.0, peak, 0.0], step)
    true = mp.mpf(float(motion.breakpoints[1])) * mp.mpf(side.alpha) / over_gravity(peak)
    return _of_motion(motion, side, true, 1.0, 1.0 / step)


KINDS: dict[str, Callable[[np.random.Generator], Question]] = {
    "a threshold touched to the last bit": threshold,
    "a double root at a threshold": double_root,
    "a weight through zero": weight,
    "uplift after a subnormal speed": after_a_subnormal_speed,
    "an arc that grazes the ground": grazing,
    "impacts within one sample": in_one_sample,
    "p dt down to 1e-9": tiny_step,
}


def package(asked: Question) -> tuple[list[float], bool]:
    """Say when the package sees the event, and whether it calls the response ambiguous."""
    response = rocking.simulate(asked.block, asked.motion, model="linear", **asked.options)
    events = response.events
    times = response.impacts["time"] if asked.kind == "impact" else events["time"][events["kind"] == "uplift"]
    found = [float(t) for t in times[: max(len(asked.true), 1)] if t <= asked.until]
    # Of a sequence that is proven to be complete the last impacts are not resolved; its rest is another promise.
    if asked.kind == "impact" and len(response.sequences) and np.isfinite(response.sequences["lower"][0]):
        found += map(float, asked.true[len(response.impacts) :])
    return found, response.ambiguous


def by_scipy(asked: Question) -> list[float]:
    """Say when `solve_ivp` sees it, restarted at each impact: DOP853, relative tolerance 1e-10, 32 steps or more."""

    def event(t: float, y: Any, sign: float) -> float:
        return asked.event(t, y)

    event.direction = -1.0 if asked.kind == "impact" else 1.0  # type: ignore[attr-defined]
    event.terminal = True  # type: ignore[attr-defined]
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-14, "max_step": asked.until / 32.0}
    found: list[float] = []
    time, start, sign = 0.0, asked.start, 1.0
    while len(found) < max(len(asked.true), 1) and time < asked.until:
        run = solve_ivp(asked.right, (time, asked.until), start, events=event, args=(sign,), **options)
        if not len(run.t_events[0]):
            break
        time, sign = float(run.t_events[0][0]), -sign
        start = 0.0, -asked.block.sides[0].restitution * float(run.y_events[0][0][1])
        found.append(time)
    return found


def judge(part: int) -> Found:
    """Judge the cases of a part, of every kind."""
    found = Found(parts=1)
    for kind, (name, draw) in enumerate(KINDS.items()):
        for number in range(part * CASES, (part + 1) * CASES):
            asked = draw(np.random.default_rng([47, kind, number]))
            found.cases += 1
            found.notes[f"{name}: cases"] += 1
            times, ambiguous = package(asked)
            if abs(asked.margin) <= UNDECIDED or ambiguous:
                found.notes[f"{name}: undecided"] += 1
                found.notes[f"{name}: not told"] += not ambiguous and _wrong(asked, times, limit=1.0) != ""
            else:
                found.judged += 1
                found.worst = max(found.worst, _error(asked, times))
                if wrong := _wrong(asked, times, limit=1.0):
                    found.notes[f"{name}: {wrong}"] += 1
                    told = f"{times}, true {[float(t) for t in asked.true]}, margin {asked.margin:g}"
                    found.fail(f"{name}, case {number}: {wrong} at {told}")
                theirs = _wrong(asked, by_scipy(asked), limit=LATE / asked.known)
                found.notes[f"{name}: SciPy {theirs}"] += theirs != ""
    return found


def _error(asked: Question, times: list[float]) -> float:
    """Largest error of a time over what doubles can know; nothing where the numbers of events differ."""
    if len(times) != len(asked.true):
        return 0.0
    return max((abs(float(t - true)) / asked.known for t, true in zip(times, asked.true, strict=True)), default=0.0)


def _wrong(asked: Question, times: list[float], limit: float) -> str:
    """Say whether an event is missed or spurious, or its time off by more than a limit."""
    missing = len(asked.true) - len(times)
    if missing:
        return "missed" if missing > 0 else "spurious"
    return "off" if _error(asked, times) > limit else ""


def table(found: Found) -> str:
    """Scores by kind: missed, spurious and off, of the package and of others."""
    heads = ("kind", "cases", "undecided", "not told", "rocking", "SciPy")
    lines = ["| " + " | ".join(heads) + " |", "|---" + "|--:" * (len(heads) - 1) + "|"]
    for name in KINDS:
        cells = [str(found.notes[f"{name}: {head}"]) for head in heads[1:4]]
        for solver in ("", "SciPy "):
            score = (str(found.notes[f"{name}: {solver}{wrong}"]) for wrong in ("missed", "spurious", "off"))
            cells.append(" / ".join(score))
        lines.append("| " + " | ".join([name, *cells]) + " |")
    return "\n".join(lines) + "\n"


PROMISE = Promise(
    name="events",
    says="no event missed, none made up",
    parts=72,
    small=1,
    judge=judge,
    least=0.85,
    table=table,
    above=OF_NO_SIMULATION,
)
