"""`rocking spectrum`, `map`, `ida` and `measures`: many simulations; `chatter` and `critical`: theory."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Parameter

from rocking.analysis.efficiency import compare_measures
from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.analysis.overturning import overturning_map
from rocking.analysis.spectrum import Abscissa, rocking_spectrum
from rocking.analysis.survey import create_file_stem
from rocking.block import Block, Blocks
from rocking.chattering.report import chattering_report, critical_report
from rocking.cli.options import (
    BLOCK_OPTIONS,
    INTENSITY_OPTIONS,
    MODEL_OPTIONS,
    READ_INTEGER,
    RECORD_OPTIONS,
    RISK_OPTIONS,
    BlockOptions,
    ClusterOptions,
    EnsembleOptions,
    LoadedRecords,
    MeasureOptions,
    ModelOptions,
    MotionOptions,
    Names,
    ObjectOptions,
    SlipOptions,
    SlipSchemeOptions,
    UnscaledOptions,
    read_ensemble_arguments,
)
from rocking.cli.output import OUTPUT_OPTIONS, OutputOptions, print_result, write_results, write_tables
from rocking.core.result import DatasetResult
from rocking.errors import BlockError, OptionError
from rocking.inputs.bodies import create_block, note_likely_mistakes
from rocking.inputs.declared import BLOCK_DESCRIPTIONS
from rocking.inputs.quantities import read_angle, read_array, read_length, read_tilt
from rocking.simulation.ensemble import list_block_names

#: Descriptions of a block for which the slenderness alone suffices.
_SLENDER_DESCRIPTIONS: Final = tuple(
    shape._replace(needed=("alpha",), optional=("p",)) if "alpha" in shape.needed else shape
    for shape in BLOCK_DESCRIPTIONS
)


def spectrum(
    *names: Names,
    alpha: str | None = None,
    p: str | None = None,
    size: str | None = None,
    restitution: str | None = None,
    ensemble: Path | None = None,
    fractiles: str = "0.16,0.5,0.84",
    abscissa: Annotated[Abscissa, Parameter(name="--against")] = "p",
    motion_options: Annotated[MotionOptions, RECORD_OPTIONS] = MotionOptions(),
    model_options: Annotated[SlipSchemeOptions, MODEL_OPTIONS] = SlipSchemeOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Compute rocking spectra: peak rotation against the frequency parameter or the size of the block.

    Lists of numbers are written 1,2,5 or START:STOP:COUNT, followed by :log for equal ratios. In the results, peaks
    are null if the block overturns. --out contains spectrum.png, .pdf, .nc, fractiles.csv, peaks.csv (every motion)
    and result.json.

    Parameters
    ----------
    alpha
        Slendernesses, for example 10deg,15deg or 0.1:0.3:5 (rad). Alternatively use --ensemble.
    p
        Frequency parameters, rad/s. Alternatively use --size.
    size
        Half diagonals of rectangular blocks, for example 0.5,1 (m) or 50cm:5m:10. Alternatively use --p.
    restitution
        Coefficients of restitution; Housner's by default.
    ensemble
        File ensemble.csv from rocking calibrate, instead of slendernesses and restitutions. Its blocks are scaled
        together, so that their median p equals each of --p (by default half to twice their own).
    fractiles
        Fractions of the motions that stay below the fractile curves.
    abscissa
        Abscissa of the figure.
    """
    if alpha is None and ensemble is None:
        raise OptionError("a spectrum requires {}, or the {} of a calibration", "alpha", "ensemble")
    if ensemble is not None and (alpha is not None or restitution is not None):
        message = "the file of {} contains slendernesses and restitutions: omit {} and {}"
        raise OptionError(message, "ensemble", "alpha", "restitution")
    with output_options.folder() as folder:
        axes: dict[str, Any] = {
            "p": None if p is None else read_array(p, "p"),
            "size": None if size is None else read_array(size, "size", read_length),
        }
        settings = model_options.create_arguments()
        if alpha is not None:
            restitutions = None if restitution is None else read_array(restitution, "restitution")
            alphas = read_array(alpha, "alpha", read_tilt)
            settings["blocks"] = Blocks.grid(alpha=alphas, restitution=restitutions, **axes)
        elif ensemble is not None:
            settings |= axes | read_ensemble_arguments(ensemble, model_options)
        settings["fractiles"] = read_array(fractiles, "fractiles").tolist()
        loaded = motion_options.read_all(names)
        result = rocking_spectrum(motions=[*loaded.motions.values()], **settings)
        _write_and_print(result, "spectrum", loaded, folder=folder, as_json=output_options.as_json, abscissa=abscissa)


