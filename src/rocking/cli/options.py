"""Options that several commands share, in groups: the block, the records, the equation of motion, what comes out."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, NamedTuple

from cyclopts import Group, Parameter

from rocking.cli.batch import output_folder
from rocking.cli.wording import option_of
from rocking.constants import Model
from rocking.errors import InvalidBlock, InvalidMotion, InvalidOption, RockingError, UnreadableRecord
from rocking.motion.motion import Motion
from rocking.motion.named import expanded, named_motion, named_vertical
from rocking.motion.scaling import IntensityName, Measure
from rocking.named_pulses import named_pulse
from rocking.plausibility import block_notes, level_notes, motion_notes, vertical_notes
from rocking.progress import Progress, note
from rocking.quantities import Quantity, acceleration, length, number, scaling, sides, tilt, values, velocity

if TYPE_CHECKING:
    from rocking.block import Block

#: What describes a block, together, and what may go with it.
_Descriptions = Mapping[tuple[str, ...], tuple[str, ...]]
_DESCRIPTIONS: Final[_Descriptions] = {
    ("width", "height"): ("offset",),
    ("half_width", "half_height"): ("offset",),
    ("p", "alpha"): (),
    ("pivots", "height_of_mass", "gyration"): (),
}

#: What goes with a slenderness that is all that is known of a block.
_FREQUENCY_PARAMETER: Final = (
    "p is sqrt(3 g/(4 R)) of a rectangular block, with the distance R from its edge to its centre of mass; the mass "
    "alone does not matter"
)

#: What a message about a record file may name.
_OF_FILES: Final = ("channel", "dt", "units")

#: Spread over the command's own options, each group under its own heading in the help.
BLOCK: Final = Parameter(name="*", group=Group("Block", sort_key=1))
RECORDS: Final = Parameter(name="*", group=Group("Records", sort_key=2))
MEASURE: Final = Parameter(name="*", group=Group("Intensity", sort_key=0))
MODEL: Final = Parameter(name="*", group=Group("Model", sort_key=3))
OUTPUT: Final = Parameter(name="*", group=Group("Output", sort_key=4))

#: Records as arguments: a lone hyphen is one, too.
Names = Annotated[
    str,
    Parameter(
        name="RECORDS",
        allow_leading_hyphen=True,
        help="Record files, folders, patterns (*.AT2), names of shipped records (see rocking records), or - for "
        "standard input. A file's format is recognised by its content.",
    ),
]


def _help(text: str) -> Parameter:
    return Parameter(help=text)


def _written(text: str) -> Parameter:
    """Help of an option whose value is a number as people write it, which may begin with a minus sign."""
    return Parameter(help=text, allow_leading_hyphen=True)


def _flag(name: str, text: str) -> Parameter:
    return Parameter(name=name, negative="", help=text)


@dataclass(frozen=True)
class BlockOptions:
    """A block by its sizes, by its parameters, or by its pivots."""

    half_width: Annotated[float | None, _help("Half the width of a rectangular block, m.")] = None
    half_height: Annotated[float | None, _help("Half its height, m.")] = None
    width: Annotated[float | None, _help("Width of a rectangular block, m; with --height.")] = None
    height: Annotated[float | None, _help("Its height, m.")] = None
    offset: Annotated[
        float | None,
        _help("How far its centre of mass is off the middle of the width, m; positive to side + (the right)."),
    ] = None
    p: Annotated[str | None, _written("Frequency parameter, rad/s; one number or two; with --alpha.")] = None
    alpha: Annotated[
        str | None, _written("Slenderness, 12deg or 0.2 (rad); two with a comma between are side + and side -.")
    ] = None
    pivots: Annotated[
        str | None,
        _written(
            "Distances of the pivots of side + and side - from the centre of mass, m, as 0.2,0.15; with "
            "--height-of-mass and --gyration."
        ),
    ] = None
    height_of_mass: Annotated[str | None, _written("Height of the centre of mass above the pivots, m.")] = None
    gyration: Annotated[str | None, _written("Radius of gyration about the centre of mass, m.")] = None
    restitution: Annotated[
        str | None,
        _written(
            "Factor on the angular speed at an impact, in (0, 1]; one or two; by default from angular momentum "
            "(Housner's where both sides are equal)."
        ),
    ] = None

    #: Descriptions of a block that the command takes.
    _TAKEN: ClassVar[_Descriptions] = _DESCRIPTIONS

    def block(self) -> Block:
        """Return the block, with notes on what looks like a mistake."""
        from rocking.block import Block

        e = None if self.restitution is None else sides(self.restitution, "restitution")
        given = self.given()
        complete = [each for each, more in self._TAKEN.items() if {*each} <= given.keys() <= {*each, *more}]
        if not complete:
            raise _which_block(tuple(given), self._TAKEN)
        if "pivots" in given:
            distances = sides(given["pivots"], "pivots", length)
            height, gyration = (length(given[name], name) for name in ("height_of_mass", "gyration"))
            pair = [distances] * 2 if isinstance(distances, float) else distances
            block = Block.from_pivots(pair, height, gyration, restitution=e)
        elif self.alpha is not None:
            alpha = sides(self.alpha, "alpha", tilt)
            if self.p is None and e is None and isinstance(alpha, list):
                raise InvalidBlock(
                    "the restitution of two different sides follows from {} and {} of both: give {}, too",
                    *("p", "alpha", "p"),
                )
            block = Block.from_parameters(1.0 if self.p is None else sides(self.p, "p"), alpha, e)
        else:
            block = Block(**given, restitution=e)
        for sentence in block_notes(block):
            note(sentence)
        return block

    def given(self) -> dict[str, Any]:
        """Return what is given of the block, in the order of the descriptions."""
        names = dict.fromkeys(name for each in _DESCRIPTIONS.items() for names in each for name in names)
        return {name: value for name in names if (value := getattr(self, name)) is not None}


@dataclass(frozen=True)
class SlendernessOptions(BlockOptions):
    """A block, of which the slenderness alone may be given: p is then 1."""

    _TAKEN: ClassVar[_Descriptions] = {
        ("alpha",) if "alpha" in needed else needed: ("p",) if "alpha" in needed else more
        for needed, more in _DESCRIPTIONS.items()
    }


def _which_block(given: Sequence[str], descriptions: _Descriptions) -> InvalidBlock:
    """Return the error that says what is missing of a block, or what belongs to different descriptions of it."""
    having = {needed: {*needed, *more} for needed, more in descriptions.items() if {*needed, *more} & {*given}}
    begun = [needed for needed in having if {*needed} & {*given}] or [*having]
    if any(not {*given} <= having[needed] for needed in begun):
        sentence = f"{_all_of(given)} belong to different descriptions of a block; give one: {_one_of(having)}"
        return InvalidBlock(sentence, *given, *chain(*having))
    if begun:
        hint = f"; {_FREQUENCY_PARAMETER}" if given == ("alpha",) and "p" in begun[0] else ""
        sentence = f"a block needs more than {_all_of(given)}: give {_one_of(begun)}{hint}"
        return InvalidBlock(sentence, *given, *chain(*begun))
    return InvalidBlock(f"a block is needed: give {_one_of(descriptions)}", *chain(*descriptions))


def _all_of(names: Sequence[str]) -> str:
    return " and ".join(["{}"] * len(names))


def _one_of(descriptions: Iterable[Sequence[str]]) -> str:
    return ", or ".join(map(_all_of, descriptions))


@dataclass(frozen=True)
class EnsembleOptions(BlockOptions):
    """A block by its sizes or by its parameters, or the ensemble of a calibration."""

    ensemble: Annotated[
        Path | None,
        _help("In place of a block the ensemble.csv that rocking calibrate writes, with its weights and its model."),
    ] = None

    def blocks(self, model: ModelOptions) -> dict[str, Any]:
        """Return blocks, weights and equation of motion as arguments."""
        if self.ensemble is None:
            return {"blocks": self.block(), "model": model.model}
        given = self.given()
        if given:
            raise InvalidBlock(f"{{}} has blocks of its own: leave {_all_of([*given])} out", "ensemble", *given)
        return ensemble_of(self.ensemble, model)


def ensemble_of(file: Path, model: ModelOptions) -> dict[str, Any]:
    """Return blocks, weights and equation of motion of an ensemble as arguments."""
    from rocking.analysis.tables import read_ensemble

    found = read_ensemble(file)
    return {"blocks": found.blocks, "weights": found.weights, "model": model.equation or found.model}


@dataclass(frozen=True)
class FileOptions:
    """What a record file does not say."""

    channel: Annotated[str | None, _help("Channel, by number or name, of files that hold several.")] = None
    dt: Annotated[float | None, _help("Sampling step, s, of files that do not say theirs.")] = None
    units: Annotated[str | None, _help("Units of files that do not say theirs: g, m/s2, cm/s2, gal, mm/s2, mg.")] = None

    def read(self, name: str, *, several: bool = False) -> Motion:
        """Return the motion of a record, alone or one of several."""
        motion = named_motion(name, channel=self.channel, dt=self.dt, units=self.units, several=several)
        return self.finished(name, motion)

    def finished(self, name: str, motion: Motion) -> Motion:
        """Return a motion as the simulations take it, with notes on what looks like a mistake."""
        for sentence in motion_notes(motion):
            note(f"{name}: {sentence}")
        return motion


def refusal(name: str, error: RockingError) -> str:
    """Return why a record cannot be read, with its name, in the words of the command line."""
    reason = error.text(lambda argument: option_of(argument) if argument in _OF_FILES else argument)
    return reason if error.path == name else f"{name}: {reason}"


def _acceleration(text: str, name: str) -> float:
    """Return an acceleration, m/s^2, with a note where a number without a unit looks like one in g."""
    value = acceleration(text, name)
    if not value > 0.0:
        raise InvalidOption(f"{{}} must be above 0, not {text.strip()}; {{}} -1 reverses a motion", name, "scale")
    for sentence in level_notes(text, value, name):
        note(sentence)
    return value


def _ratio(text: str, name: str) -> float:
    """Return a level of a measure in the block's own units."""
    try:
        return number(text, name)
    except InvalidOption:
        sentence = "{} takes plain numbers with this {}, which counts in the block's own units, not "
        raise InvalidOption(sentence + repr(text.strip()), name, "measure") from None


