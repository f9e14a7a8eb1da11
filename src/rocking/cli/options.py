"""Options that several commands share, in groups: the block, the records, the equation of motion, what comes out."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Group, Parameter

from rocking.analysis.intensity import MeasureName
from rocking.errors import InvalidBlock, InvalidMotion, InvalidOption, OutputError, UnreadableRecord
from rocking.motion.motion import Motion
from rocking.motion.named import expanded, named_motion
from rocking.plausibility import block_notes, motion_notes
from rocking.progress import Progress, note
from rocking.quantities import acceleration, angle, number, sides, values
from rocking.treatment.base import Model

if TYPE_CHECKING:
    from rocking.block import Block

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
        "standard input. A file's format is told from its content.",
    ),
]


def _help(text: str) -> Parameter:
    return Parameter(help=text)


def _flag(name: str, text: str) -> Parameter:
    return Parameter(name=name, negative="", help=text)


@dataclass(frozen=True)
class SlendernessOptions:
    """A block by its sizes, or by its slenderness alone."""

    half_width: Annotated[float | None, _help("Half the width of a rectangular block, m.")] = None
    half_height: Annotated[float | None, _help("Half its height, m.")] = None
    width: Annotated[float | None, _help("Width of a rectangular block, m; with --height.")] = None
    height: Annotated[float | None, _help("Its height, m.")] = None
    alpha: Annotated[
        str | None, _help("Slenderness, 12deg or 0.2 (rad); two with a comma between are side + and side -.")
    ] = None
    restitution: Annotated[
        str | None, _help("Factor on the angular speed at an impact, in (0, 1]; one or two; Housner's by default.")
    ] = None

    def block(self) -> Block:
        """Return the block; where only its slenderness is given, with p = 1."""
        if self.alpha is None and not self._sized():
            raise InvalidBlock("a map needs --alpha, or --width and --height (m), or their halves")
        return self._block(None if self.alpha is None else "1")

    def _block(self, p: str | None) -> Block:
        from rocking.block import Block

        e = None if self.restitution is None else sides(self.restitution, "--restitution")
        halves = self._halves()
        if halves is not None and p is None and self.alpha is None:
            block = Block(*halves, restitution=e)
        elif not self._sized() and p is not None and self.alpha is not None:
            block = Block.from_parameters(sides(p, "--p"), sides(self.alpha, "--alpha", angle), e)
        else:
            raise InvalidBlock(
                "a block needs either --width and --height (m), or their halves --half-width and --half-height, "
                "or --p (rad/s) and --alpha"
            )
        for sentence in block_notes(block):
            note(sentence)
        return block

    def _sized(self) -> bool:
        return any(size is not None for size in (self.half_width, self.half_height, self.width, self.height))

    def _halves(self) -> tuple[float, float] | None:
        """Half sizes, if the sizes are either both full or both half."""
        if self.width is None and self.height is None and self.half_width is not None and self.half_height is not None:
            return self.half_width, self.half_height
        if self.half_width is None and self.half_height is None and self.width is not None and self.height is not None:
            return 0.5 * self.width, 0.5 * self.height
        return None


@dataclass(frozen=True)
class BlockOptions(SlendernessOptions):
    """A block by its sizes or by its parameters."""

    p: Annotated[str | None, _help("Frequency parameter, rad/s; one number or two; with --alpha.")] = None

    def block(self) -> Block:
        """Return the block."""
        return self._block(self.p)


@dataclass(frozen=True)
class FileOptions:
    """What a record file does not say."""

    channel: Annotated[str | None, _help("Channel of a record, by number or name, where there are several.")] = None
    dt: Annotated[float | None, _help("Sampling step, s, of a text file that does not give times.")] = None
    units: Annotated[str | None, _help("Units of a text file: g, m/s2, cm/s2, gal, mm/s2.")] = None

    def read(self, name: str) -> Motion:
        """Return the motion of a record, with notes on what looks like a mistake."""
        motion = named_motion(name, channel=self.channel, dt=self.dt, units=self.units)
        for sentence in motion_notes(motion):
            note(f"{name}: {sentence}")
        return motion


@dataclass(frozen=True)
class ScaledOptions(FileOptions):
    """What a record file does not say, and how its motion is scaled; at most one way."""

    scale: Annotated[float | None, _help("Factor on the motion; negative: reversed.")] = None
    pga: Annotated[str | None, _help("Scale to this peak ground acceleration: 0.5g, 4.9m/s2 or 4.9 (m/s^2).")] = None
    pgv: Annotated[float | None, _help("Scale to this peak ground velocity, m/s.")] = None
    sa: Annotated[
        str | None, _help("Scale to this spectral acceleration (5 % damping) at a period: 0.4g@1.0 is 0.4 g at 1.0 s.")
    ] = None

    def read(self, name: str) -> Motion:
        """Return the motion of a record, scaled."""
        target = self._target()
        motion = super().read(name)
        return motion.scaled(**target) if target else motion

    def _target(self) -> dict[str, float]:
        given = {"--scale": self.scale, "--pga": self.pga, "--pgv": self.pgv, "--sa": self.sa}
        chosen = [option for option, value in given.items() if value is not None]
        if len(chosen) > 1:
            raise InvalidOption(f"{' and '.join(chosen)} scale the same motion; give one of them")
        if self.pga is not None:
            return {"pga": acceleration(self.pga, "--pga")}
        if self.sa is not None:
            level, at, period = self.sa.partition("@")
            if not at:
                raise InvalidOption(f"--sa takes an acceleration at a period, as 0.4g@1.0, not {self.sa!r}")
            return {"sa": acceleration(level, "--sa"), "period": number(period, "--sa")}
        plain = {"factor": self.scale, "pgv": self.pgv}
        return {name: value for name, value in plain.items() if value is not None}


@dataclass(frozen=True)
class RecordOptions(FileOptions):
    """Several records."""

    keep_going: Annotated[bool, _flag("--keep-going", "Skip records that cannot be read, and list them.")] = False

    def read_all(self, names: Sequence[str]) -> dict[str, Motion]:
        """Return the motions of records, folders of them and patterns, by the name of each.

        Raises
        ------
        UnreadableRecord
            If one cannot be read, or with --keep-going none.
        """
        records = expanded(names)
        if not records:
            raise InvalidOption(
                "give one record or more: files, folders, or names of shipped records (see rocking records)"
            )
        motions: dict[str, Motion] = {}
        skipped: list[str] = []
        with Progress("reading records", total=len(records)) as progress:
            for name in records:
                try:
                    motions[name] = self.read(name)
                except (UnreadableRecord, InvalidMotion) as error:
                    if not self.keep_going:
                        raise
                    skipped.append(str(error) if name in str(error) else f"{name}: {error}")
                progress.advance()
        if not motions:
            raise UnreadableRecord(f"none of {len(records)} records could be read; the first: {skipped[0]}")
        for reason in skipped:
            note(f"skipped: {reason}")
        return motions


@dataclass(frozen=True)
class MotionOptions(RecordOptions, ScaledOptions):
    """Several records, scaled."""


@dataclass(frozen=True)
class MeasureOptions:
    """How the intensity of motions is measured, and its levels."""

    measure: Annotated[
        MeasureName,
        _help(
            "Intensity: PGA, PGV, spectral acceleration, or in the block's own units PGA/(g tan alpha) and "
            "p PGV/(g tan alpha)."
        ),
    ] = "pga"
    period: Annotated[float | None, _help("Period of the spectral acceleration, s.")] = None
    damping: Annotated[float, _help("Its fraction of critical damping.")] = 0.05
    levels: Annotated[
        str | None,
        _help(
            "Levels to scale every motion to, as 0.1g,0.2g or 0.1g:1g:10 (of velocities, m/s, and of ratios plain "
            "numbers); START:STOP:COUNT:log for equal ratios."
        ),
    ] = None

    def chosen(self) -> dict[str, Any]:
        """Return measure and levels as arguments."""
        quantity = acceleration if self.measure in ("pga", "sa") else number
        levels = None if self.levels is None else values(self.levels, "--levels", quantity)
        return {"measure": self.measure, "period": self.period, "damping": self.damping, "levels": levels}


@dataclass(frozen=True)
class ModelOptions:
    """The equation of motion."""

    model: Annotated[Model, _help("Equation of motion: exact, or linearised for slender blocks.")] = "nonlinear"


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

        return {"model": self.model, "chattering": treatment(self.chattering)}


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

    @contextlib.contextmanager
    def folder(self) -> Iterator[Path | None]:
        """Make the folder, if one is wanted, before the work; on failure, remove it again where it is empty."""
        if self.out is None:
            yield None
            return
        with output_folder(self.out) as folder:
            yield folder


@contextlib.contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """Make a folder for results; on failure, remove what was made and is empty.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    made = [each for each in (folder, *folder.parents) if not each.exists()]
    probe = folder / ".rocking-can-write"
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error
        yield folder
    except BaseException:
        with contextlib.suppress(OSError):
            for each in made:
                each.rmdir()
        raise
