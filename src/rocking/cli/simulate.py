"""`rocking simulate`: one block under one record, or under many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.analysis.survey import Survey, survey
from rocking.cli import batch
from rocking.cli.options import (
    BLOCK,
    MODEL,
    OUTPUT,
    RECORDS,
    BlockOptions,
    MotionOptions,
    Names,
    OutputOptions,
    TreatmentOptions,
)
from rocking.errors import InvalidOption
from rocking.quantities import tilt
from rocking.response import Response
from rocking.response.forces import friction_coefficient
from rocking.simulation import simulate as run


@dataclass(frozen=True)
class _Start:
    """How a simulation starts and ends, and what is asked of it."""

    duration: Annotated[
        float | None,
        Parameter(help="Time to stop at, s; by default when the block is at rest after the motion, or has overturned."),
    ] = None
    initial_rotation: Annotated[
        str, Parameter(help="Rotation at the start, 2deg or 0.03 (rad).", allow_leading_hyphen=True)
    ] = "0"
    initial_velocity: Annotated[float, Parameter(help="Angular velocity at the start, rad/s.")] = 0.0
    friction: Annotated[
        float | None, Parameter(help="Coefficient of friction: say whether the block would slide, and when first.")
    ] = None


def simulate(
    *names: Names,
    each: Annotated[bool, Parameter(negative="")] = False,
    start: Annotated[_Start, MODEL] = _Start(),
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[TreatmentOptions, MODEL] = TreatmentOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Simulate one block under a record and say what happens to it; under several, with one line for each.

    The block is a rectangle (--width, --height, or half of each; --offset where its centre of mass is off the middle),
    or given by its parameters (--p, --alpha) or by its pivots (--pivots, --height-of-mass, --gyration). Of one record
    --out holds response.png, .pdf, .csv, .nc, events.csv, impacts.csv and result.json; of several, summary.csv,
    summary.json and (if openpyxl is installed) summary.xlsx.

    Parameters
    ----------
    each
        Of several records: write the files of each into a folder of its own below --out, too.
    """
    if start.friction is not None:
        friction_coefficient(start.friction)  # before the work
    body = block.block()
    options: dict[str, Any] = {
        **model.chosen(),
        "duration": start.duration,
        "initial_rotation": tilt(start.initial_rotation, "--initial-rotation"),
        "initial_velocity": start.initial_velocity,
    }
    if each and output.out is None:
        raise InvalidOption("--each writes files; name the folder for them with --out")
    with output.folder() as folder:
        motions, skipped = motion.read_all(names)
        if batch.is_single((*names, *motion.pulse), motions):
            ((record, shaking),) = motions.items()
            _deliver(run(body, shaking, **options), record, folder, friction=start.friction, as_json=output.as_json)
        else:
            found = survey(body, motions, friction=start.friction, **options)
            _deliver_all(replace(found, skipped=skipped), folder, each=each, as_json=output.as_json)


def _deliver(response: Response, record: str, folder: Path | None, *, friction: float | None, as_json: bool) -> None:
    result = _result(response, record, friction)
    if folder is not None:
        _write(response, result, folder)
    batch.show(result, response.summary(friction), as_json=as_json, folder=folder)


def _deliver_all(found: Survey, folder: Path | None, *, each: bool, as_json: bool) -> None:
    if folder is not None:
        found.write(folder)
    if folder is not None and each:
        for name, record, response in zip(found.folders(), found.records, found.responses, strict=True):
            (folder / name).mkdir(exist_ok=True)
            _write(response, _result(response, record, found.friction), folder / name)
    batch.show(found.to_dict(), found.summary(), as_json=as_json, folder=folder)


def _result(response: Response, record: str, friction: float | None) -> dict[str, Any]:
    """Return the result, whose motion is named by the record that was read, too, as in tables of many."""
    result = response.to_dict(friction)
    return result | {"motion": {"record": record, **result["motion"]}}


def _write(response: Response, result: dict[str, Any], folder: Path) -> None:
    """Write figure, histories, events and result into a folder."""
    response.to_csv(folder / "response.csv")
    response.to_csv(folder / "events.csv", "events")
    response.to_csv(folder / "impacts.csv", "impacts")
    response.to_netcdf(folder / "response.nc")
    batch.write(folder, figures={"response": response.plot()}, result=result)
