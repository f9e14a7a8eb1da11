"""`rocking fragility`: probability of overturning against the intensity of the motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from rocking.analysis.fragility.fit import fragility as run
from rocking.analysis.intensity import MeasureName
from rocking.cli import batch, options
from rocking.ensemble import Polarity
from rocking.errors import InvalidOption
from rocking.treatment import treatment
from rocking.treatment.base import Model


def fragility(
    *motions: str,
    half_width: float | None = None,
    half_height: float | None = None,
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    measure: MeasureName = "pga",
    period: float | None = None,
    damping: float = 0.05,
    levels: str | None = None,
    limits: str = "overturning",
    polarity: Polarity = "+",
    model: Model = "nonlinear",
    chattering: str = "certified",
    confidence: float = 0.9,
    bootstrap: int = 0,
    seed: int = 0,
    taxonomy: str = "rocking-block",
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    scale: float = 1.0,
    out: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Fit the probability that a block overturns, or passes a rotation, against the intensity of the motions.

    The block is a rectangle (--half-width, --half-height) or given by its parameters (--p, --alpha).

    Parameters
    ----------
    motions
        Record files, or names of shipped records (see `rocking records`).
    half_width
        Half the width of a rectangular block, m.
    half_height
        Half its height, m.
    p
        Frequency parameter, rad/s; two numbers with a comma between are side + and side -.
    alpha
        Slenderness, rad; one number or two.
    restitution
        Factor on the angular speed at an impact, in (0, 1]; one number or two; Housner's by default.
    measure
        Intensity: PGA, PGV, spectral acceleration, or in the block's own units PGA/(g tan alpha), p PGV/(g tan alpha).
    period
        Period of the spectral acceleration, s.
    damping
        Its fraction of critical damping.
    levels
        Stripes: every motion scaled to these levels, in SI units, as 1,2,5 or START:STOP:COUNT. Without: a cloud.
    limits
        Limit states, with commas between: overturning, or NAME=ROTATION over slenderness, as half=0.5.
    polarity
        Motions as they are (+), reversed (-), or both.
    model
        Equation of motion.
    chattering
        certified, velocity or interval; certified=1e-9 (s), velocity=5e-10 (over p alpha), interval=1e-9 (s).
    confidence
        Probability of the intervals and bands.
    bootstrap
        Draws of the bootstrap for the bands; 0: the profile likelihood.
    seed
        Seed of its random numbers.
    taxonomy
        Identifier of the fragility function in NRML.
    channel
        Channel of the records, by number or name, where there are several.
    dt
        Sampling step, s, of text files that do not give times.
    units
        Units of text files: g, m/s2, cm/s2, mm/s2.
    scale
        Factor on the motions.
    out
        Folder for fragility.png, .pdf, .csv, outcomes.csv (record, intensity, peak, outcome), result.json, and
        fragility-continuous.xml and -discrete.xml (NRML 0.5).
    as_json
        Print the result as JSON.
    """
    block = options.block_from(half_width, half_height, p, alpha, restitution)
    folder = None if out is None else options.output_folder(out)
    fitted = run(
        block,
        batch.motions_from(motions, channel=channel, dt=dt, units=units, scale=scale),
        measure=measure,
        period=period,
        damping=damping,
        levels=None if levels is None else batch.values(levels, "--levels"),
        limits=_limits(limits),
        polarity=polarity,
        model=model,
        chattering=treatment(chattering),
        confidence=confidence,
        band="bootstrap" if bootstrap != 0 else "likelihood",
        samples=bootstrap or 1,
        seed=seed,
    )
    if folder is not None:
        for form in ("continuous", "discrete"):
            fitted.to_nrml(folder / f"fragility-{form}.xml", taxonomy=taxonomy, format=form)
        fitted.to_csv(folder / "fragility.csv")
        fitted.outcomes_to_csv(folder / "outcomes.csv")
        batch.write(folder, "fragility", figure=fitted.plot(), result=fitted.to_dict())
    batch.show(fitted.to_dict(), fitted.summary(), as_json=as_json, folder=folder)


def _limits(text: str) -> dict[str, float]:
    limits = {}
    for part in text.split(","):
        name, given, value = part.strip().partition("=")
        if not given and name != "overturning":
            raise InvalidOption(f"--limits takes overturning or NAME=ROTATION over slenderness, not {part.strip()!r}")
        limit = options.numbers(value, f"--limits {name}") if given else math.inf
        assert isinstance(limit, float)
        limits[name] = limit
    return limits
