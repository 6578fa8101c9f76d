"""Loops that differ only in their bodies are compiled by numba once, and each computes by its own."""

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from phongbench.compiler import inlining, intrinsics, jit, templates
from phongbench.compiler.precisions import Array

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="without the compiler nothing is compiled")


def doubled(x: float) -> float:
    return x + x


def capped(x: float) -> float:
    """A body with a branch, which cannot be written by running it."""
    if x > 1.0:
        return 1.0
    return x


def by_other_means(x: float) -> float:
    """What Python's values can do and written ones cannot: a power, a loop, a name that is None."""
    total, nothing = 0.0, NOTHING
    for part in (x, x):
        total += part**3 if nothing is None else part
    return total


def squared_less(x: float) -> float:
    return x * x - (1 - 2.0**-29)


NOTHING = None
twice, cap, less, other = (jit.inline(body, np.float64) for body in (doubled, capped, squared_less, by_other_means))


def _signature(dtype: Any) -> Any:
    return jit.signature(jit.array_type(dtype), jit.array_type(dtype))


_at = intrinsics.function_at(_signature)


@jit.driver
def _call(address: int, x: Array, out: Array) -> None:
    _at(address, x)(x, out)


def loop_of(body: Any, offset: Any, *, wanted: bool = True, fused: bool = True) -> Callable[[float], float]:
    """Compiled out = body(x) + offset, or x + offset if the body is not wanted."""

    def loop(x: Array, out: Array) -> None:
        for i in range(len(out)):
            out[i] = (body(x[i]) if wanted else x[i]) + offset

    compiled = jit.elementwise(_signature(np.float64), loop, fused=fused)

    def value(x: float) -> float:
        out = np.empty(1)
        _call(jit.address(compiled), np.array([x]), out)
        return float(out[0])

    return value


def test_a_second_body_needs_no_template_of_its_own_and_is_its_own_loop() -> None:
    first, before = loop_of(twice, np.float64(0.25)), len(templates._TEMPLATES)
    second = loop_of(cap, np.float64(0.25))
    assert len(templates._TEMPLATES) == before
    assert [(first(x), second(x)) for x in (3.0, 0.5)] == [(6.25, 1.25), (1.25, 0.75)]
    assert first(3.0) == 6.25, "what was compiled later must not take the first one's name"


def test_what_a_loop_has_beside_bodies_is_part_of_its_template() -> None:
    """Equal numbers of other types or signs are other numbers."""
    zeros = [loop_of(twice, zero) for zero in (np.float64(-0.0), np.float64(0.0), 0)]
    assert [str(zero(-0.0)) for zero in zeros] == ["-0.0", "0.0", "0.0"]
    assert loop_of(twice, np.float64(0.0), wanted=False)(3.0) == 3.0
    near = 1 - 2.0**-30  # its square is not the rounded one
    apart, fused = (loop_of(less, np.float64(0.0), fused=fused)(near) for fused in (False, True))
    assert (apart, fused) == (squared_less(near), 2.0**-60)


@pytest.mark.parametrize("x", [-0.0, 0.7, 5.0, float("inf"), float("nan")], ids=str)
def test_bodies_with_and_without_branches_give_what_they_are(x: float) -> None:
    for body, plain in ((twice, doubled), (cap, capped), (other, by_other_means)):
        assert str(loop_of(body, np.float64(-0.0))(x)) == str(plain(x))


def test_a_body_is_known_by_its_function_alone() -> None:
    assert inlining.typed(twice) is not None
    assert [inlining.typed(value) for value in (loop_of, np.float32, 1.0, np.zeros(1), None)] == [None] * 5


def test_loops_of_one_template_that_two_processes_cached_keep_apart_in_a_third(tmp_path: Any) -> None:
    code = (
        "import sys, numpy as np\n"
        "from phongbench.formulas.kernel import evaluate\n"
        "from phongbench.formulas.registry import REGISTRY\n"
        "from phongbench.formulas.spec import Setting\n"
        "for gamma in map(int, sys.argv[1:]):\n"
        "    print(evaluate(REGISTRY['lyon'], Setting(64.0, gamma, 'taylor'), np.array([1 / 64]))[0].hex())\n"
    )
    environment = os.environ | {"PHONGBENCH_CACHE": str(tmp_path)}

    def values(*gammas: int) -> list[float]:
        command = [sys.executable, "-c", code, *map(str, gammas)]
        done = subprocess.run(command, env=environment, capture_output=True, check=True, text=True)
        return [float.fromhex(line) for line in done.stdout.split()]

    apart = [*values(4), *values(16)]
    assert values(4, 16) == apart
    assert apart == [(1 - 1 / 4) ** 4, pytest.approx((1 - 1 / 16) ** 16, rel=1e-15)]
