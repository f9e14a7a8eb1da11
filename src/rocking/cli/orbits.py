"""`rocking orbits`: periodic orbits of a block or another body, and one of them along a parameter of the pulse."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.body import Body
from rocking.cli.options import BLOCK, MODEL, BlockOptions, ModelOptions
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results
from rocking.dynamics.bodies import BouncingBall, ImpactOscillator, InvertedPendulum
from rocking.dynamics.branches import Branch
from rocking.dynamics.continuation import continue_orbit
from rocking.dynamics.orbit_search import periodic_orbits
from rocking.dynamics.orbits import PeriodicOrbit
from rocking.errors import InvalidBlock, InvalidOption
from rocking.motion.motion import Motion
from rocking.named_pulses import PulseFamily, pulse_values
from rocking.quantities import number
from rocking.tables import cell, counted, text_table


@dataclass(frozen=True)
class _OtherBodies:
    """A body in place of a block."""

    ball: Annotated[
        float | None,
        Parameter(help="In place of a block a ball on a table, by its coefficient of restitution; the motion is up."),
    ] = None
    oscillator: Annotated[
        str | None,
        Parameter(
            help="In place of a block an oscillator that hits a stop, as frequency=1,restitution=0.8,stop=0.01 (Hz, "
            "m), with damping_ratio and second_stop."
        ),
    ] = None
    pendulum: Annotated[
        str | None,
        Parameter(help="In place of a block a pendulum between walls, as p=3,gap=0.1,restitution=0.6 (rad/s, m)."),
    ] = None

    def or_block(self, block: BlockOptions) -> Body:
        """Return the body that is given, or where there is none the block."""
        given = [name for name in ("ball", "oscillator", "pendulum") if getattr(self, name) is not None]
        of_block = [*block.given()]
        if not given:
            return block.block()
        if len(given) > 1 or of_block or block.restitution is not None:
            others = [*given[1:], *of_block, *(["restitution"] if block.restitution is not None else [])]
            raise InvalidBlock(f"{{}} is a body of its own: leave {' and '.join(['{}'] * len(others))} out",
                               given[0], *others)  # fmt: skip
        if self.ball is not None:
            return BouncingBall(self.ball)
        if self.oscillator is not None:
            return ImpactOscillator(**_parameters(self.oscillator, "oscillator", ImpactOscillator))
        return InvertedPendulum(**_parameters(self.pendulum or "", "pendulum", InvertedPendulum))


def orbits(
    *,
    pulse: str,
    period: int = 1,
    along: str | None = None,
    orbit: int | None = None,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    other: Annotated[_OtherBodies, BLOCK] = _OtherBodies(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Find periodic orbits of a block under a pulse that repeats for ever, and follow one along a parameter.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha). --out holds
    orbit-1.png, .pdf, orbit-1-histories.csv, ... of every orbit and result.json; with --along, branch.png, .pdf,
    points.csv and bifurcations.csv.

    Parameters
    ----------
    pulse
        One period, sine:amplitude=0.3g,frequency=1.2Hz or any of rocking pulses; a sine has one cycle unless it is
        said.
    period
        Periods of the motion after which orbits repeat.
    along
        Parameter of the pulse with its range, amplitude:0.1g:0.5g: an orbit is followed through folds, and where it
        bifurcates is located.
    orbit
        Number of the orbit that is followed; by default the first stable one.
    """
    body = other.or_block(block)
    family, given = pulse_values(pulse)
    if "cycles" in family.needed:
        given = {"cycles": 1.0} | given
    follow = None if along is None else _follower(body, family, given, along)
    with output.folder() as folder:
        found = periodic_orbits(body, family.motion(given), period=period, model=model.equation)
        branch = None if follow is None else follow(_chosen(found, orbit))
        result: dict[str, Any] = {"orbits": [each.to_dict() for each in found]}
        if branch is not None:
            result["branch"] = branch.to_dict()
        if folder is not None:
            _write(folder, found, branch, result)
        text = _text(found) if branch is None else f"{_text(found)}\n\n{branch.summary()}"
        print_result(result, text, as_json=output.as_json, folder=folder)


