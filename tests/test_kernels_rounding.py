"""The compiled code rounds after every operation, as IEEE arithmetic does: the proofs rest on it."""

import re

import pytest
from oracles.rounding import FUSED, PRODUCTS, RELAXED, compiled_here

from rocking.kernels import compiled
from rocking.kernels.signatures import signatures

pytestmark = pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")


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
    machine, middle = compiled_here(names)
    bodies = re.findall(r"^define .*@", middle, re.MULTILINE)
    assert len(bodies) >= len(names)
    assert len(PRODUCTS.findall(machine)) >= 20 * len(names)
    assert middle.count("fmul double") >= 20 * len(names)
    assert not FUSED.findall(machine)
    assert not RELAXED.findall(middle)
