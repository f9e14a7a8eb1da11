"""`rocking orbits`, `bifurcation`, `basin`: what becomes of a body under a pulse that repeats for ever."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from rocking.block import Block, RestrainedBlock
from rocking.block.body import Body
from rocking.cli.options import BLOCK, MODEL, WHOLE, BodyOptions, ModelOptions, written
from rocking.cli.output import OUTPUT, OutputOptions, deliver, print_result, write_results, write_tables
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.tables import cell, counted, text_table
from rocking.dynamics.basin_maps import basins
from rocking.dynamics.bifurcation import Direction, bifurcation_diagram
from rocking.dynamics.branches import Branch
from rocking.dynamics.continuation import continue_orbit
from rocking.dynamics.maps import scale_of, stroboscopic_map
from rocking.dynamics.orbits import PeriodicOrbit, periodic_orbits
from rocking.errors import InvalidOption
from rocking.inputs.pulses import PulseFamily, pulse_values
from rocking.inputs.quantities import Quantity, of_state, values
from rocking.motion.motion import Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Cells of a basin along each axis.
_CELLS = 200


def orbits(
    *,
    pulse: str,
    period: Annotated[int, WHOLE] = 1,
    along: str | None = None,
    orbit: Annotated[int | None, WHOLE] = None,
    body: Annotated[BodyOptions, BLOCK] = BodyOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Find periodic orbits of a body under a pulse that repeats for ever, and follow one along a parameter.

    The body is a block (--width, --height, or --p, --alpha), perhaps a wall or with restraints (--one-sided,
    --tendon, ...), or --ball, --oscillator or --pendulum. --out holds
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
    moving, shaking = body.body(), _Repeating(pulse)
    if along is None and orbit is not None:
        raise InvalidOption("{} is about the branch that is followed with {}, which is missing", "orbit", "along")
    follow = None if along is None else _follower(moving, shaking, along)
    with output.folder() as folder:
        found = periodic_orbits(moving, shaking.motion(), period=period, model=model.equation)
        branch = None if follow is None else follow(_chosen(found, orbit))
        result: dict[str, Any] = {"orbits": [each.to_dict() for each in found]}
        if branch is not None:
            result["branch"] = branch.to_dict()
        if folder is not None:
            _write(folder, found, branch, result)
        text = _text(found) if branch is None else f"{_text(found)}\n\n{branch.summary()}"
        print_result(result, text, as_json=output.as_json)


def bifurcation(
    *,
    pulse: str,
    along: str,
    start: Annotated[
        str, written("Initial coordinate and velocity, with a comma between: 0.01,0 (rad, rad/s; m, m/s) or 1deg,0.")
    ] = "0.01,0",
    direction: Direction = "both",
    transient: Annotated[int, WHOLE] = 200,
    kept: Annotated[int, WHOLE] = 64,
    body: Annotated[BodyOptions, BLOCK] = BodyOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Follow a body under a pulse that repeats for ever as a parameter changes, and keep where it settles.

    The body is a block (--width, --height, or --p, --alpha), perhaps a wall or with restraints (--one-sided,
    --tendon, ...), or --ball, --oscillator or --pendulum. --out holds
    bifurcation.png, .pdf, .nc, states.csv (at the starts of periods), orbits.csv (periods, impacts) and result.json.

    Parameters
    ----------
    pulse
        One period, sine:frequency=1.2Hz or any of rocking pulses; a sine has one cycle unless it is said.
    along
        Parameter of the pulse with its values, amplitude:0.1g:0.5g:101 (START:STOP:COUNT, with :log at the end for
        equal ratios) or amplitude:0.1g,0.2g.
    direction
        up or down: from each value to the next; both of them; afresh: each value from the initial state.
    transient
        Periods at each value before states are kept.
    kept
        Periods whose states are kept.
    """
    moving, shaking, given = body.body(), _Repeating(pulse), start.split(",")
    if len(given) != 2:
        raise InvalidOption("{} takes a coordinate and a velocity, as 0.01,0", "start")
    first = [read(text, "start") for read, text in zip(of_state(moving.coordinate.unit), given, strict=True)]
    name, quantity, rest = shaking.parameter(along, "amplitude:0.1g:0.5g:101")
    unit = shaking.family.unit(name).replace("^2", "²")
    levels = checks.axis(values(rest, "along", quantity), "along", InvalidOption)
    with output.folder() as place:
        found = bifurcation_diagram(
            lambda value: (moving, shaking.motion(**{name: value})),
            levels,
            first,
            direction=direction,
            transient=transient,
            kept=kept,
            parameter=f"{name} ({unit})" if unit else name,
            model=model.equation,
        )
        deliver(found, "bifurcation", folder=place, as_json=output.as_json)


