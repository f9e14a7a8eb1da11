"""Compiled code, and what in it would round otherwise than IEEE arithmetic does after every operation."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

COMPILING = Path(__file__).resolve().parents[2] / "compiling"

#: One rounding for a product and a sum, on processors of Intel's and of ARM's kind.
FUSED = re.compile(r"\t(v?fn?m(?:add|sub|addsub|subadd)\w*|fml[as]\w*)\b")
PRODUCTS = re.compile(r"\t(v?mul[sp]d|fmul)\b")
#: What lets a compiler change the order of operations or their rounding, and the functions that round once.
RELAXED = re.compile(
    r"= (?:tail |musttail |notail )?(?:f\w+|call) (?:fast|reassoc|contract|arcp|afn|nnan|ninf|nsz)\b"
    r"|@llvm\.fm(?:a|uladd)\b"
)


def translated(folder: Path) -> str:
    """Code of all kernels in LLVM's language, not optimised yet, which the build leaves in a folder."""
    for share in "01":
        _step("lower", folder, share)
    return "\n".join(path.read_text("utf-8") for path in folder.glob("*.ll"))


def optimised(folder: Path, level: str) -> str:
    """Assembly for a level of the processor of what `translated` has left in a folder."""
    _step("optimise", folder, level)
    return assembly(folder / f"{level}.o")


def _step(*arguments: object) -> None:
    environment = os.environ | {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_DISABLE_JIT": "0"}
    subprocess.run([sys.executable, COMPILING / "lowering.py", *map(str, arguments)], env=environment, check=True)


def assembly(file: Path) -> str:
    """Assembly of a library or an object file, as binutils' objdump reads it."""
    command = ["objdump", "--disassemble", "--no-show-raw-insn", str(file)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout
