"""The shipped costs: whole, of today's code, and what the compilers say wherever they are."""

import json
import re
from dataclasses import astuple
from functools import partial
from pathlib import Path

import pytest

from phongbench.errors import CorruptRunError, InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.targets import __main__ as tables
from phongbench.targets import costs as module
from phongbench.targets.chips import TARGETS, target_named
from phongbench.targets.code_shapes import code
from phongbench.targets.costs import CostTable, as_text, digest, in_precision, shipped
from phongbench.targets.harness import UNROLLED
from phongbench.targets.measure import CONTEXTS, costs, dot_cost
from phongbench.targets.target import ISSUE, SPECIAL, UNITS, Target

#: a power, and a chain of products
HELD = ("phong", "lyon:dot:8")
#: formulas that are compiled anew, of each kind
SAMPLE = ("phong", "gaussian:dot", "lyon:dot:8", "lyon:cross:8", "lyon:difference:32", "lyon:tan2:8", "table-x")


#: every table that ships: a target and a precision
TABLES = [(name, precision) for precision in ("float32", "float16") for name in in_precision(precision)]


@pytest.mark.parametrize("precision", ["float32", "float16"])
@pytest.mark.parametrize("language", sorted({target.language for target in TARGETS.values()}))
def test_its_codes_are_those_that_are_written_today(language: str, precision: str) -> None:
    tables = [shipped(name, precision) for name in in_precision(precision) if TARGETS[name].language == language]
    assert len({tuple(table.rows) for table in tables}) <= 1
    changed = []
    for shape, (named, _) in [row for table in tables[:1] for row in list(table.rows.items())[::6]]:
        spelling, alpha = named.split(" ")
        one = code(Formula.parse(spelling), float(alpha), language, precision=precision)
        if shape not in (one.shape, one.exact_shape):
            changed.append(named)
    assert changed == [], "the emission has changed: make targets"


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("spelling", [*SAMPLE, "lyon:dot:16:minimax", "gaussian:dot:energy", "blinn", "schlick"])
def test_usual_formulas_have_a_cost_at_every_exponent(name: str, spelling: str) -> None:
    assert all(shipped(name).known_of(Formula.parse(spelling), alpha) for alpha in (0.7, 3.0, 33.3, 50.0, 4096.0))


@pytest.mark.parametrize("name", TARGETS)
def test_longer_chains_on_raw_vectors_have_one_too(name: str) -> None:
    known = [shipped(name).known_of(Formula.parse(f"lyon:dot:{gamma}/each"), 50.0) for gamma in (8, 16, 32)]
    assert all(known)
    costs = [cost.cost for cost in known if cost is not None]
    assert costs == sorted(costs)


@pytest.mark.parametrize(("name", "precision"), TABLES)
def test_its_numbers_are_of_this_world(name: str, precision: str) -> None:
    table = shipped(name, precision)
    # copies of registers that compilers save: in whole programs one counts for as little as a load does
    copies = 0.5 if table.target.language == "c" else 1 / UNROLLED
    assert len(table.rows) > 100
    for formula, cost in [("dot", table.dot), *table.rows.values()]:
        assert len(cost.around) == len(CONTEXTS), formula
        # of packed float16 a limit can save what the bare dot product needs: one instruction at most
        assert min(*astuple(cost)[1:-1], *cost.around) >= (-2.5 if precision == "float16" else 0), formula
        assert cost.bound_by in UNITS
        assert cost.instructions >= cost.arithmetic + cost.specials - copies - 1e-9, formula
        assert (cost.special > 0) == (cost.specials > 0), formula


@pytest.mark.parametrize("name", TARGETS)
def test_exact_phong_is_the_measure(name: str) -> None:
    table = shipped(name)
    assert table.ratio(table.baseline) == 1
    assert table.ratio(table.dot.__class__(*astuple(table.dot)), None) > 0
    assert table.over_dot(table.baseline) == pytest.approx((table.dot.cost + table.baseline.cost) / table.dot.cost)
    assert table.baseline.specials == 2 or table.target.language == "c"


def test_what_a_shader_is_short_of_decides() -> None:
    table = shipped("rdna2")
    chain, power = table.of(Formula.parse("lyon:dot:8"), 50.0), table.baseline
    assert chain.short_of(SPECIAL) == 0 < power.short_of(SPECIAL)
    assert chain.short_of(None) == chain.cost
    assert chain.short_of(ISSUE) == chain.issue


