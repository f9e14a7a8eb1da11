"""`rocking ida`: motions scaled up until the block overturns, and on."""

from __future__ import annotations

from typing import Annotated

from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.cli import batch
from rocking.cli.options import (
    BLOCK,
    MEASURE,
    MODEL,
    OUTPUT,
    RECORDS,
    BlockOptions,
    MeasureOptions,
    ModelOptions,
    Names,
    OutputOptions,
    UnscaledOptions,
)


def ida(
    *names: Names,
    tolerance: float = 1e-6,
    measure: Annotated[MeasureOptions, MEASURE] = MeasureOptions(),
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[UnscaledOptions, RECORDS] = UnscaledOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Scale motions up until the block overturns and beyond (incremental dynamic analysis).

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha). Without
    --levels, they go in steps of 5 % to three times that by which every motion has overturned the block. Bands and
    gaps between two levels are not seen; close ones see more of them. --out holds ida.png, .pdf, .nc, levels.csv,
    bands.csv (of levels that overturn) and result.json.

    Parameters
    ----------
    tolerance
        Width, relative to the level, that the ends of bands are refined to.
    """
    body = block.block()
    with output.folder() as folder:
        read = motion.read_all(names)
        motions = [*read.motions.values()]
        found = incremental_dynamic_analysis(body, motions, **measure.chosen(), model=model.model, tolerance=tolerance)
        batch.deliver(found, "ida", read, folder=folder, as_json=output.as_json)
