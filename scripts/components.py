"""List what an installation of the pinned versions holds, as a CycloneDX document that is checked to be valid.

python scripts/components.py           # dist/rocking-VERSION.cdx.json
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Install the package without extras into an empty environment, and describe that."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    target = ROOT / "dist" / f"rocking-{version}.cdx.json"
    target.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", name], check=True)
        (python,) = (path for path in Path(name).glob("*/python*") if path.stem == "python")
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(python), "install"]
        pinned = ["-c", str(ROOT / "constraints.txt")]
        subprocess.run([*pip, "-qq", "--no-compile", *pinned, str(ROOT)], check=True)
        described = ["environment", "--pyproject", str(ROOT / "pyproject.toml"), "--output-reproducible"]
        written = ["--output-format", "JSON", "--spec-version", "1.6", "--output-file", str(target)]
        subprocess.run([sys.executable, "-m", "cyclonedx_py", *described, *written, str(python)], check=True)
    text = target.read_text("utf-8")
    if error := JsonStrictValidator(SchemaVersion.V1_6).validate_str(text):
        sys.exit(f"error: {target.name} is no valid CycloneDX document: {error}")
    names = {component["name"].lower().replace("_", "-") for component in json.loads(text)["components"]}
    if missing := {"numpy", "scipy"} - names:
        sys.exit(f"error: {target.name} does not list {', '.join(sorted(missing))}")
    print(f"{target.relative_to(ROOT)}: {len(names)} components")


if __name__ == "__main__":
    main()
