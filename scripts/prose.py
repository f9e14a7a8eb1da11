"""Count phrases that make text hard to read, in pages and docstrings, and fail if there are too many.

The limits, per 10,000 words, are about twice the rates in well-edited scientific documentation. Semicolons in
docstrings also separate units. Code, tables and formulas are left out.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

#: Most occurrences of a pattern in pages and in docstrings.
LIMITS = {
    r"\bwhat\b": (12, 24),
    r"\b(?:says?|said)\b": (4, 8),
    r"\b(?:tells?|told|asks?|asked)\b": (4, 8),
    r"\b(?:that|those) of\b": (3, 6),
    r"\bwhere\b": (25, 50),
    r";": (20, 80),
    r"\S+(?:\s+[^\s.!?:]+){25,}": (100, 200),  # a sentence of more than 25 words
}
_LEFT_OUT = re.compile(
    r"```.*?```|\$\$.*?\$\$|^ *>>>.*?(?=^\s*$|\Z)|^\|.*?$|^:::+.*?$|<!--.*?-->", re.DOTALL | re.MULTILINE
)


def pages() -> Iterator[str]:
    """Yield the text of each page."""
    listed = subprocess.run(["git", "ls-files", "docs/*.md", "README.md"], cwd=ROOT, check=True, stdout=-1, text=True)
    yield from ((ROOT / name).read_text("utf-8") for name in listed.stdout.split())


def docstrings() -> Iterator[str]:
    """Yield each docstring of the package."""
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
                yield ast.get_docstring(node) or ""


failed = False
for column, (title, texts) in enumerate({"pages": pages(), "docstrings": docstrings()}.items()):
    text = "\n\n".join(re.sub(r"`[^`]*`|\$[^$]*\$", "x", _LEFT_OUT.sub("", each)) for each in texts)
    words = len(re.findall(r"[A-Za-z][A-Za-z'-]*", text))
    print(f"{title}: {words} words")
    for pattern, limits in LIMITS.items():
        rate = 1e4 * len(re.findall(pattern, text, re.IGNORECASE)) / words
        failed |= rate > limits[column]
        print(f"  {pattern}: {rate:.1f} of at most {limits[column]}{' <-' if rate > limits[column] else ''}")
sys.exit(int(failed))
