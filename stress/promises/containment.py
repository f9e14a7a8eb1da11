"""Rotation, event times, peaks and brackets of random responses, against 32 digits.

What is drawn, and what is compared, is in `tests/oracles/vertical_referee.py`: every other case has a vertical
component. An error may be 8 times what one unit in the last place of everything given changes, by the response's own
sensitivity, and as many units in the last place of the number itself; a time of rest lies in its bracket.
"""

from __future__ import annotations

from oracles import vertical_referee

from promises.promise import OF_NO_SIMULATION, Found, Promise

#: Cases of a part, six to fifteen seconds of processor time.
CASES = 200


def judge(part: int) -> Found:
    """Judge the cases of a part."""
    found = Found(parts=1)
    for number in range(part * CASES, (part + 1) * CASES):
        verdict = vertical_referee.judge(vertical_referee.case(2024, number, vertical=number % 2 == 0))
        found.cases += 1
        found.judged += verdict.judged
        found.worst = max(found.worst, verdict.units / vertical_referee.UNITS)
        for fault in verdict.faults[:1]:
            found.fail(str(fault))
        skipped = sum(verdict.skipped.values())
        found.notes.update(
            ambiguous=verdict.ambiguous,
            skipped=skipped,
            overturned=verdict.overturned,
            still=verdict.never_up,
            impacts=verdict.impacts,
            rotations=verdict.rotations,
            brackets=verdict.brackets,
        )
    return found


def table(found: Found) -> str:
    """Say what the cases were, and how many single numbers were compared."""
    counts = found.notes
    return (
        f"Of {found.cases} cases {counts['ambiguous']} call themselves ambiguous and {counts['skipped']} were refused "
        f"or could not be followed in 32 digits; of the others {counts['overturned']} overturn and {counts['still']} "
        f"never lift off. Compared were {counts['impacts']} times of impacts, {counts['rotations']} rotations and "
        f"{counts['brackets']} brackets.\n"
    )


PROMISE = Promise(
    name="containment",
    says="rotation, times and peak within the stated error",
    parts=512,
    small=3,
    judge=judge,
    least=0.85,
    table=table,
    above=OF_NO_SIMULATION,
)
