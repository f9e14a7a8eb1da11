"""The rules of the examples by which JAX and PyTorch differentiate a peak, with them and with stand-ins for them."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rocking.core.arrays import Floats

EXAMPLES = Path(__file__).resolve().parents[1] / "docs" / "howto"
#: One second of a sine and a half, m/s^2, in the steps of the examples, and a change of all samples.
SAMPLES = 3.4 * np.sin(2.0 * np.pi * 1.5 * 0.02 * np.arange(51))
CHANGE = np.cos(np.arange(51.0))


class Tensor(np.ndarray):
    """An array that answers to what the rule for PyTorch asks of a tensor."""

    device = "cpu"

    def detach(self) -> "Tensor":
        return self

    cpu = detach

    def numpy(self) -> Floats:
        return np.asarray(self)

    def new_tensor(self, value: float) -> Floats:
        return np.asarray(value)


def stand_in_for_torch() -> ModuleType:
    module: Any = ModuleType("torch")
    module.autograd = SimpleNamespace(Function=object)
    module.as_tensor = lambda values, dtype, device: np.asarray(values, dtype=dtype)
    return module


def stand_in_for_jax() -> tuple[ModuleType, ModuleType]:
    class Rule:
        def __init__(self, function: Any) -> None:
            self.function = function

        def __call__(self, *arguments: Any) -> Any:
            return self.function(*arguments)

        def defvjp(self, forward: Any, backward: Any) -> None:
            self.forward, self.backward = forward, backward

    def called(function: Any, shapes: Any, *arguments: Any, vmap_method: str) -> Any:
        found = function(*arguments)
        assert [np.shape(each) for each in found] == [each.shape for each in shapes]
        return found

    module: Any = ModuleType("jax")
    numbers: Any = ModuleType("jax.numpy")
    numbers.float64 = np.float64
    module.numpy, module.custom_vjp, module.pure_callback = numbers, Rule, called
    module.config = SimpleNamespace(update=lambda name, value: None)
    module.ShapeDtypeStruct = lambda shape, dtype: SimpleNamespace(shape=shape, dtype=dtype)
    return module, numbers


def slope_of(peak: Any) -> float:
    """Change of a peak along `CHANGE`, by central differences extrapolated."""
    wide, narrow = (
        (float(peak(SAMPLES + h * CHANGE)) - float(peak(SAMPLES - h * CHANGE))) / (2.0 * h) for h in (1e-3, 5e-4)
    )
    return (4.0 * narrow - wide) / 3.0


def test_the_rule_for_pytorch_is_that_of_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", stand_in_for_torch())
    rule = runpy.run_path(str(EXAMPLES / "gradient_torch.py"))["Peak"]
    kept: list[Any] = []

    def peak(samples: Floats) -> Any:
        return rule.forward(SimpleNamespace(save_for_backward=kept.append), samples.view(Tensor))

    expected = slope_of(peak)
    assert 0.01 < peak(SAMPLES) < 0.3
    back = rule.backward(SimpleNamespace(saved_tensors=(kept[-1],)), 3.0)
    assert float(back @ CHANGE) == pytest.approx(3.0 * expected, rel=1e-8)
    assert abs(expected) > 1e-3


def test_the_rule_for_jax_is_that_of_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, module in zip(("jax", "jax.numpy"), stand_in_for_jax(), strict=True):
        monkeypatch.setitem(sys.modules, name, module)
    peak = runpy.run_path(str(EXAMPLES / "gradient_jax.py"))["peak"]
    expected = slope_of(peak)
    height, kept = peak.forward(SAMPLES)
    assert 0.01 < height == peak(SAMPLES) < 0.3
    (back,) = peak.backward(kept, 3.0)
    assert float(back @ CHANGE) == pytest.approx(3.0 * expected, rel=1e-8)
    assert abs(expected) > 1e-3
