"""`rocking map`: what a pulse does to a block, over amplitude and frequency."""

from __future__ import annotations

from typing import Annotated, Any

from rocking.analysis.overturning import overturning_map
from rocking.cli import batch
from rocking.cli.options import BLOCK, MODEL, OUTPUT, ModelOptions, OutputOptions, SlendernessOptions
from rocking.quantities import angle, values


def map(
    pulse: str,
    *,
    amplitudes: str = "0.5:10:96",
    frequencies: str = "0.25:8:63",
    cycles: float | None = None,
    phase: str | None = None,
    gamma: float | None = None,
    kind: str | None = None,
    tolerance: float = 1e-9,
    block: Annotated[SlendernessOptions, BLOCK] = SlendernessOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Map what a pulse does to a block, over amplitude and frequency, with refined boundaries.

    Lists of numbers are 1,2,5 or START:STOP:COUNT, with :log at the end for equal ratios. --out holds map.png, .pdf,
    .nc, modes.csv, boundaries.csv and result.json.

    Parameters
    ----------
    pulse
        sine (with --cycles), half-sine, one-sine, one-cosine, ricker (with --kind) or mavroeidis-papageorgiou (with
        --phase and --gamma).
    amplitudes
        Peak accelerations over the smallest that lifts the block.
    frequencies
        2 pi times the pulse's frequency, over the block's p.
    cycles
        Cycles of a sine.
    phase
        Phase of a sine or a Mavroeidis-Papageorgiou pulse, 90deg or 1.57 (rad).
    gamma
        Length of a Mavroeidis-Papageorgiou pulse in cycles.
    kind
        symmetric or antisymmetric, of a Ricker pulse.
    tolerance
        Width, relative to the amplitude, that boundaries are refined to.
    """
    given: dict[str, Any] = {
        "cycles": cycles,
        "phase": None if phase is None else angle(phase, "--phase"),
        "gamma": gamma,
        "kind": kind,
    }
    with output.folder() as folder:
        found = overturning_map(
            block.block(),
            pulse,
            amplitudes=values(amplitudes, "--amplitudes"),
            frequencies=values(frequencies, "--frequencies"),
            model=model.model,
            tolerance=tolerance,
            **{name: value for name, value in given.items() if value is not None},
        )
        batch.deliver(found, "map", None, folder=folder, as_json=output.as_json)
