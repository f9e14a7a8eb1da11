"""What the programs share: cases, a loop from impact to impact, what steps show, and the file of answers.

A body is followed in the frame of the stop, or the side of a block, that it left last: u is its distance from there,
u'' = stiffness u - damping u' - push(t), and an impact is where u falls to 0 or, at the other stop, rises to `gap`.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

FOLDER = Path(__file__).resolve().parents[1]

#: Impacts that an answer holds.
KEPT = 60

#: Processor time after which a case is given up, s.
STEP_BUDGET = 10.0


class Push(NamedTuple):
    """Push within a piece of the motion: constant + slope (t - start) + amplitude sin(w t + phase)."""

    constant: float
    slope: float
    start: float
    amplitude: float
    w: float
    phase: float

    def __call__(self, t: float) -> float:
        steady = self.constant + self.slope * (t - self.start)
        return steady + self.amplitude * math.sin(self.w * t + self.phase) if self.amplitude else steady


class Case:
    """A case, and what its body feels."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.is_block = given, given["body"] == "block"
        self.stiffness, self.damping, self.e = given["stiffness"], given["damping"], given["restitution"]
        self.low, self.high = (given[name] for name in ("low", "high"))
        self.gap = math.inf if self.high is None else self.high - self.low
        motion, self.end = given["motion"] or {}, given["duration"]
        self.samples, self.dt = motion.get("samples", []), motion.get("dt", math.nan)
        if self.samples:
            inside = [self.dt * n for n in range(1, len(self.samples))]
        else:
            inside = [motion["cycles"] / motion["frequency"]] if motion else []
        self.ends = [t for t in inside if t < self.end] + [self.end]
        self.motion = motion

    def push(self, piece: int, side: int) -> Push:
        """Push towards the stop of a side (+1: lower one, or positive rotation) during a piece of the motion."""
        given, factor = self.given, side * self.given["gain"]
        stop = 0.0 if self.is_block else (self.low if side > 0 else self.high)
        constant = (1 if self.is_block else side) * given["pull"] - side * self.stiffness * stop
        if self.samples and piece + 1 < len(self.samples):
            left, right = self.samples[piece : piece + 2]
            return Push(constant + factor * left, factor * (right - left) / self.dt, piece * self.dt, 0.0, 0.0, 0.0)
        if self.motion and not self.samples and piece == 0:
            w = 2.0 * math.pi * self.motion["frequency"]
            return Push(constant, 0.0, 0.0, factor * self.motion["amplitude"], w, self.motion["phase"])
        return Push(constant, 0.0, 0.0, 0.0, 0.0, 0.0)

    def position(self, u: float, side: int) -> float:
        """Position of what is at a distance from the stop of a side."""
        return side * u + (0.0 if self.is_block else (self.low if side > 0 else self.high))


#: From time, distance and speed with a push to a time at most: time, distance, speed, and whether it has hit.
Advance = Callable[[Case, float, float, float, Push, float], tuple[float, float, float, bool]]


def event_driven(case: Case, advance: Advance, slowest: float) -> dict[str, Any] | None:
    """Go from impact to impact; the body is at rest when an impact leaves less than the slowest speed, m/s or rad/s.

    None where that takes longer than the budget.
    """
    x, v = case.given["start"]
    side = -1 if case.is_block and x < 0.0 else 1
    u, v = (abs(x), side * v) if case.is_block else (x - case.low, v)
    t, piece, resting = 0.0, 0, False
    latest = time.process_time() + STEP_BUDGET
    impacts: list[float] = []
    rests: list[float] = []
    deepest = 0.0
    while t < case.end:
        if time.process_time() > latest:
            return None
        until = case.ends[piece]
        if resting:
            t, side, resting = released(case, t, piece, side, until)
            piece += t >= until
            continue
        t, u, v, hit = advance(case, t, u, v, case.push(piece, side), until)
        if not hit:
            piece += t >= until
            continue
        impacts.append(t)
        across = u > 0.5 * case.gap
        deepest = max(deepest, u - case.gap if across else -u)
        v = case.e * abs(v)
        side = -side if across or case.is_block else side
        u = 0.0
        if v < slowest and case.push(piece, side)(t) > 0.0:
            rests.append(t)
            v, resting = 0.0, True
    return {"impacts": impacts[:KEPT], "rests": rests, "penetration": deepest}


