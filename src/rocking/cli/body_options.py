"""Options that describe a body: a block, what holds it back, another body in its place, or an ensemble of blocks."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, TypeVar

from cyclopts import Parameter

from rocking.cli.options import ModelOptions, hint, measured, written
from rocking.errors import InvalidBlock, InvalidOption, RockingError, literal
from rocking.plausibility import block_notes, restraint_notes
from rocking.progress import note
from rocking.quantities import length, number, position, rate, sides, tilt

if TYPE_CHECKING:
    from rocking.block import Block
    from rocking.body import Body

Made = TypeVar("Made")

#: What describes a block, together, and what may go with it.
_Descriptions = Mapping[tuple[str, ...], tuple[str, ...]]
_DESCRIPTIONS: Final[_Descriptions] = {
    ("width", "height"): ("offset", "mass"),
    ("half_width", "half_height"): ("offset", "mass"),
    ("p", "alpha"): (),
    ("pivots", "height_of_mass", "gyration"): ("mass",),
}

#: What goes with a slenderness that is all that is known of a block.
_FREQUENCY_PARAMETER: Final = (
    "p is sqrt(3 g/(4 R)) of a rectangular block, with the distance R from its edge to its centre of mass; the mass "
    "alone does not matter"
)


@dataclass(frozen=True)
class BlockOptions:
    """A block by its sizes, by its parameters, or by its pivots."""

    half_width: Annotated[
        float | None, measured("Half the width of a rectangular block, 0.12 (m) or 12cm.", position)
    ] = None
    half_height: Annotated[float | None, measured("Half its height, m.", position)] = None
    width: Annotated[
        float | None, measured("Width of a rectangular block, 0.24 (m) or 24cm; with --height.", position)
    ] = None
    height: Annotated[float | None, measured("Its height, m.", position)] = None
    offset: Annotated[
        float | None,
        measured(
            "How far its centre of mass is off the middle of the width, m; positive to side + (the right).", position
        ),
    ] = None
    p: Annotated[str | None, written("Frequency parameter, rad/s; one number or two; with --alpha.")] = None
    alpha: Annotated[
        str | None, written("Slenderness, 12deg or 0.2 (rad); two with a comma between are side + and side -.")
    ] = None
    pivots: Annotated[
        str | None,
        written(
            "Distances of the pivots of side + and side - from the centre of mass, m, as 0.2,0.15; with "
            "--height-of-mass and --gyration."
        ),
    ] = None
    height_of_mass: Annotated[str | None, written("Height of the centre of mass above the pivots, m.")] = None
    gyration: Annotated[str | None, written("Radius of gyration about the centre of mass, m.")] = None
    restitution: Annotated[
        str | None,
        written(
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
            block = Block.from_pivots(pair, height, gyration, restitution=e, mass=given.get("mass"))
        elif self.alpha is not None:
            alpha = sides(self.alpha, "alpha", tilt)
            if self.p is None and e is None and isinstance(alpha, list):
                raise InvalidBlock(
                    "the restitution of two different sides follows from {} and {} of both: give {}, too",
                    *("p", "alpha", "p"),
                )
            block = Block.from_parameters(1.0 if self.p is None else sides(self.p, "p", rate), alpha, e)
        else:
            block = Block(**given, restitution=e)
        for sentence in block_notes(block):
            note(sentence)
        return block

    def given(self) -> dict[str, Any]:
        """Return what is given of the block, in the order of the descriptions."""
        names = dict.fromkeys(name for each in _DESCRIPTIONS.items() for names in each for name in names)
        return {name: value for name in names if (value := getattr(self, name, None)) is not None}


@dataclass(frozen=True)
class HeldOptions(BlockOptions):
    """A block, and what holds it back or pushes it."""

    mass: Annotated[float | None, hint("Mass of the block, kg, which restraints need; with its sizes or pivots.")] = (
        None
    )
    one_sided: Annotated[
        bool,
        Parameter(
            help="It rocks to side + only, as a wall against transverse walls; --restitution is then the speed back "
            "over that before.",
            negative="",
        ),
    ] = False
    lean: Annotated[str | None, written("Angle by which it stands out of plumb to side +, 1deg or 0.02 (rad).")] = None
    tendon: Annotated[
        tuple[str, ...],
        Parameter(
            help="Elastic tendon, as stiffness=2e6,prestress=5e3 (N/m, N), with offset (m, to side +) and strength "
            "(N), at which it yields; several times for several.",
            negative="",
        ),
    ] = ()
    spring: Annotated[float | None, hint("Rotational spring, N m/rad.")] = None
    damper: Annotated[float | None, hint("Rotational viscous damper, N m s/rad.")] = None
    thrust: Annotated[
        tuple[str, ...],
        Parameter(
            help="Horizontal force to side +, as force=1500,height=4 (N, m), with offset (m); several times for "
            "several.",
            negative="",
        ),
    ] = ()
    load: Annotated[
        tuple[str, ...],
        Parameter(
            help="Weight on it, as mass=250,height=3 (kg, m), with offset (m), and follows=no for one that presses and "
            "does not move with it; several times for several.",
            negative="",
        ),
    ] = ()

    def held(self) -> dict[str, Any]:
        """Return what is given of restraints, by the name of its option."""
        names = ("one_sided", "lean", "tendon", "spring", "damper", "thrust", "load")
        return {name: value for name in names if (value := getattr(self, name)) not in (None, False, ())}

    def body(self) -> Body:
        """Return the block, with its restraints where there are some."""
        from rocking.block import Damper, Load, RestrainedBlock, Spring, Tendon, Thrust

        block, held = self.block(), self.held()
        if not held:
            return block
        e = None if self.restitution is None else sides(self.restitution, "restitution")
        kinds = {"tendon": Tendon, "thrust": Thrust, "load": Load}
        restraints = [_made(kind, text, name) for name, kind in kinds.items() for text in getattr(self, name)]
        for name, couple in {"spring": Spring, "damper": Damper}.items():
            if name in held:
                with _about(name):
                    restraints.append(couple(held[name]))
        lean = 0.0 if self.lean is None else tilt(self.lean, "lean")
        try:
            body = RestrainedBlock(block, *restraints, one_sided=self.one_sided, lean=lean, restitution=e)
        except InvalidBlock as wrong:
            if wrong.argument != "offset":
                raise
            raise InvalidBlock(literal(str(wrong))) from wrong  # that of a restraint, where --offset is the block's own
        for sentence in restraint_notes(body, None if block.half_height is None else 2.0 * block.half_height):
            note(sentence)
        return body


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
class BodyOptions(HeldOptions):
    """A block with what holds it back, or another body in its place."""

    ball: Annotated[
        float | None,
        hint("In place of a block a ball on a table, by its coefficient of restitution; the motion is up."),
    ] = None
    oscillator: Annotated[
        str | None,
        hint(
            "In place of a block an oscillator that hits a stop, as frequency=1,restitution=0.8,stop=0.01 (Hz, m), "
            "with damping_ratio and second_stop."
        ),
    ] = None
    pendulum: Annotated[
        str | None,
        hint("In place of a block a pendulum between walls, as p=3,gap=0.1,restitution=0.6 (rad/s, m)."),
    ] = None

    def body(self) -> Body:
        """Return the other body that is given, or where there is none the block."""
        from rocking.dynamics.bodies import BouncingBall, ImpactOscillator, InvertedPendulum

        names = ("ball", "oscillator", "pendulum", "restitution")
        first, *others = [name for name in names if getattr(self, name) is not None] or ["restitution"]
        if first == "restitution":
            return super().body()
        others = [*others, *self.given(), *self.held()]
        if others:
            raise InvalidBlock(f"{{}} is a body of its own: leave {_all_of(others)} out", first, *others)
        if self.ball is not None:
            with _about("ball"):
                return BouncingBall(self.ball)
        if self.oscillator is not None:
            return _made(ImpactOscillator, self.oscillator, "oscillator")
        return _made(InvertedPendulum, self.pendulum or "", "pendulum")


@contextmanager
def _about(option: str) -> Iterator[None]:
    """Say of which option a parameter is that is wrong, whose name may be that of another option."""
    try:
        yield
    except RockingError as wrong:
        raise InvalidOption(f"{{}}: {literal(str(wrong))}", option) from wrong


def _made(kind: Callable[..., Made], text: str, option: str) -> Made:
    """Make what an option describes by NAME=VALUE."""
    given = _parameters(text, option, kind)
    with _about(option):
        return kind(**given)


def _parameters(text: str, option: str, made: Callable[..., object]) -> dict[str, Any]:
    """Return the parameters of a body that a text gives, by name."""
    known = inspect.signature(made).parameters
    given = {}
    for part in text.split(","):
        name, equals, value = (each.strip() for each in part.partition("="))
        name = name.replace("-", "_")
        if not equals or name not in known:
            raise InvalidOption(
                f"{{}} takes NAME=VALUE with {', '.join(known)}, not {part.strip()!r}", option, value=text
            )
        if name in given:
            raise InvalidOption(f"{{}} gives {name} twice, in {text!r}", option)
        is_truth = isinstance(known[name].default, bool)
        given[name] = _truth(value, name, option) if is_truth else number(value, option)
    missing = [name for name, each in known.items() if each.default is each.empty and name not in given]
    if missing:
        raise InvalidOption(f"{{}} needs {' and '.join(missing)} as well", option)
    return given


def _truth(text: str, name: str, option: str) -> bool:
    if text not in ("yes", "no"):
        raise InvalidOption(f"{{}} takes {name}=yes or {name}=no, not {text!r}", option, value=text)
    return text == "yes"


@dataclass(frozen=True)
class EnsembleOptions(HeldOptions):
    """A block by its sizes or by its parameters, or the ensemble of a calibration."""

    ensemble: Annotated[
        Path | None,
        hint("In place of a block the ensemble.csv that rocking calibrate writes, with its weights and its model."),
    ] = None

    def blocks(self, model: ModelOptions) -> dict[str, Any]:
        """Return blocks, weights and equation of motion as arguments."""
        if self.ensemble is None:
            return {"blocks": self.body(), "model": model.model}
        self.refuse_a_block()
        return ensemble_of(self.ensemble, model)

    def refuse_a_block(self) -> None:
        """Refuse what is given of a block beside an ensemble."""
        given = self.of_block()
        if given:
            raise InvalidBlock(f"{{}} has blocks of its own: leave {_all_of(given)} out", "ensemble", *given)

    def of_block(self) -> list[str]:
        """Return the options of a block that are given."""
        return [*self.given(), *([] if self.restitution is None else ["restitution"]), *self.held()]


def ensemble_of(file: Path, model: ModelOptions) -> dict[str, Any]:
    """Return blocks, weights and equation of motion of an ensemble as arguments."""
    from rocking.calibration.tables import read_ensemble

    found = read_ensemble(file)
    return {"blocks": found.blocks, "weights": found.weights, "model": model.equation or found.model}
