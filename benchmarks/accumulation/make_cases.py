"""Draw the cases of the accumulation benchmark and write cases.json: ``python benchmarks/accumulation/make_cases.py``.

Parameters are drawn, rounded to three digits, and kept where what `rocking` finds is of the family that is wanted;
nothing else decides. tests/test_accumulation.py checks every time with 50 digits and closed-form arcs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import rocking
from rocking import dynamics

CASES = Path(__file__).with_name("cases.json")
GRAVITY = 9.81

#: Impacts whose times a case gives: so many at most, up to the first that follows within this many seconds.
IMPACTS, SHORTEST = 30, 1e-3

#: What brackets are widened by: so many relative changes of all that is given, and of the time.
ROUNDING = 4.0 * 2.0**-52

#: Number of cases of each body, restitutions, and amplitudes over the acceleration that lifts the body off.
FAMILIES = {
    "free": (5, (0.2, 0.99), (0.0, 0.0)),
    "rest": (5, (0.3, 0.9), (0.2, 0.8)),
    "several": (5, (0.2, 0.7), (1.2, 2.5)),
    "elastic": (4, (0.95, 0.99), (0.1, 0.5)),
    "incomplete": (3, (0.5, 0.9), (1.02, 1.6)),
    "grazing": (2, (0.5, 0.9), (0.8, 2.5)),
    "never": (1, (0.7, 0.9), (1.5, 4.0)),
}
FREE = (0.2, 0.5, 0.8, 0.95, 0.99)

#: How fast each body moves, 1/s: what frequencies are in proportion to.
BODIES = {"ball": 2.0, "oscillator": 1.0, "pendulum": 1.2, "block": 1.5}


def main() -> None:
    rng = np.random.default_rng(20)
    made = [
        {"name": f"{body}-{family}-{k + 1}", **first_of_family(rng, body, family, k)}
        for body in BODIES
        for family, (count, _, _) in FAMILIES.items()
        for k in range(count)
    ]
    lines = ",\n".join(json.dumps(case) for case in made)
    CASES.write_text(f"[\n{lines}\n]\n", "utf-8")
    print(f"{len(made)} cases, {sum(len(case['rests']) for case in made)} rests")


def first_of_family(rng: np.random.Generator, body: str, family: str, k: int) -> dict[str, Any]:
    while True:
        case = drawn(rng, body, family, k)
        found = solved(case)
        rests = bracketed(case) if found is not None and fits(family, found) else None
        if found is not None and rests is not None:
            if case["motion"] is None:
                case["duration"] = math.ceil(rests[-1]["time"] + 1.0)
            return case | {"impacts": found["impacts"], "count": found["count"], "rests": rests}


def drawn(rng: np.random.Generator, body: str, family: str, k: int) -> dict[str, Any]:
    """Return a case without its answers."""
    _, restitutions, amplitudes = FAMILIES[family]
    e = FREE[k] if family == "free" else rounded(rng.uniform(*restitutions))
    small = 0.05 if e >= 0.95 else 1.0
    damping = pull = 0.0
    gain = 1.0
    low: float | None = 0.0
    high: float | None = None
    if body == "ball":
        stiffness, pull = 0.0, GRAVITY
        threshold, start = GRAVITY, small * rng.uniform(0.05, 0.3)
    elif body == "oscillator":
        w = 2.0 * math.pi * rounded(rng.uniform(0.4, 1.0))
        stiffness, damping = -w * w, 2.0 * w * rounded(rng.choice([0.0, rng.uniform(0.0, 0.1)]))
        low = stop = 0.0 if family == "never" else rounded(rng.uniform(0.05, 0.2))
        threshold, start = w * w * max(stop, 0.01), stop + small * rng.uniform(0.02, 0.2)
        high = rounded(stop + rng.uniform(0.25, 0.4)) if family == "grazing" else None
    elif body == "pendulum":
        p, gap = rounded(rng.uniform(1.5, 4.0)), rounded(rng.uniform(0.05, 0.2))
        stiffness, low, high = p * p, -gap, gap
        threshold, start = p * p * gap, gap * (1.0 - small * rng.uniform(0.2, 1.8))
    else:
        p, alpha = rounded(rng.uniform(1.5, 4.0)), rounded(rng.uniform(0.1, 0.3))
        stiffness, pull, gain, low = p * p, p * p * alpha, p * p / GRAVITY, None
        threshold, start = GRAVITY * alpha, alpha * small * rng.uniform(0.1, 0.6)
    frequency = rounded(BODIES[body] * rng.uniform(0.5, 2.0))
    cycles = int(rng.integers(3, 9))
    length = 40.0 if small < 1.0 else cycles / frequency
    amplitude = rounded(threshold * rng.uniform(*amplitudes))
    motion: dict[str, Any] | None = None
    if family == "several" and k % 2:
        values = amplitude * rng.uniform(-1.5, 1.5, 6 * cycles)
        motion = {"samples": [0.0, *map(rounded, values), 0.0], "dt": rounded(0.25 / frequency)}
        length = motion["dt"] * (len(values) + 1)
    elif amplitude:
        phase = rounded(rng.uniform(0.0, 6.28))
        motion = {"amplitude": amplitude, "frequency": frequency, "phase": phase, "cycles": round(length * frequency)}
        length = motion["cycles"] / frequency
    return {
        "body": body, "family": family, "restitution": e, "stiffness": stiffness, "damping": damping, "pull": pull,
        "gain": gain, "low": low, "high": high, "motion": motion, "start": [rounded(start), 0.0],
        "duration": 150.0 if motion is None else rounded(length + 3.0),
    }  # fmt: skip


def rounded(value: float) -> float:
    return float(f"{value:.3g}")


def motion_of(case: dict[str, Any]) -> rocking.Motion | None:
    given = case["motion"]
    if given is None:
        return None
    if "samples" in given:
        return rocking.Motion.from_samples(given["samples"], given["dt"])
    return rocking.pulses.sine(given["amplitude"], given["frequency"], cycles=given["cycles"], phase=given["phase"])


def simulated(case: dict[str, Any], chattering: Any) -> Any:
    """Return the response of a case."""
    motion, e, (x, v) = motion_of(case), case["restitution"], case["start"]
    if case["body"] == "block":
        block = rocking.Block.from_parameters(
            p=math.sqrt(case["stiffness"]), alpha=case["pull"] / case["stiffness"], restitution=e, gravity=GRAVITY
        )
        return rocking.simulate(
            block, motion, model="linear", chattering=chattering, duration=case["duration"], initial_rotation=x
        )
    if case["body"] == "ball":
        body: Any = dynamics.BouncingBall(e, gravity=case["pull"])
    elif case["body"] == "pendulum":
        body = dynamics.InvertedPendulum(math.sqrt(case["stiffness"]), case["high"], e)
    else:
        w = math.sqrt(-case["stiffness"])
        body = dynamics.ImpactOscillator(
            w / (2.0 * math.pi), e, damping_ratio=case["damping"] / (2.0 * w), stop=-case["low"],
            second_stop=case["high"],
        )  # fmt: skip
    return dynamics.simulate(
        body, motion, chattering=chattering, duration=case["duration"], initial_position=x, initial_velocity=v
    )


def solved(case: dict[str, Any]) -> dict[str, Any] | None:
    """Return impacts and rests; None if it overturns."""
    certified, followed = simulated(case, "certified"), simulated(case, rocking.VelocityThreshold(1e-8))
    if certified.overturned or certified.rests_by_rounding or certified.unfinished:
        return None
    ends = certified.sequences["end"]
    rests = ends[ends <= case["duration"]]
    times = followed.impacts["time"]
    over = [bool(np.any((a < rests) & (rests <= b))) for a, b in pairwise(times)]
    close = np.flatnonzero(np.diff(times) < SHORTEST)
    return {
        "impacts": times[: min(IMPACTS, close[0] + 1 if len(close) else IMPACTS)].tolist(),
        "count": None if len(rests) else len(times),
        "rests": rests,
        "runs": list(runs(np.diff(times), over)),
        "speeds": followed.impacts["speed_before"],
        "gaps": np.diff(times, prepend=0.0),
    }


def bracketed(case: dict[str, Any]) -> list[dict[str, float]] | None:
    """Return the rests, bracketed by proof and by what rounding may change before it; None if that decides anything."""
    found = simulated(case, "certified")
    if {"events", "touch"} & set(found.ambiguities):
        return None
    change = found.sensitivity.events[found.events["kind"] == "rest"]
    rows = found.sequences[found.sequences["end"] <= case["duration"]]
    wide = ROUNDING * (rows["end"] + sum(np.abs(change[name]) for name in change.dtype.names))
    columns = rows["end"], rows["lower"] - wide, rows["upper"] + wide
    return [dict(zip(("time", "lower", "upper"), map(float, row), strict=True)) for row in zip(*columns, strict=True)]


def runs(gaps: Any, rests: list[bool]) -> Iterator[int]:
    """Lengths of runs of impacts whose intervals shrink below a fiftieth, and then grow again without a rest."""
    start = 0
    for n in range(1, len(gaps)):
        if rests[n] or rests[n - 1]:
            start = n + 1
        elif gaps[n] > gaps[n - 1]:
            if gaps[n - 1] < 0.02 * gaps[start : n + 1].max():
                yield n - start
            start = n


def fits(family: str, found: dict[str, Any]) -> bool:
    """Whether what was found is of the family."""
    rests, speeds = len(found["rests"]), found["speeds"]
    if family in ("free", "rest", "elastic"):
        return rests == 1 and len(found["impacts"]) >= 3
    if family == "several":
        return rests >= 3
    if family == "incomplete":
        return max(found["runs"], default=0) >= 5
    if family == "grazing":
        grazes = (speeds < 0.02 * speeds.max()) & (found["gaps"] > 0.3 * found["gaps"].max())
        return len(speeds) > 5 and bool(np.any(grazes))
    return not rests and len(speeds) >= 10


if __name__ == "__main__":
    main()
