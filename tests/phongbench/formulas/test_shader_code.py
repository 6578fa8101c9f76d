"""Formulas written for other languages: compiled and run where a compiler is here, they give what the kernels give.

GLSL and WGSL run in the browser too, in tests/browser; WGSL by naga in test_wgsl.py.
"""

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shader_builds import ALPHA, BUILDS, CASES, all_built, built, formula_of, pairs, text_of, writable

from phongbench.cli.main import main
from phongbench.compiler import elementary
from phongbench.errors import InputError, KernelError, UnknownNameError
from phongbench.formulas import curves
from phongbench.formulas.citations import PHONGBENCH
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import highlights
from phongbench.formulas.shader_code.export import LANGUAGES, Options, shader
from phongbench.formulas.shader_code.spellings import PRIMITIVES
from phongbench.formulas.spec import Approximation, Cost, Setting

LANGUAGES_HERE = (*BUILDS, "numpy")


@pytest.fixture(scope="module")
def together(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    """All CASES of a language, compiled at once when the first is asked for, by language."""

    @cache
    def compiled(language: str) -> dict[tuple[str, str, str], Any]:
        texts = [text_of(formula_of(*case), language) for case in CASES]
        return dict(zip(CASES, all_built(language, texts, tmp_path_factory.mktemp(language)), strict=True))

    return compiled


@pytest.mark.parametrize("language", [one for one in LANGUAGES_HERE if one != "metal"])  # see test_shader_languages
@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_compiled_it_gives_what_the_kernel_gives(
    together: Callable[..., Any], name: str, form: str, space: str, language: str
) -> None:
    formula, a, b = formula_of(name, form, space), *pairs(ALPHA)
    values = together(language)[name, form, space](a, b)
    setting = formula.setting(ALPHA)
    expected = highlights(formula.spec(), form, setting, a, b, layout="aos")
    # fused multiply-adds and the library's power differ in the last bits, which a slope of alpha enlarges
    np.testing.assert_allclose(values, expected, rtol=1e-4, atol=4 * setting.exponent * 2.0**-24)


@pytest.mark.parametrize("spelling", ["gaussian:dot", "gaussian-quadratic:dot", "lyon:cross:8", "phong/squared"])
def test_what_leaves_early_on_cores_without_vectors_changes_nothing(spelling: str, tmp_path: Path) -> None:
    a, b = pairs(ALPHA)
    a, b = np.concatenate([a, a, -a, a[:9]]), np.concatenate([b, 1.3 * b, b, b[:9]]).astype(np.float32)
    a[-9:-6, 0], b[-6:-3, 1], a[-3:] = np.nan, np.inf, 0.0
    text = shader(Formula.parse(spelling), ALPHA, Options("c")).text
    texts = {"vectors": text, "scalar": f"#define __ARM_ARCH_PROFILE 'M'\n{text}"}
    for name in texts:
        (tmp_path / name).mkdir()
    both = [built("c", text, tmp_path / name)(a, b) for name, text in texts.items()]
    np.testing.assert_array_equal(*both)
    behind = (a[:-9].astype(np.float64) * b[:-9]).sum(axis=1) < -1e-6
    assert behind.any()
    assert (both[0][:-9][behind] == 0).all()
    assert (both[0][-9:-6] == 0).all(), "NaN is dark"


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_nothing_of_python_is_left(name: str, form: str, space: str, language: str) -> None:
    formula = formula_of(name, form, space)
    if language == "numpy" or not writable(formula, language):
        return  # it is Python, or is refused: see below
    code = re.sub("//.*|#.*", "", text_of(formula, language))
    if language == "c":  # which leaves early where a processor has no vectors
        code = re.sub(r"if \(!\(cosine > 0\.0f\)\) return 0\.0f;", "", code, count=1)
    assert not re.search(r"\b_[^_\W]|\bNone\b|\bnp\b|\*\*|\bif\b|\belse\b|\blambda\b", code)
    assert code.count("{") == code.count("}")
    assert code.count("(") == code.count(")")
    assert len(re.findall(r"\bhighlight\(", code)) == 1


@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_its_error_is_that_of_the_lobe(name: str, form: str, space: str) -> None:
    formula = formula_of(name, form, space)
    found = shader(formula, ALPHA)
    angle = np.radians(np.linspace(0, 89.9, 4001))
    cosine = np.cos(angle)
    curve = curves.curve(formula.spec(), form, formula.setting(ALPHA), cosine)
    worst = float(np.abs(curve - np.maximum(cosine, 0) ** ALPHA).max())
    assert found.max_error == pytest.approx(worst, rel=2e-2, abs=2e-5)
    assert f"{found.max_error:.3g}" in found.text


def test_every_primitive_has_a_spelling() -> None:
    primitives = {body for body in vars(elementary).values() if hasattr(body, "__implementations__")}
    assert primitives
    assert primitives == set(PRIMITIVES)


def made(kernel: Any, **coefficients: float) -> Approximation:
    return Approximation(
        name="mine",
        title="Mine",
        kind="approximation",
        formula="?",
        source=PHONGBENCH,
        kernel=kernel,
        coefficients=lambda s: coefficients,
        domain="",
        cost=Cost(""),
        lambda_forms=("none",),
    )


def own_code(spec: Approximation, alpha: float, language: str) -> str:
    own = {spec.name: spec}
    return shader(Formula.of(spec.name, registry=own), alpha, Options(language), registry=own).text


def awkward(cosine: float, out: float, half: float) -> float:
    """Takes words of other languages for names, and changes an argument."""
    sample = elementary.clamped(cosine, 0.0, 1.0)
    cosine = sample * (out - half) - (out - (half - sample))
    near = -(cosine - 1.0)
    return near / (2.0 / out) if 0.0 < near <= 1.5 and not sample < 0.0 else abs(half - (sample - 1.0))


@pytest.mark.parametrize("language", LANGUAGES_HERE)
def test_awkward_names_and_brackets_survive(language: str, tmp_path: Path) -> None:
    spec, setting = made(awkward, out=0.75, half=0.5), Setting(10.0)
    a, b = pairs(10.0)
    values = built(language, own_code(spec, setting.alpha, language), tmp_path)(a[:2000], b[:2000])
    expected = highlights(spec, "none", setting, a[:2000], b[:2000], layout="aos")
    np.testing.assert_allclose(values, expected, atol=1e-5)


def highlight(cosine: float, pow: float) -> float:  # noqa: A002  as careless as a user may be
    """Has the name of what calls it."""
    return pow * elementary.power(cosine, 3.0)


@pytest.mark.parametrize("language", LANGUAGES_HERE)
def test_a_kernel_may_have_any_name(language: str, tmp_path: Path) -> None:
    spec, setting = made(highlight, pow=0.5), Setting(10.0)
    a, b = pairs(10.0)
    values = built(language, own_code(spec, setting.alpha, language), tmp_path)(a, b)
    np.testing.assert_allclose(values, highlights(spec, "none", setting, a, b, layout="aos"), rtol=1e-5, atol=1e-6)


def endless(cosine: float, top: float) -> float:
    """A constant that no float32 holds."""
    return cosine * top if cosine < 1e300 else 1e300


def test_what_cannot_be_written_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="glsl, hlsl, wgsl, metal, c"):
        text_of("lyon:dot:8", "basic")
    with pytest.raises(InputError, match="alpha"):
        shader(Formula.parse("lyon:dot:8"), -1.0)
    own = {"mine": made(endless, top=1.0)}
    with pytest.raises(KernelError, match="finite"):
        shader(Formula.of("mine", registry=own), ALPHA, registry=own)


