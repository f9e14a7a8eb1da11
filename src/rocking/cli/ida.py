"""`rocking ida`: motions scaled up until the block overturns, and on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.analysis.intensity import MeasureName
from rocking.cli import batch, options
from rocking.treatment.base import Model

if TYPE_CHECKING:
    pass


def ida(
    *motions: str,
    half_width: float | None = None,
    half_height: float | None = None,
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    measure: MeasureName = "pga",
    period: float | None = None,
    damping: float = 0.05,
    levels: str | None = None,
    model: Model = "nonlinear",
    tolerance: float = 1e-6,
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    out: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Scale motions up until the block overturns and beyond (incremental dynamic analysis).

    The block is a rectangle (--half-width, --half-height) or given by its parameters (--p, --alpha).

    Parameters
    ----------
    motions
        Record files, or names of shipped records (see `rocking records`).
    half_width
        Half the width of a rectangular block, m.
    half_height
        Half its height, m.
    p
        Frequency parameter, rad/s; two numbers with a comma between are side + and side -.
    alpha
        Slenderness, rad; one number or two.
    restitution
        Factor on the angular speed at an impact, in (0, 1); one number or two; Housner's by default.
    measure
        Intensity: PGA, PGV, spectral acceleration, or in the block's own units PGA/(g tan alpha), p PGV/(g tan alpha).
    period
        Period of the spectral acceleration, s.
    damping
        Its fraction of critical damping.
    levels
        Levels in SI units, as 1,2,5 or START:STOP:COUNT; by default in steps of 5 % to three times that by
        which every motion has overturned the block.
    model
        Equation of motion.
    tolerance
        Width, relative to the level, that the ends of bands are refined to.
    channel
        Channel of the records, by number or name, where there are several.
    dt
        Sampling step, s, of text files that do not give times.
    units
        Units of text files: g, m/s2, cm/s2, mm/s2.
    out
        Folder for ida.png, .pdf, .nc and result.json.
    as_json
        Print the result as JSON.
    """
    block = options.block_from(half_width, half_height, p, alpha, restitution)
    folder = None if out is None else options.output_folder(out)
    found = incremental_dynamic_analysis(
        block,
        batch.motions_from(motions, channel=channel, dt=dt, units=units),
        measure=measure,
        period=period,
        damping=damping,
        levels=None if levels is None else batch.values(levels, "--levels"),
        model=model,
        tolerance=tolerance,
    )
    batch.deliver(found, "ida", folder=folder, as_json=as_json)
