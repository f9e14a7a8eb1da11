"""`rocking spectrum`: peak rotation against the size of the block."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from rocking.analysis.spectrum import Abscissa, rocking_spectrum
from rocking.block import Blocks
from rocking.cli import batch
from rocking.cli.options import (
    MODEL,
    OUTPUT,
    RECORDS,
    MotionOptions,
    Names,
    OutputOptions,
    TreatmentOptions,
    ensemble_of,
)
from rocking.errors import InvalidOption
from rocking.quantities import tilt, values


def spectrum(
    *names: Names,
    alpha: str | None = None,
    p: str | None = None,
    size: str | None = None,
    restitution: str | None = None,
    ensemble: Path | None = None,
    fractiles: str = "0.16,0.5,0.84",
    against: Abscissa = "p",
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[TreatmentOptions, MODEL] = TreatmentOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Compute rocking spectra: peak rotation against the frequency parameter or the size of the block.

    Lists of numbers are 1,2,5 or START:STOP:COUNT, with :log at the end for equal ratios. In the results, peaks are
    null where the block overturns. --out holds spectrum.png, .pdf, .nc, fractiles.csv, peaks.csv (of every motion) and
    result.json.

    Parameters
    ----------
    alpha
        Slendernesses, as 10deg,15deg or 0.1:0.3:5 (rad); or give --ensemble.
    p
        Frequency parameters, rad/s; or give --size.
    size
        Half diagonals of rectangular blocks, m; or give --p.
    restitution
        Restitutions; Housner's by default.
    ensemble
        The ensemble.csv that rocking calibrate writes, in place of slendernesses and restitutions: its blocks are made
        larger or smaller together, so that their median p is each of --p (by default half to twice their own).
    fractiles
        Shares of the motions that stay below the fractile curves.
    against
        Abscissa of the figure.
    """
    if alpha is None and ensemble is None:
        raise InvalidOption("a spectrum needs {}, or the {} of a calibration", "alpha", "ensemble")
    if ensemble is not None and (alpha is not None or restitution is not None):
        raise InvalidOption(
            "the blocks of {} have slendernesses and restitutions of their own: leave {} and {} out",
            "ensemble",
            "alpha",
            "restitution",
        )
    with output.folder() as folder:
        axes: dict[str, Any] = {
            "p": None if p is None else values(p, "--p"),
            "size": None if size is None else values(size, "--size"),
        }
        how = model.chosen()
        if alpha is not None:
            restitutions = None if restitution is None else values(restitution, "--restitution")
            blocks = Blocks.grid(alpha=values(alpha, "--alpha", tilt), restitution=restitutions, **axes)
            axes = {}
        elif ensemble is not None:
            given = ensemble_of(ensemble, model)
            blocks = given.pop("blocks")
            how |= given
        shares = values(fractiles, "--fractiles").tolist()
        read = motion.read_all(names)
        found = rocking_spectrum(blocks, [*read.motions.values()], **axes, fractiles=shares, **how)
        batch.deliver(found, "spectrum", read, folder=folder, as_json=output.as_json, against=against)
