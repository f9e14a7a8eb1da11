"""`rocking map`: what a pulse does to a block, over amplitude and frequency."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from rocking.analysis.overturning import overturning_map
from rocking.block import Block
from rocking.cli import batch, options
from rocking.errors import InvalidBlock
from rocking.treatment.base import Model

if TYPE_CHECKING:
    pass


def map(
    pulse: str,
    *,
    half_width: float | None = None,
    half_height: float | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    amplitudes: str = "0.5:10:96",
    frequencies: str = "0.25:8:63",
    cycles: float | None = None,
    phase: float | None = None,
    gamma: float | None = None,
    kind: str | None = None,
    model: Model = "nonlinear",
    tolerance: float = 1e-9,
    out: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Map what a pulse does to a block, over amplitude and frequency, with refined boundaries.

    Lists of numbers are 1,2,5 or START:STOP:COUNT, with :log at the end for equal ratios.

    Parameters
    ----------
    pulse
        sine (with --cycles), half-sine, one-sine, one-cosine, ricker (with --kind) or mavroeidis-papageorgiou (with
        --phase and --gamma).
    half_width
        Half the width of a rectangular block, m.
    half_height
        Half its height, m.
    alpha
        Slenderness, rad; one number, or two for side + and side -. Or give both sizes.
    restitution
        Factor on the angular speed at an impact; one number or two; Housner's by default.
    amplitudes
        Peak accelerations over the smallest that lifts the block.
    frequencies
        2 pi times the pulse's frequency, over the block's p.
    cycles
        Cycles of a sine.
    phase
        Phase of a sine or a Mavroeidis-Papageorgiou pulse, rad.
    gamma
        Length of a Mavroeidis-Papageorgiou pulse in cycles.
    kind
        symmetric or antisymmetric, of a Ricker pulse.
    model
        Equation of motion.
    tolerance
        Width, relative to the amplitude, that boundaries are refined to.
    out
        Folder for map.png, .pdf, .nc and result.json.
    as_json
        Print the result as JSON.
    """
    block = _block(half_width, half_height, alpha, restitution)
    folder = None if out is None else options.output_folder(out)
    given: dict[str, Any] = {"cycles": cycles, "phase": phase, "gamma": gamma, "kind": kind}
    found = overturning_map(
        pulse,
        block,
        amplitudes=batch.values(amplitudes, "--amplitudes"),
        frequencies=batch.values(frequencies, "--frequencies"),
        model=model,
        tolerance=tolerance,
        **{name: value for name, value in given.items() if value is not None},
    )
    batch.deliver(found, "map", folder=folder, as_json=as_json)


def _block(half_width: float | None, half_height: float | None, alpha: str | None, restitution: str | None) -> Block:
    """Block whose p plays no part, so that with a slenderness any will do."""
    if alpha is None and (half_width is None or half_height is None):
        raise InvalidBlock("a map needs --alpha (rad), or --half-width and --half-height (m)")
    return options.block_from(half_width, half_height, None if alpha is None else "1", alpha, restitution)
