"""`rocking simulate`: one block under one record."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.cli import options
from rocking.errors import OutputError
from rocking.motion.named import named_motion
from rocking.response import Response
from rocking.simulation import simulate as run
from rocking.tables import to_json, write_text
from rocking.treatment import treatment
from rocking.treatment.base import Model


def simulate(
    motion: str,
    *,
    half_width: float | None = None,
    half_height: float | None = None,
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    model: Model = "nonlinear",
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    scale: float = 1.0,
    chattering: str = "certified",
    duration: float | None = None,
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
    out: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Simulate one block under one record and say what happens to it.

    The block is a rectangle (--half-width, --half-height) or given by its parameters (--p, --alpha).

    Parameters
    ----------
    motion
        Record file (its format is told from its content), or the name of a shipped record (see `rocking records`).
    half_width
        Half the width of a rectangular block, m.
    half_height
        Half its height, m.
    p
        Frequency parameter, rad/s; two numbers with a comma between are side + and side -.
    alpha
        Slenderness, rad; one number or two.
    restitution
        Factor on the angular speed at an impact, in (0, 1]; one number or two; Housner's by default.
    model
        Equation of motion.
    channel
        Channel of the record, by number or name, where there are several.
    dt
        Sampling step, s, of a text file that does not give times.
    units
        Units of a text file: g, m/s2, cm/s2, mm/s2.
    scale
        Factor on the motion.
    chattering
        certified, velocity, interval or time; certified=1e-9 (s), velocity=5e-10 (over p alpha), interval=1e-9 (s).
    duration
        Time to stop at, s; by default when the block is at rest after the motion, or has overturned.
    initial_rotation
        Rotation at the start, rad.
    initial_velocity
        Angular velocity at the start, rad/s.
    out
        Folder for response.png, .pdf, .csv, .nc, events.csv and result.json.
    as_json
        Print the result as JSON.
    """
    block = options.block_from(half_width, half_height, p, alpha, restitution)
    how = treatment(chattering)
    folder = None if out is None else options.output_folder(out)
    shaking = named_motion(motion, channel=channel, dt=dt, units=units, scale=scale)
    response = run(
        block,
        shaking,
        model=model,
        chattering=how,
        duration=duration,
        initial_rotation=initial_rotation,
        initial_velocity=initial_velocity,
    )
    result = response.to_dict()
    if folder is not None:
        write(response, result, folder)
    if as_json:
        print(to_json(result))
    else:
        print(response.summary())
        if folder is not None:
            print(f"\nwritten to {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


def write(response: Response, result: dict[str, Any], folder: Path) -> None:
    """Write figure, histories, events and result into a folder."""
    figure = response.plot()
    try:
        figure.savefig(folder / "response.png", dpi=160)
        figure.savefig(folder / "response.pdf")
    except OSError as error:
        raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error
    write_text(folder / "result.json", f"{to_json(result)}\n")
    response.to_csv(folder / "response.csv")
    response.to_csv(folder / "events.csv", "events")
    response.to_netcdf(folder / "response.nc")
