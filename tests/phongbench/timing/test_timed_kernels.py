"""What is timed, and over how much memory."""

import re
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.plan import Cell
from phongbench.results.machine import Caches
from phongbench.timing import blocks, timed_kernels
from phongbench.timing.timed_kernels import TimedFormula, timed_formulas

MIB = 1 << 20
LYON = TimedFormula.of("lyon:difference:8", FLOAT32)
compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")


def cells(
    approximation: str = "lyon",
    forms: tuple[str, ...] = ("dot",),
    alphas: tuple[float, ...] = (50.0,),
    gammas: tuple[int | None, ...] = (8,),
    slopes: tuple[str, ...] = ("taylor",),
    spaces: tuple[str, ...] = ("reflect",),
    precisions: tuple[str, ...] = ("float32",),
) -> list[Cell]:
    axes = product(forms, alphas, gammas, slopes, spaces, precisions)
    return [Cell(Formula(approximation, form, g, slope, space), a, p) for form, a, g, slope, space, p in axes]


def test_cells_that_differ_in_alpha_or_slope_only_are_timed_once() -> None:
    (only,) = timed_formulas(cells(alphas=(10.0, 20.0), slopes=("taylor", "minimax")))
    assert only.key == ("lyon", "dot", "reflect", 8, "float32", "pair", "none")
    assert only.alpha == timed_kernels.ALPHA
    assert only.formula == Formula.parse("lyon:dot:8")


def test_form_space_gamma_and_precision_are_timed_apart() -> None:
    axes = {"forms": ("dot", "cross"), "gammas": (4, 8), "spaces": ("reflect", "half")}
    assert len(timed_formulas(cells(**axes, precisions=("float32", "float64")))) == 16
    assert len(timed_formulas(cells("phong", ("none",), alphas=(10.0, 50.0), gammas=(None,)))) == 1


def test_float16_is_emulated_and_therefore_not_timed() -> None:
    assert timed_formulas(cells(precisions=("float16",))) == ()
    with pytest.raises(InputError, match="emulated"):
        timed_kernels.compiled(replace(LYON, precision=FLOAT16))


@compiled_only
@pytest.mark.skipif(not jit.ESTIMATES_ROOTS, reason="no instruction estimates roots here")
def test_an_estimate_of_a_root_is_timed_by_the_processors_own_instruction() -> None:
    """Its errors are those of a table of 12 bits; its time is that of the instruction, without a Newton step."""
    (timed,) = timed_formulas([Cell(Formula.parse("phong/estimate"), 50.0, "float32")])
    kernel = timed_kernels.compiled(timed)
    _, assembly = jit.code(kernel.kernel.loop)
    assert "rsqrt" in assembly
    assert not re.search(r"\bv?(sqrt|div)[ps]s\b", assembly)
    a = np.random.default_rng(1).normal(size=(3, 500)).astype(np.float32)
    b, out = (1.5 * a + 0.1 * a[::-1]).astype(np.float32), np.empty(500, np.float32)
    kernel.kernel.fill_pairs(a, b, out)
    exact = TimedFormula.of("phong/each", FLOAT32)
    off = np.abs(out - timed_kernels.compiled(exact).plain(a.astype(float), b.astype(float))).max()
    assert 1e-6 < off <= 50 * 2 * 1.5 * 2.0**-12


def test_where_no_instruction_estimates_roots_none_is_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "ESTIMATES_ROOTS", False)
    names = ("phong/estimate", "lyon:cross:8/estimate", "phong/fast")
    timed = timed_formulas([Cell(Formula.parse(name), 50.0, "float32") for name in names])
    assert [str(one.formula) for one in timed] == ["phong/fast"]


def test_a_formula_that_is_not_accepted_at_the_usual_alpha_keeps_its_own() -> None:
    picky = replace(REGISTRY["phong"], name="picky", accepts=lambda s: s.alpha == 7.0)
    (timed,) = timed_formulas(cells("picky", ("none",), alphas=(7.0,), gammas=(None,)), {"picky": picky})
    assert timed.alpha == 7.0


@compiled_only
def test_every_block_holds_the_exact_powers_and_the_ceilings() -> None:
    names = [c.name for c in timed_kernels.companions(FLOAT32)]
    assert {"phong", "aa-twin", "phong-libm", "copy", "triad", "dot", "fma"} <= set(names)
    assert ("integer-power" in names) == ("integer-power" in REGISTRY)
    twin, phong = (next(c for c in timed_kernels.companions(FLOAT32) if c.name == n) for n in ("aa-twin", "phong"))
    assert twin.kernel.loop is phong.kernel.loop


def test_recipes_are_timed_with_light_and_viewer_at_infinity_too() -> None:
    """In the first cache, beside the same from N, L and V; and from their own rows: N alone."""
    names = ("phong@reflect", "phong@lengthwise/once", "blinn@halfway/once", "phong@reflect/each", "phong/once")
    timed = timed_formulas([Cell(Formula.parse(name), 50.0, "float32") for name in names])
    far = [one for one in timed if one.far]
    assert {(one.name, str(one.formula)) for one in far} == {
        ("far-phong", "phong@reflect"),
        ("far-phong", "phong@lengthwise/once"),
        ("far-blinn", "blinn@halfway/once"),
    }
    assert len({one.key for one in timed}) == len(timed) == 8


@compiled_only
@pytest.mark.parametrize("spelling", timed_kernels.AT_INFINITY)
def test_a_kernel_at_infinity_takes_the_first_l_and_v_for_all(spelling: str) -> None:
    n, vl = np.random.default_rng(1).normal(size=(3, 200)), np.random.default_rng(2).normal(size=(6, 200))
    n += 3 * vl[:3, :1] / np.linalg.norm(vl[:3, 0]) + 3 * vl[3:, :1] / np.linalg.norm(vl[3:, 0])
    near = TimedFormula.of(spelling, FLOAT64, alpha=2.0)
    found, same, out = timed_kernels.compiled(replace(near, far=True)), timed_kernels.compiled(near), np.empty((2, 200))
    found.kernel.fill_pairs(n, vl, out[0])
    same.kernel.fill_pairs(n, np.repeat(vl[:, :1], 200, axis=1), out[1])
    assert (out[1] > 0.01).sum() > 50
    np.testing.assert_allclose(out[0], out[1], rtol=1e-12)
    np.testing.assert_allclose(out[0], found.plain(n, vl), atol=1e-12)


@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64])
@pytest.mark.parametrize("total", [1, 24 << 10, MIB, 32 * MIB])
def test_rows_do_not_alias_and_fill_the_working_set(precision: Any, total: int) -> None:
    row = blocks.elements_of(total, precision) * precision.carrier.itemsize
    assert row // 512 % 2 == 1
    assert row % 512 == 0
    assert abs(timed_kernels.ROWS * row - total) <= timed_kernels.ROWS * 512


@pytest.mark.parametrize(
    ("caches", "sizes"),
    [
        (Caches(32 << 10, MIB, 8 * MIB), [32, 16]),
        (Caches(32 << 10, MIB, 32 * MIB), [128, 64]),
        (Caches(32 << 10, MIB, 100 * MIB), [256]),
        (Caches(48 << 10, 2 * MIB, 480 * MIB), [256, 128, 64, 32, 16]),
    ],
)
def test_memory_is_beyond_the_last_cache_where_the_cap_allows_it(caches: Caches, sizes: list[int]) -> None:
    assert [size / MIB for size in blocks.memory_sizes(caches)] == sizes
