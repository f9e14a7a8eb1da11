"""Options shared by several commands, built from the declared inputs."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, TypeVar

from cyclopts import Group, Parameter, Token

from rocking.core.constants import Model
from rocking.core.progress import Progress, note
from rocking.errors import InvalidBlock, InvalidMotion, InvalidOption, RockingError, UnreadableRecord, escape_braces
from rocking.inputs import bodies, declared
from rocking.inputs.declared import INPUTS, read_noted_acceleration
from rocking.inputs.notes import motion_notes, vertical_notes
from rocking.inputs.pulses import named_pulse
from rocking.inputs.quantities import Quantity, read_acceleration, read_array, read_number, read_scaling, read_velocity
from rocking.inputs.texts import write_option_name
from rocking.motion.motion import Motion
from rocking.motion.scaling import IntensityName, Measure
from rocking.records.named import expand_record_names, load_motion, load_vertical

if TYPE_CHECKING:
    from rocking.block import Block
    from rocking.block.body import Body

Made = TypeVar("Made")
Options = TypeVar("Options", bound="InputOptions")

#: Spread over the options of a command, each group under its own heading in the help.
MEASURE: Final = Parameter(name="*", group=Group("Intensity", sort_key=0))
BLOCK: Final = Parameter(name="*", group=Group("Block", sort_key=1))
RECORDS: Final = Parameter(name="*", group=Group("Records", sort_key=2))
MODEL: Final = Parameter(name="*", group=Group("Model", sort_key=3))

#: Records as arguments, including a lone hyphen.
Names = Annotated[
    str,
    Parameter(
        name="RECORDS",
        allow_leading_hyphen=True,
        help="Record files, folders, patterns (*.AT2), names of shipped records (see rocking records), or - for "
        "standard input. A file's format is recognised by its content.",
    ),
]


def hint(text: str) -> Parameter:
    """Return the help of an option."""
    return Parameter(help=text)


def written(text: str) -> Parameter:
    """Return the help of a numeric option whose value may begin with a minus sign."""
    return Parameter(help=text, allow_leading_hyphen=True)


def _whole(_: Any, tokens: Sequence[Token]) -> int:
    if not re.fullmatch(r"[+-]?\d+", tokens[0].value):
        raise ValueError(f"{tokens[0].value} is not a whole number")
    return int(tokens[0].value)


#: Reader of integers; the parser itself would round 1.5 to an integer.
WHOLE: Final = Parameter(converter=_whole)


@dataclass(frozen=True)
class InputOptions:
    """Texts of some inputs."""

    def given(self, *names: str) -> dict[str, Any]:
        """Return the texts that were supplied, or the named ones."""
        texts = {each.name: getattr(self, each.name) for each in fields(self)}
        return {n: text for n, text in texts.items() if text not in (None, False, ()) and (not names or n in names)}

    def read(self, *names: str) -> dict[str, Any]:
        """Return the values of the supplied texts, or of the named ones."""
        return {name: INPUTS[name].read(text) for name, text in self.given(*names).items() if name in INPUTS}


#: Types and defaults of options that are not a text.
_TYPES: Final[Mapping[str, tuple[Any, Any]]] = {"flag": (bool, False), "texts": (tuple[str, ...], ())}


def _with(*names: str) -> Callable[[type[Options]], type[Options]]:
    """Add a field for each of some inputs to a class of options."""

    def decorated(options: type[Options]) -> type[Options]:
        made: list[Any] = []
        for name in names:
            each = INPUTS[name]
            kind, default = _TYPES.get(each.kind, (str | None, None))
            is_signed = each.kind in declared.READERS or "acceleration" in each.kind
            of = Parameter(help=each.help, negative="", allow_leading_hyphen=is_signed)
            made.append((name, Annotated[kind, of], default))
        about = {"__doc__": options.__doc__, "__module__": options.__module__}
        return make_dataclass(options.__name__, made, bases=(options,), frozen=True, namespace=about)

    return decorated


@_with(*(name for name in declared.BLOCK if name != "mass"))
class BlockOptions(InputOptions):
    """Block described by its sizes, parameters, or pivots."""

    def block(self) -> Block:
        """Return the block, with notes on likely mistakes."""
        block = bodies.create_block(self.read(*declared.BLOCK))
        bodies.note_likely_mistakes([block])
        return block


@_with("mass", *declared.SUPPORTS)
class HeldOptions(BlockOptions):
    """Block with restraints."""

    def body(self) -> Body:
        """Return the block, with its restraints if any."""
        given, block = self.given(), bodies.create_block(self.read(*declared.BLOCK))
        forces = [_made(declared.FORCES[name], text, name) for name in declared.FORCES for text in given.get(name, ())]
        for name, couple in declared.COUPLES.items():
            if name in given:
                with _about(name):
                    forces.append(couple(INPUTS[name].read(given[name])))
        try:
            body = bodies.create_body(block, self.read("restitution", "one_sided", "lean"), forces)
        except InvalidBlock as wrong:
            if not forces or wrong.argument != "offset":
                raise
            raise InvalidBlock(
                escape_braces(str(wrong))
            ) from wrong  # offset of a restraint, not the --offset of the block
        bodies.note_likely_mistakes([block], [body])
        return body


@dataclass(frozen=True)
class EnsembleOptions(HeldOptions):
    """Block described by its sizes or parameters, or an ensemble from a calibration."""

    ensemble: Annotated[
        Path | None,
        hint("In place of a block the ensemble.csv that rocking calibrate writes, with its weights and its model."),
    ] = None

    def blocks(self, model: ModelOptions) -> dict[str, Any]:
        """Return blocks, weights and equation of motion as arguments."""
        if self.ensemble is None:
            return {"blocks": self.body(), "model": model.model}
        if given := self.of_block():
            raise InvalidBlock(f"{{}} has blocks of its own: leave {bodies.name_all(given)} out", "ensemble", *given)
        return ensemble_of(self.ensemble, model)

    def of_block(self) -> list[str]:
        """Return the supplied options of a block."""
        return [name for name in self.given() if name != "ensemble"]


def ensemble_of(file: Path, model: ModelOptions) -> dict[str, Any]:
    """Return blocks, weights and equation of motion of an ensemble as arguments."""
    from rocking.calibration.tables import read_ensemble

    found = read_ensemble(file)
    return {"blocks": found.blocks, "weights": found.weights, "model": model.equation or found.model}


@contextmanager
def _about(option: str) -> Iterator[None]:
    """Add the option to errors on its parameters, because other options share their names."""
    try:
        yield
    except RockingError as wrong:
        raise InvalidOption(f"{{}}: {escape_braces(str(wrong))}", option) from wrong


def _made(kind: Callable[..., Made], text: str, option: str) -> Made:
    """Create an object from an option with NAME=VALUE pairs."""
    given: dict[str, Any] = {}
    flags = {name for name, each in inspect.signature(kind).parameters.items() if isinstance(each.default, bool)}
    for part in text.split(","):
        name, equals, value = (each.strip() for each in part.partition("="))
        name = name.replace("-", "_")
        if not equals or name in given:
            sentence = "{} takes NAME=VALUE with commas between, each name once, not "
            raise InvalidOption(sentence + escape_braces(repr(text)), option, value=text)
        if name in flags and value not in ("yes", "no"):
            raise InvalidOption(f"{{}} takes {name}=yes or {name}=no, not {value!r}", option, value=text)
        given[name] = value == "yes" if name in flags else bodies.find_reader(name)(value, option)
    bodies.check_parameters(kind, given, "{}", option)
    with _about(option):
        return kind(**given)


@_with("channel", "dt", "units")
class FileOptions(InputOptions):
    """Metadata that a record file lacks."""

    def about(self) -> dict[str, Any]:
        """Return channel, step and units as arguments."""
        return {"channel": None, "dt": None, "units": None} | self.read("channel", "dt", "units")

    def motion(self, name: str, *, several: bool = False, is_pulse: bool = False) -> Motion:
        """Return the scaled motion of a record or pulse, with notes."""
        given, vertical = self.given(), self.given().get("vertical")
        # Mistakes in the options are reported before a long file is read.
        target = read_scaling({n: given[n] for n in ("scale", "pga", "pgv", "sa") if n in given}, positive_acceleration)
        if is_pulse:
            motion = named_pulse(name)
            if vertical is not None:
                motion = motion.with_vertical(load_vertical(vertical, name, **self.about()))
        else:
            motion = load_motion(name, **self.about(), vertical=vertical, several=several)
        notes = motion_notes(motion)
        for sentence in (*notes, *vertical_notes(motion)):
            note(f"{name}: {sentence}")
        if target is None:
            return motion
        scaled = motion.scaled_to(*target)
        for sentence in motion_notes(scaled):
            if sentence not in notes:
                note(f"{name}, scaled: {sentence}")
        return scaled

    def pulses(self) -> dict[str, Motion]:
        """Return the pulses by their texts."""
        return {text: self.motion(text, is_pulse=True) for text in self.given().get("pulse", ())}


@_with("vertical", "scale", "pga", "pgv", "sa", "pulse")
class ScaledPulseOptions(FileOptions):
    """One record at a time, or pulses, scaled."""


class ReadRecords(NamedTuple):
    """Motions of records and pulses.

    Attributes
    ----------
    motions : dict of str to Motion
        Motions by the names in the command.
    skipped : dict of str to str
        Reasons why records could not be read.
    single : bool
        Whether the command names one record or pulse itself, rather than a folder or pattern with one match.
    """

    motions: dict[str, Motion]
    skipped: dict[str, str]
    single: bool

    def to_dict(self) -> dict[str, Any]:
        """Return the records and skipped files for JSON."""
        from rocking.analysis.survey import record_columns

        return {"records": record_columns([*self.motions], [*self.motions.values()]), "skipped": self.skipped}


def refusal(name: str, error: RockingError) -> str:
    """Return why a record cannot be read, for the command line."""
    reason = error.text(
        lambda argument: write_option_name(argument) if argument in ("channel", "dt", "units") else argument
    )
    return reason if error.path == name else f"{name}: {reason}"


def read_each(
    names: Sequence[str], read: Callable[[str], Made], *, keep_going: bool
) -> tuple[dict[str, Made], dict[str, str]]:
    """Read records one by one; return the motions and, if reading continues after errors, the errors."""
    found: dict[str, Made] = {}
    refused: dict[str, str] = {}
    with Progress("reading records", total=len(names)) as progress:
        for name in names:
            try:
                found[name] = read(name)
            except (UnreadableRecord, InvalidMotion) as error:
                if not keep_going:
                    raise
                refused[name] = refusal(name, error)
            progress.advance()
    return found, refused


@dataclass(frozen=True)
class _RecordOptions(FileOptions):
    """Several records and pulses."""

    keep_going: Annotated[
        bool, Parameter(name="--keep-going", negative="", help="Skip records that cannot be read, and list them.")
    ] = False

    def read_all(self, names: Sequence[str]) -> ReadRecords:
        """Return the motions by name."""
        records, pulses = expand_record_names(names), self.given().get("pulse", ())
        if not records and not pulses:
            raise InvalidOption(
                "give one record or more: files, folders, or names of shipped records (see rocking records), or {}",
                "pulse",
            )
        made = self.pulses()
        motions, skipped = read_each(
            records, lambda name: self.motion(name, several=len(records) > 1), keep_going=self.keep_going
        )
        if records and not motions:
            raise UnreadableRecord(
                f"none of {len(records)} records could be read; the first: {next(iter(skipped.values()))}"
            )
        for reason in skipped.values():
            note(f"skipped: {reason}")
        motions |= made
        return ReadRecords(motions, skipped, [*motions] == [*names, *pulses] and len(motions) == 1)


@_with("vertical", "pulse")
class UnscaledOptions(_RecordOptions):
    """Several records and pulses with vertical motions, scaled by the analysis itself."""


@_with("vertical", "scale", "pga", "pgv", "sa", "pulse")
class MotionOptions(_RecordOptions):
    """Several records and pulses, scaled."""


@dataclass(frozen=True)
class IntensityOptions:
    """Intensity measure of motions."""

    measure: Annotated[
        IntensityName,
        hint(
            "Intensity: PGA, PGV, spectral acceleration, or in the block's own units PGA and p PGV "
            "over the acceleration that lifts it."
        ),
    ] = "pga"
    period: Annotated[float | None, hint("Period of the spectral acceleration, s.")] = None
    damping: Annotated[float, hint("Its fraction of critical damping.")] = 0.05

    @property
    def wanted(self) -> Measure:
        """Return the intensity measure."""
        return Measure(self.measure, self.period, self.damping)


@dataclass(frozen=True)
class MeasureOptions(IntensityOptions):
    """Intensity measure of motions, and its levels."""

    levels: Annotated[
        str | None,
        written(
            "Levels to scale every motion to, as 0.1g,0.2g or 0.1g:1g:10 (velocities as 0.4 (m/s) or 40cm/s, ratios as "
            "plain numbers); START:STOP:COUNT:log for equal ratios."
        ),
    ] = None

    def chosen(self) -> dict[str, Any]:
        """Return measure and levels as arguments."""
        readers: Mapping[str, Quantity] = {
            "pga": positive_acceleration,
            "sa": positive_acceleration,
            "pgv": read_velocity,
        }
        levels = None if self.levels is None else read_array(self.levels, "levels", readers.get(self.measure, _ratio))
        return {"measure": self.wanted, "levels": levels}


@dataclass(frozen=True)
class ModelOptions:
    """Equation of motion."""

    equation: Annotated[Model | None, Parameter(name="--model", help=INPUTS["model"].help)] = None

    @property
    def model(self) -> Model:
        """Return the equation of motion; nonlinear by default."""
        return self.equation or "nonlinear"


@dataclass(frozen=True)
class SchemeOptions(ModelOptions):
    """Equation of motion and chattering scheme."""

    chattering: Annotated[str, hint(INPUTS["chattering"].help)] = "certified"

    def chosen(self) -> dict[str, Any]:
        """Return model and scheme as arguments."""
        from rocking.engine.schemes import chattering_scheme

        return {"model": self.model, "chattering": chattering_scheme(self.chattering)}


@_with("duration", "initial_rotation", "initial_velocity")
class StartOptions(InputOptions):
    """Start and end of a simulation."""


def labels_of(clusters: str | None) -> str | list[str] | None:
    """Return the labels of an option that groups motions."""
    from rocking.analysis.levels import BY_STATION

    return clusters if clusters in (None, BY_STATION) else [label.strip() for label in clusters.split(",")]


def positive_acceleration(text: str, name: str) -> float:
    """Return a positive acceleration, m/s^2, with a note if a bare number looks like a multiple of g."""
    if not read_acceleration(text, name) > 0.0:
        raise InvalidOption(
            f"{{}} must be above 0, not {text.strip()}; {{}} -1 reverses a motion", name, "scale", value=text
        )
    return read_noted_acceleration(text, name)


def _ratio(text: str, name: str) -> float:
    """Return a level of a measure in the units of the block."""
    try:
        return read_number(text, name)
    except InvalidOption:
        sentence = "{} takes plain numbers with this {}, which counts in the block's own units, not "
        raise InvalidOption(sentence + repr(text.strip()), name, "measure") from None


def parse_limit_states(text: str) -> dict[str, float]:
    """Return limit states by name: overturning, or rotations divided by the slenderness, as half=0.5."""
    limits = {}
    for part in text.split(","):
        name, given, value = part.strip().partition("=")
        if not given and name != "overturning":
            raise InvalidOption(
                f"{{}} takes overturning or NAME=ROTATION over slenderness, not {part.strip()!r}",
                "limit_states",
                value=text,
            )
        if name in limits or (given and name in ("", "overturning")):
            why = f"has {name} twice" if name in limits else f"gives a rotation the name {name!r}"
            raise InvalidOption(f"{{}} {why}; name each limit state once, as half=0.5", "limit_states")
        try:
            limits[name] = read_number(value, "limit_states") if given else math.inf
        except InvalidOption:
            raise InvalidOption(
                f"{{}} {name} takes a number, not {value.strip()!r}", "limit_states", value=text
            ) from None
    return limits
