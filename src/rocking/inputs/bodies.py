"""Creation of a block and its restraints from the values of inputs."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, TypeVar

from rocking.block import Block, Blocks, RestrainedBlock, Restraint
from rocking.block.body import Body
from rocking.core import checks
from rocking.core.distributions import Distribution
from rocking.core.progress import note
from rocking.errors import BlockError, OptionError, RockingError, escape_braces, join_placeholders
from rocking.inputs import texts
from rocking.inputs.declared import (
    BLOCK_DESCRIPTIONS,
    BLOCK_INPUTS,
    FORCE_RESTRAINTS,
    INPUTS,
    MOMENT_RESTRAINTS,
    READERS,
    BlockDescription,
)
from rocking.inputs.notes import list_block_notes, list_restraint_notes
from rocking.inputs.quantities import NumberReader
from rocking.motion.motion import Motion
from rocking.motion.stochastic import synthesize_motions

Item = TypeVar("Item")

#: Number of bodies that are checked for likely mistakes.
_MAX_CHECKED: Final = 100


#: Hint if a slenderness is the only input of a block.
_FREQUENCY_PARAMETER: Final = (
    "p is sqrt(3 g/(4 R)) of a rectangular block, with the distance R from its edge to its centre of mass; the mass "
    "alone does not matter"
)


def find_description(
    names: Iterable[str], descriptions: Sequence[BlockDescription] = BLOCK_DESCRIPTIONS
) -> BlockDescription:
    """Return the description that contains the named inputs, or raise `BlockError` if there is not exactly one."""
    described = (name for description in descriptions for name in (*description.needed, *description.optional))
    known = dict.fromkeys((*BLOCK_INPUTS, *described))
    provided = [name for name in known if name in {*names} and name != "restitution"]
    for description in descriptions:
        if {*description.needed} <= {*provided} <= {*description.needed, *description.optional}:
            return description
    candidates = {description.needed: {*description.needed, *description.optional} for description in descriptions}
    candidates = {needed: allowed for needed, allowed in candidates.items() if allowed & {*provided}} or candidates
    partly_given = [needed for needed in candidates if {*needed} & {*provided}] or [*candidates]
    placeholders = join_placeholders(provided)
    if not provided:
        message, alternatives = "a block is required; give ", [*candidates]
    elif any(not {*provided} <= candidates[needed] for needed in partly_given):
        message = f"{placeholders} are from different descriptions of a block; give only "
        alternatives = [*candidates]
    else:
        message, alternatives = f"a block requires more than {placeholders}; give ", partly_given
    hint = f"; {_FREQUENCY_PARAMETER}" if provided == ["alpha"] and "p" in partly_given[0] else ""
    message += ", or ".join(map(join_placeholders, alternatives)) + hint
    raise BlockError(message, *provided, *itertools.chain(*alternatives))


def create_block(values: Mapping[str, Any], descriptions: Sequence[BlockDescription] = BLOCK_DESCRIPTIONS) -> Block:
    """Create the block that the values describe.

    Examples
    --------
    >>> create_block({"width": 0.24, "height": 1.1}).half_width, write_block_call({"p": 2.0, "alpha": 0.2})
    (0.12, 'Block.from_parameters(p=2.0, alpha=0.2)')
    """
    block_values = {name: value for name, value in values.items() if name in BLOCK_INPUTS or name == "gravity"}
    if uncertain := find_uncertain(values):
        message = f"this analysis requires one number for {join_placeholders(uncertain)}; omit the standard deviation"
        raise BlockError(message, *uncertain)
    return find_description(block_values, descriptions).make(**_convert_arguments(block_values))


def find_uncertain(values: Mapping[str, Any]) -> list[str]:
    """Return the names of values that are distributions."""
    return [name for name, value in values.items() if isinstance(value, Distribution)]


def sample_bodies(values: Mapping[str, Any], count: int, seed: int = 0, restraints: Sequence[Restraint] = ()) -> Blocks:
    """Sample blocks with uncertain values (distributions), each with the restraints.

    Examples
    --------
    >>> blocks = sample_bodies({"width": INPUTS["width"].read_uncertain("24 +- 1 cm"), "height": 1.1}, 50)
    >>> f"{blocks.alpha.mean():.4f}"
    '0.2149'
    """

    def create(**row: Any) -> Any:
        return create_body(create_block(row), row, restraints)

    return Blocks.sample(count, create, seed=seed, **values)


def write_block_call(values: Mapping[str, Any]) -> str:
    """Return the Python call that creates the block."""
    return f"{find_description(values).make.__qualname__}({texts.format_arguments(_convert_arguments(values))})"


def create_body(
    block: Block, values: Mapping[str, Any], restraints: Sequence[Restraint] = ()
) -> Block | RestrainedBlock:
    """Return a block with its restraints, as a wall or leaning if the values require it; by default the block alone."""
    options = {name: values[name] for name in ("one_sided", "lean") if name in values}
    if not restraints and not options:
        return block
    return RestrainedBlock(block, *restraints, **options, restitution=values.get("restitution"))


def read_values(texts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of inputs from their texts, without forces; uncertain values are distributions."""
    names = [name for name in texts if name in INPUTS and name not in FORCE_RESTRAINTS]
    return {name: INPUTS[name].read_uncertain(texts[name]) for name in names}


