"""`rocking fragility`: probability of overturning against the intensity of the motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from rocking import checks
from rocking.analysis.fragility.fit import fragility as run
from rocking.analysis.hazard import HazardCurve
from rocking.cli import batch
from rocking.cli.options import (
    BLOCK,
    MEASURE,
    MODEL,
    OUTPUT,
    RECORDS,
    BlockOptions,
    MeasureOptions,
    MotionOptions,
    Names,
    OutputOptions,
    TreatmentOptions,
)
from rocking.errors import InvalidOption
from rocking.product import Polarity
from rocking.quantities import number


def fragility(
    *names: Names,
    limits: str = "overturning",
    polarity: Polarity = "+",
    confidence: float = 0.9,
    bootstrap: int = 0,
    seed: int = 0,
    taxonomy: str = "rocking-block",
    hazard: Path | None = None,
    site: int = 0,
    years: float = 50.0,
    measure: Annotated[MeasureOptions, MEASURE] = MeasureOptions(),
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[TreatmentOptions, MODEL] = TreatmentOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Fit the probability that a block overturns, or passes a rotation, against the intensity of the motions.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha). With
    --levels every motion is scaled to each (stripes); without, motions are taken as they are (a cloud). --out holds
    fragility.png, .pdf, .csv, outcomes.csv (record, intensity, peak, outcome), result.json, and
    fragility-continuous.xml and -discrete.xml (NRML 0.5).

    Parameters
    ----------
    limits
        Limit states, with commas between: overturning, or NAME=ROTATION over slenderness, as half=0.5.
    polarity
        Motions as they are (+), reversed (-), or both; a symmetric block does the same in both, which count once.
    confidence
        Probability of the intervals and bands.
    bootstrap
        Draws of the bootstrap for the bands; 0: the profile likelihood.
    seed
        Seed of its random numbers.
    taxonomy
        Identifier of the fragility function in NRML.
    hazard
        CSV file of the site's hazard curve (pga_g,annual_rate, or OpenQuake's): adds annual rates of exceeding the
        limit states, and risk.png and .pdf to --out.
    site
        Row of OpenQuake's file, from 0.
    years
        Time for which probabilities are given.
    """
    body = block.block()
    curve = None if hazard is None else HazardCurve.read(hazard, site=site, period=measure.period)
    checks.positive(years, "years", InvalidOption)
    with output.folder() as folder:
        fitted = run(
            body,
            list(motion.read_all(names).values()),
            **measure.chosen(),
            **model.chosen(),
            limits=_limits(limits),
            polarity=polarity,
            confidence=confidence,
            band="bootstrap" if bootstrap != 0 else "likelihood",
            samples=bootstrap or 1,
            seed=seed,
        )
        found, text = fitted.to_dict(), fitted.summary()
        risk = None if curve is None else fitted.annual_rate(curve)
        if risk is not None:
            found["risk"], text = risk.to_dict(years), f"{text}\n\n{risk.summary(years)}"
        if folder is not None:
            for form in ("continuous", "discrete"):
                fitted.to_nrml(folder / f"fragility-{form}.xml", taxonomy=taxonomy, format=form)
            fitted.to_csv(folder / "fragility.csv")
            fitted.outcomes_to_csv(folder / "outcomes.csv")
            figures = {"fragility": fitted.plot()} | ({} if risk is None else {"risk": risk.plot()})
            batch.write(folder, figures=figures, result=found)
        batch.show(found, text, as_json=output.as_json, folder=folder)


def _limits(text: str) -> dict[str, float]:
    limits = {}
    for part in text.split(","):
        name, given, value = part.strip().partition("=")
        if not given and name != "overturning":
            raise InvalidOption(f"--limits takes overturning or NAME=ROTATION over slenderness, not {part.strip()!r}")
        limits[name] = number(value, f"--limits {name}") if given else math.inf
    return limits
