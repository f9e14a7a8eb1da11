"""Run a program of this folder in a virtual environment of its own: ``python programs/run.py heyoka_events``.

The environment is made in a temporary folder from the line ``# requires: ...`` of the program, and removed after.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
import venv
from pathlib import Path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="name of a file of this folder, without .py")
    given, options = parser.parse_known_args()
    script = Path(__file__).with_name(f"{given.program}.py")
    found = re.search(r"^# requires: (.*)$", script.read_text("utf-8"), re.MULTILINE)
    if found is None:
        parser.error(f"{script.name} has no line '# requires: PACKAGE==VERSION ...'")
    with tempfile.TemporaryDirectory(prefix="accumulation-") as folder:
        venv.create(folder, with_pip=True)
        python = Path(folder) / "bin" / "python"
        subprocess.run([python, "-m", "pip", "install", "-q", *found[1].split()], check=True)
        subprocess.run([python, script, *options], check=True)


if __name__ == "__main__":
    main()
