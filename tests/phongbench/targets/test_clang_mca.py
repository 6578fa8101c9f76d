"""Processors by clang and llvm-mca: which instructions count, that vectors are used, and what becomes of bad code."""

import ctypes
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.targets import clang_mca
from phongbench.targets.chips import target_named
from phongbench.targets.clang_mca import Loop, Processor
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.measure import bare, costs

HEAD = "static inline float highlight(const float a[3], const float b[3]) {{\n    {}\n}}"
DOT = "a[0] * b[0] + a[1] * b[1] + a[2] * b[2]"
#: a loop within a function, as clang prints it: constants and branches around and within
FUNCTION = """
@ %bb.0:
\tvldr\ts6, .LCPI0_0
.LBB0_1:                                @ =>This Inner Loop Header: Depth=1
\tvldr\ts10, [r3, #768]
\tvcmp.f32\ts10, #0
\tvmrs\tAPSR_nzcv, fpscr
\tble\t.LBB0_3
@ %bb.2:                                @   in Loop: Header=BB0_1 Depth=1
\tvdiv.f32\ts10, s6, s10
.LBB0_3:                                @   in Loop: Header=BB0_1 Depth=1
\tvfma.f32\ts11, s10, s31
\tcmp.w\tr0, #256
\tbne\t.LBB0_1
@ %bb.4:
\tbx\tlr
"""


def processor(name: str) -> Processor:
    found = target_named(name)
    assert isinstance(found, Processor)
    return found


@pytest.fixture
def compiler() -> None:
    if (missing := target_named("zen4").why_not()) is not None:
        pytest.skip(missing)


def test_a_loop_ends_at_its_branch_and_its_instructions_go_to_their_units() -> None:
    loop = Loop.of(FUNCTION, 1)
    assert [name for name, _ in loop.lines] == ["vldr", "vcmp.f32", "vmrs", "ble", "vdiv.f32", "vfma.f32", "cmp.w"]
    assert (loop.specials, loop.text(special=True)) == (1, ["\tvdiv.f32\ts10, s6, s10"])
    assert loop.text()[1] == "\tvcmp.f32\ts10, s0"  # with zero there is no schedule
    counts = loop.counts(5.0, 2.0, 6.0)
    assert (counts.instructions, counts.arithmetic, counts.specials, counts.registers) == (7, 2, 1, 4)


def test_what_is_counted_is_for_an_element() -> None:
    loop = Loop.of(FUNCTION, 4)
    assert loop.counts(6.0, 2.0, 8.0).cycles == 2
    assert loop.counts(6.0, 2.0, 8.0).instructions == 7 / 4


def test_a_call_has_no_schedule() -> None:
    with pytest.raises(InputError, match="a call of powf"):
        Loop.of(FUNCTION.replace("vdiv.f32\ts10, s6, s10", "bl\tpowf"), 1)


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize(
    ("target", "cycles"),
    # of one multiply-add for an element: of vectors of four in half a cycle or in two, of sixteen in one
    [("cortex-a55", 1 / 8), ("cortex-a76", 1 / 8), ("cortex-m7", 1), ("cortex-m55", 1 / 2), ("zen4", 1 / 16)],
)
def test_a_dot_product_is_three_multiply_adds_and_copies(target: str, cycles: float) -> None:
    chip = processor(target)
    found = chip.counted([(bare("c", 2, dot=dot), 4) for dot in (True, False)], (0, 32, 64))
    assert (found[0][2].cycles - found[0][1].cycles) / 4 / 32 == pytest.approx(cycles, rel=0.01)
    assert 3 * cycles <= (found[0][0].cycles - found[1][0].cycles) / 4 <= 5 * cycles


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("target", [target.name for target in clang_mca.TARGETS])
def test_formulas_keep_their_vectors_on_every_core(target: str) -> None:
    chip, names = processor(target), ("phong", "lyon:cross:8", "gaussian:dot", "table-u:dot", "phong/each")
    loops = chip._loops([chip.program(code(Formula.parse(name), 50.0, "c"), 4) for name in names])
    assert {loop.width for loop in loops} == {chip.width}
    assert [loop.specials > 0 for loop in loops] == [False, False, False, False, True]


@pytest.mark.usefixtures("compiler")
def test_own_functions_are_those_that_kernels_use(tmp_path: Path) -> None:
    text = clang_mca._prelude() + '\nextern "C" float run(int f, float x, float y) {\n'
    text += (
        "    return f == 0 ? powf(x, y) : f == 1 ? exp2f(x) : f == 2 ? acosf(x) : f == 3 ? floorf(x) : rintf(x);\n}\n"
    )
    (tmp_path / "own.cpp").write_text(text)
    options = ["-std=c++20", "-w", "-ffreestanding", "-fPIC", "-shared", "-nostdlib", "-o", str(tmp_path / "own.so")]
    subprocess.run([str(clang_mca._tool("clang")), "-x", "c++", *options, str(tmp_path / "own.cpp")], check=True)
    run = ctypes.CDLL(str(tmp_path / "own.so")).run
    run.restype, run.argtypes = ctypes.c_float, [ctypes.c_int, ctypes.c_float, ctypes.c_float]
    points = [0.0, 0.001, 0.25, 0.5, 0.9, 0.999, 1.0]
    assert [run(0, x, 50.0) for x in points] == pytest.approx([x**50 for x in points], abs=1e-6)
    assert [run(1, -80 * x, 0.0) for x in points] == pytest.approx([2 ** (-80 * x) for x in points], rel=1e-6)
    assert [run(2, x, 0.0) for x in points] == pytest.approx(np.arccos(points), abs=1e-6)
    for f, function in ((3, np.floor), (4, np.rint)):
        numbers = [-2.5, -1.5, -0.5, 0.0, 0.49, 0.5, 1.5, 7.9, 1e9]
        assert [run(f, x, 0.0) for x in numbers] == [function(np.float32(x)) for x in numbers]


@pytest.mark.usefixtures("compiler")
def test_code_that_is_none_is_refused_with_the_compilers_words() -> None:
    with pytest.raises(InputError, match=r"clang for cortex-m7 refuses the code: .*nonsense"):
        costs(target_named("cortex-m7"), [Code("mine 50", HEAD.format("return nonsense;"))])


@pytest.mark.usefixtures("compiler")
def test_a_core_that_the_compiler_does_not_know_is_told() -> None:
    with pytest.raises(InputError, match="clang for cortex-m9 refuses"):
        costs(replace(processor("cortex-m7"), name="cortex-m9", chip="cortex-m9"), [bare("c", 2, dot=True)])


def test_without_the_compiler_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clang_mca, "_tool", lambda name: None if name == "llvm-mca" else name)
    with pytest.raises(InputError, match=r"cannot compile for zen4 here: there is no llvm-mca; apt"):
        costs(target_named("zen4"), [])
