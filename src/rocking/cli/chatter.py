"""`rocking chatter`: one chattering sequence under a sine, by every method."""

from __future__ import annotations

import math
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.chattering import (
    asymptotic_table,
    chattering_time,
    critical_amplitude,
    first_impact_speed,
    first_interval,
    sequence,
    series_diagnosis,
)
from rocking.tables import rows_of, to_json


def chatter(
    a: float,
    omega: float,
    eta: float,
    *,
    order: int = 4,
    resolved: int = 60,
    table: Annotated[bool, Parameter(negative="")] = False,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Say how long a slender block chatters under a sine, by every method, and whether it comes to rest.

    Parameters
    ----------
    a
        Amplitude of the ground acceleration over g alpha, at least 1.
    omega
        Frequency of the ground acceleration (rad/s) over the block's p.
    eta
        Coefficient of restitution.
    order
        Terms of the expansion in a - 1, 1 to 34.
    resolved
        Impacts that the semi-analytical method resolves.
    table
        Show the paper's iterative procedure (Eqs 62 and 64), cycle by cycle.
    as_json
        Print the result as JSON.
    """
    result = _result(a, omega, eta, order, resolved)
    if table:
        result["asymptotic_table"] = rows_of(asymptotic_table(a, omega, eta))
    if as_json:
        print(to_json(result))
        return
    for name, text in _lines(result):
        print(f"{name:<30}{text}")
    if table:
        _print_table(result["asymptotic_table"])


def _result(a: float, omega: float, eta: float, order: int, resolved: int) -> dict[str, Any]:
    exact = sequence(a, omega, eta)
    first = exact.impacts[0] if exact.impacts.size else {"interval": 0.0, "speed_before": 0.0}
    return {
        "a": a,
        "omega": omega,
        "eta": eta,
        "complete": exact.complete,
        "half_period": math.pi / omega,
        "chattering_time": {
            "exact": float(chattering_time(a, omega, eta)),
            "asymptotic": float(chattering_time(a, omega, eta, method="asymptotic")),
            "semianalytical": float(chattering_time(a, omega, eta, method="semianalytical", resolved=resolved)),
            "series": float(chattering_time(a, omega, eta, method="series", order=order)),
        },
        "series": _series(a, omega, eta, order),
        "resolved": resolved,
        "bracket": {"lower": exact.lower, "upper": exact.upper, "impacts": int(exact.impacts.size)},
        "critical_amplitude": float(critical_amplitude(omega, eta)),
        "first_interval": {"exact": float(first["interval"]), "eq32": float(first_interval(a, omega))},
        "first_impact_speed": {"exact": float(first["speed_before"]), "eq34": float(first_impact_speed(a, omega))},
    }


def _series(a: float, omega: float, eta: float, order: int) -> dict[str, float]:
    """Return what is known of the expansion's error; without loss at impacts there is no expansion."""
    if eta == 1.0:
        return {"order": order, "error": math.inf, "radius": 0.0}
    diagnosis = series_diagnosis(a, omega, eta, order=order)
    return {"order": order, "error": float(diagnosis.error), "radius": float(diagnosis.radius)}


def _lines(result: dict[str, Any]) -> list[tuple[str, str]]:
    times, bracket = result["chattering_time"], result["bracket"]
    critical = result["critical_amplitude"]
    if result["complete"]:
        verdict = f"complete: proven to rest before half a period, {result['half_period']:.9g}, is over"
        width = f"{bracket['lower']:.15g} to {bracket['upper']:.15g}, from {bracket['impacts']} impacts"
    else:
        verdict, width = "incomplete: the next half period lifts the block before it rests", "none"
    series = result["series"]
    rest = (
        f"the terms left out add about {series['error']:.1e}"
        if math.isfinite(series["error"])
        else f"worthless: it converges up to a = {1.0 + series['radius']:.5g} only"
    )
    return [
        ("chattering", verdict),
        ("critical amplitude", f"{critical:.12g}"),
        ("time, exact", _time(times["exact"])),
        ("  proven bracket", width),
        (f"time, Eq. 75, {result['resolved']} impacts", _time(times["semianalytical"])),
        ("time, Eq. 65", _time(times["asymptotic"])),
        (f"time, series, {series['order']} terms", f"{_time(times['series'])}, {rest}"),
        *(
            (name, f"{result[key]['exact']:.12g} exact, {result[key][equation]:.12g} by Eq. {equation[2:]}")
            for name, key, equation in (
                ("first interval", "first_interval", "eq32"),
                ("speed at first impact", "first_impact_speed", "eq34"),
            )
        ),
    ]


def _time(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.12g}"


def _print_table(cycles: list[dict[str, Any]]) -> None:
    print(f"\n{'n':>4}  sign  {'T_n;1 or T_n;3':>17}  {'interval':>17}  {'time':>17}")
    for cycle in cycles:
        term = f"T_{cycle['n']};{cycle['order']} = {cycle['term']:.6g}"
        print(f"{cycle['n']:>4}  {cycle['sign']:>+4}  {term:>17}  {cycle['interval']:>17.9e}  {cycle['time']:>17.12f}")
