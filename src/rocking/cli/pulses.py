"""`rocking pulses`: the pulses that --pulse takes."""

from __future__ import annotations

from typing import Annotated, Any

from rocking.cli.options import OUTPUT, PrintOptions
from rocking.named_pulses import FAMILIES, Family
from rocking.tables import text_table, to_json

_EXAMPLE = "rocking simulate --pulse sine:amplitude=0.2g,frequency=2Hz,cycles=5 --width 0.24 --height 1.1"


def pulses(*, output: Annotated[PrintOptions, OUTPUT] = PrintOptions()) -> None:
    """List the pulses that --pulse takes, with their parameters and, where they need not be given, their defaults."""
    if output.as_json:
        print(to_json({"pulses": [_entry(family) for family in FAMILIES.values()]}))
        return
    rows = [(family.name, _needed(family), _optional(family)) for family in FAMILIES.values()]
    print(text_table(["pulse", "needs", "takes"], rows))
    print(f"\namplitudes may be 0.5g or 4.9m/s2, frequencies 2Hz or 12.6rad/s, angles 90deg:\n{_EXAMPLE}")


def _entry(family: Family) -> dict[str, Any]:
    units = {name: family.unit(name) for name in (*family.needed, *family.optional)}
    return {"name": family.name, "needs": family.needed, "takes": family.optional, "units": units}


def _needed(family: Family) -> str:
    return ", ".join(f"{name}{_in(family.unit(name))}" for name in family.needed)


def _optional(family: Family) -> str:
    return ", ".join(
        f"{name}{_in(family.unit(name))}{_by_default(default)}" for name, default in family.optional.items()
    )


def _by_default(default: Any) -> str:
    return "" if default is None else f" = {default:g}" if isinstance(default, float) else f" = {default}"


def _in(unit: str) -> str:
    return f" ({unit})" if unit else ""
