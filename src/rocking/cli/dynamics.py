"""`rocking bifurcation`, `basin`: what becomes of a block under a sine that never ends."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from rocking import quantities
from rocking.arrays import Floats
from rocking.cli.options import BLOCK, MODEL, BlockOptions, ModelOptions, written
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results
from rocking.dynamics.basin_maps import basins
from rocking.dynamics.bifurcation import Direction, bifurcation_diagram
from rocking.errors import InvalidOption
from rocking.motion.pulses import sine
from rocking.quantities import values
from rocking.result import DatasetResult

#: Cells of a basin along each axis.
_CELLS = 200


def bifurcation(
    *,
    amplitude: str,
    frequency: str,
    phase: str = "0",
    start: Annotated[str, written("Initial rotation and velocity, rad and rad/s, with a comma between.")] = "0.01,0",
    direction: Direction = "both",
    transient: int = 200,
    kept: int = 64,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Follow a block under a sine without end as its amplitude or its frequency changes, and keep where it settles.

    One of the two is a list: 0.1g,0.2g or START:STOP:COUNT, with :log at the end for equal ratios. --out holds
    bifurcation.png, .pdf, .nc, states.csv (at the starts of periods), orbits.csv (periods, impacts) and result.json.

    Parameters
    ----------
    amplitude
        Amplitude of the ground acceleration, 0.3g or 2.9 (m/s^2), or a list of them.
    frequency
        Frequency of the sine, 1.2Hz or 1.2, or a list of them.
    phase
        Phase of the sine at the start of a period, 90deg or 1.57 (rad).
    direction
        up or down: from each value to the next; both of them; afresh: each value from the initial state.
    transient
        Periods at each value before states are kept.
    kept
        Periods whose states are kept.
    """
    levels, frequencies = (
        values(amplitude, "amplitude", quantities.acceleration),
        values(frequency, "frequency", quantities.frequency),
    )
    if (levels.size > 1) == (frequencies.size > 1):
        raise InvalidOption(
            "one of {} and {} must be a list, as 0.1g:1g:91 or 0.5:3:126, and the other not", "amplitude", "frequency"
        )
    body, shift, first = block.block(), quantities.angle(phase, "phase"), values(start, "start")
    if first.size != 2:
        raise InvalidOption("{} takes a rotation and a velocity, as 0.01,0", "start")
    over_amplitude = levels.size > 1
    with output.folder() as folder:
        found = bifurcation_diagram(
            lambda value: (
                body,
                sine(
                    value if over_amplitude else float(levels[0]),
                    float(frequencies[0]) if over_amplitude else value,
                    cycles=1,
                    phase=shift,
                ),
            ),
            levels if over_amplitude else frequencies,
            first,
            direction=direction,
            transient=transient,
            kept=kept,
            parameter="amplitude (m/s²)" if over_amplitude else "frequency (Hz)",
            model=model.model,
        )
        _deliver(found, "bifurcation", folder=folder, as_json=output.as_json)


def basin(
    *,
    amplitude: str,
    frequency: str,
    phase: str = "0",
    rotations: Annotated[str | None, written("Rotations, rad; by default up to the slenderness on both sides.")] = None,
    velocities: Annotated[
        str | None, written("Angular velocities, rad/s; by default up to p times the slenderness.")
    ] = None,
    periods: int = 200,
    folder: Annotated[
        Path | None, Parameter(help="Where to keep what was computed, again and again; the same call goes on there.")
    ] = None,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Find what becomes of a block under a sine without end, for every initial state of a grid.

    Lists of numbers are 1,2,5 or START:STOP:COUNT. An interrupt (Ctrl-C) ends it with what was computed so far, coarse
    to fine. --out holds basin.png, .pdf, .nc, attractors.csv, outcomes.csv, orbits.csv and result.json.

    Parameters
    ----------
    amplitude
        Amplitude of the ground acceleration, 0.3g or 2.9 (m/s^2).
    frequency
        Frequency of the sine, 1.2Hz or 1.2.
    phase
        Phase of the sine at the start of a period, 90deg or 1.57 (rad).
    periods
        Most periods that a state is followed for.
    """
    body = block.block()
    pushed, shaken = quantities.acceleration(amplitude, "amplitude"), quantities.frequency(frequency, "frequency")
    motion = sine(pushed, shaken, cycles=1, phase=quantities.angle(phase, "phase"))
    lean, rate = max(side.alpha for side in body.sides), max(side.p * side.alpha for side in body.sides)
    with output.folder() as place:
        found = basins(
            body,
            motion,
            _axis(rotations, "rotations", lean, quantities.tilt),
            _axis(velocities, "velocities", rate, quantities.number),
            periods,
            model=model.model,
            folder=folder,
        )
        _deliver(found, "basin", folder=place, as_json=output.as_json)


def _axis(text: str | None, name: str, extent: float, quantity: quantities.Quantity) -> Floats:
    if text is None:
        return np.linspace(-extent, extent, _CELLS)
    axis = values(text, name, quantity)
    if np.any(np.diff(axis) <= 0.0):
        raise InvalidOption("{} must be increasing numbers", name)
    return axis


def _deliver(found: DatasetResult, stem: str, *, folder: Path | None, as_json: bool) -> None:
    """Write a result into a folder where there is one, and print it."""
    result = found.to_dict()
    if folder is not None:
        for table in found.TABLES:
            found.to_csv(folder / f"{table}.csv", table)
        found.to_netcdf(folder / f"{stem}.nc")
        write_results(folder, figures={stem: found.plot}, result=result)
    print_result(result, found.summary(), as_json=as_json, folder=folder)