def read_forces(texts: Mapping[str, Any]) -> list[Restraint]:
    """Create the restraints and loads from texts of inputs, of which those of `FORCE_RESTRAINTS` are sequences."""
    forces = [
        create_from_pairs(restraint, text, name)
        for name, restraint in FORCE_RESTRAINTS.items()
        for text in texts.get(name, ())
    ]
    for name in (name for name in MOMENT_RESTRAINTS if name in texts):
        with add_option_to_errors(name):
            forces.append(MOMENT_RESTRAINTS[name](INPUTS[name].read(texts[name])))
    return forces


def create_restrained(values: Mapping[str, Any], forces: Sequence[Restraint]) -> tuple[Block, Block | RestrainedBlock]:
    """Create a block without and with its restraints."""
    block = create_block({name: value for name, value in values.items() if name in BLOCK_INPUTS})
    try:
        return block, create_body(block, values, forces)
    except BlockError as error:
        if not forces or error.argument != "offset":
            raise
        raise BlockError(escape_braces(str(error))) from error  # of a restraint, not the --offset of the block


def note_likely_mistakes(blocks: Sequence[Block], bodies: Sequence[Body] = ()) -> None:
    """Issue a note on each likely mistake in the first of some blocks, or in their restraints, without repetition."""
    notes = [sentence for block in blocks[:_MAX_CHECKED] for sentence in list_block_notes(block)]
    for body in bodies[:_MAX_CHECKED]:
        notes += list_restraint_notes(body) if isinstance(body, RestrainedBlock) else ()
    for sentence in dict.fromkeys(notes):
        note(sentence)


def find_reader(parameter: str) -> NumberReader:
    """Return the reader of a parameter of a restraint or of another body."""
    kind = INPUTS[parameter].kind if parameter in INPUTS else "number"
    return READERS.get(kind, READERS["number"])[0]


#: Readers of parameters of stochastic motions.
STOCHASTIC_READERS: Final[Mapping[str, NumberReader]] = {
    "arias_intensity": READERS["velocity"][0],
    **dict.fromkeys(("duration", "middle_time", "dt"), READERS["duration"][0]),
    **dict.fromkeys(("frequency", "highpass"), READERS["frequency"][0]),
    **dict.fromkeys(("frequency_rate", "damping", "count", "seed"), READERS["number"][0]),
}


def create_stochastic(values: Mapping[str, Any], owner: str, *names: str) -> tuple[Motion, ...]:
    """Create stochastic motions from values by name, which ``names`` are parameters in ``owner``."""
    check_parameters(synthesize_motions, values, owner, *names)
    whole = {k: int(v) for k, v in values.items() if k in ("count", "seed") and float(v).is_integer()}
    return synthesize_motions(**{**values, **whole})


def check_parameters(factory: Callable[..., object], provided: Iterable[str], owner: str, *names: str) -> None:
    """Check that names are parameters of a kind and that none is missing; ``names`` are the parameters in ``owner``."""
    parameters = inspect.signature(factory).parameters
    for name in provided:
        if name not in parameters:
            message = f"{owner} has no {escape_braces(name)}; {checks.suggest(name, [*parameters])}"
            raise OptionError(message, *names, name)
    missing = [name for name, item in parameters.items() if item.default is item.empty and name not in {*provided}]
    if missing:
        raise OptionError(f"{owner} also requires {' and '.join(missing)}", *names)


def _convert_arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    return {declared_input.argument or name: values[name] for name, declared_input in INPUTS.items() if name in values}


@contextmanager
def add_option_to_errors(option: str) -> Iterator[None]:
    """Add the option to errors on its parameters, because other options share their names."""
    try:
        yield
    except RockingError as error:
        raise OptionError(f"{{}}: {escape_braces(str(error))}", option) from error


def create_from_pairs(kind: Callable[..., Item], text: str, option: str) -> Item:
    """Create an object from an option with NAME=VALUE pairs."""
    parameters = inspect.signature(kind).parameters.values()
    flags = {parameter.name for parameter in parameters if isinstance(parameter.default, bool)}
    values = read_pairs(text, option, find_reader, flags)
    check_parameters(kind, values, "{}", option)
    with add_option_to_errors(option):
        return kind(**values)


def read_pairs(
    text: str, option: str, find_reader: Callable[[str], NumberReader], flags: Collection[str] = ()
) -> dict[str, Any]:
    """Return the values of NAME=VALUE pairs."""
    values: dict[str, Any] = {}
    for part in text.split(","):
        name, equals, value = (parameter.strip() for parameter in part.partition("="))
        name = name.replace("-", "_")
        if not equals or name in values:
            message = "{} must be NAME=VALUE pairs separated by commas, with distinct names; got "
            raise OptionError(message + escape_braces(repr(text)), option, value=text)
        if name in flags and value not in ("yes", "no"):
            raise OptionError(f"{{}} must contain {name}=yes or {name}=no; got {value!r}", option, value=text)
        values[name] = value == "yes" if name in flags else find_reader(name)(value, option)
    return values