def basin(
    *,
    pulse: str,
    positions: Annotated[
        str | None,
        written("Rotations of a block, rad or 1deg,2deg, or positions, m; by default up to its balance or stops."),
    ] = None,
    velocities: Annotated[
        str | None,
        written("Velocities, rad/s or 5deg/s, or m/s; by default up to p times the balance, or what is natural."),
    ] = None,
    periods: Annotated[int, WHOLE] = 200,
    body: Annotated[BodyOptions, BLOCK] = BodyOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Find what becomes of a body under a pulse that repeats for ever, for every initial state of a grid.

    The body is a block (--width, --height, or --p, --alpha), perhaps a wall or with restraints (--one-sided,
    --tendon, ...), or --ball, --oscillator or --pendulum. Lists of numbers
    are 1,2,5 or START:STOP:COUNT. --out holds basin.png, .pdf, .nc, attractors.csv, outcomes.csv, orbits.csv and
    result.json.

    Parameters
    ----------
    pulse
        One period, sine:amplitude=0.3g,frequency=1.2Hz or any of rocking pulses; a sine has one cycle unless it is
        said.
    periods
        Most periods that a state is followed for.
    """
    moving, motion = body.body(), _Repeating(pulse).motion()
    read_position, read_velocity = of_state(moving.coordinate.unit)
    at, rates = _natural_axes(moving, motion)
    with output.folder() as place:
        found = basins(
            moving,
            motion,
            at if positions is None else values(positions, "positions", read_position),
            rates if velocities is None else values(velocities, "velocities", read_velocity),
            periods,
            model=model.equation,
        )
        deliver(found, "basin", folder=place, as_json=output.as_json)


class _Repeating:
    """A pulse that repeats for ever; of a sine one cycle unless it is said."""

    def __init__(self, text: str) -> None:
        self.family: PulseFamily
        self.family, given = pulse_values(text)
        self.given = {"cycles": 1.0} | given if "cycles" in self.family.needed else given

    def motion(self, **others: float) -> Motion:
        """Return one period, with other values of some parameters."""
        return self.family.motion(self.given | others)

    def parameter(self, along: str, example: str) -> tuple[str, Quantity, str]:
        """Return the parameter that changes, what reads its values, and the text of these."""
        name, colon, rest = (each.strip() for each in along.partition(":"))
        if not colon or not name:
            raise InvalidOption(f"{{}} takes a parameter of the pulse with its values, as {example}", "along")
        quantity = self.family.quantity(name)
        if quantity is None:
            raise InvalidOption(f"{{}} takes a number of the pulse, and {name} is a word", "along")
        return name, quantity, rest


def _follower(body: Body, shaking: _Repeating, along: str) -> Callable[[PeriodicOrbit], Branch]:
    """Return what follows an orbit along a parameter of the pulse."""
    example = "amplitude:0.1g:0.5g"
    name, quantity, rest = shaking.parameter(along, example)
    ends = rest.split(":")
    if name not in shaking.given or len(ends) != 2:
        raise InvalidOption(f"{{}} takes a parameter that the pulse gives, with its range, as {example}", "along")
    low, high = (quantity(end, "along") for end in ends)
    value, unit = float(shaking.given[name]), shaking.family.unit(name) or "1"
    if not low < high:
        raise InvalidOption(f"{{}} takes a range from a lower value to a higher one, not {rest}", "along", value=along)
    if not low <= value <= high:
        raise InvalidOption(f"{{}} must hold the pulse's own {name}, {value:g}, at which orbits are found", "along")

    def follow(orbit: PeriodicOrbit) -> Branch:
        return continue_orbit(
            orbit, lambda at: (body, shaking.motion(**{name: at})), value, (low, high), name=name, unit=unit
        )

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
            k, each.period, "infinite" if math.isinf(each.impacts) else int(each.impacts),
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
    figures: dict[str, Callable[[], Figure]] = {f"orbit-{k}": each.plot for k, each in enumerate(found, 1)}
    if branch is not None:
        write_tables(folder, branch)
        figures["branch"] = branch.plot
    write_results(folder, figures=figures, result=result)


def _natural_axes(body: Body, motion: Motion) -> tuple[Floats, Floats]:
    """Return coordinates and velocities that are natural to a body under a motion."""
    middles = (np.arange(_CELLS) + 0.5) / _CELLS
    if isinstance(body, (Block, RestrainedBlock)):
        ends = [side.alpha if math.isinf(at) else at for side, at in zip(body.sides, body.balance, strict=False)]
        lean, rate = max(ends), max(side.p * end for side, end in zip(body.sides, ends, strict=True))
        one_way = isinstance(body, RestrainedBlock) and body.is_one_sided
        return lean * middles if one_way else np.linspace(-lean, lean, _CELLS), np.linspace(-rate, rate, _CELLS)
    (low, high), scale = body.stops, scale_of(stroboscopic_map(body, motion))
    width = high - low or scale.coordinate
    return low + width * middles, scale.velocity * (2.0 * middles - 1.0)
