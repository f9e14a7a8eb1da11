"""Times of rest in the linear model under a constant push, or none, against their closed form in 50 digits.

And those of blocks that start next to their balance, under motions and without: see `tests/oracles/balance.py`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from oracles import balance

import rocking
from promises.exact import GRAVITY, Side, rest
from promises.promise import ABOVE_ENSEMBLES, Found, Promise
from rocking.engine.schemes import Certified

#: Cases of a part, some ten seconds of processor time.
CASES = 400

#: Cases next to a balance in a part, in the linear model and in the nonlinear one, which is followed in 40 digits.
NEXT_TO_BALANCE = {"linear": 250, "nonlinear": 20}

#: Tolerances, s, whose costs are compared: the cost is the number of impacts that are resolved one by one.
TOLERANCES = (1e-6, 1e-9, 1e-12, 1e-15)

#: Impacts more than it takes to follow them one by one until the tolerance is left.
MORE = 20

#: Impacts more, on an average over the cases of a part, for a tolerance a tenth of another.
FOR_A_DIGIT = 1.0

_ULP = 2.0**-52


def drawn(number: int) -> tuple[tuple[Side, Side], float, float]:
    """Sides, push (m/s^2) and initial velocity (rad/s) of a case: half of them one block, a third without a push."""
    rng = np.random.default_rng([31, number])
    p, alpha, e = (
        np.exp(rng.uniform(np.log(0.5), np.log(20.0), 2)),
        rng.uniform(0.02, 0.6, 2),
        rng.uniform(0.1, 0.97, 2),
    )
    sides = [Side(float(p[k]), float(alpha[k]), float(e[k])) for k in (0, 1)]
    if rng.random() < 0.5:
        sides[1] = sides[0]
    near = 1.0 - 10.0 ** rng.uniform(-9.0, -0.1)
    share = float(rng.choice([0.0, near, rng.uniform(0.0, 0.95)])) * float(rng.choice([-1.0, 1.0]))
    push = share * GRAVITY * min(side.alpha for side in sides)
    slowest = min(side.p * (side.alpha + sign * push / GRAVITY) for side, sign in zip(sides, (1, -1), strict=True))
    velocity = slowest * 10.0 ** rng.uniform(-12.0, -0.02) * float(rng.choice([-1.0, 1.0]))
    return (sides[0], sides[1]), push, float(velocity)


def judge(part: int) -> Found:
    """Judge the cases of a part."""
    found = Found(parts=1)
    for number in range(part * CASES, (part + 1) * CASES):
        _judge_case(number, found)
    for model, count in NEXT_TO_BALANCE.items():
        for number in range(part * count, (part + 1) * count):
            _judge_near_balance(model, number, found)
    finest, coarsest = TOLERANCES[-1], TOLERANCES[0]
    more = found.notes[f"resolved at {finest:g}"] - found.notes[f"resolved at {coarsest:g}"]
    each = more / CASES / math.log10(coarsest / finest)
    if each > FOR_A_DIGIT:
        found.fail(f"part {part}: each digit of the tolerance costs {each:.2f} impacts on an average")
    return found


def _judge_case(number: int, found: Found) -> None:
    sides, push, velocity = drawn(number)
    named: dict[str, Any] = {
        name: tuple(getattr(side, name) for side in sides) for name in ("p", "alpha", "restitution")
    }
    block = rocking.Block.from_parameters(**named)
    motion = rocking.Motion(np.array([0.0, 1e6]), np.array([[push]]))
    true = rest(sides, push, abs(velocity), int(velocity < 0.0))
    costs = []
    found.cases += 1
    found.judged += 1
    for tolerance in TOLERANCES:
        response = rocking.simulate(
            block, motion, model="linear", chattering=Certified(tolerance), initial_velocity=velocity
        )
        costs.append(len(response.impacts))
        what = f"case {number}, tolerance {tolerance:g} s"
        if len(response.sequences) != 1 or [event["kind"] for event in response.events] != ["rest"]:
            found.fail(f"{what}: events {response.events.tolist()}, not one rest")
            return
        sequence, last = response.sequences[0], response.impacts[-1:]
        after = [(float(each["time"]), float(each["speed_after"]), int(each["side"] < 0)) for each in last]
        time, speed, side = after[0] if after else (0.0, abs(velocity), int(velocity < 0.0))
        proven = time + rest(sides, push, speed, side)
        narrow = response.solution.sequences[
            0
        ]  # the proof alone, which holds from the last impact as it is in double precision
        for bracket, rested in ((narrow, proven), (sequence, true)):
            if not bracket["lower"] <= rested <= bracket["upper"]:
                found.fail(
                    f"{what}: rest at {float(rested)!r} s outside [{bracket['lower']!r}, {bracket['upper']!r}] s"
                )
        changes = response.sensitivity.events[0]
        unit = _ULP * (sum(abs(float(changes[name])) for name in changes.dtype.names) + float(true))
        error = max(0.0, abs(float(sequence["end"] - true)) - float(narrow["upper"] - narrow["lower"]))
        found.worst = max(found.worst, error / (8.0 * unit))
        if error > 8.0 * unit:
            found.fail(f"{what}: rest at {sequence['end']!r} s, true {float(true)!r} s")
    shrinks = -0.5 * math.log(sides[0].restitution * sides[1].restitution)
    one_by_one = [MORE + max(0.0, math.log(float(true) / each)) / shrinks for each in TOLERANCES]
    if any(cost > most for cost, most in zip(costs, one_by_one, strict=True)):
        found.fail(f"case {number}: {costs} impacts resolved for tolerances of {TOLERANCES} s")
    for each, cost, most in zip(TOLERANCES, costs, one_by_one, strict=True):
        found.notes[f"one by one at {each:g}"] += round(most - MORE)
        found.notes[f"resolved at {each:g}"] += cost


def _judge_near_balance(model: str, number: int, found: Found) -> None:
    given = balance.case(61, number, model)
    response, true = given.simulate(), given.rest()
    found.cases += 1
    if response.ambiguous:
        found.notes["ambiguous"] += 1
        return
    found.judged += 1
    found.notes[f"next to balance, {model}"] += 1
    if (true is None) != response.overturned:
        found.fail(f"{given}: overturned is {response.overturned}, true rest {true}")
    elif true is None:
        found.notes["overturned"] += 1
    else:
        sequence = response.sequences[0]
        if not sequence["lower"] <= true <= sequence["upper"]:
            found.fail(f"{given}: rest at {float(true)!r} s outside [{sequence['lower']!r}, {sequence['upper']!r}] s")


def table(found: Found) -> str:
    """Mean numbers of impacts that were resolved."""
    head = "| tolerance, s | " + " | ".join(f"{each:g}" for each in TOLERANCES) + " |"
    lines = [head, "|---" + "|--:" * len(TOLERANCES) + "|"]
    for row in ("resolved", "one by one"):
        means = (f"{found.notes[f'{row} at {each:g}'] / max(CASES * found.parts, 1):.1f}" for each in TOLERANCES)
        lines.append(f"| impacts {row}, mean | " + " | ".join(means) + " |")
    linear, nonlinear = (found.notes[f"next to balance, {model}"] for model in NEXT_TO_BALANCE)
    near = (
        f"Of the blocks that start next to their balance, {linear} were judged in the linear model and {nonlinear} in "
        f"the nonlinear one. {found.notes['overturned']} of them overturn, truly and in the response. "
        f"{found.notes['ambiguous']} more call themselves ambiguous.\n"
    )
    return "\n".join(lines) + "\n\n" + near


PROMISE = Promise(
    name="chattering",
    says="rest inside its bracket, at a bounded cost",
    parts=26,
    small=1,
    judge=judge,
    least=0.999,
    table=table,
    above=ABOVE_ENSEMBLES,
)
