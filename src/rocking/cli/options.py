"""Options shared by several commands, built from the declared inputs."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, make_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, TypeVar, cast

from cyclopts import Group, Parameter, Token

from rocking.core import checks
from rocking.core.constants import Model
from rocking.core.progress import Progress, note
from rocking.errors import BlockError, MotionError, OptionError, RecordError, join_placeholders
from rocking.inputs import bodies, declared
from rocking.inputs.declared import INPUTS, read_noted_acceleration
from rocking.inputs.inventory import read_labelled
from rocking.inputs.notes import list_hazard_notes, list_motion_notes, list_vertical_notes
from rocking.inputs.pulses import named_pulse
from rocking.inputs.quantities import (
    NumberReader,
    read_acceleration,
    read_array,
    read_duration,
    read_length,
    read_number,
    read_scaling,
    read_velocity,
)
from rocking.inputs.texts import format_option_name
from rocking.motion.motion import Motion
from rocking.motion.scaling import ComponentName, IntensityName, Measure
from rocking.records.components import collect_pairs, name_components, note_skipped, separate_verticals
from rocking.records.formats.source import Request
from rocking.records.named import (
    OWN,
    STANDARD_INPUT,
    expand_record_names,
    list_motion_names,
    load_motion,
    load_vertical,
)

if TYPE_CHECKING:
    from rocking.analysis.hazard import HazardCurve
    from rocking.block import Block
    from rocking.block.body import Body

Item = TypeVar("Item")
OptionsClass = TypeVar("OptionsClass", bound="InputOptions")

#: Spread over the options of a command, each group under its own heading in the help.
INTENSITY_OPTIONS: Final = Parameter(name="*", group=Group("Intensity", sort_key=0))
BLOCK_OPTIONS: Final = Parameter(name="*", group=Group("Block", sort_key=1))
RECORD_OPTIONS: Final = Parameter(name="*", group=Group("Records", sort_key=2))
MODEL_OPTIONS: Final = Parameter(name="*", group=Group("Model", sort_key=3))

#: Records as arguments, including a lone hyphen.
Names = Annotated[
    str,
    Parameter(
        name="RECORD_OPTIONS",
        allow_leading_hyphen=True,
        help="Record files, folders, patterns (*.AT2), names of shipped records (see rocking records), or - for "
        "standard input. A file's format is recognised by its content.",
    ),
]


def _convert_integer(_: Any, tokens: Sequence[Token]) -> int:
    if not re.fullmatch(r"[+-]?\d+", tokens[0].value):
        raise ValueError(f"{tokens[0].value} is not a whole number")
    return int(tokens[0].value)


#: Reader of integers; the parser itself would round 1.5 to an integer.
READ_INTEGER: Final = Parameter(converter=_convert_integer)


@dataclass(frozen=True)
class InputOptions:
    """Options that are texts of inputs."""

    def supplied_texts(self, *names: str) -> dict[str, Any]:
        """Return the texts that were supplied, or the named ones."""
        texts = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: text for name, text in texts.items() if text not in (None, False, ()) and (not names or name in names)
        }

    def read_values(self, *names: str) -> dict[str, Any]:
        """Return the values of the supplied texts, or of the named ones."""
        return {name: INPUTS[name].read(text) for name, text in self.supplied_texts(*names).items() if name in INPUTS}


#: Types and defaults of options that are not a text.
_OPTION_TYPES: Final[Mapping[str, tuple[Any, Any]]] = {"flag": (bool, False), "texts": (tuple[str, ...], ())}


def _with_inputs(*names: str) -> Callable[[type[OptionsClass]], type[OptionsClass]]:
    """Add a field for each of some inputs to a class of options."""

    def add_fields(options: type[OptionsClass]) -> type[OptionsClass]:
        new_fields: list[Any] = []
        for name in names:
            option_input = INPUTS[name]
            kind, default = _OPTION_TYPES.get(option_input.kind, (str | None, None))
            is_signed = option_input.kind in declared.READERS or "acceleration" in option_input.kind
            parameter = Parameter(help=option_input.help, negative="", allow_leading_hyphen=is_signed)
            new_fields.append((name, Annotated[kind, parameter], default))
        namespace = {"__doc__": options.__doc__, "__module__": options.__module__}
        return make_dataclass(options.__name__, new_fields, bases=(options,), frozen=True, namespace=namespace)

    return add_fields


@_with_inputs(*(name for name in declared.BLOCK_INPUTS if name != "mass"))
class BlockOptions(InputOptions):
    """Block described by its sizes, parameters, or pivots."""

    def read_uncertain(self, *names: str) -> dict[str, Any]:
        """Return the values of supplied texts, some of which may be distributions."""
        return {name: INPUTS[name].read_uncertain(text) for name, text in self.supplied_texts(*names).items()}

    def create_block(self) -> Block:
        """Return the block, with notes on likely mistakes."""
        block = bodies.create_block(self.read_uncertain(*declared.BLOCK_INPUTS))
        bodies.note_likely_mistakes([block])
        return block


@_with_inputs("mass", *declared.SUPPORT_INPUTS)
class RestrainedOptions(BlockOptions):
    """Block with restraints."""

    def create_body(self) -> Body:
        """Return the block, with its restraints if any."""
        texts = self.supplied_texts()
        block, body = bodies.create_restrained(bodies.read_values(texts), bodies.read_forces(texts))
        bodies.note_likely_mistakes([block], [body])
        return body


_INVENTORY_HELP: Final = "CSV or Excel table with an object in each row, instead of a block (rocking assess --help)."


@dataclass(frozen=True)
class _InventoryOptions(BlockOptions):
    """Block, or objects from a table."""

    inventory: Annotated[Path | None, Parameter(help=_INVENTORY_HELP)] = None

    def create_objects(self, create: Callable[[], Body], labels: Sequence[str]) -> Any:
        """Return the objects of the table with labels that have a meaning, or the block that a function creates."""
        if self.inventory is None:
            return create()
        if conflicting := [name for name in self.supplied_texts() if name != "inventory"]:
            message = f"{{}} replaces the block: omit {join_placeholders(conflicting)}"
            raise BlockError(message, "inventory", *conflicting)
        inventory = read_labelled(self.inventory, expected=labels)
        return inventory if len(inventory) > 1 else inventory[0]


@dataclass(frozen=True)
class FreeObjectOptions(_InventoryOptions):
    """Block without restraints, or objects from a table."""

    def create_blocks(self) -> Any:
        """Return the block, or the objects."""
        return self.create_objects(self.create_block, ("name", "friction"))


@dataclass(frozen=True)
class ObjectOptions(RestrainedOptions, _InventoryOptions):
    """Block, or objects from a table."""

    def create_bodies(self, labels: Sequence[str] = ("name", "friction")) -> Any:
        """Return the block, or the objects with labels that have a meaning."""
        return self.create_objects(self.create_body, labels)


_DEFAULT_SAMPLE_COUNT: Final = 100
_SAMPLES_HELP: Final = (
    "Number of sampled blocks if a size or parameter is uncertain (mean +- standard deviation), as in --width '0.30 +- "
    "0.02'; 100 by default."
)
_ENSEMBLE_HELP: Final = "File ensemble.csv from rocking calibrate, instead of a block; includes weights and model."


@dataclass(frozen=True)
class EnsembleOptions(RestrainedOptions):
    """Block described by its sizes or parameters, possibly uncertain, or an ensemble from a calibration."""

    ensemble: Annotated[Path | None, Parameter(help=_ENSEMBLE_HELP)] = None
    samples: Annotated[int | None, READ_INTEGER, Parameter(help=_SAMPLES_HELP)] = None
    seed: Annotated[int | None, READ_INTEGER, Parameter(help="Seed of the samples, 0 by default.")] = None

    def create_block_arguments(self, model_options: ModelOptions) -> dict[str, Any]:
        """Return blocks, weights and equation of motion as arguments."""
        if self.ensemble is None:
            values = self.read_uncertain(*declared.BLOCK_INPUTS, "one_sided", "lean")
            if bodies.find_uncertain(values):
                forces, sample_count = bodies.read_forces(self.supplied_texts()), self.samples or _DEFAULT_SAMPLE_COUNT
                blocks = bodies.sample_bodies(values, sample_count, self.seed or 0, forces)
                return {"blocks": blocks, "model": model_options.model}
            for name in self.supplied_texts("samples", "seed"):
                message = "{} requires an uncertain size or parameter, as in {} '0.30 +- 0.02'"
                raise OptionError(message, name, "width")
            return {"blocks": self.create_body(), "model": model_options.model}
        if conflicting := [name for name in self.supplied_texts() if name != "ensemble"]:
            message = f"{{}} replaces the block: omit {join_placeholders(conflicting)}"
            raise BlockError(message, "ensemble", *conflicting)
        return read_ensemble_arguments(self.ensemble, model_options)


def read_ensemble_arguments(file: Path, model_options: ModelOptions) -> dict[str, Any]:
    """Read blocks, weights and equation of motion of an ensemble as arguments."""
    from rocking.calibration.tables import read_ensemble

    ensemble = read_ensemble(file)
    return {"blocks": ensemble.blocks, "weights": ensemble.weights, "model": model_options.equation or ensemble.model}


#: Options of `FileOptions`, by the names of arguments.
_FILE_OPTIONS: Final = {name: format_option_name(name) for name in ("channel", "dt", "units")}


@_with_inputs(*_FILE_OPTIONS, "baseline", "highpass")
class FileOptions(InputOptions):
    """Metadata that a record file lacks, and corrections of its numbers."""

    def read_options(self) -> dict[str, Any]:
        """Return channel, step, units, baseline and corner frequency as arguments, if they were supplied."""
        return self.read_values(*_FILE_OPTIONS, "baseline", "highpass")

    def create_request(self, *, are_defaults: bool = False) -> Request:
        """Return the options as a request, possibly as defaults for several files."""
        return Request.create(**self.read_options(), are_defaults=are_defaults)

    def read_motion(self, name: str, *, is_pulse: bool = False) -> Motion:
        """Return the scaled motion of a record or pulse, with notes."""
        vertical = self.supplied_texts().get("vertical")
        target = self._read_target()  # mistakes in the options are reported before a long file is read
        if is_pulse:
            motion = named_pulse(name)
            if vertical is not None:
                motion = motion.with_vertical(load_vertical(vertical, name, self.create_request()))
        else:
            motion = load_motion(name, self.create_request(), vertical)
        return self._scale_motion(name, motion, target)

    def _read_target(self) -> tuple[float, Measure] | None:
        """Return the level and the measure to which motions are scaled, if any."""
        texts = {name: text for name, text in self.supplied_texts().items() if name in declared.SCALINGS}
        return read_scaling(texts, read_positive_acceleration)

    def _scale_motion(self, name: str, motion: Motion, target: tuple[float, Measure] | None) -> Motion:
        """Return the scaled motion, of the floor if there is one, with notes."""
        notes = list_motion_notes(motion)
        for sentence in (*notes, *list_vertical_notes(motion)):
            note(f"{name}: {sentence}")
        if (floor := self.supplied_texts().get("floor")) is not None:
            motion = bodies.create_from_pairs(motion.on_floor, floor, "floor")
        if target is None:
            return motion
        scaled = motion.scaled_to(*target)
        for sentence in list_motion_notes(scaled):
            if sentence not in notes:
                note(f"{name}, scaled: {sentence}")
        return scaled

    def create_pulses(self) -> dict[str, Motion]:
        """Return the pulses by their texts."""
        return {text: self.read_motion(text, is_pulse=True) for text in self.supplied_texts().get("pulse", ())}

    def create_stochastic_motions(self) -> dict[str, Motion]:
        """Return the stochastic motions by distinct names."""
        motions, readers = list[Motion](), bodies.STOCHASTIC_READERS
        for text in self.supplied_texts().get("stochastic", ()):
            values = bodies.read_pairs(text, "stochastic", lambda name: readers.get(name, read_number))
            with bodies.add_option_to_errors("stochastic"):
                motions += bodies.create_stochastic(values, "{}", "stochastic")
        named = zip(list_motion_names(motions), motions, strict=True)
        return {name: self._scale_motion(name, motion, self._read_target()) for name, motion in named}


@_with_inputs("vertical", "floor", "scale", "pga", "pgv", "sa", "pulse")
class ScaledPulseOptions(FileOptions):
    """One record at a time, or pulses, scaled."""


class LoadedRecords(NamedTuple):
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
    is_single: bool

    def to_dict(self) -> dict[str, Any]:
        """Return the records and skipped files for JSON."""
        from rocking.analysis.survey import create_record_columns

        return {"records": create_record_columns([*self.motions], [*self.motions.values()]), "skipped": self.skipped}


def read_records(
    names: Sequence[str], read_record: Callable[[str], Item], *, keep_going: bool
) -> tuple[dict[str, Item], dict[str, str]]:
    """Read records one by one; return the motions and, if reading continues after errors, the errors."""
    results: dict[str, Item] = {}
    messages: dict[str, str] = {}
    with Progress("reading records", total=len(names)) as progress:
        for name in names:
            try:
                results[name] = read_record(name)
            except (RecordError, MotionError) as error:
                if not keep_going:
                    raise
                message = error.text(lambda argument: _FILE_OPTIONS.get(argument, argument))
                messages[name] = message if error.path == name else f"{name}: {message}"
            progress.advance()
    return results, messages


_COMPONENT_HELP: Final = (
    "Component to which intensity measures and levels refer: own, or for pairs of horizontal components, which are "
    "grouped by station and event, geometric_mean, larger, rotd50 or rotd100. With pairs, --vertical own adds the "
    "vertical component of the station."
)


@dataclass(frozen=True)
class _RecordOptions(FileOptions):
    """Several records and pulses."""

    keep_going: Annotated[
        bool, Parameter(name="--keep-going", negative="", help="Skip records that cannot be read, and list them.")
    ] = False
    component: Annotated[ComponentName, Parameter(help=_COMPONENT_HELP)] = "own"
    reversed: Annotated[bool, Parameter(negative="", help="Also use every motion reversed (x -1).")] = False

    def read_all(self, names: Sequence[str], *, accepts_pairs: bool = False) -> LoadedRecords:
        """Return the motions by name, with pairs those of all horizontal components."""
        records, pulses = expand_record_names(names), self.supplied_texts().get("pulse", ())
        stochastic = self.create_stochastic_motions()
        if not (records or pulses or stochastic):
            message = "at least one record is required: file, folder, or name of a shipped record, or {} or {}"
            raise OptionError(message, "pulse", "stochastic")
        has_channel_names = "channel" in self.supplied_texts() or self.supplied_texts().get("vertical", OWN) != OWN
        if self.component != "own" or (
            accepts_pairs and records and not has_channel_names and STANDARD_INPUT not in records
        ):
            return self._load_pairs(records, [*pulses, *stochastic], has_channel_names=has_channel_names)
        pulse_motions, target = self.create_pulses(), self._read_target()
        vertical_name = self.supplied_texts().get("vertical")
        request = self.create_request(are_defaults=len(records) > 1)
        load = functools.partial(load_motion, request=request, vertical_name=vertical_name)
        loaded, skipped = read_records(records, load, keep_going=self.keep_going)
        exempt = loaded if "channel" in self.supplied_texts() else names  # a user may choose a vertical component
        loaded, verticals = separate_verticals(loaded, exempt, keep_going=self.keep_going)
        motions, unscaled = read_records(
            [*loaded], lambda name: self._scale_motion(name, loaded[name], target), keep_going=self.keep_going
        )
        skipped |= unscaled | {name: f"{name}: {reason}" for name, reason in verticals.items()}
        messages = [*skipped.values()]
        if records and not motions:
            raise RecordError(f"none of {len(records)} records could be used; the first: {messages[0]}")
        for message in messages:
            note(f"skipped: {message}")
        motions |= pulse_motions | stochastic
        is_single = [*motions] == [*names, *pulses] and len(motions) == 1 and not self.reversed
        return LoadedRecords(self._add_reversed(motions), skipped, is_single)

    def _load_pairs(self, records: Sequence[str], others: Sequence[str], *, has_channel_names: bool) -> LoadedRecords:
        """Return both horizontal components of each station, scaled by one factor unless each has its own measure."""
        is_own = self.component == "own"
        if not is_own and (others or has_channel_names):
            message = f"{{}} {self.component} requires records: omit {{}}, {{}} and {{}}, and use {{}} {OWN} or omit it"
            raise OptionError(message, "component", "pulse", "stochastic", "channel", "vertical")
        target = self._read_target()
        if target is not None and target[1].name != "factor":
            target = target[0], replace(target[1], component=self.component)
        options = self.read_values("dt", "units", "baseline", "highpass") | {"includes_singles": is_own}
        with_vertical = "vertical" in self.supplied_texts()
        pairs, skipped = collect_pairs(records, with_vertical=with_vertical, keep_going=self.keep_going, **options)
        motion_names = name_components(pairs) if is_own else list_motion_names(pairs)
        named_pairs = dict(zip(motion_names, pairs, strict=True))
        horizontals, verticals = separate_verticals(named_pairs, keep_going=self.keep_going)
        skipped |= verticals
        note_skipped(skipped)
        motions = {name: self._scale_motion(name, motion, target) for name, motion in horizontals.items()}
        motions |= {**self.create_pulses(), **self.create_stochastic_motions()} if others else {}
        return LoadedRecords(self._add_reversed(motions), skipped, False)

    def _add_reversed(self, motions: dict[str, Motion]) -> dict[str, Motion]:
        """Add the reversed motions if required."""
        return motions | {f"{name} x -1": -motion for name, motion in motions.items()} if self.reversed else motions


@_with_inputs("vertical", "floor", "pulse", "stochastic")
class UnscaledOptions(_RecordOptions):
    """Several records and pulses with vertical motions, scaled by the analysis itself."""


@_with_inputs("vertical", "floor", "scale", "pga", "pgv", "sa", "pulse", "stochastic")
class MotionOptions(_RecordOptions):
    """Several records and pulses, scaled."""


_MEASURE_HELP: Final = (
    "Intensity: PGA, PGV, PGD, spectral acceleration at a period or its mean over several, Arias intensity, cumulative "
    "absolute velocity, incremental velocity, significant duration, or PGA and p PGV divided by the block's uplift "
    "acceleration."
)
_LEVELS_HELP: Final = (
    "Levels to scale every motion to, as 0.1g,0.2g or 0.1g:1g:10 (velocities as 0.4 (m/s) or 40cm/s, ratios as plain "
    "numbers); START:STOP:COUNT:log for equal ratios."
)


@dataclass(frozen=True)
class IntensityOptions:
    """Intensity measure of motions."""

    measure: Annotated[IntensityName, Parameter(help=_MEASURE_HELP)] = "pga"
    period: Annotated[
        str | None, Parameter(help="Period of the spectral acceleration, s, or periods of sa_average, as 0.5,1,2.")
    ] = None
    damping: Annotated[float, Parameter(help="Fraction of critical damping of the spectral acceleration.")] = 0.05

    @property
    def periods(self) -> float | tuple[float, ...] | None:
        """Return the period or periods."""
        if self.period is None:
            return None
        periods = read_array(self.period, "period").tolist()
        return periods[0] if len(periods) == 1 and self.measure != "sa_average" else tuple(periods)

    def create_measure(self, component: ComponentName = "own") -> Measure:
        """Return the intensity measure of a component."""
        return Measure(self.measure, self.periods, self.damping, component)


@dataclass(frozen=True)
class MeasureOptions(IntensityOptions):
    """Intensity measure of motions, and its levels."""

    levels: Annotated[str | None, Parameter(help=_LEVELS_HELP, allow_leading_hyphen=True)] = None

    def create_arguments(self, component: ComponentName = "own") -> dict[str, Any]:
        """Return measure and levels as arguments."""
        measure, acceleration = self.create_measure(component), cast(NumberReader, read_positive_acceleration)
        readers = {"m/s^2": acceleration, "m/s": read_velocity, "m": read_length, "s": read_duration}
        reader = readers.get(measure.units, _read_ratio)
        levels = None if self.levels is None else read_array(self.levels, "levels", reader)
        return {"measure": measure, "levels": levels}


#: Default time for probabilities, years.
_DEFAULT_YEARS: Final = 50.0

#: Options among those of the command itself.
RISK_OPTIONS: Final = Parameter(name="*")
_CLUSTERS_HELP: Final = (
    "Groups of records for the intervals: station groups the components of one station in one earthquake, as named in "
    "the files; or a label for each record, separated by commas. By default each record, or pair, is a group."
)
_HAZARD_HELP: Final = "CSV file of the site's hazard curve (pga_g,annual_rate, or OpenQuake's), for annual rates."


@dataclass(frozen=True)
class ClusterOptions:
    """Groups of records."""

    clusters: Annotated[str | None, Parameter(help=_CLUSTERS_HELP)] = None

    def parse_clusters(self) -> str | list[str] | None:
        """Parse the labels that group motions."""
        from rocking.analysis.levels import BY_STATION

        text = self.clusters
        return text if text is None or text == BY_STATION else [label.strip() for label in text.split(",")]


@dataclass(frozen=True)
class RiskOptions(ClusterOptions):
    """Statistics of a fragility, and hazard curve of a site."""

    confidence: Annotated[float, Parameter(help="Probability of the intervals and bands.")] = 0.9
    hazard: Annotated[Path | None, Parameter(help=_HAZARD_HELP)] = None
    site: Annotated[int, READ_INTEGER, Parameter(help="Row of OpenQuake's file, from 0.")] = 0
    years: Annotated[float, Parameter(help="Time of the probabilities, years.")] = _DEFAULT_YEARS

    def read_hazard(self, measure_options: IntensityOptions, record_options: _RecordOptions) -> HazardCurve | None:
        """Check the numbers, and read the hazard curve, if any, with notes."""
        from rocking.analysis.hazard import HazardCurve

        checks.fraction(self.confidence, "confidence", OptionError)
        checks.positive(self.years, "years", OptionError)
        if self.hazard is None:
            for name, is_given in {"site": self.site != 0, "years": self.years != _DEFAULT_YEARS}.items():
                if is_given:
                    raise OptionError("{} requires a hazard curve; add one with {}, or omit it", name, "hazard")
            return None
        if "floor" in record_options.supplied_texts():
            raise OptionError("{} describes the ground, not the motion of {}: omit one of them", "hazard", "floor")
        settings: Any = {"period": measure_options.periods, "component": record_options.component}
        hazard_curve = HazardCurve.read(self.hazard, site=self.site, **settings)
        for sentence in list_hazard_notes(hazard_curve.intensity, hazard_curve.measure):
            note(f"{self.hazard}: {sentence}")
        return hazard_curve


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

    chattering: Annotated[str, Parameter(help=INPUTS["chattering"].help)] = "certified"

    def create_arguments(self) -> dict[str, Any]:
        """Return model and scheme as arguments."""
        from rocking.engine.schemes import chattering_scheme

        return {"model": self.model, "chattering": chattering_scheme(self.chattering)}


_FRICTION_HELP: Final = (
    "Coefficient of friction with which the block slips, or the static and the kinetic one, as 0.3,0.25. By default it "
    "never slips."
)


def read_friction(text: str | None) -> dict[str, Any]:
    """Return coefficients of friction as an argument, if any."""
    if text is None:
        return {}
    values = read_array(text, "friction").tolist()
    return {"friction": values[0] if len(values) == 1 else values}


@dataclass(frozen=True)
class SlipOptions(ModelOptions):
    """Equation of motion and friction."""

    friction: Annotated[str | None, Parameter(help=_FRICTION_HELP)] = None

    def create_arguments(self) -> dict[str, Any]:
        """Return model and friction as arguments."""
        return {"model": self.model, **read_friction(self.friction)}


@dataclass(frozen=True)
class SlipSchemeOptions(SchemeOptions):
    """Equation of motion, chattering scheme and friction."""

    friction: Annotated[str | None, Parameter(help=_FRICTION_HELP)] = None

    def create_arguments(self) -> dict[str, Any]:
        """Return model, scheme and friction as arguments."""
        return super().create_arguments() | read_friction(self.friction)


@_with_inputs("duration", "initial_rotation", "initial_velocity")
class StartOptions(InputOptions):
    """Start and end of a simulation."""


def read_positive_acceleration(text: str, name: str) -> float:
    """Read a positive acceleration, m/s^2, with a note if a bare number looks like a multiple of g."""
    if not read_acceleration(text, name) > 0.0:
        message = f"{{}} must be positive; got {text.strip()}; use {{}} -1 to reverse a motion"
        raise OptionError(message, name, "scale", value=text)
    return read_noted_acceleration(text, name)


def _read_ratio(text: str, name: str) -> float:
    """Read a level of a measure in the units of the block."""
    try:
        return read_number(text, name)
    except OptionError:
        message = "{} must be plain numbers with this {}, which is in units of the block; got "
        raise OptionError(message + repr(text.strip()), name, "measure") from None


def parse_limit_states(text: str) -> dict[str, float]:
    """Parse limit states by name: overturning, or rotations divided by the slenderness, as half=0.5."""
    limits = {}
    for part in text.split(","):
        name, equals, value = part.strip().partition("=")
        if not equals and name != "overturning":
            message = f"{{}} must be overturning or NAME=ROTATION divided by slenderness; got {part.strip()!r}"
            raise OptionError(message, "limit_states", value=text)
        if name in limits or (equals and name in ("", "overturning")):
            message = f"contains {name} twice" if name in limits else f"must not name a rotation {name!r}"
            raise OptionError(f"{{}} {message}; name each limit state once, as half=0.5", "limit_states")
        try:
            limits[name] = read_number(value, "limit_states") if equals else math.inf
        except OptionError:
            message = f"{{}} {name} must be a number; got {value.strip()!r}"
            raise OptionError(message, "limit_states", value=text) from None
    return limits
