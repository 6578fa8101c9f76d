"""Lowering: a body keeps its meaning in every precision, or is refused with the line that stands in the way."""

import inspect
import re

import numpy as np
import pytest
from numpy.typing import NDArray

from phongbench.compiler import elementary, intrinsics, jit
from phongbench.compiler.lowering import (
    FLOAT16,
    FLOAT32,
    FLOAT64,
    PRECISIONS,
    Body,
    Precision,
    Table,
    lower,
    precision_named,
)
from phongbench.errors import InputError, KernelError, UnknownNameError
from phongbench.testing import over

THIRD = 1 / 3


def source(body: Body) -> str:
    return str(body.__lowered_source__)  # type: ignore[attr-defined]


def scaled(x: float) -> float:
    return (1.0 - 2 * x) * THIRD


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=PRECISIONS)
def test_literals_and_constants_get_the_working_precision(precision: Precision) -> None:
    lowered = lower(scaled, precision)
    assert not re.search(r"\d\.\d", source(lowered))
    constants = [v for k, v in lowered.__globals__.items() if k.startswith("_c") and k[2:].isdigit()]
    assert {type(c) for c in constants} == {precision.carrier.type}
    assert precision.constant(THIRD) in constants


def test_a_value_keeps_the_type_of_its_precision() -> None:
    assert type(lower(scaled, FLOAT32)(np.float32(0.3))) is np.float32
    assert type(lower(scaled, FLOAT64)(np.float64(0.3))) is np.float64


def test_a_constant_too_large_for_half_is_infinite() -> None:
    assert FLOAT16.constant(1e6) == np.inf


def add(a: float, b: float) -> float:
    return a + b


def subtract(a: float, b: float) -> float:
    return a - b


def multiply(a: float, b: float) -> float:
    return a * b


def divide(a: float, b: float) -> float:
    return a / b


@pytest.mark.parametrize("body", [add, subtract, multiply, divide], ids=lambda b: b.__name__)
def test_every_operation_in_half_is_rounded_as_numpy_rounds_it(body: Body) -> None:
    rng = np.random.default_rng(3)
    a, b = rng.integers(0, 2**16, (2, 200_000), dtype=np.uint16).view(np.float16)
    special = np.array([0, 0x8000, 1, 0x03FF, 0x0400, 0x3C00, 0x3BFF, 0x7BFF, 0x7C00, 0xFC00, 0x7E00], np.uint16)
    left, right = np.meshgrid(special.view(np.float16), special.view(np.float16))
    a, b = np.concatenate([a, left.ravel()]), np.concatenate([b, right.ravel()])
    with np.errstate(all="ignore"):
        expected = body(a, b)
    found = over(body, FLOAT16, a, b).astype(np.float16)
    same = (found.view(np.uint16) == expected.view(np.uint16)) | (np.isnan(found) & np.isnan(expected))
    assert same.all()


def mixed(a: float, b: float) -> float:
    c = a - b
    d = a * b
    return c * c + d * d - c * d


def test_a_sum_of_products_in_half_is_not_fused() -> None:
    """On processors that compute in float16, LLVM would fuse products and sums, and lose the rounding between."""
    a, b = np.random.default_rng(4).normal(size=(2, 50_000)).astype(np.float16)
    assert np.array_equal(over(mixed, FLOAT16, a, b), mixed(a, b).astype(np.float32))


def test_a_loop_over_a_known_range_is_unrolled() -> None:
    text = source(lower(elementary.squared, FLOAT32, n=5))
    assert text.count("x * x") == 1
    assert text.count("result * result") == 4
    assert "for" not in text


def branching(x: float, n: int) -> float:
    total = 0.0
    for k in range(1, n):
        if k == 2:
            total += k * x
        else:
            total -= x / k
    return -total if n > 3 else abs(total)


@pytest.mark.parametrize("n", [1, 3, 5])
@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64], ids=["float32", "float64"])
def test_what_is_known_is_decided_when_compiling(precision: Precision, n: int) -> None:
    x = np.linspace(-2, 2, 9)
    assert over(branching, precision, x, n=n) == pytest.approx([branching(v, n) for v in x.tolist()], rel=1e-6)
    assert " if " not in source(lower(branching, precision, n=n))


