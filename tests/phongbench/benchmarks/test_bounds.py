"""The least time of a loop: what is counted in its code, by hand and by law, and what follows from rates."""

import itertools
import platform

import numpy as np
import pytest

from phongbench.benchmarks import bounds
from phongbench.benchmarks.bounds import BYTES, CALIBRATED, PORTS, ROOTS, VECTORS, Work, counted, excuses
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.results.schema import DOT, FMA
from phongbench.timing.ceilings import bare_loop
from phongbench.timing.timed_kernels import CHAIN, TimedFormula, compiled

on_x86 = pytest.mark.skipif(
    jit.DISABLED or platform.machine().lower() not in ("x86_64", "amd64"), reason="x86's code of vectors is counted"
)
#: two vectors of eight: a constant, a value for all lanes and a spilled one are no bytes of arrays
LOOP = """
.LBB0_1:
\tvmovaps\t%ymm0, (%rsp)
.LBB0_2:
\tvmovups\t(%rdi,%rax,4), %ymm0
\tvmulps\t32(%rsi,%rax,4), %ymm0, %ymm1
\tvfmadd231ps\t.LCPI0_0(%rip), %ymm0, %ymm1
\tvaddps\t(%rcx){1to8}, %ymm1, %ymm1
\tvminps\t(%rsp), %ymm1, %ymm1
\tvmovaps\t%ymm1, %ymm2
\tvmovups\t%ymm1, -64(%rdx,%rax,4)
\taddq\t$16, %rax
\tjne\t.LBB0_2
\tvmulps\t%ymm0, %ymm0, %ymm0
\tjmp\t.LBB0_1
.LBB0_3:
\tvmulss\t(%rdi,%rax,4), %xmm0, %xmm0
\tvmovss\t%xmm0, (%rdx,%rax,4)
\tjne\t.LBB0_3
"""


def test_by_hand() -> None:
    work = counted(LOOP, 4)
    assert work == Work(multiply_adds=2 / 8, vectors=4 / 8, bytes=12.0, lanes=8)


def test_a_frame_pointer_is_the_stack_and_without_a_frame_a_register_like_others() -> None:
    text = LOOP.replace("%rdi", "%rbp")
    assert counted(text, 4) == counted(LOOP, 4)
    framed = counted("\tmovq\t%rsp, %rbp\n" + text, 4)
    assert framed is not None
    assert framed.bytes == 8


@pytest.mark.parametrize("text", ["", "\tret\n", ".L1:\n\tfmul\tv0.4s, v1.4s, v2.4s\n\tb.ne\t.L1\n"])
def test_other_code_is_not_counted(text: str) -> None:
    assert counted(text, 4) is None


@on_x86
@pytest.mark.parametrize(("name", "multiply_adds", "moved"), [(DOT, 3, 28), (FMA, CHAIN, 8)])
def test_loops_ask_what_their_formula_asks(name: str, multiply_adds: int, moved: int) -> None:
    work = bounds.of_loop(bare_loop(name, FLOAT32))
    assert work is not None
    assert (work.multiply_adds * work.lanes, work.bytes) == (multiply_adds, moved)


@on_x86
def test_each_squaring_is_one_more_multiplication_and_not_a_byte() -> None:
    works = [bounds.of_loop(compiled(TimedFormula.of(f"lyon:dot:{2**n}", FLOAT32)).kernel.loop) for n in (1, 3, 5)]
    asked = [(w.multiply_adds * w.lanes, w.vectors * w.lanes, w.bytes) for w in works if w is not None]
    assert [b[0] - a[0] for a, b in itertools.pairwise(asked)] == [2, 2]
    assert [b[1] - a[1] for a, b in itertools.pairwise(asked)] == [2, 2]
    assert {moved for *_, moved in asked} == {28}


@on_x86
@pytest.mark.parametrize("unit", CALIBRATED)
def test_a_calibrating_loop_asks_for_its_unit(unit: str) -> None:
    a = np.linspace(0.1, 0.9, 3 * 256, dtype=np.float32).reshape(3, 256)
    out = np.full(256, np.nan, np.float32)
    bounds.calibrating(unit, a, a, out)()
    assert not np.isnan(out).all()
    if unit == ROOTS:  # two to an element, and both on the slow unit
        code = bounds.jit.code(bounds._busy(unit)[0])[1]
        assert {name: code.count(name) > 0 for name in ("sqrtps", "divps")} == {"sqrtps": True, "divps": True}
        np.testing.assert_allclose(out, 0.75 / np.sqrt(a[0] ** 2 + 0.75) + 0.75 / np.sqrt(a[0] ** 2 + 0.5), rtol=1e-6)
        assert bounds.rate(unit, 4.0) == 0.5
        return
    work = bounds.of_loop(bounds._busy(unit)[0], 8 if unit == VECTORS else 4)
    assert work is not None
    if unit == BYTES:
        assert work.bytes == 28
        np.testing.assert_allclose(out, 2 * a.sum(axis=0), rtol=1e-6)
    else:  # nothing but its unit, and little that is moved for it
        assert work.of(unit) == work.vectors >= work.bytes / 8
        assert (work.multiply_adds > 0) == (unit == PORTS)


def test_the_scarcest_unit_decides() -> None:
    work = Work(multiply_adds=0.5, vectors=1.0, bytes=28.0, lanes=16)
    rates = {PORTS: 4.0, VECTORS: 4.0, BYTES: 280.0}
    assert work.bound(rates) == (0.25, VECTORS)
    assert work.bound(rates | {PORTS: 1.0}) == (0.5, PORTS)
    assert work.bound(rates | {BYTES: 28.0}) == (1.0, BYTES)


def test_a_time_far_above_its_bound_is_explained_by_what_is_known() -> None:
    row = {"work": "lyon", "working_set": "l2", "over_bound": 1.29, "ns": 0.5, "serial": 0.6}
    assert excuses([row]) == []
    assert "in turn they would take 0.6 ns" in excuses([row | {"over_bound": 1.4}])[0]
    assert "waits of its own steps" in excuses([row | {"over_bound": 1.4, "ns": 0.7}])[0]
