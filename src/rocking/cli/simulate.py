"""`rocking simulate` and `check`: one block under records; `rocking records` and `pulses`: available motions."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.analysis.survey import folder_names, survey
from rocking.cli.options import (
    BLOCK,
    MODEL,
    RECORDS,
    BlockOptions,
    FileOptions,
    HeldOptions,
    ModelOptions,
    MotionOptions,
    Names,
    SchemeOptions,
    StartOptions,
    read_each,
)
from rocking.cli.output import OUTPUT, OutputOptions, PrintOptions, left_out, print_result, subfolder, write_results
from rocking.core.progress import note
from rocking.core.tables import format_table, to_json
from rocking.errors import InvalidOption, UnreadableRecord
from rocking.inputs.notes import reading_notes
from rocking.inputs.pulses import FAMILIES, PulseFamily
from rocking.records.named import (
    STANDARD_INPUT,
    Contents,
    contents,
    expand_record_names,
    is_shipped,
    reject_redundant_arguments,
    shipped,
)
from rocking.response import PRECISION, Response, choose_steps
from rocking.response.mechanics import check_friction
from rocking.rules import check as apply_rules
from rocking.simulation.simulate import simulate as run


@dataclass(frozen=True)
class _Start(StartOptions):
    """Start and end of a simulation, and optional results."""

    friction: Annotated[
        float | None, Parameter(help="Coefficient of friction: say whether the block would slide, and when first.")
    ] = None
    precision: Annotated[
        float,
        Parameter(help="Relative precision of the record: the outcome is also counted in 11 motions within it."),
    ] = PRECISION


def simulate(
    *names: Names,
    each: Annotated[bool, Parameter(negative="")] = False,
    energy: Annotated[bool, Parameter(negative="")] = False,
    start: Annotated[_Start, MODEL] = _Start(),
    block: Annotated[HeldOptions, BLOCK] = HeldOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[SchemeOptions, MODEL] = SchemeOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Simulate one block under a record and describe its response; for several records, print one line each.

    The block is a rectangle (--width, --height, or half of each; --offset if its centre of mass is not in the middle),
    or described by its parameters (--p, --alpha) or pivots (--pivots, --height-of-mass, --gyration). It may be
    restrained or pushed (--tendon, --spring, --damper, --thrust, --load), lean, or rock to one side only (--one-sided).
    For one record --out contains response.png, .pdf, .csv, .nc, events.csv, impacts.csv and result.json; for several,
    summary.csv, summary.json and (if openpyxl is installed) summary.xlsx.

    Parameters
    ----------
    each
        Also write the files of each of several records into its own folder below --out.
    energy
        Also draw the phase plane (phase-plane.png, .pdf) and the energy against time (energy.png, .pdf) into --out.
    """
    if start.friction is not None:
        check_friction(start.friction)  # checked before the simulation
    choose_steps(start.precision)
    shown: dict[str, Any] = {"friction": start.friction, "precision": start.precision}
    body = block.body()
    options: dict[str, Any] = {**model.chosen(), **start.read()}
    for name in [name for name, chosen in (("each", each), ("energy", energy)) if chosen and output.out is None]:
        raise InvalidOption("{} writes files; name the folder for them with {}", name, "out")
    with output.folder() as folder:
        read = motion.read_all(names)
        if read.single:
            ((record, shaking),) = read.motions.items()
            response = run(body, shaking, **options)
            result, text = _result(response, record, shown, folder, energy), response.summary(**shown)
        else:
            if energy and not each:
                raise InvalidOption("{} draws single responses; of several records give {}, too", "energy", "each")
            found = replace(survey(body, read.motions, **shown, **options), skipped=read.skipped)
            if folder is not None:
                found.to_csv(folder / "summary.csv")
                found.to_json(folder / "summary.json")
                with left_out("summary.xlsx"):
                    found.to_excel(folder / "summary.xlsx")
            if folder is not None and each:
                folders = folder_names(found.records)
                for name, record, response in zip(folders, found.records, found.responses, strict=True):
                    _result(response, record, shown, subfolder(folder, name), energy)
            result, text = found.to_dict(), found.summary()
        print_result(result, text, as_json=output.as_json)


