"""Tables of documents: what is missing, what is unknown, and where."""

from pathlib import Path

import pytest

from phongbench.errors import InputError, UnknownNameError
from phongbench.support.document_paths import DATA, UNTRUSTED, Source, line_of
from phongbench.support.documents import Table, load

TEXT = '[[light]]\nname = "a"\n[light.place]\nx = 1\n[[light]]\nname = "b"\n[light.place]\nx = "two"\n'


@pytest.fixture
def document(tmp_path: Path) -> Table:
    path = tmp_path / "d.toml"
    path.write_text(TEXT)
    return load(path, "scene")


def test_a_value_that_is_missing_is_named_and_a_default_stands_in_for_it(document: Table) -> None:
    assert document.value("size", 7) == 7
    assert document.number("width", 0.0) == 0.0
    with pytest.raises(InputError, match="depth is missing"):
        document.value("depth")
    with pytest.raises(InputError, match="light"):
        document.value("lights")  # the fix names what is meant by it


def test_a_key_that_nobody_read_is_refused_by_name(document: Table) -> None:
    document.has("colour")
    with pytest.raises(UnknownNameError, match="light"):
        document.finish()
    document.has("light")
    document.finish()


def test_of_a_long_key_as_much_is_shown_as_a_line_holds() -> None:
    with pytest.raises(UnknownNameError) as error:
        Table({"k" * 100: 1}).finish()
    assert "k" * 60 in error.value.what
    assert "k" * 61 not in error.value.what


def test_zero_is_a_whole_number_of_its_own_accord() -> None:
    assert Table({"n": 0}).whole("n") == 0
    with pytest.raises(InputError, match="whole number from 0"):
        Table({"n": -1}).whole("n")


@pytest.mark.parametrize("value", [0.0, 0.5, 1, 1.0])
def test_a_number_may_be_either_end_of_its_range(value: float) -> None:
    assert Table({"x": value}).number("x", low=0.0, high=1.0) == value
    for outside in (-0.001, 1.001, float("nan")):
        with pytest.raises(InputError, match=r"outside 0 \.\. 1"):
            Table({"x": outside}).number("x", low=0.0, high=1.0)


def test_a_vector_has_three_numbers() -> None:
    assert Table({"v": [1, 2, 3]}).vector("v") == (1.0, 2.0, 3.0)
    for value in ([1, 2], [1, 2, 3, 4], 1, "abc"):
        with pytest.raises(InputError, match="not a list of 3 numbers"):
            Table({"v": value}).vector("v")


def test_only_of_trusted_documents_is_a_wrong_value_repeated() -> None:
    assert "n = -7 is" in Table({"n": -7}).wrong("is wrong", -7, "n").what
    assert Table({"n": -7}, UNTRUSTED).wrong("is wrong", -7, "n").what == "n is wrong"


@pytest.mark.parametrize(("source", "place"), [(DATA, "pets.cat.legs"), (UNTRUSTED, "pets[1].legs")])
def test_tables_by_name_are_told_by_it_or_by_their_number_where_anyone_may_have_named_them(
    source: Source, place: str
) -> None:
    pets = Table({"pets": {"dog": {"legs": 4}, "cat": {"legs": "four"}}}, source).named("pets")
    assert list(pets) == ["dog", "cat"]
    assert pets["dog"].whole("legs") == 4
    with pytest.raises(InputError) as error:
        pets["cat"].whole("legs")
    assert error.value.where == place


def test_a_name_that_the_document_does_not_have_is_refused_with_those_it_has(document: Table) -> None:
    assert isinstance(document.unknown("material", "gold", ["golden"], "light"), UnknownNameError)
    assert "nor any other" in document.unknown("material", "gold", [], "light").what


def test_every_value_has_its_line_those_inside_lists_of_tables_too() -> None:
    assert line_of(TEXT, ("light", 0, "name")) == 2
    assert line_of(TEXT, ("light", 0, "place", "x")) == 4
    assert line_of(TEXT, ("light", 1, "name")) == 6
    assert line_of(TEXT, ("light", 1, "place", "x")) == 8
    assert line_of(TEXT, ("light", 1, "place", "y")) == 7  # the nearest thing around what is missing
    nested = "[[a]]\n[[a.b]]\n[[a.b]]\nx = 1\n[[a]]\n[[a.b]]\nx = 1\n"
    assert line_of(nested, ("a", 0, "b", 1, "x")) == 4
    assert line_of(nested, ("a", 1, "b", 0, "x")) == 7