def _parameters(text: str, option: str, made: type[ImpactOscillator] | type[InvertedPendulum]) -> dict[str, float]:
    """Return the parameters of a body that a text gives, by name."""
    known = [*inspect.signature(made).parameters]
    needed = [name for name, each in inspect.signature(made).parameters.items() if each.default is each.empty]
    given = {}
    for part in text.split(","):
        name, equals, value = (each.strip() for each in part.partition("="))
        if not equals or name.replace("-", "_") not in known:
            raise InvalidOption(f"{{}} takes NAME=VALUE with {', '.join(known)}, not {part.strip()!r}", option)
        given[name.replace("-", "_")] = number(value, option)
    missing = [name for name in needed if name not in given]
    if missing:
        raise InvalidOption(f"{{}} needs {' and '.join(missing)} as well", option)
    return given


def _follower(body: Body, family: PulseFamily, given: dict[str, Any], along: str) -> Callable[[PeriodicOrbit], Branch]:
    """Return what follows an orbit along a parameter of the pulse."""
    name, *ends = (each.strip() for each in along.split(":"))
    if name not in given or len(ends) != 2:
        raise InvalidOption("{} takes a parameter of the pulse with its range, as amplitude:0.1g:0.5g", "along")
    quantity = family.quantity(name)
    if quantity is None:
        raise InvalidOption(f"{{}} takes a number of the pulse, and {name} is a word", "along")
    low, high = (quantity(end, "along") for end in ends)

    def member(value: float) -> tuple[Body, Motion]:
        return body, family.motion(given | {name: value})

    def follow(orbit: PeriodicOrbit) -> Branch:
        return continue_orbit(orbit, member, float(given[name]), (low, high), name=name, unit=family.unit(name) or "1")

    return follow


def _chosen(found: list[PeriodicOrbit], number_of: int | None) -> PeriodicOrbit:
    """Return the orbit that is followed."""
    if number_of is None:
        stable = [each for each in found if each.is_stable] or found
        if not stable:
            raise InvalidOption("no orbit was found, so that none can be followed {}", "along")
        return stable[0]
    if not 1 <= number_of <= len(found):
        raise InvalidOption(f"{{}} must be from 1 to {len(found)}, the orbits that were found", "orbit")
    return found[number_of - 1]


def _text(found: list[PeriodicOrbit]) -> str:
    """Return a table of orbits."""
    if not found:
        return "no periodic orbit was found"
    coordinate = found[0].body.coordinate
    rows = [
        [
            k, each.period, "infinite" if each.rests and each.impacts else int(each.impacts),
            "yes" if each.is_stable else "no", "yes" if each.symmetric else "no",
            f"{each.state[0]:.9g}", f"{each.state[1]:.9g}", cell(float(abs(each.multipliers[0]))),
        ]
        for k, each in enumerate(found, 1)
    ]  # fmt: skip
    unit = coordinate.unit
    header = [
        "orbit", "periods", "impacts", "stable", "symmetric", f"{coordinate.name} ({unit})", f"velocity ({unit}/s)",
        "largest multiplier",
    ]  # fmt: skip
    return f"{counted(len(found), 'periodic orbit')}\n\n{text_table(header, rows)}"


def _write(folder: Path, found: list[PeriodicOrbit], branch: Branch | None, result: dict[str, Any]) -> None:
    """Write figures, tables and the result."""
    for k, each in enumerate(found, 1):
        each.to_csv(folder / f"orbit-{k}-histories.csv", "histories")
    figures = {f"orbit-{k}": each.plot for k, each in enumerate(found, 1)}
    if branch is not None:
        for table in branch.TABLES:
            branch.to_csv(folder / f"{table}.csv", table)
        figures["branch"] = branch.plot
    write_results(folder, figures=figures, result=result)
