"""`rocking check`: rules of thumb beside the exact answer."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from rocking.analysis.rules.check import check as run
from rocking.cli import batch
from rocking.cli.options import (
    BLOCK,
    MODEL,
    OUTPUT,
    RECORDS,
    BlockOptions,
    ModelOptions,
    MotionOptions,
    Names,
    OutputOptions,
)


def check(
    *names: Names,
    rules: str | None = None,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Say of each record what rules of thumb make of a block, and what it really does.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha). Numbers are
    demand over capacity: from 1 on the block overturns. --out holds check.csv and result.json.

    Parameters
    ----------
    rules
        Some of west,ishiyama,housner,asce_43_05,priestley; by default all.
    """
    body = block.block()
    chosen = None if rules is None else [name.strip() for name in rules.split(",")]
    with output.folder() as folder:
        read = motion.read_all(names)
        found = replace(run(body, read.motions, rules=chosen, model=model.model), skipped=read.skipped)
        result = found.to_dict()
        if folder is not None:
            found.to_csv(folder / "check.csv")
            batch.write(folder, figures={}, result=result)
        batch.show(result, found.summary(), as_json=output.as_json, folder=folder)
