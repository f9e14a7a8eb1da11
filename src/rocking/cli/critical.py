"""`rocking critical`: the critical amplitude of a sine, by every method."""

from __future__ import annotations

from typing import Annotated

from rocking.chattering.report import critical_report
from rocking.cli import batch
from rocking.cli.options import OUTPUT, OutputOptions


def critical(omega: float, eta: float, *, output: Annotated[OutputOptions, OUTPUT] = OutputOptions()) -> None:
    """Give the amplitude up to which chattering under a sine is complete, by every method.

    --out holds result.json.

    Parameters
    ----------
    omega
        Frequency of the ground acceleration (rad/s) over the block's p.
    eta
        Coefficient of restitution.
    """
    with output.folder() as folder:
        report = critical_report(omega, eta)
        if folder is not None:
            report.to_json(folder / "result.json")
        batch.show(report.to_dict(), report.summary(), as_json=output.as_json, folder=folder)
