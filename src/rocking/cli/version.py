"""`rocking --version`: the version, and what the answers come from."""

from __future__ import annotations

import platform
from importlib import metadata

import rocking
from rocking.kernels import compiled


def version(*, verbose: bool = False) -> None:
    """Display the version.

    Parameters
    ----------
    verbose
        Add the versions of Python and of the libraries below, and which compiled code serves this installation.
    """
    if not verbose:
        print(rocking.__version__)
        return
    below = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy"))
    rows = {
        "rocking": rocking.__version__,
        "Python": f"{platform.python_version()} on {platform.platform()}",
        "packages": below,
        "compiled code": compiled.state(),
    }
    for name, value in rows.items():
        print(f"{name:13}  {value}")
