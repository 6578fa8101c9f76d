"""What an exponent, a list or a range of them means, and what speaks for it."""

import pytest

from phongbench.analysis.exponents import Exponents
from phongbench.errors import InputError

KNOWN = (10.0, 20.0, 50.0, 200.0)


@pytest.mark.parametrize(
    ("text", "values", "continuous"),
    [
        ("50", (50.0,), False),
        (50, (50.0,), False),
        ("200, 10,50,10", (10.0, 50.0, 200.0), False),
        ("10..200", (10.0, 200.0), True),
        ("200..10", (10.0, 200.0), True),
        ("1e1 .. 2e2", (10.0, 200.0), True),
        ("50..50", (50.0,), False),
    ],
)
def test_one_several_or_a_range(text: str, values: tuple[float, ...], continuous: bool) -> None:
    asked = Exponents.of(text)
    assert (asked.values, asked.continuous) == (values, continuous)
    assert Exponents.of(str(asked)) == asked


@pytest.mark.parametrize("text", ["", "ten", "-5", "0", "nan", "inf", "1e999", "10..", "10...20", "1..2..3", "5,,6"])
def test_anything_else_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(InputError, match=r"10\.\.200"):
        Exponents.of(text)


def test_measured_ones_are_those_listed_or_within() -> None:
    assert Exponents.of("10..50").measured(KNOWN) == (10.0, 20.0, 50.0)
    assert Exponents.of("15..60").measured(KNOWN) == (20.0, 50.0)
    assert Exponents.of("200,10").measured(KNOWN) == (10.0, 200.0)
    for missing in ("11", "10,11", "21..49"):
        with pytest.raises(InputError, match="known: 10, 20, 50, 200"):
            Exponents.of(missing).measured(KNOWN)


def test_neighbours_vouch_for_what_was_not_measured() -> None:
    assert Exponents.of(20).around(KNOWN) == (20.0,)
    assert Exponents.of(30).around(KNOWN) == (20.0, 50.0)
    assert Exponents.of("20,100").around(KNOWN) == (20.0, 50.0, 200.0)
    assert Exponents.of("15..60").around(KNOWN) == KNOWN
    assert Exponents.of("20..50").around(KNOWN) == (20.0, 50.0)


@pytest.mark.parametrize("text", ["5", "300", "5..20", "20,300"])
def test_nothing_vouches_for_what_lies_outside(text: str) -> None:
    assert Exponents.of(text).around(KNOWN) is None