@dataclass(frozen=True)
class VerticalOptions(FileOptions):
    """What a record file does not say, and the vertical motion that comes with it."""

    vertical: Annotated[
        str | None,
        _help("Vertical motion, scaled alike: a channel of the same file, or another file or shipped record."),
    ] = None

    def finished(self, name: str, motion: Motion) -> Motion:
        """Return a motion with its vertical component, if one is asked for, with notes on that as well."""
        noted = super().finished(name, motion)
        if self.vertical is None:
            return noted
        noted = noted.with_vertical(
            named_vertical(self.vertical, name, channel=self.channel, dt=self.dt, units=self.units)
        )
        for sentence in vertical_notes(noted):
            note(f"{name}: {sentence}")
        return noted


@dataclass(frozen=True)
class ScaledOptions(VerticalOptions):
    """What a record file does not say, its vertical motion, and how they are scaled; at most one way."""

    scale: Annotated[float | None, _help("Factor on the motion; negative: reversed.")] = None
    pga: Annotated[str | None, _written("Scale to this peak ground acceleration: 0.5g, 4.9m/s2 or 4.9 (m/s^2).")] = None
    pgv: Annotated[float | None, _help("Scale to this peak ground velocity, m/s.")] = None
    sa: Annotated[
        str | None,
        _written("Scale to this spectral acceleration (5 % damping) at a period: 0.4g@1.0 is 0.4 g at 1.0 s."),
    ] = None

    def read(self, name: str, *, several: bool = False) -> Motion:
        """Return the motion of a record, scaled."""
        _ = self._target  # A mistake in the options is told before a long file is read.
        return super().read(name, several=several)

    def finished(self, name: str, motion: Motion) -> Motion:
        """Return a motion with its vertical component, if one is asked for, scaled; with notes on that as well."""
        noted = super().finished(name, motion)
        if self._target is None:
            return noted
        scaled = noted.scaled_to(*self._target)
        for sentence in motion_notes(scaled):
            if sentence not in motion_notes(noted):
                note(f"{name}, scaled: {sentence}")
        return scaled

    @functools.cached_property
    def _target(self) -> tuple[float, Measure] | None:
        given = {"scale": self.scale, "pga": self.pga, "pgv": self.pgv, "sa": self.sa}
        return scaling(given, lambda text, name: _acceleration(text, f"--{name}"))


