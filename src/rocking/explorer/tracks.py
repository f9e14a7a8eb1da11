"""How far each slider of a block goes before the block is refused: asked of what would refuse it. It knows no web."""

from __future__ import annotations

import bisect
from collections.abc import Callable
from typing import Final

from rocking.errors import RockingError
from rocking.explorer.inputs import read_case
from rocking.explorer.parameters import PARAMETERS, Texts, names_of
from rocking.explorer.uploads import UploadStore
from rocking.inputs.declared import Input

#: Steps of a slider from its low to its high end, as the page has them.
STEPS: Final = 1000

#: Texts that say whether a block can be made and simulated.
_OF_BLOCKS: Final = frozenset({*names_of("block"), "gravity", "model", "duration"})


def text_at(parameter: Input, step: int) -> str:
    """Write the number at a step of a parameter's slider as the page does.

    Examples
    --------
    >>> text_at(PARAMETERS["width"], 0), text_at(PARAMETERS["alpha"], 1000)
    ('0.02', '40deg')
    """
    part, (low, high) = step / STEPS, (parameter.low, parameter.high)
    number = low * (high / low) ** part if parameter.logarithmic else low + part * (high - low)
    return f"{float(f'{number:.3g}')!r}".removesuffix(".0") + parameter.suffix


def tracks(texts: Texts) -> dict[str, list[list[int]]]:
    """Return the first and the last step of each slider of a case's block, for both sides or for each.

    Beyond them the block would be refused, all else unchanged. A field that the case leaves out has its default; a mesh
    has no such ends.

    Examples
    --------
    A centre of mass is at most a quarter of the width off the middle:

    >>> found = tracks({"width": "0.4", "height": "1", "offset": "0.05"})
    >>> [text_at(PARAMETERS["offset"], step) for step in found["offset"][0]]
    ['-0.1', '0.1']
    """
    given = {name: text for name, text in texts.items() if name in _OF_BLOCKS and text}
    if "mesh" in given:  # it is turned all the way round
        return {}
    fields = {name: text for name, text in given.items() if PARAMETERS[name].group == "block"}
    if "width" in fields:
        fields.setdefault("offset", "0")
    return {name: [_track(given, name, fields[name], k) for k in range(fields[name].count(",") + 1)] for name in fields}


def _track(given: Texts, name: str, text: str, side: int) -> list[int]:
    """Return the ends of the stretch of steps about the present one in which the block can be made."""
    parameter, sides = PARAMETERS[name], text.split(",")

    def refused(step: int) -> bool:
        changed = ",".join([*sides[:side], text_at(parameter, step), *sides[side + 1 :]])
        try:
            read_case({**given, name: changed, "motion": "none"}, UploadStore())
        except RockingError:
            return True
        return False

    here = _nearest(parameter, sides[side])
    return [here - _reach(lambda k: refused(here - k), here), here + _reach(lambda k: refused(here + k), STEPS - here)]


def _nearest(parameter: Input, text: str) -> int:
    def value(of: str) -> float:
        found = parameter.read(of)
        return float(found[0] if isinstance(found, tuple) else found)

    return min(bisect.bisect_left(range(STEPS + 1), value(text), key=lambda k: value(text_at(parameter, k))), STEPS)


def _reach(refused: Callable[[int], bool], most: int) -> int:
    """Return the number of steps before the first that is refused, which all beyond it are."""
    return max(bisect.bisect_left(range(most + 1), True, key=refused) - 1, 0)
