"""`rocking mesh`: a body from a mesh, its resistance in every direction, and equivalent blocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.block import Block
from rocking.cli.output import OUTPUT_OPTIONS, OutputOptions, print_result, write_results, write_tables
from rocking.core.progress import note
from rocking.core.tables import format_table, write_csv
from rocking.errors import OptionError
from rocking.inputs.notes import list_block_notes
from rocking.inputs.quantities import read_array, read_densities, read_length, read_length_unit, read_number, read_sides
from rocking.solid.solid import Solid

_Signed = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def mesh(
    file: str,
    *,
    azimuth: _Signed = None,
    density: str | None = None,
    support: _Signed = None,
    tolerance: str | None = None,
    up: _Signed = None,
    unit: str = "m",
    turn: _Signed = None,
    restitution: str | None = None,
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Compute the mass of a body from a mesh, its resistance in every direction, and the equivalent blocks.

    FILE is an OBJ, PLY, STL or glTF file, another format that trimesh reads, or "statue", the shipped mesh. x points
    east and y north. Azimuths are in degrees clockwise from north. --out contains rose.png, .pdf, .csv (uplift
    acceleration, slenderness and p against the azimuth), .nc, support.csv, with --azimuth blocks.csv, and result.json.

    Parameters
    ----------
    file
        Mesh file.
    azimuth
        Azimuths of blocks to list, degrees: 0,45,90 or 0:165:12. Other commands accept their pivots, height of mass
        and gyration.
    density
        Density, kg/m^3; or the density of each part, as plinth=2700,figure=2650. By default the density is uniform.
    support
        Corners of the support, m, as "0.3,0.2;-0.3,0.2;0,-0.2". By default the corners of the mesh near the ground.
    tolerance
        Height above the lowest corner up to which corners carry load, as 0.002 (m) or 0.2cm. By default a thousandth of
        the height.
    up
        Axis that points up: x, y, z, -x, -y, -z, or a vector, 0.1,0,1. By default z, for glTF files y.
    unit
        Unit of the coordinates: m, cm, mm, in, ft, or its length in m.
    turn
        Rotation of the mesh, degrees, clockwise seen from above.
    restitution
        Coefficient of restitution, in (0, 1], one or two. By default from conservation of angular momentum.
    """
    with output_options.folder() as folder:
        if restitution is not None and azimuth is None:
            message = "{} applies only to blocks created by {}; add such a block, or omit it"
            raise OptionError(message, "restitution", "azimuth")
        solid = Solid.from_mesh(
            file,
            density=None if density is None else read_densities(density, "density"),
            support=None if support is None else [_read_numbers(corner, "support") for corner in support.split(";")],
            tolerance=None if tolerance is None else read_length(tolerance, "tolerance"),
            up=_read_numbers(up, "up") if up is not None and "," in up else up,
            unit=read_length_unit(unit, "unit"),
            turn=0.0 if turn is None else read_number(turn, "turn"),
        )
        rose = solid.rose()
        e = None if restitution is None else read_sides(restitution, "restitution")
        azimuths = [] if azimuth is None else read_array(azimuth, "azimuth").tolist()
        blocks = [_create_block_row(degrees, solid.block(degrees, restitution=e)) for degrees in azimuths]
        result: dict[str, Any] = {"solid": solid.to_dict(), **rose.to_dict(), "blocks": blocks}
        texts = [solid.summary(), rose.summary()]
        if blocks:
            texts.append(format_table([*blocks[0]], [[*row.values()] for row in blocks]))
        if folder is not None:
            write_tables(folder, rose)
            rose.to_netcdf(folder / "rose.nc")
            if blocks:
                import pandas as pd

                write_csv(folder / "blocks.csv", pd.DataFrame(blocks))
            write_results(folder, figures={"rose": rose.plot}, result=result)
        print_result(result, "\n\n".join(texts), as_json=output_options.as_json)


def _create_block_row(azimuth: float, block: Block) -> dict[str, float]:
    """Create a table row with a block's pivots and the parameters of both sides, with notes on the block."""
    for sentence in list_block_notes(block):
        note(f"azimuth {azimuth:g}: {sentence}")
    plus, minus = block.sides
    row = {
        "azimuth_deg": azimuth,
        "pivot_plus_m": plus.radius * math.sin(plus.alpha),
        "pivot_minus_m": minus.radius * math.sin(minus.alpha),
        "height_of_mass_m": plus.radius * math.cos(plus.alpha),
        "gyration_m": math.sqrt(block.gravity * plus.radius / plus.p**2 - plus.radius**2),
    }
    for name, unit in (("p", "_rad_s"), ("alpha", "_rad"), ("restitution", "")):
        row |= {f"{name}_plus{unit}": getattr(plus, name), f"{name}_minus{unit}": getattr(minus, name)}
    return row


def _read_numbers(text: str, name: str) -> Sequence[float]:
    """Read numbers separated by commas."""
    return [read_number(part, name) for part in text.split(",")]
