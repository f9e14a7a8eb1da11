"""`rocking simulate`: one block under one record."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from rocking.cli import options
from rocking.errors import OutputError
from rocking.motion.motion import Motion
from rocking.motion.named import named_motion
from rocking.response import Response
from rocking.simulation import simulate as run
from rocking.tables import rows_of, to_json
from rocking.treatment import treatment
from rocking.treatment.base import Model

#: Chattering sequences that the printed table lists.
_LISTED = 12


def simulate(
    motion: str,
    *,
    half_width: float | None = None,
    half_height: float | None = None,
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    model: Model = "nonlinear",
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    scale: float = 1.0,
    chattering: str = "certified",
    duration: float | None = None,
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
    out: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Simulate one block under one record and say what happens to it.

    The block is a rectangle (--half-width, --half-height) or given by its parameters (--p, --alpha).

    Parameters
    ----------
    motion
        Record file (its format is told from its content), or the name of a shipped record (see `rocking records`).
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
    model
        Equation of motion.
    channel
        Channel of the record, by number or name, where there are several.
    dt
        Sampling step, s, of a text file that does not give times.
    units
        Units of a text file: g, m/s2, cm/s2, mm/s2.
    scale
        Factor on the motion.
    chattering
        certified, velocity, interval or time; certified=1e-9 (s), velocity=5e-10 (over p alpha), interval=1e-9 (s).
    duration
        Time to stop at, s; by default when the block is at rest after the motion, or has overturned.
    initial_rotation
        Rotation at the start, rad.
    initial_velocity
        Angular velocity at the start, rad/s.
    out
        Folder for response.png, .pdf, .csv, .nc, events.csv and result.json.
    as_json
        Print the result as JSON.
    """
    block = options.block_from(half_width, half_height, p, alpha, restitution)
    how = treatment(chattering)
    folder = None if out is None else options.output_folder(out)
    shaking = named_motion(motion, channel=channel, dt=dt, units=units, scale=scale)
    response = run(
        block,
        shaking,
        model=model,
        chattering=how,
        duration=duration,
        initial_rotation=initial_rotation,
        initial_velocity=initial_velocity,
    )
    result = summary(response, shaking)
    if folder is not None:
        write(response, result, folder)
    if as_json:
        print(to_json(result))
    else:
        print(table(response, shaking))
        if folder is not None:
            print(f"\nwritten to {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


def summary(response: Response, motion: Motion) -> dict[str, Any]:
    """Return the result for machines; units are in the names."""
    sides = response.block.sides
    return {
        "block": {
            "description": response.block.description,
            "p_rad_per_s": [side.p for side in sides],
            "alpha_rad": [side.alpha for side in sides],
            "restitution": [side.restitution for side in sides],
        },
        "motion": {
            "name": motion.name,
            "duration_s": motion.duration,
            "pga_m_per_s2": motion.pga,
            "history": motion.history,
        },
        "model": response.model,
        "chattering_treatment": repr(response.treatment),
        "overturned": response.overturned,
        "overturn_time_s": response.overturn_time,
        "peak_rotation_rad": response.peak_rotation,
        "peak_over_slenderness": response.peak_over_slenderness,
        "peak_time_s": response.peak_time,
        "required_friction": response.required_friction,
        "minimum_normal_force_over_weight": response.minimum_normal_force,
        "impact_count": len(response.impacts),
        "duration_s": response.duration,
        "time_at_rest_s": response.time_at_rest,
        "ambiguous": response.ambiguous,
        "events": rows_of(response.events),
        "chattering": rows_of(response.chattering),
    }


def table(response: Response, motion: Motion) -> str:
    """Return the result for people."""
    gravity = response.block.gravity
    plus, minus = (threshold / gravity for threshold in response.block.uplift_thresholds(response.model))
    lines = [
        ("block", response.block.description),
        ("parameters", "; ".join(_side_text(response, k) for k in range(1 if response.block.is_symmetric else 2))),
        ("motion", f"{motion.name}, {motion.duration:.2f} s, peak {motion.pga / gravity:.4f} g"),
        ("uplift above", f"{plus:.4f} g" if plus == minus else f"{plus:.4f} g (side +), {minus:.4f} g (side -)"),
        *_event_lines(response),
        ("impacts", f"{len(response.impacts)}"),
        (
            "peak rotation",
            f"{response.peak_rotation:.6g} rad at {response.peak_time:.4f} s, "
            f"{response.peak_over_slenderness:.4f} of the slenderness",
        ),
        ("friction needed", f"{response.required_friction:.4f}"),
        ("least normal force", f"{response.minimum_normal_force:.4f} of the weight"),
        ("verdict", _verdict(response)),
    ]
    return "\n".join(f"{name:<20}{text}" for name, text in lines)


def _side_text(response: Response, k: int) -> str:
    side = response.block.sides[k]
    return f"p = {side.p:.5g} rad/s, alpha = {side.alpha:.5g} rad, restitution = {side.restitution:.5g}"


def _event_lines(response: Response) -> list[tuple[str, str]]:
    sequences = {float(row["end"]): row for row in response.chattering}
    lines = []
    for event in response.events[:_LISTED]:
        text = f"{event['time']:.9f} s"
        if event["kind"] == "uplift":
            text += f", to side {'+' if event['side'] > 0 else '-'}"
        sequence = sequences.get(float(event["time"]))
        if event["kind"] == "rest" and sequence is not None:
            text += _bracket_text(sequence)
        lines.append((str(event["kind"]), text))
    if len(response.events) > _LISTED:
        lines.append(("...", f"{len(response.events) - _LISTED} more events"))
    return lines or [("uplift", "none")]


def _bracket_text(sequence: np.void) -> str:
    width = sequence["upper"] - sequence["lower"]
    if not width >= 0.0:
        return ", by the treatment, not proven"
    return f", complete chattering proven from {sequence['start']:.6f} s on, rest known to {width:.1e} s"


def _verdict(response: Response) -> str:
    if response.overturned:
        verdict = f"overturns at {response.overturn_time:.4f} s"
    elif len(response.events) == 0 and len(response.impacts) == 0:
        verdict = "does not move"
    else:
        verdict = "rocks and does not overturn"
    if response.stalled:
        verdict += f"; {response.stalled} rest(s) not proven"
    if response.ambiguous:
        verdict += "; AMBIGUOUS: one unit in the last place of the motion changes this response"
    return verdict


def write(response: Response, result: dict[str, Any], folder: Path) -> None:
    """Write figure, histories, events and result into a folder."""
    figure = response.plot()
    try:
        figure.savefig(folder / "response.png", dpi=160)
        figure.savefig(folder / "response.pdf")
        np.savetxt(
            folder / "events.csv",
            response.events,
            fmt=["%.15g", "%s", "%d"],
            delimiter=",",
            header="time_s,kind,side",
            comments="",
        )
        (folder / "result.json").write_text(to_json(result) + "\n", "utf-8")
    except OSError as error:
        raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error
    response.to_csv(folder / "response.csv")
    response.to_netcdf(folder / "response.nc")
