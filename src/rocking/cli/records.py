"""Records and pulses: the options by which commands take them; `rocking records` and `rocking pulses` list them."""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, NamedTuple

from cyclopts import Group, Parameter

from rocking.cli.options import hint, measured, noted_acceleration, written
from rocking.cli.output import OUTPUT, PrintOptions
from rocking.cli.wording import option_of
from rocking.errors import InvalidMotion, InvalidOption, RockingError, UnreadableRecord
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.named_pulses import FAMILIES, PulseFamily, named_pulse
from rocking.plausibility import motion_notes, reading_notes, vertical_notes
from rocking.progress import Progress, note
from rocking.quantities import duration, scaling, velocity
from rocking.records.named import (
    STANDARD_INPUT,
    Contents,
    contents,
    expanded,
    is_shipped,
    named_motion,
    named_vertical,
    refuse_what_is_known,
    shipped,
)
from rocking.tables import text_table, to_json

#: What a message about a record file may name.
_OF_FILES: Final = ("channel", "dt", "units")

#: Names of files in one sentence.
_SHOWN: Final = 5

_EXAMPLE = "rocking simulate --pulse sine:amplitude=0.2g,frequency=2Hz,cycles=5 --width 0.24 --height 1.1"

RECORDS: Final = Parameter(name="*", group=Group("Records", sort_key=2))

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


@dataclass(frozen=True)
class FileOptions:
    """What a record file does not say."""

    channel: Annotated[str | None, hint("Channel, by number or name, of files that hold several.")] = None
    dt: Annotated[
        float | None, measured("Sampling step, 0.01 (s) or 10ms, of files that do not say theirs.", duration)
    ] = None
    units: Annotated[str | None, hint("Units of files that do not say theirs: g, m/s2, cm/s2, gal, mm/s2, mg.")] = None

    def read(self, name: str, *, several: bool = False) -> Motion:
        """Return the motion of a record, alone or one of several."""
        return self.finished(name, named_motion(name, **self.said(), several=several))

    def said(self) -> dict[str, Any]:
        """Return what `named_motion` takes besides a name."""
        return {"channel": self.channel, "dt": self.dt, "units": self.units}

    def of_pulse(self, text: str) -> Motion:
        """Return the motion of a pulse."""
        return self.finished(text, named_pulse(text))

    def finished(self, name: str, motion: Motion) -> Motion:
        """Return a motion as the simulations take it, with notes on what looks like a mistake."""
        for sentence in motion_notes(motion):
            note(f"{name}: {sentence}")
        return motion


def refusal(name: str, error: RockingError) -> str:
    """Return why a record cannot be read, with its name, in the words of the command line."""
    reason = error.text(lambda argument: option_of(argument) if argument in _OF_FILES else argument)
    return reason if error.path == name else f"{name}: {reason}"


@dataclass(frozen=True)
class VerticalOptions(FileOptions):
    """What a record file does not say, and the vertical motion that comes with it."""

    vertical: Annotated[
        str | None,
        hint("Vertical motion, scaled alike: a channel of the same file, or another file or shipped record."),
    ] = None

    def said(self) -> dict[str, Any]:
        """Return what `named_motion` takes besides a name, the vertical motion included."""
        return super().said() | {"vertical": self.vertical}

    def of_pulse(self, text: str) -> Motion:
        """Return the motion of a pulse, with its vertical component, if one is asked for."""
        pulse = named_pulse(text)
        if self.vertical is not None:
            pulse = pulse.with_vertical(named_vertical(self.vertical, text, **super().said()))
        return self.finished(text, pulse)

    def finished(self, name: str, motion: Motion) -> Motion:
        """Return a motion as the simulations take it, with notes on its vertical component as well."""
        noted = super().finished(name, motion)
        for sentence in vertical_notes(noted):
            note(f"{name}: {sentence}")
        return noted


@dataclass(frozen=True)
class ScaledOptions(VerticalOptions):
    """What a record file does not say, its vertical motion, and how they are scaled; at most one way."""

    scale: Annotated[float | None, hint("Factor on the motion; negative: reversed.")] = None
    pga: Annotated[str | None, written("Scale to this peak ground acceleration: 0.5g, 4.9m/s2 or 4.9 (m/s^2).")] = None
    pgv: Annotated[float | None, measured("Scale to this peak ground velocity, 0.4 (m/s) or 40cm/s.", velocity)] = None
    sa: Annotated[
        str | None,
        written("Scale to this spectral acceleration (5 % damping) at a period: 0.4g@1.0 is 0.4 g at 1.0 s."),
    ] = None

    def read(self, name: str, *, several: bool = False) -> Motion:
        """Return the motion of a record, scaled."""
        _ = self._target  # A mistake in the options is told before a long file is read.
        return super().read(name, several=several)

    def finished(self, name: str, motion: Motion) -> Motion:
        """Return a motion scaled, with notes on that as well."""
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
        return scaling(given, noted_acceleration)


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
        return {text: self.of_pulse(text) for text in self.pulse}