def test_the_command_in_the_comment_makes_the_same_again() -> None:
    runner = CliRunner()
    first = runner.invoke(main, ["shader", "lyon:cross:16", "--alpha", "200", "--beta", "minimax", "--language", "c"])
    assert first.exit_code == 0
    command = re.search(r": phongbench (shader .*)", first.output)
    assert command
    assert runner.invoke(main, command[1].split()).output == first.output


def test_a_budget_chooses_the_formula(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runner = CliRunner()
    ask = ["--alpha", "33.3", "--max-error", "0.02"]
    best = json.loads(runner.invoke(main, ["recommend", *ask, "--json"]).output)["choices"][0]
    told = json.loads(runner.invoke(main, ["shader", *ask, "--json"]).output)
    assert told["formula"] == best["approximation"]
    assert told["max_error"] <= 0.02
    assert f"gamma = {best['gamma']}" in told["text"]
    out = tmp_path / "highlight.glsl"
    assert runner.invoke(main, ["shader", *ask, "--out", str(out)]).output == f"{out}\n"
    assert out.read_text() == told["text"]
    assert runner.invoke(main, ["shader", *ask, "--out", str(tmp_path / "highlight.c")]).exit_code == 0
    assert "static inline float highlight" in (tmp_path / "highlight.c").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--alpha", "50"], "--max-error"),
        (["lyon:dot:8", "--alpha", "50", "--max-error", "0.1"], "either"),
        (["lyn:dot:8", "--alpha", "50"], "lyon"),
        (["lyon:dot", "--alpha", "50"], "gamma"),
        (["lyon:dot:8", "--alpha", "nan"], "alpha"),
        (["lyon:dot:8", "--alpha", "50", "--space", "third"], "reflect"),
        (["lyon:dot:8", "--alpha", "50", "--beta", "none"], "minimax"),
        (["--alpha", "50", "--max-error", "1e-12"], "recommend"),
    ],
)
def test_wrong_wishes_are_answered_in_two_lines(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = CliRunner().invoke(main, ["shader", *arguments])
    assert found.exit_code == 2
    assert said in found.output
    assert found.output.count("\n") <= 2


def test_an_error_without_end_is_a_word_in_json() -> None:
    """In float16 a power of what is a step above 1 overflows."""
    asked = ["phong/once", "--alpha", "12345.678", "--precision", "float16", "--over-long", "keep", "--json"]
    told = json.loads(CliRunner().invoke(main, ["shader", *asked]).stdout)
    assert told["max_error"] == "Infinity"
    assert told["contract"] is None


@pytest.mark.parametrize("name", ["phong", "gaussian:dot", "lyon:dot:8", "schlick"])
def test_over_long_vectors_give_no_more_than_one_unless_they_are_to(name: str, tmp_path: Path) -> None:
    formula, alpha = Formula.parse(name), 10.0
    a, b = (np.tile(np.float32([[0.0, 0.0, length]]), (4, 1)) for length in (1.0, 1.02))
    limited = built("hlsl", text_of(formula, "hlsl", alpha), tmp_path)(a, b)
    np.testing.assert_array_equal(limited, 1.0)
    text = text_of(formula, "hlsl", alpha, over_long="keep")
    (tmp_path / "kept").mkdir()
    kept = built("hlsl", text, tmp_path / "kept")(a, b)
    expected = highlights(formula.spec(), formula.lambda_form, formula.setting(alpha), a, b, layout="aos")
    assert expected.min() > 1
    np.testing.assert_allclose(kept, expected, rtol=1e-5)
    assert "--over-long keep" in text
    with pytest.raises(UnknownNameError, match="clamp, keep"):
        text_of(formula, "hlsl", alpha, over_long="drop")
