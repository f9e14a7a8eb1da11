"""`rocking measures`: which intensity measure tells best when motions overturn a block."""

from __future__ import annotations

from typing import Annotated

from rocking.analysis.efficiency import compare_measures
from rocking.cli import batch
from rocking.cli.options import (
    BLOCK,
    MODEL,
    OUTPUT,
    RECORDS,
    BlockOptions,
    ModelOptions,
    Names,
    OutputOptions,
    RecordOptions,
)
from rocking.quantities import values


def measures(
    *names: Names,
    periods: str = "0.5,1,2",
    damping: float = 0.05,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[RecordOptions, RECORDS] = RecordOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Compare intensity measures: how widely motions scatter, by each, at which they first overturn a block.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha). Every
    motion is scaled up until it overturns the block. --out holds measures.png, .pdf, .nc, measures.csv,
    intensities.csv (at which each motion overturns) and result.json.

    Parameters
    ----------
    periods
        Periods of spectral accelerations, s: 0.5,1,2 or 0.2:4:10:log.
    damping
        Their fraction of critical damping.
    """
    body = block.block()
    with output.folder() as folder:
        found = compare_measures(
            body,
            list(motion.read_all(names).values()),
            periods=values(periods, "--periods"),
            damping=damping,
            model=model.model,
        )
        batch.deliver(found, "measures", folder=folder, as_json=output.as_json)
