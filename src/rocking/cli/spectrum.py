"""`rocking spectrum`: peak rotation against the size of the block."""

from __future__ import annotations

from typing import Annotated, Any

from rocking.analysis.spectrum import Abscissa, rocking_spectrum
from rocking.cli import batch
from rocking.cli.options import MODEL, OUTPUT, RECORDS, MotionOptions, Names, OutputOptions, TreatmentOptions
from rocking.quantities import tilt, values


def spectrum(
    *names: Names,
    alpha: str,
    p: str | None = None,
    size: str | None = None,
    restitution: str | None = None,
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
        Slendernesses, as 10deg,15deg or 0.1:0.3:5 (rad).
    p
        Frequency parameters, rad/s; or give --size.
    size
        Half diagonals of rectangular blocks, m; or give --p.
    restitution
        Restitutions; Housner's by default.
    fractiles
        Shares of the motions that stay below the fractile curves.
    against
        Abscissa of the figure.
    """
    with output.folder() as folder:
        axes: dict[str, Any] = {
            "alpha": values(alpha, "--alpha", tilt),
            "p": None if p is None else values(p, "--p"),
            "size": None if size is None else values(size, "--size"),
            "restitution": None if restitution is None else values(restitution, "--restitution"),
        }
        shares = values(fractiles, "--fractiles").tolist()
        motions = list(motion.read_all(names).values())
        found = rocking_spectrum(motions, **axes, fractiles=shares, **model.chosen())
        batch.deliver(found, "spectrum", folder=folder, as_json=output.as_json, against=against)
