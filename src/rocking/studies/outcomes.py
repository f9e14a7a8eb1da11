"""Which outcomes of its simulations a study keeps, and whether they are enough for what is asked of it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import Final

from rocking import checks
from rocking.errors import InvalidOption
from rocking.product import VARIABLES

#: All outcomes of a simulation, in the order in which a store holds them.
OUTCOMES: Final = tuple(VARIABLES)

#: Kept whatever is chosen: without them nobody could tell an answer from one that was given up, stopped or not proven.
DOUBTS: Final = ("stalled", "unfinished", "stopped")


def chosen_outcomes(outcomes: Sequence[str] | None) -> tuple[str, ...]:
    """Return the outcomes that a study of this choice keeps, in the order of the store; all without a choice.

    Raises
    ------
    InvalidOption
        If the choice is no list of one or more different outcomes.
    """
    if outcomes is None:
        return OUTCOMES
    names = checks.several(outcomes, "outcomes", InvalidOption)
    if not names:
        raise InvalidOption(f"outcomes must name one or more of {', '.join(OUTCOMES)}; leave it out to keep all")
    for name in names:
        checks.one_of(name, "each of outcomes", InvalidOption, OUTCOMES)
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise InvalidOption(f"outcomes names {repeated[0]} more than once: name it once")
    return tuple(name for name in OUTCOMES if name in {*names, *DOUBTS})


def require(kept: Sequence[str], needed: Sequence[str], what: str) -> None:
    """Check that the outcomes that are kept are enough for something.

    Raises
    ------
    InvalidOption
        If they are not; the message says what is missing, and with which choice it would not be.
    """
    missing = [name for name in needed if name not in kept]
    if missing:
        choice = [name for name in OUTCOMES if name in {*kept, *needed} and name not in DOUBTS]
        raise InvalidOption(
            f"{what} needs {' and '.join(missing)}, and the study keeps only {', '.join(kept)}: create one with "
            f"outcomes = {json.dumps(choice)}"
        )


def told(kept: Sequence[str]) -> str:
    """Write in a few words what is kept."""
    return "all" if len(kept) == len(OUTCOMES) else ", ".join(kept)