def released(case: Case, t: float, piece: int, side: int, until: float) -> tuple[float, int, bool]:
    """When a body at rest leaves within a piece, to which side, and whether it still rests."""
    count = 400
    sides = (1, -1) if case.is_block else (side,)
    for n in range(count + 1):
        after = t + (until - t) * n / count
        for each in sides:
            push = case.push(piece, each)
            if push(after) < 0.0:
                before = t + (until - t) * max(n - 1, 0) / count
                for _ in range(60):
                    middle = 0.5 * (before + after)
                    before, after = (before, middle) if push(middle) < 0.0 else (middle, after)
                return after, each, False
    return until, side, True


def seen_in_steps(
    case: Case, steps: Iterable[tuple[float, float]], touch: float = 1e-7, away: float = 1e-5
) -> dict[str, Any]:
    """Impacts and rests in the positions after steps of time.

    An impact is where a body comes within `touch` of a stop, m. It rests from where it does not leave for 20 ms, until
    it is further than `away` from it.
    """
    impacts: list[float] = []
    rests: list[float] = []
    deepest, since, resting = 0.0, math.inf, False
    for t, x in steps:
        u = min(x - case.low, math.inf if case.high is None else case.high - x)
        deepest = max(deepest, -u)
        if u > (away if resting else touch):
            since, resting = math.inf, False
        elif since == math.inf:
            since = t
            impacts.append(t)
        elif not resting and t - since > 0.02:
            rests.append(since)
            resting = True
    return {"impacts": impacts[:KEPT], "rests": rests, "penetration": deepest}


def event_program(package: str, settings: str, advance: Advance, slowest: float) -> None:
    """Write the answers with a threshold; with ``--thresholds 1e-9 1e-10 ...``, print what each of these is worth."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--thresholds", nargs="+", type=float)
    thresholds = parser.parse_args().thresholds
    if thresholds is None:
        answer(package, f"{settings}; rest below {slowest:g} m/s", lambda case: event_driven(case, advance, slowest))
        return
    sys.path.insert(0, str(FOLDER))
    from score import scored

    cases = [Case(given) for given in json.loads((FOLDER / "cases.json").read_text("utf-8"))]
    print("| program | rest below, m/s | no answer | right to 10 ms | to 1 us | to 1 ns | to 0.1 ns | ms a case |")
    for threshold in thresholds:
        event_driven(cases[0], advance, threshold)
        seconds, errors = [], []
        for case in cases:
            start = time.process_time()
            found = event_driven(case, advance, threshold)
            seconds.append(time.process_time() - start)
            errors.append(scored(case.given, found).error)
        right = (sum(error <= limit for error in errors) for limit in (1e-2, 1e-6, 1e-9, 1e-10))
        cells = (package, f"{threshold:g}", sum(map(math.isnan, errors)), *right)
        print(f"| {' | '.join(map(str, cells))} | {1e3 * statistics.median(seconds):.3g} |", flush=True)


def answer(package: str, settings: str, solve: Callable[[Case], dict[str, Any] | None]) -> None:
    """Have a program solve all cases, and write its answers; a case that it cannot pose is left out."""
    cases = [Case(given) for given in json.loads((FOLDER / "cases.json").read_text("utf-8"))]
    solve(cases[0])  # what compiles, compiles here
    answers = {}
    for case in cases:
        start = time.process_time()
        found = solve(case)
        seconds = round(time.process_time() - start, 6)
        if found is not None:
            impacts = [round(t, 9) for t in found["impacts"]]
            answers[case.given["name"]] = found | {"impacts": impacts, "seconds": seconds}
            print(case.given["name"], found["rests"][:3], seconds, flush=True)
    target = FOLDER / "answers" / f"{package}.json"
    target.parent.mkdir(exist_ok=True)
    head = json.dumps({"program": package, "version": version(package), "settings": settings})[:-1]
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(found)}" for name, found in answers.items())
    target.write_text(f'{head}, "answers": {{\n{lines}\n}}}}\n', "utf-8")
