"""`rocking simulate` and `rocking check`: one block under one record, or under many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rocking import quantities
from rocking.analysis.survey import folder_names, survey
from rocking.cli.body_options import BlockOptions, HeldOptions
from rocking.cli.options import BLOCK, MODEL, ModelOptions, TreatmentOptions, measured
from rocking.cli.output import OUTPUT, OutputOptions, print_result, subfolder, write_results
from rocking.cli.records import RECORDS, MotionOptions, Names
from rocking.errors import InvalidOption
from rocking.response import PRECISION, Response, steps_within
from rocking.response.contact import friction_coefficient
from rocking.rules import check as apply_rules
from rocking.simulation import simulate as run


@dataclass(frozen=True)
class _Start:
    """How a simulation starts and ends, and what is asked of it."""

    duration: Annotated[
        float | None,
        measured(
            "Time to stop at, s; by default when the block is at rest after the motion, or has overturned.",
            quantities.duration,
        ),
    ] = None
    initial_rotation: Annotated[
        str, Parameter(help="Rotation at the start, 2deg or 0.03 (rad).", allow_leading_hyphen=True)
    ] = "0"
    initial_velocity: Annotated[
        float, measured("Angular velocity at the start, 5deg/s or 0.09 (rad/s).", quantities.rate)
    ] = 0.0
    friction: Annotated[
        float | None, Parameter(help="Coefficient of friction: say whether the block would slide, and when first.")
    ] = None
    precision: Annotated[
        float,
        Parameter(help="Relative precision of the record: the outcome is also counted in 11 motions within it."),
    ] = PRECISION


def simulate(
    *names: Names,
    each: Annotated[bool, Parameter(negative="")] = False,
    energy: Annotated[bool, Parameter(negative="")] = False,
    start: Annotated[_Start, MODEL] = _Start(),
    block: Annotated[HeldOptions, BLOCK] = HeldOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[TreatmentOptions, MODEL] = TreatmentOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Simulate one block under a record and say what happens to it; under several, with one line for each.

    The block is a rectangle (--width, --height, or half of each; --offset where its centre of mass is off the middle),
    or given by its parameters (--p, --alpha) or by its pivots (--pivots, --height-of-mass, --gyration). It may be held
    back or pushed (--tendon, --spring, --damper, --thrust, --load), lean, or rock one way (--one-sided). Of one record
    --out holds response.png, .pdf, .csv, .nc, events.csv, impacts.csv and result.json; of several, summary.csv,
    summary.json and (if openpyxl is installed) summary.xlsx.

    Parameters
    ----------
    each
        Of several records: write the files of each into a folder of its own below --out, too.
    energy
        Draw the phase plane (phase-plane.png, .pdf) and the energy over time (energy.png, .pdf) into --out, too.
    """
    if start.friction is not None:
        friction_coefficient(start.friction)  # before the work
    steps_within(start.precision)
    shown: dict[str, Any] = {"friction": start.friction, "precision": start.precision}
    body = block.body()
    options: dict[str, Any] = {
        **model.chosen(),
        "duration": start.duration,
        "initial_rotation": quantities.tilt(start.initial_rotation, "initial_rotation"),
        "initial_velocity": start.initial_velocity,
    }
    for name in [name for name, chosen in (("each", each), ("energy", energy)) if chosen and output.out is None]:
        raise InvalidOption("{} writes files; name the folder for them with {}", name, "out")
    with output.folder() as folder:
        read = motion.read_all(names)
        if read.single:
            ((record, shaking),) = read.motions.items()
            response = run(body, shaking, **options)
            result, text = _result(response, record, shown, folder, energy), response.summary(**shown)
        else:
            if energy and not each:
                raise InvalidOption("{} draws single responses; of several records give {}, too", "energy", "each")
            found = replace(survey(body, read.motions, **shown, **options), skipped=read.skipped)
            if folder is not None:
                found.write(folder)
            if folder is not None and each:
                folders = folder_names(found.records)
                for name, record, response in zip(folders, found.records, found.responses, strict=True):
                    _result(response, record, shown, subfolder(folder, name), energy)
            result, text = found.to_dict(), found.summary()
        print_result(result, text, as_json=output.as_json)


def _result(
    response: Response, record: str, shown: dict[str, Any], folder: Path | None, energy: bool
) -> dict[str, Any]:
    """Return the result, and write it with figures, histories and events into a folder where there is one."""
    result = response.to_dict(**shown)
    # Its motion is named by the record that was read, too, as in tables of many.
    result |= {"motion": {"record": record, **result["motion"]}}
    if folder is not None:
        response.to_csv(folder / "response.csv")
        response.to_csv(folder / "events.csv", "events")
        response.to_csv(folder / "impacts.csv", "impacts")
        response.to_netcdf(folder / "response.nc")
        figures: dict[str, Callable[[], Any]] = {"response": response.plot}
        if energy:
            figures |= {"phase-plane": response.plot_phase_plane, "energy": response.plot_energy}
        write_results(folder, figures=figures, result=result)
    return result


def check(
    *names: Names,
    rules: str | None = None,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Compare rules of thumb with the simulated response of a block under records.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha). Numbers are
    demand over capacity: from 1 on the block overturns. --out holds check.csv and result.json.

    Parameters
    ----------
    rules
        Some of west,ishiyama,housner,asce_43_05,priestley; by default all.
    """
    body = block.block()
    chosen = None if rules is None else [name.strip() for name in rules.split(",")]
    with output.folder() as folder:
        read = motion.read_all(names)
        found = replace(apply_rules(body, read.motions, rules=chosen, model=model.model), skipped=read.skipped)
        result = found.to_dict()
        if folder is not None:
            found.to_csv(folder / "check.csv")
            write_results(folder, figures={}, result=result)
        print_result(result, found.summary(), as_json=output.as_json)
