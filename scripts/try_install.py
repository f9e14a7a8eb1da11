"""Install a wheel or a source distribution into an empty environment, and simulate there.

python scripts/try_install.py dist/rocking-*.whl            # with this Python and the pinned versions
python scripts/try_install.py FILE --python python3.12 python3.13 --extras --sizes

Each environment is new, in a temporary folder, and knows nothing of the source tree.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

#: A simulation; it rocks.
SIMULATION = "simulate el-centro-meloland-270 --width 0.24 --height 1.1 --json"

#: What each extra is for, as a program that fails without it.
USES = {
    "formats": "import obspy.core",
    "excel": "import pandas; pandas.DataFrame({'a': [1.0]}).to_excel('table.xlsx')",
    "explorer": "import uvicorn, rocking.explorer.launch, rocking.explorer.server",
    "browser": "import playwright.sync_api",
    "cluster": "import distributed, dask_jobqueue",
    "parquet": "import pandas; pandas.DataFrame({'a': [1.0]}).to_parquet('table.parquet')",
    "mesh": "import rocking; rocking.Solid.from_mesh('statue')",
}


class Environment:
    """An empty environment with a package in it."""

    def __init__(self, python: str, folder: Path, package: str) -> None:
        subprocess.run([python, "-m", "venv", "--without-pip", str(folder)], check=True)
        self.folder = folder
        self.programs = folder / ("Scripts" if os.name == "nt" else "bin")
        self.python = self.programs / ("python.exe" if os.name == "nt" else "python")
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(self.python)]
        options = ["install", "-qq", "--no-compile", "-c", str(ROOT / "constraints.txt")]
        subprocess.run([*pip, *options, package], check=True)

    def run(self, *command: str | Path) -> str:
        """Run a program of the environment in its folder; what it prints."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROCKING"))}
        done = subprocess.run(command, cwd=self.folder, env=kept, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"error: {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
        return done.stdout

    def sizes(self) -> Counter[str]:
        """Bytes of each package that was installed, libraries beside it included."""
        (packages,) = {path.parent for path in self.folder.glob("**/site-packages/numpy")}
        found: Counter[str] = Counter()
        for path in packages.rglob("*"):
            if path.is_file() and not path.is_symlink():
                name = path.relative_to(packages).parts[0]
                found[re.split(r"\.libs|-[0-9].*\.dist-info|\.py", name)[0].lower()] += path.stat().st_size
        return found


def tried(environment: Environment) -> str:
    """Simulate with nothing but the base dependencies."""
    rocking = environment.programs / "rocking"
    told = environment.run(rocking, "--version", "--verbose")
    (kernels,) = re.findall(r"^compiled code +(.*)$", told, re.MULTILINE)
    found = json.loads(environment.run(rocking, *SIMULATION.split()))
    if not found["impacts_resolved"]:
        sys.exit(f"error: `rocking {SIMULATION}` found no impact")
    return kernels


def main() -> None:
    """Try a file with each Python, and each extra alone with the first."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("file", type=Path, help="wheel or source distribution")
    parser.add_argument("--python", nargs="+", default=[sys.executable], help="interpreters; by default this one")
    parser.add_argument("--extras", action="store_true", help="try every extra alone, too")
    parser.add_argument("--sizes", action="store_true", help="print what each package takes")
    options = parser.parse_args()
    package = str(options.file.resolve(strict=True))
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    with tempfile.TemporaryDirectory() as name:
        for k, python in enumerate(options.python):
            environment = Environment(python, Path(name) / f"base-{k}", package)
            print(f"{python}: base; kernels: {tried(environment)}", flush=True)
            if options.sizes:
                sizes = environment.sizes()
                print("\n".join(f"{size / 1e6:8.1f} MB  {each}" for each, size in sizes.most_common(25)))
                print(f"{sum(sizes.values()) / 1e6:8.1f} MB  in all")
        for extra in (each for each in extras if options.extras and each in USES):
            environment = Environment(options.python[0], Path(name) / extra, f"{package}[{extra}]")
            environment.run(environment.python, "-c", USES[extra])
            print(f"{options.python[0]}: {extra}", flush=True)


if __name__ == "__main__":
    main()
