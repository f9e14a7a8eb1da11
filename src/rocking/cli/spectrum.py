"""`rocking spectrum`: peak rotation against the size of the block."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from rocking.analysis.spectrum import rocking_spectrum, spectrum_figure
from rocking.cli import batch, options
from rocking.treatment import treatment
from rocking.treatment.base import Model

if TYPE_CHECKING:
    import xarray as xr


def spectrum(
    *motions: str,
    alpha: str,
    p: str | None = None,
    size: str | None = None,
    restitution: str | None = None,
    fractiles: str = "0.16,0.5,0.84",
    model: Model = "nonlinear",
    chattering: str = "certified",
    against: Literal["p", "period", "size"] = "p",
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    scale: float = 1.0,
    out: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Compute rocking spectra: peak rotation against the frequency parameter or the size of the block.

    Lists of numbers are 1,2,5 or START:STOP:COUNT, with :log at the end for equal ratios.

    Parameters
    ----------
    motions
        Record files, or names of shipped records (see `rocking records`).
    alpha
        Slendernesses, rad.
    p
        Frequency parameters, rad/s; or give --size.
    size
        Half diagonals of rectangular blocks, m; or give --p.
    restitution
        Restitutions; Housner's by default.
    fractiles
        Shares of the motions that stay below the fractile curves.
    model
        Equation of motion.
    chattering
        certified, velocity or interval; certified=1e-9 (s), velocity=5e-10 (over p alpha), interval=1e-9 (s).
    against
        Abscissa of the figure.
    channel
        Channel of the records, by number or name, where there are several.
    dt
        Sampling step, s, of text files that do not give times.
    units
        Units of text files: g, m/s2, cm/s2, mm/s2.
    scale
        Factor on the motions.
    out
        Folder for spectrum.png, .pdf, .nc and result.json.
    as_json
        Print the result as JSON; peaks are null where the block overturns.
    """
    folder = None if out is None else options.output_folder(out)
    dataset = rocking_spectrum(
        batch.motions_from(motions, channel=channel, dt=dt, units=units, scale=scale),
        alpha=batch.values(alpha, "--alpha"),
        p=None if p is None else batch.values(p, "--p"),
        size=None if size is None else batch.values(size, "--size"),
        restitution=None if restitution is None else batch.values(restitution, "--restitution"),
        fractiles=batch.values(fractiles, "--fractiles").tolist(),
        model=model,
        chattering=treatment(chattering),
    )
    result = _result(dataset)
    if folder is not None:
        batch.write(
            folder, "spectrum", figure=spectrum_figure(dataset, against=against), result=result, dataset=dataset
        )
    batch.show(result, _text(dataset), as_json=as_json, folder=folder)


def _result(dataset: xr.Dataset) -> dict[str, Any]:
    axes = [str(name) for name in dataset.overturned_share.dims]
    return {
        "motions": dataset.motion.values,
        "model": dataset.model,
        "chattering_treatment": dataset.chattering,
        "p_rad_per_s": dataset.p.values,
        "period_s": dataset.period.values,
        "size_m": dataset["size"].values,
        "alpha_rad": dataset.alpha.values,
        **({"restitution": dataset.restitution.values} if "restitution" in dataset.dims else {}),
        "fractile": dataset.fractile.values,
        "axes": axes,
        "fractile_over_alpha": dataset.fractile_over_alpha.transpose("fractile", *axes).values,
        "overturned_share": dataset.overturned_share.values,
    }


def _text(dataset: xr.Dataset) -> str:
    """Fractiles of peak rotation over slenderness at some sizes, for each slenderness and restitution."""
    names = [name for name in ("alpha", "restitution") if name in dataset.dims]
    stacked = dataset.stack(curve=names)
    header = ["p (rad/s)", "R (m)", *(f"{100 * share:g} %" for share in dataset.fractile.values), "overturned"]
    blocks = [f"peak rotation over slenderness, {dataset.sizes['motion']} motion(s), {dataset.model} model"]
    for k in range(stacked.sizes["curve"]):
        one = stacked.isel(curve=k)
        rows = [
            [
                float(one.p[j]),
                float(one["size"][j]),
                *one.fractile_over_alpha.transpose("p", "fractile").values[j],
                f"{100 * float(one.overturned_share[j]):.0f} %",
            ]
            for j in batch.some(dataset.sizes["p"])
        ]
        title = ", ".join(f"{name} = {float(one[name]):g}" for name in names)
        blocks.append(f"{title}\n{batch.table(header, rows)}")
    return "\n\n".join(blocks)
