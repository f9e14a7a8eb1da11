"""`rocking spectrum`: peak rotation against the size of the block."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rocking.analysis.spectrum import Abscissa, rocking_spectrum
from rocking.cli import batch, options
from rocking.treatment import treatment
from rocking.treatment.base import Model

if TYPE_CHECKING:
    pass


def spectrum(
    *motions: str,
    alpha: str,
    p: str | None = None,
    size: str | None = None,
    restitution: str | None = None,
    fractiles: str = "0.16,0.5,0.84",
    model: Model = "nonlinear",
    chattering: str = "certified",
    against: Abscissa = "p",
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
    found = rocking_spectrum(
        batch.motions_from(motions, channel=channel, dt=dt, units=units, scale=scale),
        alpha=batch.values(alpha, "--alpha"),
        p=None if p is None else batch.values(p, "--p"),
        size=None if size is None else batch.values(size, "--size"),
        restitution=None if restitution is None else batch.values(restitution, "--restitution"),
        fractiles=batch.values(fractiles, "--fractiles").tolist(),
        model=model,
        chattering=treatment(chattering),
    )
    batch.deliver(found, "spectrum", folder=folder, as_json=as_json, against=against)
