"""The compiled code rounds after every operation, as IEEE arithmetic does: the proofs rest on it."""

import shutil
from pathlib import Path

import pytest
from oracles.rounding import FUSED, PRODUCTS, RELAXED, assembly, translated

from rocking.kernels import library
from rocking.kernels.signatures import signatures


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


def test_no_product_and_sum_are_rounded_once() -> None:
    if shutil.which("objdump") is None:
        pytest.skip("objdump is not installed")
    libraries = library.manifest()["libraries"]
    assert libraries
    for each in libraries:
        machine = assembly(library.FOLDER / each["file"])
        assert len(PRODUCTS.findall(machine)) >= 20 * len(signatures())
        assert not FUSED.findall(machine)


@pytest.mark.slow
def test_no_operation_may_be_reordered(tmp_path: Path) -> None:
    middle = translated(tmp_path)
    assert middle.count("fmul double") >= 20 * len(signatures())
    assert not RELAXED.findall(middle)
