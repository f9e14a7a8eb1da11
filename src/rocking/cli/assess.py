"""`rocking assess`: named objects under records, from the tables to the report."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from rocking.assessment.assess import assess as assess_objects
from rocking.cli.options import (
    INTENSITY_OPTIONS,
    MODEL_OPTIONS,
    READ_INTEGER,
    RECORD_OPTIONS,
    RISK_OPTIONS,
    MeasureOptions,
    MotionOptions,
    Names,
    RiskOptions,
    SlipOptions,
)
from rocking.cli.output import OUTPUT_OPTIONS, OutputOptions, print_result, skip_on_error
from rocking.core.tables import format_reasons
from rocking.errors import OptionError, RecordError
from rocking.inputs.inventory import read_labelled
from rocking.simulation.ensemble import Polarity


def assess(
    inventory: Path,
    *names: Names,
    level_count: Annotated[int, READ_INTEGER, Parameter(name="--count")] = 20,
    sample_count: Annotated[int, READ_INTEGER, Parameter(name="--samples")] = 50,
    polarity: Annotated[Polarity, Parameter(allow_leading_hyphen=True)] = "both",
    risk_options: Annotated[RiskOptions, RISK_OPTIONS] = RiskOptions(),
    measure_options: Annotated[MeasureOptions, INTENSITY_OPTIONS] = MeasureOptions(),
    motion_options: Annotated[MotionOptions, RECORD_OPTIONS] = MotionOptions(),
    model_options: Annotated[SlipOptions, MODEL_OPTIONS] = SlipOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Assess which objects of a table overturn, at which intensity, and how often at a site, in one report.

    Each object is simulated under the records as they are and scaled to levels of intensity, with its fragility, rank
    and rules of thumb. Objects and records that cannot be read are listed, and do not stop the others. --out contains
    report.html (one page with figures, for the browser and for printing), assessment.xlsx (if openpyxl is installed)
    and assessment.nc. With --hazard, the intensity measure is its measure.

    Parameters
    ----------
    inventory
        CSV file or Excel workbook with one object in each row: name, sizes with units in the heading, as Width (cm) and
        Height (m), or p and alpha, or pivots; optionally friction, restraints and standard deviations (24 +- 1). All
        other columns, such as location or value, are listed in the report.
    level_count
        Number of levels of each object, if --levels does not set them for all.
    sample_count
        Number of sampled blocks of an object with uncertain sizes.
    polarity
        Motions as they are (+), reversed (-), or both. A symmetric object responds equally to both, which count once.
    """
    curve = risk_options.read_hazard(measure_options, motion_options)
    settings = measure_options.create_arguments(motion_options.component) | model_options.create_arguments()
    settings["levels"] = level_count if settings["levels"] is None else settings["levels"]
    if curve is not None:
        if measure_options.measure not in ("pga", curve.measure.name):
            message = f"{{}} must be the measure of the hazard curve, {curve.measure.label}: omit it"
            raise OptionError(message, "measure", value=measure_options.measure)
        settings["measure"] = curve.measure
    settings |= {"polarity": polarity, "clusters": risk_options.parse_clusters(), "confidence": risk_options.confidence}
    settings["years"] = risk_options.years
    with output_options.folder() as folder:
        objects = read_labelled(inventory, keep_going=True, expected=("name", "friction"))
        loaded = replace(motion_options, keep_going=True).read_all(names, accepts_pairs=True)
        if not loaded.motions:
            raise RecordError("no motion can be used: " + "; ".join(format_reasons(loaded.skipped)))
        result = assess_objects(objects, loaded.motions, hazard=curve, sample_count=sample_count, **settings)
        skipped = {name: reason.removeprefix(name).lstrip(",: ") for name, reason in loaded.skipped.items()}
        result = replace(result, skipped=skipped | {**result.skipped})
        if folder is not None:
            result.to_html(folder / "report.html", command=shlex.join(["rocking", *sys.argv[1:]]))
            with skip_on_error("assessment.xlsx"):
                result.to_excel(folder / "assessment.xlsx")
            result.to_netcdf(folder / "assessment.nc")
        print_result(result.to_dict(), result.summary(), as_json=output_options.as_json)