def looked_up(x: float, table: Table) -> float:
    last = len(table) - 1
    i = int(x)
    i = i if i < last else last
    return table[i] + table[0] * float(i)


def test_tables_and_whole_numbers() -> None:
    table = np.array([10.0, 20.0, 30.0])
    lowered = lower(looked_up, FLOAT64)
    assert [lowered(np.float64(x), table) for x in (0.5, 1.5, 9.0)] == [10, 30, 50]
    assert [looked_up(x, table) for x in (0.5, 1.5, 9.0)] == [10, 30, 50]


def positive_part(x: float) -> float:
    """A helper of the same name as one of powers."""
    return x + 100.0


def namesakes(x: float) -> float:
    return positive_part(x) + elementary.positive_part(x)


def test_helpers_of_the_same_name_from_two_modules_stay_apart() -> None:
    assert over(namesakes, FLOAT64, [1.5, -2.0]).tolist() == [103.0, 98.0]


# bodies that cannot be lowered; the line in question is marked with <-


def uses_power(x: float) -> float:
    y = x + 1.0
    return y**2  # <-


def uses_while(x: float) -> float:
    while x > 1.0:  # <-
        x = x / 2.0
    return x


def uses_unknown_bound(x: float, n: float) -> float:
    for _ in range(n):  # type: ignore[call-overload]  # <-
        x = x * x
    return x


def uses_numpy(x: float) -> float:
    return float(np.sin(x) * 1.0)  # <-


def uses_unknown_name(x: float) -> float:
    return x * nowhere  # type: ignore[name-defined] # noqa: F821  # <-


def uses_missing_helper(x: float) -> float:
    return elementary.no_such(x)  # type: ignore[attr-defined, no-any-return]  # <-


def uses_wrong_number_of_arguments(x: float) -> float:
    return elementary.clamped(x, 0.0)  # type: ignore[call-arg]  # <-


def uses_if_on_a_number(x: float) -> float:
    if x > 1.0:  # <-
        return 1.0
    return x


def uses_bad_constant(x: float) -> float:
    return x + 1.0 / 0.0  # <-


def uses_two_targets(x: float) -> float:
    a, b = x, x  # <-
    return a + b


REFUSED = [f for name, f in sorted(globals().items()) if name.startswith("uses_")]


@pytest.mark.parametrize("body", REFUSED, ids=lambda b: b.__name__)
def test_what_is_outside_the_language_is_refused_with_file_and_line(body: Body) -> None:
    lines, first = inspect.getsourcelines(body)
    marked = first + next(i for i, line in enumerate(lines) if "# <-" in line)
    with pytest.raises(KernelError) as refusal:
        lower(body, FLOAT32)
    assert refusal.value.where == f"{__file__}:{marked}"
    assert body.__name__ in refusal.value.what
    assert refusal.value.fix


def test_a_known_argument_must_be_given() -> None:
    with pytest.raises(KernelError, match="squared needs a known value of n"):
        lower(elementary.squared, FLOAT32)


def test_a_kernel_without_source_or_def_is_refused() -> None:
    made = eval("lambda x: x")
    with pytest.raises(KernelError, match="cannot be read"):
        lower(made, FLOAT32)
    with pytest.raises(KernelError, match="not a plain function"):
        lower(lambda x: x, FLOAT32)


def test_an_unknown_precision_lists_the_known_ones() -> None:
    assert precision_named("float16") is FLOAT16
    with pytest.raises(UnknownNameError, match=r"(?s)float8.*float16, float32, float64") as refusal:
        precision_named("float8")
    assert isinstance(refusal.value, InputError)


def test_the_half_helpers_round_alike_compiled_and_plain() -> None:
    x = np.random.default_rng(5).normal(size=1000).astype(np.float32)

    def run(values: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        for i in range(len(values)):
            out[i] = intrinsics.round_to_half(values[i])

    out = np.empty_like(x)
    jit.driver(run)(x, out)
    assert np.array_equal(out, [intrinsics.round_to_half(v) for v in x])
    assert intrinsics.half_product(np.float32(0.1), np.float32(3)) == np.float32(
        np.float16(np.float32(0.1) * np.float32(3))
    )
