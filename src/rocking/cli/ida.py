"""`rocking ida`: motions scaled up until the block overturns, and on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from rocking.analysis.incremental import dynamic_figure, incremental_dynamic_analysis
from rocking.analysis.intensity import MeasureName
from rocking.cli import batch, options
from rocking.treatment.base import Model

if TYPE_CHECKING:
    import xarray as xr


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
        Levels in SI units, as 1,2,5 or START:STOP:COUNT; by default in steps of 5 % to twice the first that overturns.
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
    dataset = incremental_dynamic_analysis(
        block,
        batch.motions_from(motions, channel=channel, dt=dt, units=units),
        measure=measure,
        period=period,
        damping=damping,
        levels=None if levels is None else batch.values(levels, "--levels"),
        model=model,
        tolerance=tolerance,
    )
    result = _result(dataset, block.description)
    if folder is not None:
        title = f"{block.description}, {model} model"
        batch.write(folder, "ida", figure=dynamic_figure(dataset, title=title), result=result, dataset=dataset)
    batch.show(result, _text(dataset, block.description), as_json=as_json, folder=folder)


def _bands(dataset: xr.Dataset, motion: int) -> list[tuple[float, float]]:
    mine = dataset.band_motion.values == motion
    return list(zip(dataset.band_start.values[mine].tolist(), dataset.band_end.values[mine].tolist(), strict=True))


def _result(dataset: xr.Dataset, block: str) -> dict[str, Any]:
    chosen = dataset.isel(block=0)
    return {
        "block": block,
        "model": dataset.model,
        "measure": dataset.level.long_name,
        "level": dataset.level.values,
        "motions": [
            {
                "name": str(dataset.motion.values[m]),
                "overturning_level": float(chosen.overturning_level[m]),
                "overturns": [{"from": low, "to": high} for low, high in _bands(dataset, m)],
                "peak_over_alpha": chosen.peak_over_alpha.transpose("motion", "level").values[m],
            }
            for m in range(dataset.sizes["motion"])
        ],
    }


def _text(dataset: xr.Dataset, block: str) -> str:
    rows = []
    for m in range(dataset.sizes["motion"]):
        bands = "; ".join(_band(low, high) for low, high in _bands(dataset, m)) or "never"
        rows.append([str(dataset.motion.values[m]), bands])
    shown = "\n".join(f"{name:<28}{text}" for name, text in rows)
    return f"{block}, {dataset.model} model; {dataset.level.long_name} that overturns it\n\n{shown}"


def _band(low: float, high: float) -> str:
    if low != low:
        return f"up to {high:.5g}" if high == high else "at every level"
    return f"{low:.5g} to {high:.5g}" if high == high else f"{low:.5g} and more"
