"""Compiled code, and what in it would round otherwise than IEEE arithmetic does after every operation."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

from rocking.kernels.signatures import named, signatures

#: One rounding for a product and a sum, on processors of Intel's and of ARM's kind.
FUSED = re.compile(r"\t(v?fn?m(?:add|sub|addsub|subadd)\w*|fml[as]\w*)\b")
PRODUCTS = re.compile(r"\t(v?mul[sp]d|fmul)\b")
#: What lets a compiler change the order of operations or their rounding, and the functions that round once.
RELAXED = re.compile(
    r"= (?:tail |musttail |notail )?(?:f\w+|call) (?:fast|reassoc|contract|arcp|afn|nnan|ninf|nsz)\b"
    r"|@llvm\.fm(?:a|uladd)\b"
)


def compiled_here(names: Sequence[str]) -> tuple[str, str]:
    """Assembly of kernels for this processor, and LLVM's code that it is made of; from numba's cache where it is."""
    from numba import typeof

    machine, middle = [], []
    for name in names:
        kernel, (arguments, *_) = named(name), signatures()[name]
        kernel.compiled.compile(tuple(map(typeof, arguments)))
        for made in kernel.compiled.overloads.values():
            module = made.library._get_module_for_linking()
            machine.append(made.library.codegen._tm.emit_assembly(module))
            middle.append(str(module))
    return "\n".join(machine), "\n".join(middle)


def of_library(file: Path) -> str:
    """Assembly of a library, as binutils' objdump reads it from the file."""
    command = ["objdump", "--disassemble", "--no-show-raw-insn", str(file)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout
