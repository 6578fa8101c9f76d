"""pb.specular, pb.curve and pb.shader: the kernels' own values for arrays of any layout, or what was expected."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

import phongbench as pb
from phongbench.errors import InputError, UnknownNameError
from phongbench.face import highlight
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import highlights

FORMULA, ALPHA, COUNT = "lyon:cross:8:minimax", 50.0, 1001


def directions(count: int = COUNT, dtype: Any = np.float32) -> tuple[Any, Any]:
    """Pairs (count, 3) near each other, so that most highlights are neither 0 nor 1."""
    rng = np.random.default_rng(1)
    a = rng.normal(size=(count, 3))
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    return a.astype(dtype), (a + 0.1 * rng.normal(size=a.shape)).astype(dtype)


def expected(a: Any, b: Any, dtype: Any = np.float32) -> Any:
    """The timed kernel's values of (n, 3) pairs."""
    formula = Formula.parse(FORMULA)
    precision = highlight.FLOAT32 if dtype == np.float32 else highlight.FLOAT64
    values = highlights(formula.spec(), "cross", formula.setting(ALPHA), a, b, precision=precision, layout="aos")
    assert 0.2 < np.mean((values > 0.01) & (values < 0.99)) < 1
    return values


LAYOUTS = {
    "(N, 3)": lambda v: v,
    "(3, N)": lambda v: np.ascontiguousarray(v.T),
    "(N, 3) by columns": np.asfortranarray,
    "(3, N) of rows": lambda v: v.T,
    "strided": lambda v: np.repeat(v, 2, axis=0)[::2],
    "a list": lambda v: v.tolist(),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_kernels_values(layout: str, dtype: Any) -> None:
    a, b = directions(dtype=dtype)
    values = pb.specular(LAYOUTS[layout](a), LAYOUTS[layout](b), FORMULA, alpha=ALPHA)
    assert values.dtype == (np.float64 if layout == "a list" else dtype)
    np.testing.assert_allclose(values, expected(a, b, dtype), rtol=0, atol=2e-6)


def test_both_sides_may_be_laid_out_differently() -> None:
    a, b = directions()
    values = pb.specular(a, np.ascontiguousarray(b.T), FORMULA, alpha=ALPHA)
    np.testing.assert_array_equal(values, pb.specular(a, b, FORMULA, alpha=ALPHA))


@pytest.mark.parametrize("by_rows", [False, True])
def test_contiguous_arrays_are_used_as_they_are(by_rows: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = (v.T.copy() if by_rows else v for v in directions())
    a.flags.writeable = b.flags.writeable = False
    seen: list[Any] = []
    monkeypatch.setattr(highlight, "_fill", lambda kernel, pair, *rest: seen.extend(pair))
    pb.specular(a, b, FORMULA, alpha=ALPHA, out=np.empty(COUNT, np.float32))
    assert np.shares_memory(seen[0], a)
    assert np.shares_memory(seen[1], b)
    pb.specular(b[:, 0] if by_rows else b[0], a, FORMULA, alpha=ALPHA)
    assert np.shares_memory(seen[3], a)


def test_read_only_arrays_are_taken() -> None:
    a, b = directions()
    wanted = pb.specular(a, b, FORMULA, alpha=ALPHA)
    a.flags.writeable = b.flags.writeable = False
    np.testing.assert_array_equal(pb.specular(a, b, FORMULA, alpha=ALPHA), wanted)


@pytest.mark.parametrize("by_rows", [False, True])
@pytest.mark.parametrize("threads", [1, 3])
def test_a_single_vector_is_paired_with_every_other(
    threads: int, by_rows: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(highlight, "BLOCK", 100)
    a, b = directions()
    same = np.broadcast_to(b[7], a.shape)
    wanted = [pb.specular(*pair, FORMULA, alpha=ALPHA) for pair in ((a, same), (same, a))]
    many = np.ascontiguousarray(a.T) if by_rows else a
    for one in (b[7], b[7:8], b[7:8].T):
        np.testing.assert_array_equal(pb.specular(many, one, FORMULA, alpha=ALPHA, threads=threads), wanted[0])
        np.testing.assert_array_equal(pb.specular(one, many, FORMULA, alpha=ALPHA, threads=threads), wanted[1])


@pytest.mark.parametrize("by_rows", [False, True])
def test_threads_change_no_value(by_rows: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(highlight, "BLOCK", 64)
    a, b = (np.ascontiguousarray(v.T) if by_rows else v for v in directions())
    values = [pb.specular(a, b, FORMULA, alpha=ALPHA, threads=n) for n in (1, 2, 5)]
    np.testing.assert_array_equal(values[1], values[0])
    np.testing.assert_array_equal(values[2], values[0])


def test_out_is_filled_and_returned() -> None:
    a, b = directions()
    out = np.full(COUNT + 2, -1, np.float32)
    assert pb.specular(a, b, FORMULA, alpha=ALPHA, out=out[1:-1]).base is out
    np.testing.assert_array_equal(out[1:-1], pb.specular(a, b, FORMULA, alpha=ALPHA))
    assert (out[0], out[-1]) == (-1, -1)


def test_three_by_three_is_read_as_three_vectors() -> None:
    a, b = directions(3)
    singly = [float(pb.specular(*pair, FORMULA, alpha=ALPHA)) for pair in zip(a, b, strict=True)]
    assert pb.specular(a, b, FORMULA, alpha=ALPHA).tolist() == singly


def test_two_vectors_give_one_number() -> None:
    value = pb.specular([0, 0, 1], [0, 0, 1], alpha=5)
    assert value.shape == ()
    assert float(value) == 1


def test_no_vectors_give_no_values() -> None:
    assert pb.specular(np.zeros((0, 3)), np.zeros((0, 3)), alpha=5).shape == (0,)
    assert pb.specular(np.zeros((3, 0)), [0, 0, 1], alpha=5).shape == (0,)


@pytest.mark.parametrize(
    ("one", "other", "wanted"),
    [
        (np.float32, np.float32, np.float32),
        (np.float32, np.float64, np.float64),
        (np.float16, np.float32, np.float32),
        (np.int32, np.float32, np.float64),
        (np.int32, np.int32, np.float64),
        (">f8", "<f8", np.float64),
    ],
)
def test_the_wider_type_is_computed_in(one: Any, other: Any, wanted: Any) -> None:
    values = pb.specular(np.eye(3).astype(one), np.eye(3).astype(other), alpha=5)
    assert values.dtype == wanted
    assert values.tolist() == [1, 1, 1]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"a": np.ones((4, 2))}, r"a of shape \(4, 2\)\n?.*\(N, 3\), \(3, N\)"),
        ({"a": np.ones(4)}, "a of shape"),
        ({"b": np.ones((5, 3))}, "4 vectors in a and 5 in b"),
        ({"a": np.ones((4, 3), complex)}, "complex128"),
        ({"a": np.full((4, 3), "x")}, "a holds <U1"),
        ({"out": np.empty(5)}, r"float64 of shape \(5,\)"),
        ({"out": np.empty(4, np.float32)}, "float32 of shape"),
        ({"out": np.empty(8)[::2]}, "strided"),
        ({"out": [0.0] * 4}, "list"),
        ({"threads": 0}, "0 threads"),
        ({"alpha": -1}, "alpha"),
        ({"alpha": "x"}, "not a number"),
        ({"formula": "lyon:8"}, "lambda form"),
        ({"formula": "lyon:dot"}, "gamma"),
        ({"formula": 3}, "spelling"),
    ],
)
def test_what_does_not_fit_is_refused_with_what_was_expected(change: dict[str, Any], said: str) -> None:
    given = {"a": np.ones((4, 3)), "b": np.ones((4, 3)), "formula": "lyon:dot:8", "alpha": 10} | change
    with pytest.raises(InputError, match=said) as refused:
        pb.specular(given.pop("a"), given.pop("b"), given.pop("formula"), **given)
    assert refused.value.where or refused.value.fix