def test_a_file_that_was_changed_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = as_text(shipped("rdna2"))
    assert text == (module.FOLDER / "rdna2.json").read_text()
    assert json.loads(text)["digest"] == digest(text)
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    (tmp_path / "rdna2.json").write_text(text.replace('"unit": "cycles"', '"unit": "slots"'))
    shipped.cache_clear()
    try:
        with pytest.raises(CorruptRunError, match="rdna2"):
            shipped("rdna2")
        (tmp_path / "rdna2.json").unlink()
        with pytest.raises(InputError, match="make targets"):
            shipped("rdna2")
    finally:
        shipped.cache_clear()


def test_a_table_names_a_compiler_and_no_machine() -> None:
    for path in module.FOLDER.iterdir():
        text = path.read_text()
        assert re.search(r'"tool_version": "[^"/]*\d+\.\d+', text), path.name
        assert "/" not in re.sub(r"@\w+/\w+|/(each|once|squared|fast|estimate)", "", text), path.name


def test_a_target_that_cannot_be_compiled_stops_no_other_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def compiled(target: Target, codes: object, precision: str) -> CostTable:
        if target.name == "sm89":
            raise InputError("NVRTC refuses the code", None, "see `phongbench shader`")
        return shipped(target.name, precision)

    monkeypatch.setattr(tables, "compiled", compiled)
    monkeypatch.setattr(tables, "_codes", lambda language, precision: ())
    monkeypatch.setattr(tables, "write", partial(tables.write, folder=tmp_path))
    assert tables.main(["rdna2", "sm89", "cortex-m7"]) == 1
    assert {path.name for path in tmp_path.iterdir()} == {"rdna2.json", "rdna2.float16.json", "cortex-m7.json"}
    assert "sm89: NVRTC refuses" in capsys.readouterr().err
    assert tables.main(["rdna2"]) == 0


def test_an_unknown_target_is_answered_with_those_there_are() -> None:
    with pytest.raises(UnknownNameError, match="rdna2"):
        target_named("rdna9")
    with pytest.raises(UnknownNameError, match="rdna2"):
        shipped("../rdna2")


@pytest.mark.parametrize(("name", "precision"), TABLES)
def test_compiled_anew_they_are_the_same_to_the_digit(name: str, precision: str) -> None:
    target, table = target_named(name), shipped(name, precision)
    sample = SAMPLE if precision == "float32" else SAMPLE[:4]  # some have no tables
    if (missing := target.why_not()) is not None:
        pytest.skip(missing)
    if target.tool_version() != table.tool_version:
        pytest.skip(f"{target.tool_version()} is here, and {table.tool_version} made the table")
    codes = [code(Formula.parse(spelling), 50.0, target.language, precision=precision) for spelling in sample]
    assert dict(zip(sample, costs(target, codes), strict=True)) == {
        spelling: table.known(one) for spelling, one in zip(sample, codes, strict=True)
    }
    assert dot_cost(target, precision) == table.dot


def test_an_own_formula_needs_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    target = target_named("rdna2")
    monkeypatch.setattr(type(target), "why_not", lambda self: "pip install it")
    with pytest.raises(InputError, match="pip install it") as caught:
        shipped("rdna2").of(Formula.parse("integer-power"), 3001.0)
    assert caught.value.where == "rdna2"


@pytest.mark.parametrize(
    ("target", "most"),
    [
        ("rdna2", {"gaussian:dot": 6.5, "lyon:dot:8": 8.5, "phong": 10.5, "phong/once": 28.5}),
        ("gcn4", {"gaussian:dot": 25, "lyon:dot:8": 17, "phong": 41, "phong/once": 89}),
    ],
)
def test_code_that_is_written_keeps_its_bars(target: str, most: dict[str, float]) -> None:
    found = {name: shipped(target).of(Formula.parse(name), 50.0).cost for name in most}
    assert all(found[name] <= bar for name, bar in most.items()), found


