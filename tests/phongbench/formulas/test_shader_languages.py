"""Languages and precisions: compilers take what is written in each, and the error told is that of the code itself."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shader_builds import ALPHA, BUILDS, CASES, built, formula_of, pairs, text_of, writable

from phongbench.compiler.precisions import FLOAT16
from phongbench.errors import InputError, KernelError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import highlights
from phongbench.formulas.shader_code.export import Options, folding, shader
from phongbench.formulas.shader_code.language import HELD
from phongbench.formulas.shader_code.languages import LANGUAGES, language_of_file
from phongbench.formulas.shader_code.measured import ANGLES, compiled, cosines, directions

#: every kind of code that is written: one form of each approximation, the lambda forms, recipes and ways with lengths
KINDS = [
    *dict.fromkeys(name for name, _, _ in CASES if name != "lyon"),
    *("lyon:dot:8", "lyon:cross:8", "lyon:difference:8", "lyon:tan2:8"),
    *("lyon:dot:8@reflect", "lyon:cross:8@lengthwise", "phong/each", "phong/once", "lyon:cross:8/once"),
    *("lyon:dot:8@halfway", "phong/squared"),
]
#: those that between them use every word of a language
SOME = ["phong", "table-x", "bit-trick", "kuijk-blake", "gaussian-quadratic", *KINDS[-8:-4], "lyon:dot:8@halfway"]
#: language -> what stands before and after its text to make a shader of two or three directions
AROUND = {
    "glsl": ("#version 450\n", "layout(location={}) in", "layout(location=0) out vec4 colour;"),
    "essl300": ("#version 300 es\n", "in", "out vec4 colour;"),
    "essl100": ("#version 100\n", "varying", "\n#define colour gl_FragColor\n"),
}
IN_WRITING = [(name, precision) for name, one in LANGUAGES.items() for precision in ("float32", *one.precisions)]


def spelled(kind: str) -> Formula:
    """The formula of a kind."""
    cases = [case for case in CASES if case[0] == kind]
    return formula_of(*cases[0]) if cases else Formula.parse(kind)


def whole(language: str, precision: str, formula: Formula) -> tuple[str, list[str]]:
    """A shader that calls the formula, and how glslang is told to compile it."""
    text, names = text_of(formula, language, precision=precision), "pqs"[: 2 if formula.recipe == "pair" else 3]
    kind = LANGUAGES[language].in_precision(precision).direction[0]
    if language == "hlsl":
        given = ", ".join(f"{kind} {name} : {name.upper()}" for name in names)
        short = ["--hlsl-enable-16bit-types"] if precision == "float16" else []
        body = f"float4 main({given}) : SV_Target {{ return highlight({', '.join(names)}); }}"
        return f"{text}\n{body}\n", ["-D", "-e", "main", "-V", *short]
    version, into, out = AROUND[language]
    inputs = "\n".join(f"{into.format(i)} vec3 {name};" for i, name in enumerate(names))
    # inputs of 16 bits are an extension of their own
    taken = ", ".join(f"{kind}({name})" for name in names)
    body = f"void main() {{ colour = vec4(float(highlight({taken}))); }}"
    return f"{version}{text}\n{inputs}\n{out}\n{body}\n", ["-V"] if language == "glsl" else []


@pytest.mark.parametrize("kind", SOME)
@pytest.mark.parametrize(("language", "precision"), [one for one in IN_WRITING if one[0] in (*AROUND, "hlsl")])
def test_glslang_takes_it(kind: str, language: str, precision: str, tmp_path: Path) -> None:
    glslang = shutil.which("glslangValidator")
    if glslang is None:
        pytest.skip("no glslangValidator here; apt's glslang-tools brings it")
    formula = spelled(kind)
    if not writable(formula, language, precision):
        return  # refused: see below
    text, options = whole(language, precision, formula)
    (tmp_path / "shader.frag").write_text(text)
    command = [glslang, *options, *(["-o", "shader.spv"] if "-V" in options else []), "shader.frag"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout}\n{text}"
    assert "WARNING" not in done.stdout


@pytest.mark.parametrize("precision", ["float32", "float16"])
@pytest.mark.parametrize("kind", SOME)
def test_metal_is_what_its_statements_say(kind: str, precision: str, tmp_path: Path) -> None:
    """By C++ with the words of Metal's header: its own compiler runs on Apple's machines alone."""
    formula, language = spelled(kind), LANGUAGES["metal"].in_precision(precision)
    if not writable(formula, "metal", precision):
        return  # refused: see below
    a, b = pairs(ALPHA)
    values = built("metal", text_of(formula, "metal", precision=precision), tmp_path)(a, b)
    setting, held = formula.setting(ALPHA), [one.astype(HELD[precision]) for one in (a, b)]
    given = held if formula.recipe == "pair" else [*held, held[1]]
    expected = compiled(formula.spec(), formula, setting, language, limited=True)(*given)
    # what is rounded otherwise, more of it where the pair is made first, and what a slope of alpha makes of it
    steps = (4 if formula.recipe == "pair" else 12) * {"float32": 2.0**-24, "float16": 2.0**-11}[precision]
    np.testing.assert_allclose(values, expected.astype(np.float32), rtol=1e-4, atol=steps * setting.exponent)


def angles(formula: Formula, kind: Any) -> tuple[list[Any], Any]:
    """Directions as a precision holds them, and exact Phong of the angles between them, by NumPy alone."""
    held = [one.astype(kind) for one in directions(formula, 90.0 * np.linspace(0.0, 1.0, ANGLES) ** 2)]
    cosine = cosines(formula, held)
    return held, np.where(cosine > 0, np.abs(cosine) ** ALPHA, 0.0)


@pytest.mark.parametrize("kind", ["phong", "lyon:dot:8", "lyon:cross:8", "gaussian:dot", "schlick", "kuijk-blake"])
@pytest.mark.parametrize(("language", "precision"), [("c", "float32"), ("numpy", "float32"), ("numpy", "float16")])
def test_the_error_told_is_that_of_the_code(kind: str, language: str, precision: str, tmp_path: Path) -> None:
    formula, options = Formula.parse(kind), Options(language, precision)
    told = shader(formula, ALPHA, options)
    (a, b), exact = angles(formula, HELD[precision])
    values = built(language, told.text, tmp_path)(a, b)
    worst = float(np.abs(np.asarray(values, np.float64) - exact).max())
    # multiply-adds count both ways, so the error told may be the larger one
    assert worst <= told.max_error * 1.01 + 2e-6
    assert worst >= told.max_error * (0.7 if precision == "float16" else 0.9)
    assert f"{told.max_error:.3g}" in told.text


@pytest.mark.parametrize(
    ("name", "form", "space"), [case for case in CASES if case[0] in ("phong", "lyon", "gaussian")]
)
def test_half_as_many_digits_give_the_half_kernel_within_their_rounding(name: str, form: str, space: str) -> None:
    formula = formula_of(name, form, space)
    setting = formula.setting(ALPHA)
    held, exact = angles(formula, np.float16)
    values = built("numpy", text_of(formula, "numpy", precision="float16"), Path())(*held)
    assert values.dtype == np.float16
    expected = highlights(formula.spec(), form, setting, *held, precision=FLOAT16, layout="aos")
    np.testing.assert_allclose(values, expected, rtol=0, atol=4 * setting.exponent * 2.0**-11)
    # and the digits matter: float32 is closer to the formula than to this
    assert np.abs(values.astype(np.float64) - exact).max() > shader(formula, ALPHA, Options("numpy")).max_error / 2


@pytest.mark.parametrize("fused", [False, True])
@pytest.mark.parametrize("language", ["glsl", "c"])
@pytest.mark.parametrize("alpha", [5.0, 33.3, 200.0])
@pytest.mark.parametrize("kind", ["lyon:dot:8", "lyon:cross:16", "lyon:difference:2", "lyon-quadratic:dot:8"])
def test_folded_constants_move_a_value_by_no_more_than_is_allowed_for(
    kind: str, alpha: float, language: str, fused: bool
) -> None:
    formula = Formula.parse(kind)
    spec, setting = formula.spec(), formula.setting(alpha)
    held = [one.astype(np.float32) for one in directions(formula, np.linspace(0.0, 89.9, 4001))]
    folded = compiled(spec, formula, setting, LANGUAGES[language], limited=False, fused=fused)(*held)
    kernel = highlights(spec, formula.lambda_form, setting, *held, layout="aos")
    assert float(np.abs(folded - kernel).max()) <= folding(setting) + 4 * 2.0**-24


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        (
            "lyon:dot:8",
            {"precision": "float16", "language": "essl100"},
            "essl100 has no float16\nwrite float32, mediump",
        ),
        ("lyon:dot:8", {"precision": "mediump", "language": "wgsl"}, "wgsl has no mediump\nwrite float32, float16"),
        ("table-x", {"language": "essl100"}, "essl100 in float32 has no constant tables\nwrite it in another language"),
        ("bit-trick", {"language": "essl100"}, "essl100 in float32 has no bits of floats"),
        ("bit-trick", {"precision": "float16"}, "glsl in float16 has no float32 whose bits could be read"),
        ("table-x", {"language": "cuda", "precision": "float16"}, "cuda in float16 has no constant tables"),
        ("lyon:dot:8", {"length_error": -0.1}, "lengths cannot be wrong by -0.1"),
        ("lyon:dot:8", {"length_error": float("nan")}, "lengths cannot be wrong by nan"),
        ("lyon:dot:8", {"length_error": 0.5}, "0 to below 0.5"),
    ],
)
def test_what_a_language_lacks_is_refused(kind: str, options: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        shader(Formula.parse(kind), ALPHA, Options(**options))
    assert said in str(caught.value)


def test_a_constant_beyond_float16_is_refused() -> None:
    assert "144269" in text_of("gaussian:dot", "glsl", 1e5)
    with pytest.raises(KernelError, match="not a finite float16"):
        shader(Formula.parse("gaussian:dot"), 1e5, Options(precision="float16"))
    with pytest.raises(UnknownNameError, match="float32, float16, mediump"):
        shader(Formula.parse("gaussian:dot"), 50.0, Options(precision="float64"))


@pytest.mark.parametrize("name", LANGUAGES)
def test_every_formula_that_has_no_table_and_reads_no_bits_is_written_in_every_language(name: str) -> None:
    for precision in ("float32", *LANGUAGES[name].precisions):
        for kind in KINDS:
            if not kind.startswith(("table", "bit-trick", "gaussian-quadratic")):
                assert writable(spelled(kind), name, precision), (kind, precision)


def test_the_end_of_a_file_names_the_language() -> None:
    ends = {
        "frag": "glsl",
        "cu": "cuda",
        "metal": "metal",
        "py": "numpy",
        "h": "c",
        "wgsl": "wgsl",
        "essl100": "essl100",
        "": None,
    }
    assert {end: language_of_file(end) for end in ends} == ends
    assert language_of_file("docx") == "docx"  # which no language is called


@pytest.mark.parametrize("language", ["glsl", "essl100", "essl300"])
def test_glsl_is_one_piece(language: str) -> None:
    for spelling, taken in (("lyon:dot:8", "r v"), ("blinn", "n h"), ("lyon:dot:8@reflect", "n l v")):
        text = text_of(spelling, language)
        assert f"float highlight({', '.join(f'vec3 {name}' for name in taken.split())})" in text
        assert "#version" not in text
        assert ("precision highp float;" in text) == (language != "glsl")


def test_numpy_takes_lists_and_broadcasts() -> None:
    run = built("numpy", text_of("lyon:dot:8", "numpy"), Path())
    assert run([0, 0, 1], [0, 0, 1]) == 1
    many = run(np.tile([0.0, 0.0, 1.0], (4, 1, 1)), np.ones((1, 5, 3)) / np.sqrt(3))
    assert many.shape == (4, 5)
    assert many.dtype == np.float32
    assert np.asarray(run([np.nan, 0, 1], [0, 0, 1])) == 0


def test_c_has_no_warning_and_every_language_a_text() -> None:
    assert {"-Wall", "-Wextra"} <= set(BUILDS["c"][1])
    assert all("static inline" in text_of(kind, "c") for kind in ("phong", "table-x", "bit-trick"))