class ReadRecords(NamedTuple):
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

    keep_going: Annotated[
        bool, Parameter(name="--keep-going", negative="", help="Skip records that cannot be read, and list them.")
    ] = False

    def read_all(self, names: Sequence[str]) -> ReadRecords:
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
        return ReadRecords(motions, skipped, single)


@dataclass(frozen=True)
class UnscaledOptions(RecordOptions, VerticalOptions):
    """Several records, and pulses, with their vertical motions, that an analysis scales itself."""


@dataclass(frozen=True)
class MotionOptions(RecordOptions, ScaledOptions):
    """Several records, and pulses, scaled."""


@dataclass(frozen=True)
class ScaledPulseOptions(PulseOptions, ScaledOptions):
    """One record at a time, and pulses, scaled."""


def records(
    *names: Names,
    file: Annotated[FileOptions, RECORDS] = FileOptions(),
    output: Annotated[PrintOptions, OUTPUT] = PrintOptions(),
) -> None:
    """List the shipped records, or show what record files hold and what the reader took them for.

    Of several files those that cannot be read are listed with the reason, and the exit status is 2.
    """
    files = expanded(names)
    found: list[Contents] = []
    refused: dict[str, str] = {}
    with Progress("reading records", total=len(files)) as progress:
        for name in files:
            try:
                found.append(_contents(name, file, several=len(files) > 1))
            except (UnreadableRecord, InvalidMotion) as error:
                if len(files) == 1:
                    raise
                refused[name] = refusal(name, error)
            progress.advance()
    found = found if files else [shipped()]
    if output.as_json:
        listed = [each.to_dict() for each in found] + [{"file": name, "error": refused[name]} for name in refused]
        print(to_json(listed[0] if len(listed) == 1 else {"files": listed}))
    else:
        print("\n\n".join([each.summary() for each in found] + [*refused.values()]))
    if refused:
        left = len(refused) - _SHOWN
        shown = ", ".join([*refused][:_SHOWN]) + (f" and {left} more" if left > 0 else "")
        raise UnreadableRecord(f"{len(refused)} of {len(files)} files cannot be read: {shown}")


def _contents(name: str, file: FileOptions, *, several: bool) -> Contents:
    if is_shipped(name):
        if not several:
            refuse_what_is_known(name, channel=file.channel, dt=file.dt, units=file.units)
        return shipped(name)
    source = sys.stdin.buffer if name == STANDARD_INPUT else name
    found = contents(source, channel=file.channel, dt=file.dt, units=file.units, several=several)
    for motion, entry in zip(found.motions, found.entries, strict=True):
        for sentence in reading_notes(motion):
            note(f"{name}, channel {entry['channel']}: {sentence}")
    return found


def pulses(*, output: Annotated[PrintOptions, OUTPUT] = PrintOptions()) -> None:
    """List the pulses that --pulse takes, with their parameters and, where they need not be given, their defaults."""
    families = FAMILIES.values()
    if output.as_json:
        units = [{name: one.unit(name) for name in (*one.needed, *one.optional)} for one in families]
        known = [{"name": one.name, "needs": one.needed, "takes": one.optional} for one in families]
        print(to_json({"pulses": [one | {"units": of_one} for one, of_one in zip(known, units, strict=True)]}))
        return
    rows = [(one.name, _listed(one, dict.fromkeys(one.needed)), _listed(one, one.optional)) for one in families]
    print(text_table(["pulse", "needs", "takes"], rows))
    print(f"\namplitudes may be 0.5g or 4.9m/s2, frequencies 2Hz or 12.6rad/s, angles 90deg:\n{_EXAMPLE}")


def _listed(family: PulseFamily, parameters: Mapping[str, Any]) -> str:
    """Return parameters of a pulse with their units and defaults."""
    units = {name: f" ({family.unit(name)})" if family.unit(name) else "" for name in parameters}
    defaults = {
        name: "" if value is None else f" = {value:g}" if isinstance(value, float) else f" = {value}"
        for name, value in parameters.items()
    }
    return ", ".join(name + units[name] + defaults[name] for name in parameters)