@pytest.mark.parametrize("target", ["sm75", "sm86", "sm89", "sm90", "sm120"])
def test_nvidia_raises_by_two_special_instructions_and_lyon_needs_none(target: str) -> None:
    found = {name: shipped(target).of(Formula.parse(name), 50.0) for name in ("phong", "gaussian:dot", "lyon:dot:8")}
    assert [cost.specials for cost in found.values()] == [2, 1, 0]
    assert [cost.special for cost in found.values()] == [16, 8, 0]  # slots: a special instruction takes eight
    assert [cost.arithmetic for cost in found.values()] == pytest.approx([1, 1, 3], abs=0.1)  # limits cost nothing
    assert shipped(target).dot.cost == (6 if target == "sm75" else 3)  # which adds at half the rate


@pytest.mark.parametrize("target", [name for name, chip in TARGETS.items() if chip.language == "c"])
def test_without_a_unit_for_them_powers_and_exponentials_are_polynomials_that_squarings_replace(target: str) -> None:
    power, gaussian, chain = (
        shipped(target).of(Formula.parse(name), 50.0) for name in ("phong", "gaussian:dot", "lyon:dot:8")
    )
    assert power.specials == gaussian.specials == chain.specials == 0
    assert power.cost > 1.5 * gaussian.cost > 1.5**2 * chain.cost
    assert shipped(target).of(Formula.parse("phong/each"), 50.0).specials > 0  # roots and divisions


def test_a_table_is_no_bargain_where_a_vector_is_gathered_one_by_one() -> None:
    for target in ("zen4", "cortex-a55", "cortex-a76", "cortex-m7"):
        table, chain = (shipped(target).of(Formula.parse(name), 50.0).cost for name in ("table-x", "lyon:dot:8"))
        assert table > 1.5 * chain, target


@pytest.mark.parametrize("target", ["gcn4", "cortex-m7", "zen4"])
def test_a_target_without_units_of_float16_says_so_and_which_have_them(target: str) -> None:
    with pytest.raises(InputError, match=f"no costs of {target} in float16 ship.*") as caught:
        shipped(target, "float16")
    assert "rdna2" in caught.value.fix


@pytest.mark.parametrize("target", ["cortex-a55", "cortex-a76", "cortex-m55"])
def test_vectors_of_float16_hold_twice_as_many_products_but_functions_stay_those_of_float32(target: str) -> None:
    tables = shipped(target), shipped(target, "float16")
    (slow, slow_16), (fast, fast_16) = ([t.of(Formula.parse(f), 50.0) for t in tables] for f in HELD)
    assert fast_16.cost == pytest.approx(fast.cost / 2, rel=0.35)
    assert slow_16.cost > 0.75 * slow.cost
    assert shipped(target, "float16").dot.cost < 0.7 * shipped(target).dot.cost


@pytest.mark.parametrize("target", ["gcn5", "rdna2", "rdna3"])
def test_amd_takes_as_many_instructions_in_float16_and_fewer_registers(target: str) -> None:
    for spelling in HELD:
        one, half = (shipped(target, p).of(Formula.parse(spelling), 50.0) for p in ("float32", "float16"))
        assert (half.specials, half.registers <= one.registers) == (one.specials, True)
        assert half.cost == pytest.approx(one.cost, abs=4.1)


def test_what_float16_cannot_write_has_no_cost_in_it() -> None:
    table = shipped("rdna2", "float16")
    assert not any(named.startswith("bit-trick") for named, _ in table.rows.values())


def test_numbers_that_amds_instructions_hold_cost_less() -> None:
    def cost(target: str, spelling: str, alpha: float) -> float:
        known = shipped(target).known_of(Formula.parse(spelling), alpha)
        assert known is not None
        return known.cost

    for gcn in ("gcn4", "gcn5"):  # a slope of 4 saves the move of the other number; one of 5 does not
        assert cost(gcn, "lyon:dot:8", 32.0) == cost(gcn, "lyon:dot:8", 50.0) - 4
        assert cost(gcn, "lyon:dot:8", 40.0) == cost(gcn, "lyon:dot:8", 50.0)
    assert cost("rdna2", "lyon:dot:8", 32.0) == cost("rdna2", "lyon:dot:8", 50.0)
    for name in ("gcn4", "rdna2"):  # a power that is made of products
        assert cost(name, "phong", 2.0) < cost(name, "phong", 4.0) < cost(name, "phong", 50.0) / 2
