"""`rocking chatter`, `rocking critical`: the paper's theory of chattering under a sine."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from rocking.chattering.report import chattering_report, critical_report
from rocking.cli.options import WHOLE
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results


def chatter(
    a: float,
    omega: float,
    eta: float,
    *,
    p: float | None = None,
    order: Annotated[int, WHOLE] = 4,
    resolved: Annotated[int | None, WHOLE] = None,
    table: Annotated[bool, Parameter(negative="")] = False,
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Say how long a slender block chatters under a sine, by every method, and whether it comes to rest.

    Times are dimensionless, p t; with --p also in seconds. --out holds chatter.png, .pdf (intervals between
    the impacts), result.json, impacts.csv and cycles.csv.

    Parameters
    ----------
    a
        Amplitude of the ground acceleration over g alpha, at least 1.
    omega
        Frequency of the ground acceleration (rad/s) over the block's p.
    eta
        Coefficient of restitution.
    p
        The block's frequency parameter, rad/s.
    order
        Terms of the expansion in a - 1, 1 to 34.
    resolved
        Impacts that the semi-analytical method resolves; by default as many as the restitution asks for.
    table
        Show the paper's iterative procedure (Eqs 62 and 64): its first cycles and the last; all are in cycles.csv.
    """
    with output.folder() as folder:
        report = chattering_report(a, omega, eta, order=order, resolved=resolved, p=p)
        result, text = report.to_dict(), report.summary()
        if table:
            text += f"\n\n{report.table()}"
            result = {**result, "asymptotic_table": report.to_dataframe("cycles").to_dict("records")}
        if folder is not None:
            report.to_csv(folder / "impacts.csv")
            if report.cycles is not None:
                report.to_csv(folder / "cycles.csv", "cycles")
            write_results(folder, figures={"chatter": report.plot}, result=report.to_dict())
        print_result(result, text, as_json=output.as_json)


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
        print_result(report.to_dict(), report.summary(), as_json=output.as_json)
