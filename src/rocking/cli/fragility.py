"""`rocking fragility`: probability of overturning against the intensity of the motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rocking import checks
from rocking.analysis.fragility.curve import Band
from rocking.analysis.fragility.fit import fit_fragility
from rocking.analysis.fragility.fit import fragility as run
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.tables import read_observed
from rocking.cli.options import BLOCK, MEASURE, MODEL, EnsembleOptions, MeasureOptions, TreatmentOptions
from rocking.cli.output import OUTPUT, OutputOptions, print_result, with_records, write_results
from rocking.cli.records import RECORDS, MotionOptions, Names
from rocking.ensemble import Polarity
from rocking.errors import InvalidOption
from rocking.quantities import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def fragility(
    *names: Names,
    outcomes: Path | None = None,
    limits: str = "overturning",
    polarity: Annotated[Polarity, Parameter(allow_leading_hyphen=True)] = "+",
    confidence: float = 0.9,
    bootstrap: int = 0,
    seed: int = 0,
    taxonomy: str = "rocking-block",
    hazard: Path | None = None,
    site: int = 0,
    years: float = 50.0,
    standing: float | None = None,
    measure: Annotated[MeasureOptions, MEASURE] = MeasureOptions(),
    block: Annotated[EnsembleOptions, BLOCK] = EnsembleOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[TreatmentOptions, MODEL] = TreatmentOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Fit the probability that a block overturns, or passes a rotation, against the intensity of the motions.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha), or the
    ensemble of a calibration stands for it (--ensemble). With --levels every motion is scaled to each (stripes);
    without, motions are taken as they are (a cloud). Or outcomes that were observed are fitted (--outcomes), without
    records and block. --out holds fragility.png, .pdf, .csv, outcomes.csv (record, intensity, peak, outcome),
    result.json, and fragility-continuous.xml and -discrete.xml (NRML 0.5).

    Parameters
    ----------
    outcomes
        CSV table of what was observed: a column overturned (1 or 0; with a column trials, how many of them), and the
        intensity (pga_g, pgv_m_s, sa_g with --period) or the motion (a record file, or a shipped record, of which the
        --measure is taken); and where wanted group: outcomes that belong together.
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
    standing
        Years for which the block has stood: adds how strongly and how often it was not shaken, and with --hazard how
        probable that is; survival.png and .pdf to --out.
    """
    if outcomes is not None:
        _refuse_beside_outcomes(names, block, motion, measure, limits, polarity)
    bodies = {} if outcomes is not None else block.blocks(model)
    curve = None if hazard is None else HazardCurve.read(hazard, site=site, period=measure.period)
    checks.positive(years, "years", InvalidOption)
    if standing is not None:
        checks.positive(standing, "standing", InvalidOption)
    band = Band("bootstrap" if bootstrap != 0 else "likelihood", confidence, samples=bootstrap or 1, seed=seed)
    with output.folder() as folder:
        read = None
        if outcomes is not None:
            observed = read_observed(outcomes, measure.wanted, channel=motion.channel, dt=motion.dt, units=motion.units)
            fitted = fit_fragility(**observed, band=band)
        else:
            read = motion.read_all(names)
            fitted = run(
                motions=list(read.motions.values()),
                **measure.chosen(),
                **model.chosen() | bodies,
                limits=_limits(limits),
                polarity=polarity,
                band=band,
            )
        found, text = fitted.to_dict() | ({} if read is None else read.to_dict()), [fitted.summary()]
        figures: dict[str, Callable[[], Figure]] = {"fragility": fitted.plot}
        if curve is not None:
            risk = fitted.annual_rate(curve)
            found["risk"], figures["risk"] = risk.to_dict(years), risk.plot
            text.append(risk.summary(years))
        if standing is not None:
            survived = fitted.survival(standing, curve, limit_state=fitted.curves[-1].limit_state)
            found["survival"], figures["survival"] = survived.to_dict(), survived.plot
            text.append(survived.summary())
        if folder is not None:
            for form in ("continuous", "discrete"):
                fitted.to_nrml(folder / f"fragility-{form}.xml", taxonomy=taxonomy, format=form)
            fitted.to_csv(folder / "fragility.csv")
            if fitted.outcomes is not None:
                together = fitted if read is None else with_records(fitted, read)
                together.to_csv(folder / "outcomes.csv", "outcomes")
            write_results(folder, figures={name: draw() for name, draw in figures.items()}, result=found)
        print_result(found, "\n\n".join(text), as_json=output.as_json, folder=folder)


def _refuse_beside_outcomes(
    names: Sequence[str],
    block: EnsembleOptions,
    motion: MotionOptions,
    measure: MeasureOptions,
    limits: str,
    polarity: Polarity,
) -> None:
    """Refuse options that do not go with observed outcomes."""
    given = {
        "records": names,
        "pulse": motion.pulse,
        "levels": measure.levels,
        "ensemble": block.ensemble,
        "limits": limits if limits != "overturning" else None,
        "polarity": polarity if polarity != "+" else None,
        **block.given(),
    }
    found = [option for option, value in given.items() if value]
    if found:
        sentence = "{} are observed, of a block and under motions of their own: leave {} out"
        raise InvalidOption(sentence, "outcomes", found[0])


def _limits(text: str) -> dict[str, float]:
    limits = {}
    for part in text.split(","):
        name, given, value = part.strip().partition("=")
        if not given and name != "overturning":
            raise InvalidOption(
                f"{{}} takes overturning or NAME=ROTATION over slenderness, not {part.strip()!r}", "limits"
            )
        limits[name] = number(value, "limits") if given else math.inf
    return limits
