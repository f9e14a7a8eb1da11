"""`rocking measures`: which intensity measure predicts best when motions overturn a block."""

from __future__ import annotations

from typing import Annotated

from rocking.analysis.efficiency import compare_measures
from rocking.cli import batch
from rocking.cli.options import (
    BLOCK,
    MODEL,
    OUTPUT,
    RECORDS,
    EnsembleOptions,
    ModelOptions,
    Names,
    OutputOptions,
    UnscaledOptions,
)
from rocking.quantities import values


def measures(
    *names: Names,
    periods: str = "0.5,1,2",
    damping: float = 0.05,
    block: Annotated[EnsembleOptions, BLOCK] = EnsembleOptions(),
    motion: Annotated[UnscaledOptions, RECORDS] = UnscaledOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Compare intensity measures: how widely motions scatter, by each, at which they first overturn a block.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha), or the
    ensemble of a calibration stands for it (--ensemble). Every motion is scaled up until it overturns the block. --out
    holds measures.png, .pdf, .nc, measures.csv, intensities.csv (at which each motion overturns) and result.json.

    Parameters
    ----------
    periods
        Periods of spectral accelerations, s: 0.5,1,2 or 0.2:4:10:log.
    damping
        Their fraction of critical damping.
    """
    bodies = block.blocks(model)
    with output.folder() as folder:
        read = motion.read_all(names)
        found = compare_measures(
            motions=[*read.motions.values()],
            periods=values(periods, "--periods"),
            damping=damping,
            **bodies,
        )
        batch.deliver(found, "measures", read, folder=folder, as_json=output.as_json)