@dataclass(frozen=True)
class PulseOptions(FileOptions):
    """Pulses beside the records."""

    pulse: Annotated[
        tuple[str, ...],
        Parameter(
            consume_multiple=False,
            negative="",
            help="A pulse as the ground motion, sine:amplitude=0.2g,frequency=2Hz,cycles=5 (see rocking pulses); once "
            "for each.",
        ),
    ] = ()

    def pulses(self) -> dict[str, Motion]:
        """Return the pulses by their texts."""
        return {text: self.finished(text, named_pulse(text)) for text in self.pulse}


class Records(NamedTuple):
    """Records that were read, and pulses.

    Attributes
    ----------
    motions : dict of str to Motion
        Motions by the names that were asked for.
    skipped : dict of str to str
        Why records could not be read.
    single : bool
        Whether one record or pulse was named by itself, and no folder or pattern that happens to hold one.
    """

    motions: dict[str, Motion]
    skipped: dict[str, str]
    single: bool

    def to_dict(self) -> dict[str, Any]:
        """Return for machines what stands for each record in other tables, and what was skipped."""
        from rocking.analysis.survey import record_columns

        listed = record_columns([*self.motions], [*self.motions.values()])
        return {"records": listed, "skipped": self.skipped}


@dataclass(frozen=True)
class RecordOptions(PulseOptions):
    """Several records, and pulses."""

    keep_going: Annotated[bool, _flag("--keep-going", "Skip records that cannot be read, and list them.")] = False

    def read_all(self, names: Sequence[str]) -> Records:
        """Return the motions of records, folders of them and patterns, and the pulses, by the name of each.

        Raises
        ------
        UnreadableRecord
            If one cannot be read, or with --keep-going none.
        """
        records = expanded(names)
        if not records and not self.pulse:
            raise InvalidOption(
                "give one record or more: files, folders, or names of shipped records (see rocking records), or {}",
                "pulse",
            )
        pulses = self.pulses()
        motions: dict[str, Motion] = {}
        skipped: dict[str, str] = {}
        with Progress("reading records", total=len(records)) as progress:
            for name in records:
                try:
                    motions[name] = self.read(name, several=len(records) > 1)
                except (UnreadableRecord, InvalidMotion) as error:
                    if not self.keep_going:
                        raise
                    skipped[name] = refusal(name, error)
                progress.advance()
        if records and not motions:
            raise UnreadableRecord(
                f"none of {len(records)} records could be read; the first: {next(iter(skipped.values()))}"
            )
        for reason in skipped.values():
            note(f"skipped: {reason}")
        motions |= pulses
        single = [*motions] == [*names, *self.pulse] and len(motions) == 1
        return Records(motions, skipped, single)


