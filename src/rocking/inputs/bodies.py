"""Creation of a block and its restraints from the values of inputs."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from rocking.block import Block, RestrainedBlock, Restraint
from rocking.block.body import Body
from rocking.core import checks
from rocking.core.progress import note
from rocking.errors import InvalidBlock, InvalidOption, literal
from rocking.inputs import texts
from rocking.inputs.declared import BLOCK, INPUTS, READERS, SHAPES, Shape
from rocking.inputs.notes import block_notes, restraint_notes
from rocking.inputs.quantities import Quantity

#: Number of bodies that are checked for likely mistakes.
_NOTED: Final = 100


#: Hint if a slenderness is the only input of a block.
_FREQUENCY_PARAMETER: Final = (
    "p is sqrt(3 g/(4 R)) of a rectangular block, with the distance R from its edge to its centre of mass; the mass "
    "alone does not matter"
)


def shape_of(names: Iterable[str], shapes: Sequence[Shape] = SHAPES) -> Shape:
    """Return the description that contains the named inputs, or raise `InvalidBlock` if there is not exactly one."""
    given = [name for name in BLOCK if name in {*names} and name != "restitution"]
    for shape in shapes:
        if {*shape.needed} <= {*given} <= {*shape.needed, *shape.optional}:
            return shape
    having = {shape.needed: {*shape.needed, *shape.optional} for shape in shapes}
    having = {needed: known for needed, known in having.items() if known & {*given}} or having
    begun = [needed for needed in having if {*needed} & {*given}] or [*having]
    if not given:
        raise InvalidBlock(f"a block is needed: give {one_of(having)}", *itertools.chain(*having))
    if any(not {*given} <= having[needed] for needed in begun):
        sentence = f"{all_of(given)} belong to different descriptions of a block; give one: {one_of(having)}"
        raise InvalidBlock(sentence, *given, *itertools.chain(*having))
    hint = f"; {_FREQUENCY_PARAMETER}" if given == ["alpha"] and "p" in begun[0] else ""
    raise InvalidBlock(
        f"a block needs more than {all_of(given)}: give {one_of(begun)}{hint}", *given, *itertools.chain(*begun)
    )


def block_of(values: Mapping[str, Any], shapes: Sequence[Shape] = SHAPES) -> Block:
    """Create the block that the values describe.

    Examples
    --------
    >>> block_of({"width": 0.24, "height": 1.1}).half_width, call_of({"p": 2.0, "alpha": 0.2})
    (0.12, 'Block.from_parameters(p=2.0, alpha=0.2)')
    """
    described = {name: value for name, value in values.items() if name in BLOCK or name == "gravity"}
    return shape_of(described, shapes).make(**_arguments(described))


def call_of(values: Mapping[str, Any]) -> str:
    """Return the Python call that creates the block."""
    return f"{shape_of(values).make.__qualname__}({texts.arguments(_arguments(values))})"


def body_of(block: Block, values: Mapping[str, Any], restraints: Sequence[Restraint] = ()) -> Body:
    """Return a block with its restraints, as a wall or leaning if the values require it; by default the block alone."""
    held = {name: values[name] for name in ("one_sided", "lean") if name in values}
    if not restraints and not held:
        return block
    return RestrainedBlock(block, *restraints, **held, restitution=values.get("restitution"))


def note_likely_mistakes(blocks: Sequence[Block], bodies: Sequence[Body] = ()) -> None:
    """Issue a note on each likely mistake in the first of some blocks, or in their restraints, without repetition."""
    notes = [sentence for block in blocks[:_NOTED] for sentence in block_notes(block)]
    for body in bodies[:_NOTED]:
        notes += restraint_notes(body) if isinstance(body, RestrainedBlock) else ()
    for sentence in dict.fromkeys(notes):
        note(sentence)


def quantity_of(parameter: str) -> Quantity:
    """Return the reader of a parameter of a restraint or of another body."""
    kind = INPUTS[parameter].kind if parameter in INPUTS else "number"
    return READERS.get(kind, READERS["number"])[0]


def check_parameters(kind: Callable[..., object], given: Iterable[str], of: str, *names: str) -> None:
    """Check that names are parameters of a kind and that none is missing; ``names`` are the parameters in ``of``."""
    known = inspect.signature(kind).parameters
    for name in given:
        if name not in known:
            hint = checks.meant(name, [*known], f"there are {', '.join(known)}")
            raise InvalidOption(f"{of} has no {literal(name)}; {hint}", *names, name)
    missing = [name for name, each in known.items() if each.default is each.empty and name not in {*given}]
    if missing:
        raise InvalidOption(f"{of} needs {' and '.join(missing)} as well", *names)


def all_of(names: Sequence[str]) -> str:
    """Return placeholders for all of some names in a sentence."""
    return " and ".join(["{}"] * len(names))


def one_of(descriptions: Iterable[Sequence[str]]) -> str:
    """Return placeholders for the names of one of several descriptions in a sentence."""
    return ", or ".join(map(all_of, descriptions))


def _arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    return {each.argument or name: values[name] for name, each in INPUTS.items() if name in values}