def test_a_wrong_name_lists_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'lyon'"):
        pb.specular([0, 0, 1], [0, 0, 1], "lyn:dot:8", alpha=10)


def test_out_that_overlaps_the_vectors_is_refused() -> None:
    rows = np.ones((3, 4))
    with pytest.raises(InputError, match="shares memory"):
        pb.specular(rows, rows, alpha=5, out=rows[0])


def test_a_curve_tells_value_truth_and_error() -> None:
    table = pb.curve(FORMULA, alpha=ALPHA)
    assert list(table) == ["angle_degrees", "value", "exact", "error"]
    assert (len(table), table["angle_degrees"].iloc[-1]) == (361, 90)
    np.testing.assert_allclose(table["exact"], np.cos(np.radians(table["angle_degrees"])).clip(0) ** ALPHA, atol=1e-15)
    coarse = pb.curve(FORMULA, alpha=ALPHA, degrees=[0, 10], precision="float16")
    assert 0 < np.abs(coarse["value"] - pb.curve(FORMULA, alpha=ALPHA, degrees=[0, 10])["value"]).max() < 0.1
    with pytest.raises(InputError, match="one dimension"):
        pb.curve(FORMULA, alpha=ALPHA, degrees=3.0)


def test_a_shader_is_a_text_in_the_language() -> None:
    text = pb.shader(FORMULA, alpha=ALPHA, language="wgsl")
    assert "fn highlight(" in text
    assert f"phongbench shader {FORMULA} --alpha 50 --language wgsl" in text
    with pytest.raises(UnknownNameError, match="glsl, hlsl, wgsl, metal, c"):
        pb.shader(FORMULA, alpha=ALPHA, language="basic")


def test_moments_are_rows_for_each_incidence_and_lengths_change_nothing() -> None:
    rows = pb.moments("lyon:dot:8", alpha=50, incidence=[0, 60])
    assert rows["incidence_degrees"].tolist() == [0, 60]
    beta, gamma = 50 / 8, 8
    assert rows["energy"][0] == pytest.approx(2 * np.pi / (beta * (gamma + 1)))
    pd.testing.assert_frame_equal(pb.moments("lyon:dot:8/once", alpha=50, incidence=[0, 60]), rows)
    pd.testing.assert_frame_equal(pb.moments("phong/squared", alpha=50), pb.moments("phong", alpha=50))
    with pytest.raises(InputError, match="outside 0"):
        pb.moments("phong", alpha=50, incidence=91)
    with pytest.raises(InputError):
        pb.moments("phong", alpha=50, incidence="steep")
