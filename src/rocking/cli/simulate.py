"""`rocking simulate` and `check`: one block under records; `rocking records` and `pulses`: available motions."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.analysis.survey import create_folder_names, survey
from rocking.cli.options import (
    BLOCK_OPTIONS,
    MODEL_OPTIONS,
    RECORD_OPTIONS,
    FileOptions,
    FreeObjectOptions,
    MotionOptions,
    Names,
    ObjectOptions,
    SlipOptions,
    SlipSchemeOptions,
    StartOptions,
    read_records,
)
from rocking.cli.output import (
    OUTPUT_OPTIONS,
    OutputOptions,
    PrintOptions,
    create_subfolder,
    print_result,
    skip_on_error,
    write_results,
)
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.progress import note
from rocking.core.tables import format_table, list_some, round_decimal, to_json
from rocking.errors import OptionError, RecordError
from rocking.inputs.notes import list_reading_notes
from rocking.inputs.pulses import FAMILIES, PulseFamily
from rocking.motion.motion import Motion
from rocking.records import formats
from rocking.records.catalogue import info, load
from rocking.records.catalogue import names as list_shipped_names
from rocking.records.formats.source import Request
from rocking.records.named import (
    STANDARD_INPUT,
    expand_record_names,
    is_shipped,
    reject_redundant_arguments,
    split_factor,
)
from rocking.response import Response
from rocking.response.mechanics import check_available_friction
from rocking.response.perturbed import MOTION_PRECISION, choose_factors
from rocking.rules import compare_rules
from rocking.simulation.simulate import simulate as run_simulation


@dataclass(frozen=True)
class _ResponseOptions(StartOptions):
    """Start and end of a simulation, and optional results."""

    available_friction: Annotated[
        float | None,
        Parameter(help="Coefficient of friction, to report whether and when a block that never slips would slide."),
    ] = None
    precision: Annotated[
        float, Parameter(help="Relative precision of the record; 11 motions within it are also simulated.")
    ] = MOTION_PRECISION


def simulate(
    *names: Names,
    writes_each: Annotated[bool, Parameter(name="--each", negative="")] = False,
    draws_energy: Annotated[bool, Parameter(name="--energy", negative="")] = False,
    start_options: Annotated[_ResponseOptions, MODEL_OPTIONS] = _ResponseOptions(),
    block_options: Annotated[ObjectOptions, BLOCK_OPTIONS] = ObjectOptions(),
    motion_options: Annotated[MotionOptions, RECORD_OPTIONS] = MotionOptions(),
    model_options: Annotated[SlipSchemeOptions, MODEL_OPTIONS] = SlipSchemeOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Simulate a block under a record and describe its response; for several of either, print one line for each pair.

    The block is a rectangle (--width, --height, or half of each; --offset if its centre of mass is not in the middle),
    or described by its parameters (--p, --alpha) or pivots (--pivots, --height-of-mass, --gyration). It may be
    restrained or pushed (--tendon, --spring, --damper, --thrust, --load), lean, or rock to one side only (--one-sided).
    With --inventory each object of a table is simulated. For one block and record --out contains response.png, .pdf,
    .csv, .nc, events.csv, impacts.csv and result.json; for several, summary.csv, summary.json and (if openpyxl is
    installed) summary.xlsx.

    Parameters
    ----------
    writes_each
        Also write the files of each of several records into its own folder below --out.
    draws_energy
        Also draw the phase plane (phase-plane.png, .pdf) and the energy against time (energy.png, .pdf) into --out.
    """
    if start_options.available_friction is not None:
        check_available_friction(start_options.available_friction)  # checked before the simulation
    choose_factors(start_options.precision)
    summary_options = {name: getattr(start_options, name) for name in ("available_friction", "precision")}
    body = block_options.create_bodies()
    options: dict[str, Any] = {**model_options.create_arguments(), **start_options.read_values()}
    flags = {"each": writes_each, "energy": draws_energy}
    for name in [name for name, is_set in flags.items() if is_set and output_options.out is None]:
        raise OptionError("{} writes files; set their folder with {}", name, "out")
    with output_options.folder() as folder:
        loaded = motion_options.read_all(names)
        if loaded.is_single and not isinstance(body, Sequence):
            ((record, base_motion),) = loaded.motions.items()
            response = run_simulation(body, base_motion, **options)
            result = _write_response(response, record, summary_options, folder, draws_energy)
            text = response.summary(**summary_options)
        else:
            if draws_energy and not writes_each:
                raise OptionError("{} draws single responses; with several of them also use {}", "energy", "each")
            results = replace(survey(body, loaded.motions, **summary_options, **options), skipped=loaded.skipped)
            if folder is not None:
                results.to_csv(folder / "summary.csv")
                results.to_json(folder / "summary.json")
                with skip_on_error("summary.xlsx"):
                    results.to_excel(folder / "summary.xlsx")
                folders = create_folder_names(results.records, results.responses) if writes_each else []
                for name, record, response in zip(folders, results.records, results.responses, strict=False):
                    _write_response(response, record, summary_options, create_subfolder(folder, name), draws_energy)
            result, text = results.to_dict(), results.summary()
        print_result(result, text, as_json=output_options.as_json)