@dataclass(frozen=True)
class UnscaledOptions(RecordOptions, VerticalOptions):
    """Several records, and pulses, with their vertical motions, that an analysis scales itself."""


@dataclass(frozen=True)
class MotionOptions(RecordOptions, ScaledOptions):
    """Several records, and pulses, scaled."""


@dataclass(frozen=True)
class ScaledPulseOptions(PulseOptions, ScaledOptions):
    """One record at a time, and pulses, scaled."""


@dataclass(frozen=True)
class MeasureOptions:
    """How the intensity of motions is measured, and its levels."""

    measure: Annotated[
        IntensityName,
        _help(
            "Intensity: PGA, PGV, spectral acceleration, or in the block's own units PGA/(g tan alpha) and "
            "p PGV/(g tan alpha)."
        ),
    ] = "pga"
    period: Annotated[float | None, _help("Period of the spectral acceleration, s.")] = None
    damping: Annotated[float, _help("Its fraction of critical damping.")] = 0.05
    levels: Annotated[
        str | None,
        _written(
            "Levels to scale every motion to, as 0.1g,0.2g or 0.1g:1g:10 (velocities as 0.4 (m/s) or 40cm/s, ratios as "
            "plain numbers); START:STOP:COUNT:log for equal ratios."
        ),
    ] = None

    def chosen(self) -> dict[str, Any]:
        """Return measure and levels as arguments."""
        levels = None if self.levels is None else values(self.levels, "levels", self._quantity())
        return {"measure": self.wanted, "levels": levels}

    @property
    def wanted(self) -> Measure:
        """Measure of intensity."""
        return Measure(self.measure, self.period, self.damping)

    def _quantity(self) -> Quantity:
        """Return what reads a level of the measure."""
        return {"pga": _acceleration, "sa": _acceleration, "pgv": velocity}.get(self.measure, _ratio)


@dataclass(frozen=True)
class ModelOptions:
    """The equation of motion."""

    equation: Annotated[
        Model | None,
        Parameter(
            name="--model",
            help="Equation of motion: exact (nonlinear, the default), or linearised for slender blocks; an ensemble "
            "has its own.",
        ),
    ] = None

    @property
    def model(self) -> Model:
        """Equation of motion, nonlinear unless it is said."""
        return self.equation or "nonlinear"


@dataclass(frozen=True)
class TreatmentOptions(ModelOptions):
    """The equation of motion, and how chattering ends."""

    chattering: Annotated[
        str,
        _help(
            "How chattering ends: certified, velocity, interval, or (under a sine) time; with a limit, as "
            "certified=1e-9 (s), velocity=5e-10 (over p alpha), interval=1e-9 (s)."
        ),
    ] = "certified"

    def chosen(self) -> dict[str, Any]:
        """Return model and treatment as arguments."""
        from rocking.treatment import treatment

        return {"model": self.equation or "nonlinear", "chattering": treatment(self.chattering)}


@dataclass(frozen=True)
class QuietOptions:
    """What every command takes."""

    quiet: Annotated[bool, _flag("--quiet", "No notes on stderr.")] = False


@dataclass(frozen=True)
class PrintOptions(QuietOptions):
    """How a result is printed."""

    as_json: Annotated[bool, _flag("--json", "Print the result as JSON.")] = False


@dataclass(frozen=True)
class OutputOptions(PrintOptions):
    """How a result is printed, and where its files go."""

    out: Annotated[Path | None, _help("Folder for the files: figures, tables, result.json.")] = None

    def folder(self) -> AbstractContextManager[Path | None]:
        """Make the folder, if one is wanted, before the work; on failure, remove it again where it is empty."""
        return nullcontext() if self.out is None else output_folder(self.out)
