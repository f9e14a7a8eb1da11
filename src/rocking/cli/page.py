"""`rocking page`: the standalone page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from rocking.cli.output import OUTPUT_OPTIONS, QuietOptions
from rocking.core.tables import write_text


def page(
    *,
    out: Path = Path("block.html"),
    records: str | None = None,
    class_links: Annotated[Path | None, Parameter("--class")] = None,
    output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions(),
) -> None:
    """Write a page with a rocking block that needs no server and no installation: one HTML file.

    The file contains the compiled kernels and some of the shipped records. It works in any current browser, offline,
    also on a phone. A case is part of the address, so that a link opens it.

    Parameters
    ----------
    out
        File to write.
    records
        Names of the shipped records in the page, separated by commas, by default el-centro-meloland-270 and
        ridgecrest-clc-090.
    class_links
        Text file with links for a class, which the page lists above its tours: in each line words, and at its end the
        address of a case.
    """
    from rocking.explorer.standalone import RECORD_NAMES, build_page

    names = RECORD_NAMES if records is None else [name.strip() for name in records.split(",") if name.strip()]
    text = build_page(names, class_links)
    write_text(out, text)
    print(f"written to {out}: {len(text.encode()) // 1000} kB; open it in a browser")
