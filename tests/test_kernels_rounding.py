"""The compiled code rounds after every operation, as IEEE arithmetic does: the proofs rest on it."""

import re

import pytest

from rocking.kernels import compiled
from rocking.kernels.signatures import named, signatures

pytestmark = pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")

#: One rounding for a product and a sum, on processors of Intel's and of ARM's kind.
FUSED = re.compile(r"\t(v?fn?m(?:add|sub|addsub|subadd)\w*|fml[as]\w*)\b")
PRODUCTS = re.compile(r"\t(v?mul[sp]d|fmul)\b")
#: What lets a compiler change the order of operations or their rounding, and the functions that round once.
RELAXED = re.compile(
    r"= (?:tail |musttail |notail )?(?:f\w+|call) (?:fast|reassoc|contract|arcp|afn|nnan|ninf|nsz)\b"
    r"|@llvm\.fm(?:a|uladd)\b"
)


def code(names: tuple[str, ...]) -> tuple[str, str]:
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


def test_a_fused_operation_and_a_relaxed_one_would_be_seen() -> None:
    for line in ("  1:\tc4 e2 \tvfmadd213sd %xmm0,%xmm1,%xmm2", "  1:\t\tvfnmsub231pd %ymm0", "  1:\t\tfmla v0.2d"):
        assert FUSED.search(line)
    for line in (
        "%x = fmul fast double %a, %b",
        "%x = tail call contract double @f(double %a)",
        "declare double @llvm.fma.f64(",
        "%1 = call double @llvm.fmuladd.f64(",
    ):
        assert RELAXED.search(line)
    for line in ("%x = fmul double %a, %b", "%x = tail call double @cos(double %a)", "  1:\t\tvmulsd %xmm0"):
        assert not RELAXED.search(line)
        assert not FUSED.search(line)


@pytest.mark.parametrize(
    "names",
    [
        pytest.param(
            ("ground.fill", "sine.eq65.eq65_time", "oscillator.peak_displacements"),
            marks=pytest.mark.thorough,
            id="some",
        ),
        pytest.param(tuple(signatures()), marks=pytest.mark.slow, id="all"),
    ],
)
def test_no_product_and_sum_are_rounded_once(names: tuple[str, ...]) -> None:
    machine, middle = code(names)
    bodies = re.findall(r"^define .*@", middle, re.MULTILINE)
    assert len(bodies) >= len(names)
    assert len(PRODUCTS.findall(machine)) >= 20 * len(names)
    assert middle.count("fmul double") >= 20 * len(names)
    assert not FUSED.findall(machine)
    assert not RELAXED.findall(middle)
