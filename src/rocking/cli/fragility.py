"""`rocking fragility`: curves fitted to simulated or observed outcomes, and the resulting rates at a site."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from rocking.analysis.curve import check_nrml_names
from rocking.analysis.fragility import Fragility, fit_fragility
from rocking.analysis.fragility import fragility as fit_simulated
from rocking.analysis.risk import check_measure
from rocking.calibration.tables import read_observed
from rocking.cli.options import (
    BLOCK_OPTIONS,
    INTENSITY_OPTIONS,
    MODEL_OPTIONS,
    RECORD_OPTIONS,
    RISK_OPTIONS,
    EnsembleOptions,
    MeasureOptions,
    MotionOptions,
    Names,
    RiskOptions,
    SlipSchemeOptions,
    parse_limit_states,
)
from rocking.cli.output import OUTPUT_OPTIONS, OutputOptions, print_result, skip_on_error, write_results
from rocking.core import checks
from rocking.core.progress import note
from rocking.core.tables import write_csv
from rocking.errors import FitError, OptionError
from rocking.simulation.ensemble import Polarity

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def fragility(
    *names: Names,
    outcomes: Path | None = None,
    limit_states: str = "overturning",
    polarity: Annotated[Polarity, Parameter(allow_leading_hyphen=True)] = "+",
    larger: Annotated[bool, Parameter(negative="")] = False,
    taxonomy: str = "rocking-block",
    standing: float | None = None,
    risk_options: Annotated[RiskOptions, RISK_OPTIONS] = RiskOptions(),
    measure_options: Annotated[MeasureOptions, INTENSITY_OPTIONS] = MeasureOptions(),
    block_options: Annotated[EnsembleOptions, BLOCK_OPTIONS] = EnsembleOptions(),
    motion_options: Annotated[MotionOptions, RECORD_OPTIONS] = MotionOptions(),
    model_options: Annotated[SlipSchemeOptions, MODEL_OPTIONS] = SlipSchemeOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Fit the probability that a block overturns, or exceeds a rotation, against the intensity of the motions.

    The block is a rectangle (--width, --height, or half of each), described by its parameters (--p, --alpha), or an
    ensemble from a calibration (--ensemble). With --levels every motion is scaled to each level (stripes); otherwise
    motions are used unscaled (a cloud). --outcomes fits observed outcomes instead, without records and block. --out
    contains fragility.png, .pdf, .csv, outcomes.csv (record, intensity, peak, outcome), result.json, and fragility.xml
    (NRML 0.5), with --hazard also risk.png and .pdf.

    Parameters
    ----------
    outcomes
        CSV table of observations: a column overturned (1 or 0; with a column trials, their number), the intensity
        (pga_g, pgv_m_s, sa_g with --period) or the motion (a record file, a shipped record, or a pulse, for which
        --measure is computed), and optionally group: outcomes that belong together.
    limit_states
        Limit states, separated by commas: overturning, or NAME=ROTATION divided by the slenderness, as half=0.5.
    polarity
        Motions as they are (+), reversed (-), or both. A symmetric block responds equally to both, which count once.
    larger
        Count only the larger response of both components of each pair (--component), and of both polarities.
    taxonomy
        Identifier of the fragility function in NRML.
    standing
        Years for which the block has stood: adds upper bounds on how strongly and how often it was shaken, with
        --hazard the probability of its survival, and survival.png and .pdf to --out.
    """
    if outcomes is not None:
        conflicting = {
            "records": names, "levels": measure_options.levels, "ensemble": block_options.ensemble,
            "clusters": risk_options.clusters, "larger": larger, "limit_states": limit_states != "overturning",
            "polarity": polarity != "+", "model": model_options.equation,
            "chattering": model_options.chattering != "certified", **block_options.supplied_texts(),
            **motion_options.supplied_texts("pulse", "scale", "pga", "pgv", "sa", "vertical", "keep_going")
        }  # fmt: skip
        for option in [option for option, value in conflicting.items() if value]:
            message = "{} are observed, for their own block and motions: omit {}"
            raise OptionError(message, "outcomes", option)
    bodies = {} if outcomes is not None else block_options.create_block_arguments(model_options)
    curve = risk_options.read_hazard(measure_options, motion_options)
    limits, measure = parse_limit_states(limit_states), measure_options.create_measure(motion_options.component)
    if output_options.out is not None:
        check_nrml_names("taxonomy", taxonomy)
        check_nrml_names("a limit state", *limits)
    if standing is not None:
        checks.positive(standing, "standing", OptionError)
        standing_limit = _find_standing_limit([*limits])
    with output_options.folder() as folder:
        records: dict[str, Any] = {}
        if outcomes is not None:
            observed = read_observed(outcomes, measure, **motion_options.read_options())
            fitted = fit_fragility(**observed, confidence=risk_options.confidence)
        else:
            check_measure(curve, measure)  # before the simulations
            loaded = motion_options.read_all(names)
            records, settings = loaded.to_dict(), measure_options.create_arguments(motion_options.component)
            settings |= model_options.create_arguments() | bodies
            settings |= {"polarity": polarity, "limit_states": limits, "larger": larger}
            settings |= {"clusters": risk_options.parse_clusters(), "confidence": risk_options.confidence}
            with _save_outcomes_on_failure(folder):
                fitted = fit_simulated(motions=[*loaded.motions.values()], **settings)
        result, texts = fitted.to_dict() | records, [fitted.summary()]
        figures: dict[str, Callable[[], Figure]] = {"fragility": fitted.plot}
        if curve is not None:
            rates = fitted.annual_rate(curve)
            result["risk"], figures["risk"] = rates.to_dict(risk_options.years), rates.plot
            texts.append(rates.summary(risk_options.years))
        if standing is not None:
            survival = fitted.survival(standing, curve, limit_state=standing_limit)
            result["survival"], figures["survival"] = survival.to_dict(), survival.plot
            texts.append(survival.summary())
        if folder is not None:
            with skip_on_error(name := "fragility.xml"):
                fitted.to_nrml(folder / name, taxonomy=taxonomy)
            fitted.to_csv(folder / "fragility.csv")
            if fitted.outcomes is not None:
                _add_record_names(fitted, result.get("records", [])).to_csv(folder / "outcomes.csv", "outcomes")
            write_results(folder, figures=figures, result=result)
        print_result(result, "\n\n".join(texts), as_json=output_options.as_json)


def _find_standing_limit(names: list[str]) -> str:
    """Find the limit state that a standing block has not exceeded: overturning, or the only one."""
    if len(names) > 1 and "overturning" not in names:
        message = f"{{}} requires overturning or a single limit state; got {' and '.join(names)}: choose one in {{}}"
        raise OptionError(message, "standing", "limit_states", value=names)
    return "overturning" if "overturning" in names else names[0]


def _add_record_names(fitted: Fragility, records: list[dict[str, Any]]) -> Fragility:
    """Add the record to the name of the motion of each outcome."""
    if not records or fitted.outcomes is None:
        return fitted
    table = fitted.outcomes.copy()
    table.insert(0, "record", table["motion"].map({row["motion"]: row["record"] for row in records}))
    return replace(fitted, outcomes=table)


@contextlib.contextmanager
def _save_outcomes_on_failure(folder: Path | None) -> Iterator[None]:
    """Write simulated outcomes even if the fit fails."""
    try:
        yield
    except FitError as error:
        if folder is not None and error.outcomes is not None:
            write_csv(folder / "outcomes.csv", error.outcomes)
            note(f"the simulated outcomes are in {folder / 'outcomes.csv'}")
        raise
