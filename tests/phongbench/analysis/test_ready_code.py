"""What stands at the top of code: the error that is promised of it, and its cost on the targets asked for."""

import json

import pytest
from click.testing import CliRunner

from phongbench.analysis.promises import bound_at
from phongbench.analysis.ready_code import codes_of, ready_code
from phongbench.cli.main import main
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.export import Options, folding
from phongbench.targets.chips import TARGETS
from phongbench.targets.costs import shipped

LYON = Formula.parse("lyon:dot:8")


@pytest.mark.parametrize("name", ["phong", "gaussian:dot", "lyon:dot:8", "lyon:cross:8"])
def test_its_costs_are_those_of_the_tables(name: str) -> None:
    formula = Formula.parse(name)
    told = ready_code(formula, 50.0, Options(targets=(*TARGETS, *TARGETS)))
    assert [cost["target"] for cost in told.costs] == [*TARGETS]
    for cost in told.costs:
        table = shipped(cost["target"])
        known = table.known_of(formula, 50.0)
        assert known is not None
        assert (cost["cost"], cost["ratio"]) == (known.cost, table.ratio(known))
        line = next(line for line in told.text.splitlines() if line.startswith(f"// on {cost['target']}: "))
        assert f"{cost['cost']:.3g} {cost['unit']} beyond the dot product" in line
        assert table.tool_version in line


@pytest.mark.parametrize("name", ["phong", "lyon:dot:8", "lyon:cross:8", "lyon:difference:8", "table-x"])
@pytest.mark.parametrize("wrong", [0.0, 0.001, 0.02])
def test_a_promise_with_wrong_lengths_holds_what_was_sampled(name: str, wrong: float) -> None:
    formula = Formula.parse(name)
    for over_long in ("clamp", "keep"):
        told = ready_code(formula, 50.0, Options(length_error=wrong, over_long=over_long))
        assert told.bound is not None
        assert told.max_error <= told.bound
        if wrong:
            assert f"lengths wrong by up to {wrong:g}" in told.text
            assert told.bound > ready_code(formula, 50.0).max_error
    bound = bound_at(formula, 50.0, length_error=wrong)
    assert bound is not None
    assert told.bound == pytest.approx(bound + folding(formula.setting(50.0)) * (1 + wrong) ** 2)


def test_of_fewer_digits_nothing_is_promised() -> None:
    told = ready_code(LYON, 50.0, Options(precision="float16"))
    assert told.bound is None
    assert "in float16" in told.text
    assert told.max_error > ready_code(LYON, 50.0).max_error


@pytest.mark.parametrize("precision", ["float16", "mediump"])
def test_code_of_fewer_digits_has_costs_of_its_own(precision: str) -> None:
    told = ready_code(Formula(), 50.0, Options(targets=("rdna3", "cortex-a55"), precision=precision), compiles=False)
    known = [shipped(name, "float16").of(Formula(), 50.0).cost for name in ("rdna3", "cortex-a55")]
    assert [cost["cost"] for cost in told.costs] == known
    assert [cost["ratio"] for cost in told.costs] == [1, 1]


def test_what_has_no_cost_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="rdna2"):
        ready_code(LYON, 50.0, Options(targets=("rdna9",)))
    with pytest.raises(InputError, match="timed as a whole"):
        ready_code(LYON, 50.0, Options(targets=("cpu",)))
    with pytest.raises(InputError, match="no costs of gcn4 in float16 ship"):
        ready_code(LYON, 50.0, Options(targets=("gcn4",), precision="mediump"))
    with pytest.raises(InputError, match="is shipped"):
        ready_code(LYON, 50.0, Options(targets=("rdna2",), over_long="keep"), compiles=False)


def test_the_command_takes_the_options_and_tells_how_to_repeat_it() -> None:
    asked = ["shader", "lyon:dot:8", "--alpha", "50", "--language", "essl300", "--target", "rdna2,gcn4"]
    asked += ["--length-error", "1/100"]
    done = CliRunner().invoke(main, [*asked, "--json"])
    assert done.exit_code == 0
    answer = json.loads(done.stdout)
    assert [cost["target"] for cost in answer["costs"]] == ["rdna2", "gcn4"]
    said = next(line for line in answer["text"].splitlines() if "phongbench shader" in line)
    again = said.partition("phongbench shader ")[2].split()
    assert CliRunner().invoke(main, ["shader", *again]).stdout == answer["text"]
    half = CliRunner().invoke(main, ["shader", "phong", "--alpha", "50", "--precision", "mediump"])
    assert "precision mediump float;" in half.stdout
    assert "--precision mediump" in half.stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--precision", "float8"], "float32, float16, mediump"),
        (["--precision", "float16", "--language", "essl300"], "write float32, mediump"),
        (["--target", "rdna9"], "did you mean"),
        (["--length-error", "lots"], "not a number"),
        (["--length-error", "-1"], "0 to below 0.5"),
        (["--over-long", "drop"], "clamp, keep"),
    ],
)
def test_wrong_options_are_answered_in_two_lines(options: list[str], said: str) -> None:
    done = CliRunner().invoke(main, ["shader", "lyon:dot:8", "--alpha", "50", *options])
    assert done.exit_code == 2
    assert said in done.stderr
    assert done.stderr.count("\n") <= 2


def test_the_code_of_an_answer_is_that_of_its_choice_at_each_exponent() -> None:
    answer = {"choices": [{"name": "lyon:dot:8"}, {"name": "phong"}], "alpha": "20, 50", "precision": "float32"}
    written = {alpha: ready_code(LYON, alpha, Options("glsl")).text for alpha in (20.0, 50.0)}
    told = codes_of(answer, "glsl")
    assert {one["alpha"]: one["code"] for one in told} == written
    assert {one["name"] for one in told} == {"lyon:dot:8"}
    assert codes_of({**answer, "choices": []}, "glsl") == []
