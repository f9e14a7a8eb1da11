"""Write the table of formats in docs/reference/records.md from the declarations of the package."""

from __future__ import annotations

from pathlib import Path

from rocking.records.formats.declared import Format, load_formats

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "records.md"
FIRST, LAST = "<!-- formats: written by scripts/format_table.py -->\n", "<!-- end of formats -->\n"


def write_table() -> str:
    """Return the table of the declared formats, and of those that are found otherwise."""
    units = "from the heading, or `units=`"
    rows = []
    for form in load_formats():
        agency, recognised, form_units = (form.documentation[name] for name in ("agency", "recognised", "units"))
        rows.append((agency, f"`{form.name}`", recognised, _count_channels(form), form_units))
    rows += [
        ("Text, CSV and XLSX", "`text table`", "rows of numbers", "those in the heading", units),
        (
            "Rows of numbers, such as OpenSees `.g3`",
            "`wrapped numbers`",
            "three or more numbers a row",
            "one",
            "`units=`",
        ),
        ("MiniSEED, SAC, GSE2, ...", "ObsPy's name", "ObsPy, with the extra `formats`", "several", "`units=`"),
    ]
    heading = ("Origin", "`format`", "Recognised by", "Channels", "Units")
    return "".join(f"| {' | '.join(row)} |\n" for row in [heading, ["---"] * 5, *rows])


def _count_channels(form: Format) -> str:
    has_columns = any("(?P<columns" in pattern for pattern in form.statement_patterns)
    return "several" if form.has_several_channels or has_columns else "one"


def update_page(page: str) -> str:
    """Return the text of the page with the current table."""
    before, _, rest = page.partition(FIRST)
    return f"{before}{FIRST}{write_table()}{LAST}{rest.partition(LAST)[2]}"


if __name__ == "__main__":
    PAGE.write_text(update_page(PAGE.read_text("utf-8")), "utf-8")