def _result(
    response: Response, record: str, shown: dict[str, Any], folder: Path | None, energy: bool
) -> dict[str, Any]:
    """Return the result, and write it with figures, histories and events into a folder, if any."""
    result = response.to_dict(**shown)
    # The record also names the motion, as in tables of several records.
    result |= {"motion": {"record": record, **result["motion"]}}
    if folder is not None:
        response.to_csv(folder / "response.csv")
        response.to_csv(folder / "events.csv", "events")
        response.to_csv(folder / "impacts.csv", "impacts")
        response.to_netcdf(folder / "response.nc")
        figures: dict[str, Callable[[], Any]] = {"response": response.plot}
        if energy:
            figures |= {"phase-plane": response.plot_phase_plane, "energy": response.plot_energy}
        write_results(folder, figures=figures, result=result)
    return result


def check(
    *names: Names,
    rules: str | None = None,
    block: Annotated[BlockOptions, BLOCK] = BlockOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Compare rules of thumb with the simulated response of a block under records.

    The block is a rectangle (--width, --height, or half of each) or described by its parameters (--p, --alpha). Numbers
    are demand divided by capacity: a rule predicts overturning from 1 on. --out contains check.csv and result.json.

    Parameters
    ----------
    rules
        Some of west,ishiyama,housner,asce_43_05,priestley. By default all.
    """
    body = block.block()
    chosen = None if rules is None else [name.strip() for name in rules.split(",")]
    with output.folder() as folder:
        read = motion.read_all(names)
        found = replace(apply_rules(body, read.motions, rules=chosen, model=model.model), skipped=read.skipped)
        result = found.to_dict()
        if folder is not None:
            found.to_csv(folder / "check.csv")
            write_results(folder, figures={}, result=result)
        print_result(result, found.summary(), as_json=output.as_json)


def records(
    *names: Names,
    file: Annotated[FileOptions, RECORDS] = FileOptions(),
    output: Annotated[PrintOptions, OUTPUT] = PrintOptions(),
) -> None:
    """List the shipped records, or show the content of record files and how it was interpreted.

    For several files, those that cannot be read are listed with the reason, and the exit status is 2.
    """
    files = expand_record_names(names)
    several = len(files) > 1
    found, refused = read_each(files, lambda name: _contents(name, file, several=several), keep_going=several)
    shown = [*found.values()] if files else [shipped()]
    if output.as_json:
        listed = [each.to_dict() for each in shown] + [{"file": name, "error": refused[name]} for name in refused]
        print(to_json(listed[0] if len(listed) == 1 else {"files": listed}))
    else:
        print("\n\n".join([each.summary() for each in shown] + [*refused.values()]))
    if refused:
        names_of = ", ".join([*refused][:5]) + (f" and {len(refused) - 5} more" if len(refused) > 5 else "")
        raise UnreadableRecord(f"{len(refused)} of {len(files)} files cannot be read: {names_of}")


def _contents(name: str, file: FileOptions, *, several: bool) -> Contents:
    if is_shipped(name):
        if not several:
            reject_redundant_arguments(name, **file.about())
        return shipped(name)
    source = sys.stdin.buffer if name == STANDARD_INPUT else name
    found = contents(source, **file.about(), several=several)
    for motion, entry in zip(found.motions, found.entries, strict=True):
        for sentence in reading_notes(motion):
            note(f"{name}, channel {entry['channel']}: {sentence}")
    return found


def pulses(*, output: Annotated[PrintOptions, OUTPUT] = PrintOptions()) -> None:
    """List the pulses that --pulse accepts, with their parameters and defaults."""
    families = FAMILIES.values()
    if output.as_json:
        units = [{name: one.unit(name) for name in (*one.needed, *one.optional)} for one in families]
        known = [{"name": one.name, "needs": one.needed, "takes": one.optional} for one in families]
        print(to_json({"pulses": [one | {"units": of_one} for one, of_one in zip(known, units, strict=True)]}))
        return
    rows = [(one.name, _listed(one, dict.fromkeys(one.needed)), _listed(one, one.optional)) for one in families]
    print(format_table(["pulse", "needs", "takes"], rows))
    print("\namplitudes may be 0.5g or 4.9m/s2, frequencies 2Hz or 12.6rad/s, angles 90deg:")
    print("rocking simulate --pulse sine:amplitude=0.2g,frequency=2Hz,cycles=5 --width 0.24 --height 1.1")


def _listed(family: PulseFamily, parameters: Mapping[str, Any]) -> str:
    """Return the parameters of a pulse with units and defaults."""
    units = {name: f" ({family.unit(name)})" if family.unit(name) else "" for name in parameters}
    defaults = {
        name: "" if value is None else f" = {value:g}" if isinstance(value, float) else f" = {value}"
        for name, value in parameters.items()
    }
    return ", ".join(name + units[name] + defaults[name] for name in parameters)