def _write_response(
    response: Response, record: str, summary_options: dict[str, Any], folder: Path | None, draws_energy: bool
) -> dict[str, Any]:
    """Write the result, figures, histories and events into a folder, if any, and return the result."""
    result = response.to_dict(**summary_options)
    # The record also names the motion, as in tables of several records.
    result |= {"motion": {"record": record, **result["motion"]}}
    if folder is not None:
        response.to_csv(folder / "response.csv")
        response.to_csv(folder / "events.csv", "events")
        response.to_csv(folder / "impacts.csv", "impacts")
        response.to_netcdf(folder / "response.nc")
        figures: dict[str, Callable[[], Any]] = {"response": response.plot}
        if draws_energy:
            figures |= {"phase-plane": response.plot_phase_plane, "energy": response.plot_energy}
        write_results(folder, figures=figures, result=result)
    return result


def check(
    *names: Names,
    rules: str | None = None,
    block_options: Annotated[FreeObjectOptions, BLOCK_OPTIONS] = FreeObjectOptions(),
    motion_options: Annotated[MotionOptions, RECORD_OPTIONS] = MotionOptions(),
    model_options: Annotated[SlipOptions, MODEL_OPTIONS] = SlipOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Compare rules of thumb with the simulated response of a block under records.

    The block is a rectangle (--width, --height, or half of each), described by its parameters (--p, --alpha), or each
    object of a table (--inventory). Numbers are demand divided by capacity: a rule predicts overturning from 1 on.
    --out contains check.csv and result.json.

    Parameters
    ----------
    rules
        Some of west,ishiyama,housner,asce_43_05,priestley. By default all.
    """
    body = block_options.create_blocks()
    rule_names = None if rules is None else [name.strip() for name in rules.split(",")]
    with output_options.folder() as folder:
        loaded = motion_options.read_all(names)
        comparison = compare_rules(body, loaded.motions, rules=rule_names, **model_options.create_arguments())
        comparison = replace(comparison, skipped=loaded.skipped)
        result = comparison.to_dict()
        if folder is not None:
            comparison.to_csv(folder / "check.csv")
            write_results(folder, figures={}, result=result)
        print_result(result, comparison.summary(), as_json=output_options.as_json)


def records(
    *names: Names,
    file_options: Annotated[FileOptions, RECORD_OPTIONS] = FileOptions(),
    output_options: Annotated[PrintOptions, OUTPUT_OPTIONS] = PrintOptions(),
) -> None:
    """List the shipped records, or show the content of record files and how it was interpreted.

    For several files, those that cannot be read are listed with the reason, and the exit status is 2.
    """
    files = expand_record_names(names)
    is_single = len(files) == 1
    request = file_options.create_request(are_defaults=not is_single)
    read = functools.partial(_list_record, request=request)
    listings, messages = read_records(files, read, keep_going=not is_single) if files else ({"": _list_shipped()}, {})
    if output_options.as_json:
        entries = [{**facts, "channels" if facts else "records": rows} for facts, rows in listings.values()]
        entries += [{"file": name, "error": message} for name, message in messages.items()]
        print(to_json(entries[0] if len(entries) == 1 else {"files": entries}))
    else:
        print("\n\n".join([_format_listing(*listing) for listing in listings.values()] + [*messages.values()]))
    if messages:
        raise RecordError(f"{len(messages)} of {len(files)} files cannot be read: {list_some([*messages])}")


#: File, format and reason of its identification (empty for shipped records), and a row for each channel or record.
_Listing = tuple[dict[str, Any], list[dict[str, Any]]]


def _list_record(name: str, request: Request) -> _Listing:
    if is_shipped(name):
        reject_redundant_arguments(name, request)
        return _list_shipped(name)
    source, factor = split_factor(name)
    identification, channels = formats.read_content(sys.stdin.buffer if name == STANDARD_INPUT else source, request)
    rows = []
    for channel in channels:
        motion = channel.motion(request.baseline, request.highpass)
        for sentence in (*list_reading_notes(motion), *motion.history):
            note(f"{name}, channel {channel.number}: {sentence}")
        facts = {"channel": channel.number, "name": channel.name, "units": channel.units}
        rows.append(facts | _tabulate_motion(motion.scaled(factor)))
    return {"file": "standard input" if name == STANDARD_INPUT else name, **identification._asdict()}, rows


def _list_shipped(*names: str) -> _Listing:
    rows = []
    for record in map(info, names or list_shipped_names()):
        facts = {"name": record.name, "event": record.event, "station": record.station, "direction": record.direction}
        rows.append(facts | _tabulate_motion(load(record.name)) | {"terms": record.terms})
    return {}, rows


def _tabulate_motion(motion: Motion) -> dict[str, Any]:
    peak = round_decimal(motion.pga / STANDARD_GRAVITY)
    return {"step_s": motion.dt, "duration_s": motion.duration, "pga_g": peak, "pgv_m_s": motion.pgv}


def _format_listing(facts: dict[str, Any], rows: list[dict[str, Any]]) -> str:
    # A missing value is the step of unevenly spaced samples.
    cells = [["uneven" if value is None else value for value in row.values()] for row in rows]
    title = "{file}: {format}, since {reason}\n\n".format(**facts) if facts else ""
    return title + format_table([*rows[0]], cells)


def pulses(*, output_options: Annotated[PrintOptions, OUTPUT_OPTIONS] = PrintOptions()) -> None:
    """List the pulses that --pulse accepts, with their parameters and defaults."""
    families = FAMILIES.values()
    if output_options.as_json:
        entries = [{"name": family.name, "needs": family.needed, "takes": family.optional} for family in families]
        for entry, family in zip(entries, families, strict=True):
            entry["units"] = {name: family.unit(name) for name in (*family.needed, *family.optional)}
        print(to_json({"pulses": entries}))
        return
    rows = []
    for family in families:
        needed = _format_parameters(family, dict.fromkeys(family.needed))
        rows.append((family.name, needed, _format_parameters(family, family.optional)))
    print(format_table(["pulse", "needs", "takes"], rows))
    print("\namplitudes may be 0.5g or 4.9m/s2, frequencies 2Hz or 12.6rad/s, angles 90deg:")
    print("rocking simulate --pulse sine:amplitude=0.2g,frequency=2Hz,cycles=5 --width 0.24 --height 1.1")


def _format_parameters(family: PulseFamily, parameters: Mapping[str, Any]) -> str:
    """Format the parameters of a pulse with units and defaults."""
    texts = []
    for name, default in parameters.items():
        unit_text = f" ({family.unit(name)})" if family.unit(name) else ""
        default_text = "" if default is None else f" = {default:g}" if isinstance(default, float) else f" = {default}"
        texts.append(name + unit_text + default_text)
    return ", ".join(texts)
