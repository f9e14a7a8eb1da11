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
from rocking.errors import BlockError, OptionError, escape_braces
from rocking.inputs import texts
from rocking.inputs.declared import BLOCK, INPUTS, READERS, SHAPES, Shape
from rocking.inputs.notes import block_notes, restraint_notes
from rocking.inputs.quantities import Quantity

#: Number of bodies that are checked for likely mistakes.
_MAX_CHECKED: Final = 100


#: Hint if a slenderness is the only input of a block.
_FREQUENCY_PARAMETER: Final = (
    "p is sqrt(3 g/(4 R)) of a rectangular block, with the distance R from its edge to its centre of mass; the mass "
    "alone does not matter"
)


def find_shape(names: Iterable[str], shapes: Sequence[Shape] = SHAPES) -> Shape:
    """Return the description that contains the named inputs, or raise `BlockError` if there is not exactly one."""
    provided = [name for name in BLOCK if name in {*names} and name != "restitution"]
    for shape in shapes:
        if {*shape.needed} <= {*provided} <= {*shape.needed, *shape.optional}:
            return shape
    candidates = {shape.needed: {*shape.needed, *shape.optional} for shape in shapes}
    candidates = {needed: allowed for needed, allowed in candidates.items() if allowed & {*provided}} or candidates
    started = [needed for needed in candidates if {*needed} & {*provided}] or [*candidates]
    if not provided:
        raise BlockError(f"a block is required; give {name_either(candidates)}", *itertools.chain(*candidates))
    if any(not {*provided} <= candidates[needed] for needed in started):
        sentence = (
            f"{name_all(provided)} are from different descriptions of a block; give only {name_either(candidates)}"
        )
        raise BlockError(sentence, *provided, *itertools.chain(*candidates))
    hint = f"; {_FREQUENCY_PARAMETER}" if provided == ["alpha"] and "p" in started[0] else ""
    raise BlockError(
        f"a block requires more than {name_all(provided)}; give {name_either(started)}{hint}",
        *provided,
        *itertools.chain(*started),
    )


def create_block(values: Mapping[str, Any], shapes: Sequence[Shape] = SHAPES) -> Block:
    """Create the block that the values describe.

    Examples
    --------
    >>> create_block({"width": 0.24, "height": 1.1}).half_width, write_block_call({"p": 2.0, "alpha": 0.2})
    (0.12, 'Block.from_parameters(p=2.0, alpha=0.2)')
    """
    block_values = {name: value for name, value in values.items() if name in BLOCK or name == "gravity"}
    return find_shape(block_values, shapes).make(**_find_arguments(block_values))


def write_block_call(values: Mapping[str, Any]) -> str:
    """Return the Python call that creates the block."""
    return f"{find_shape(values).make.__qualname__}({texts.write_arguments(_find_arguments(values))})"


def create_body(block: Block, values: Mapping[str, Any], restraints: Sequence[Restraint] = ()) -> Body:
    """Return a block with its restraints, as a wall or leaning if the values require it; by default the block alone."""
    options = {name: values[name] for name in ("one_sided", "lean") if name in values}
    if not restraints and not options:
        return block
    return RestrainedBlock(block, *restraints, **options, restitution=values.get("restitution"))


def note_likely_mistakes(blocks: Sequence[Block], bodies: Sequence[Body] = ()) -> None:
    """Issue a note on each likely mistake in the first of some blocks, or in their restraints, without repetition."""
    notes = [sentence for block in blocks[:_MAX_CHECKED] for sentence in block_notes(block)]
    for body in bodies[:_MAX_CHECKED]:
        notes += restraint_notes(body) if isinstance(body, RestrainedBlock) else ()
    for sentence in dict.fromkeys(notes):
        note(sentence)


def find_reader(parameter: str) -> Quantity:
    """Return the reader of a parameter of a restraint or of another body."""
    kind = INPUTS[parameter].kind if parameter in INPUTS else "number"
    return READERS.get(kind, READERS["number"])[0]


def check_parameters(factory: Callable[..., object], provided: Iterable[str], owner: str, *names: str) -> None:
    """Check that names are parameters of a kind and that none is missing; ``names`` are the parameters in ``of``."""
    parameters = inspect.signature(factory).parameters
    for name in provided:
        if name not in parameters:
            hint = checks.suggest(name, [*parameters], f"there are {', '.join(parameters)}")
            raise OptionError(f"{owner} has no {escape_braces(name)}; {hint}", *names, name)
    missing = [name for name, item in parameters.items() if item.default is item.empty and name not in {*provided}]
    if missing:
        raise OptionError(f"{owner} also requires {' and '.join(missing)}", *names)


def name_all(names: Sequence[str]) -> str:
    """Return placeholders of a message for all names."""
    return " and ".join(["{}"] * len(names))


def name_either(descriptions: Iterable[Sequence[str]]) -> str:
    """Return placeholders of a message for the names of alternative descriptions."""
    return ", or ".join(map(name_all, descriptions))


def _find_arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    return {declared_input.argument or name: values[name] for name, declared_input in INPUTS.items() if name in values}