def map(
    pulse: str,
    *,
    amplitudes: str = "0.5:10:96",
    frequencies: str = "0.25:8:63",
    cycles: float | None = None,
    phase: str | None = None,
    gamma: float | None = None,
    kind: str | None = None,
    rtol: float = 1e-6,
    block_options: Annotated[BlockOptions, BLOCK_OPTIONS] = BlockOptions(),
    model_options: Annotated[SlipOptions, MODEL_OPTIONS] = SlipOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Map the outcomes of a pulse over its amplitude and frequency, with refined boundaries.

    Lists of numbers are written 1,2,5 or START:STOP:COUNT, followed by :log for equal ratios. --out contains map.png,
    .pdf, .nc, modes.csv, boundaries.csv and result.json.

    Parameters
    ----------
    pulse
        sine (with --cycles), half-sine, one-sine, one-cosine, ricker (with --kind) or mavroeidis-papageorgiou (with
        --phase and --gamma).
    amplitudes
        Peak accelerations divided by the uplift acceleration.
    frequencies
        2 pi times the pulse's frequency, divided by the block's p.
    cycles
        Number of cycles of a sine.
    phase
        Phase of a sine or a Mavroeidis-Papageorgiou pulse, 90deg or 1.57 (rad).
    gamma
        Length of a Mavroeidis-Papageorgiou pulse in cycles.
    kind
        Kind of a Ricker pulse: symmetric or antisymmetric.
    rtol
        Width of the refined boundaries, relative to the amplitude.
    """
    angle = None if phase is None else read_angle(phase, "phase")
    options = {"cycles": cycles, "phase": angle, "gamma": gamma, "kind": kind}
    parameters: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    with output_options.folder() as folder:
        block = _create_slender_block(block_options)
        texts = {"amplitudes": amplitudes, "frequencies": frequencies}
        axes: dict[str, Any] = {name: read_array(text, name) for name, text in texts.items()}
        result = overturning_map(block, pulse, **axes, **model_options.create_arguments(), rtol=rtol, **parameters)
        _write_and_print(result, "map", None, folder=folder, as_json=output_options.as_json)


def ida(
    *names: Names,
    rtol: float = 1e-6,
    measure_options: Annotated[MeasureOptions, INTENSITY_OPTIONS] = MeasureOptions(),
    block_options: Annotated[ObjectOptions, BLOCK_OPTIONS] = ObjectOptions(),
    motion_options: Annotated[UnscaledOptions, RECORD_OPTIONS] = UnscaledOptions(),
    model_options: Annotated[SlipOptions, MODEL_OPTIONS] = SlipOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Scale motions up until the block overturns and beyond (incremental dynamic analysis).

    The block is a rectangle (--width, --height, or half of each), described by its parameters (--p, --alpha), or each
    object of a table (--inventory), with a figure for each. By default --levels increase in steps of 5 % to three times
    the level by which every motion has overturned the block. Bands and gaps between two levels are missed. Closer
    levels miss fewer. --out contains ida.png, .pdf, .nc, levels.csv, bands.csv (levels that overturn) and result.json.

    Parameters
    ----------
    rtol
        Width of the refined ends of bands, relative to the level.
    """
    body = block_options.create_bodies(labels=("name",))  # all objects have the same friction
    with output_options.folder() as folder:
        loaded = motion_options.read_all(names)
        motions = [*loaded.motions.values()]
        settings = measure_options.create_arguments(motion_options.component) | model_options.create_arguments()
        result = incremental_dynamic_analysis(body, motions, **settings, rtol=rtol)
        blocks = list_block_names(result.data) if isinstance(body, Sequence) else []
        _write_and_print(result, "ida", loaded, folder=folder, as_json=output_options.as_json, blocks=blocks)


def measures(
    *names: Names,
    periods: str = "0.5,1,2",
    damping: float = 0.05,
    further_measures: Annotated[str | None, Parameter(name="--also")] = None,
    cluster_options: Annotated[ClusterOptions, RISK_OPTIONS] = ClusterOptions(),
    block_options: Annotated[EnsembleOptions, BLOCK_OPTIONS] = EnsembleOptions(),
    motion_options: Annotated[UnscaledOptions, RECORD_OPTIONS] = UnscaledOptions(),
    model_options: Annotated[ModelOptions, MODEL_OPTIONS] = ModelOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Compare intensity measures by the scatter of the intensities at which motions first overturn a block.

    The block is a rectangle (--width, --height, or half of each), described by its parameters (--p, --alpha), or an
    ensemble from a calibration (--ensemble). Every motion is scaled up until it overturns the block. --out contains
    measures.png, .pdf, .nc, measures.csv, intensities.csv (at which each motion overturns) and result.json.

    Parameters
    ----------
    periods
        Periods of spectral accelerations, s: 0.5,1,2 or 0.2:4:10:log.
    damping
        Fraction of critical damping of the spectral accelerations.
    further_measures
        Further measures, separated by commas: pgd, arias, cav, incremental_velocity, duration.
    """
    settings = block_options.create_block_arguments(model_options)
    with output_options.folder() as folder:
        loaded = motion_options.read_all(names)
        settings |= {"periods": read_array(periods, "periods"), "clusters": cluster_options.parse_clusters()}
        measure_names = [] if further_measures is None else [name.strip() for name in further_measures.split(",")]
        settings |= {"damping": damping, "component": motion_options.component, "further_measures": measure_names}
        result = compare_measures(motions=[*loaded.motions.values()], **settings)
        _write_and_print(result, "measures", loaded, folder=folder, as_json=output_options.as_json)


def _write_and_print(
    analysis: DatasetResult,
    stem: str,
    loaded: LoadedRecords | None,
    *,
    folder: Path | None,
    as_json: bool,
    blocks: Sequence[str] = (),
    **figure: Any,
) -> None:
    """Write an analysis into a folder, if any (figures, tables, dataset, result), and print it, with the records.

    Several blocks have their own figures.
    """
    result = analysis.to_dict()
    if loaded is not None:
        result |= loaded.to_dict()
        analysis = replace(analysis, data=analysis.data.assign_coords(record=("motion", [*loaded.motions])))
    if folder is not None:
        write_tables(folder, analysis)
        analysis.to_netcdf(folder / f"{stem}.nc")
        plot: Callable[..., Any] = analysis.plot
        figures = {stem: functools.partial(plot, **figure)}
        if blocks:
            stems = [f"{stem}-{create_file_stem(name)}" for name in blocks]
            figures = {name: functools.partial(plot, block=k) for k, name in enumerate(stems)}
        write_results(folder, figures=figures, result=result)
    print_result(result, analysis.summary(), as_json=as_json)


def _create_slender_block(options: BlockOptions) -> Block:
    """Return a block for which the slenderness alone suffices: p is then 1."""
    values = options.read_values()
    if isinstance(values.get("alpha"), tuple) and not {"p", "restitution"} & values.keys():
        message = "the restitution of two different sides depends on {} and {} of both; also set {}"
        raise BlockError(message, "p", "alpha", "p")
    block = create_block({"p": 1.0} | values if "alpha" in values else values, _SLENDER_DESCRIPTIONS)
    note_likely_mistakes([block])
    return block


def chatter(
    a: float,
    omega: float,
    eta: float,
    *,
    p: float | None = None,
    order: Annotated[int, READ_INTEGER] = 4,
    impact_count: Annotated[int | None, READ_INTEGER] = None,
    table: Annotated[bool, Parameter(negative="")] = False,
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Compute how long a slender block chatters under a sine and whether it comes to rest, by every method.

    Times are dimensionless, p t, with --p also in seconds. --out contains chatter.png, .pdf (intervals between the
    impacts), result.json, impacts.csv and cycles.csv.

    Parameters
    ----------
    a
        Amplitude of the ground acceleration divided by g alpha, at least 1.
    omega
        Frequency of the ground acceleration (rad/s) divided by the block's p.
    eta
        Coefficient of restitution.
    p
        Frequency parameter of the block, rad/s.
    order
        Number of terms of the expansion in a - 1, 1 to 40.
    impact_count
        Number of impacts that the semi-analytical method resolves. The default depends on the restitution.
    table
        Show some cycles of the paper's iterative procedure (Eqs 62 and 64). cycles.csv contains all.
    """
    with output_options.folder() as folder:
        report = chattering_report(a, omega, eta, order=order, impact_count=impact_count, p=p)
        result, text = report.to_dict(), report.summary()
        if table:
            text += f"\n\n{report.table()}"
            result = {**result, "asymptotic_table": report.to_dataframe("cycles").to_dict("records")}
        if folder is not None:
            report.to_csv(folder / "impacts.csv")
            if report.cycles is not None:
                report.to_csv(folder / "cycles.csv", "cycles")
            write_results(folder, figures={"chatter": report.plot}, result=report.to_dict())
        print_result(result, text, as_json=output_options.as_json)


def critical(
    omega: float, eta: float, *, output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions()
) -> None:
    """Compute the amplitude up to which chattering under a sine is complete, by every method.

    --out contains result.json.

    Parameters
    ----------
    omega
        Frequency of the ground acceleration (rad/s) divided by the block's p.
    eta
        Coefficient of restitution.
    """
    with output_options.folder() as folder:
        report = critical_report(omega, eta)
        if folder is not None:
            report.to_json(folder / "result.json")
        print_result(report.to_dict(), report.summary(), as_json=output_options.as_json)
