"""A user's file of approximations is taken like ours, or refused with the file and line at fault."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import phongbench as pb
from phongbench.cli.main import main
from phongbench.errors import InputError, KernelError
from phongbench.formulas.kernel import evaluate
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Setting
from phongbench.formulas.user_files import installed, load_file, registry_with
from phongbench.testing import CHECKS

GOOD = '''\
from phongbench.compiler import elementary
from phongbench.formulas.citations import PHONGBENCH
from phongbench.formulas.spec import Approximation, Cost

def parabola(cosine_deficit: float, alpha: float) -> float:
    """One parabola.

    cosine_deficit  float      lambda
    alpha           float > 0  shininess
    returns         float      highlight in [0, 1]

    Formula  max(0, 1 - alpha * lambda / 2) ** 2
    Source   PHONGBENCH
    Domain   a rough sketch of a highlight
    """
    return elementary.squared(elementary.positive_part(1.0 - 0.5 * alpha * cosine_deficit), 1)

SPEC = Approximation(
    name="parabola", title="Parabola", kind="approximation", formula="max(0, 1 - u/2)^2", source=PHONGBENCH,
    kernel=parabola, coefficients=lambda s: {"alpha": s.alpha}, domain="nowhere good", cost=Cost("one squaring"),
)
'''


#: entry point and what its module holds, of a distribution that is installed
PLUG_INS = {
    "one": ("mine:SPEC", GOOD),
    "several": ("mine:BOTH", GOOD + "from dataclasses import replace\nBOTH = (SPEC, replace(SPEC, name='other'))\n"),
    "module": ("mine", GOOD),
}


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], Path]]:
    """Puts a distribution `highlights-and-more` 1.2 with this entry point and this module on the path."""
    monkeypatch.syspath_prepend(tmp_path)

    def put(entry: str, module: str) -> Path:
        about = tmp_path / "highlights_and_more-1.2.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: highlights-and-more\nVersion: 1.2\n")
        (about / "entry_points.txt").write_text(f"[phongbench.approximations]\nplugged = {entry}\n")
        installed.cache_clear()
        return written(tmp_path, module)

    yield put
    installed.cache_clear()
    sys.modules.pop("mine", None)


@pytest.mark.parametrize("kind", PLUG_INS)
def test_an_installed_distribution_adds_its_formulas(kind: str, install: Callable[[str, str], Path]) -> None:
    install(*PLUG_INS[kind])
    assert set(registry_with([])) == {*REGISTRY, "parabola"} | ({"other"} if kind == "several" else set())
    assert "parabola" not in REGISTRY
    assert pb.specular([0, 0, 1], [0, 0.6, 0.8], "parabola:dot", alpha=4) == pytest.approx(0.36)
    shown = CliRunner().invoke(main, ["shader", "parabola:dot", "--alpha", "4"])
    assert (shown.exit_code, "float highlight" in shown.output) == (0, True)


@pytest.mark.parametrize(
    ("entry", "module", "said"),
    [
        ("mine:SPEC", "raise RuntimeError('broken')\n", "RuntimeError: broken"),
        ("mine:NONE", GOOD, "AttributeError"),
        ("mine:SPEC", "SPEC = 3\n", "mine:SPEC is no approximation"),
        ("mine:SPEC", GOOD.replace('"parabola"', '"lyon"'), "phongbench has an approximation 'lyon'"),
        (
            "mine:SPEC",
            GOOD.replace("return elementary", "alpha = alpha ** 2\n    return elementary"),
            "cannot be compiled",
        ),
    ],
)
def test_a_plug_in_that_fails_is_left_out_with_a_warning_that_names_it(
    entry: str, module: str, said: str, install: Callable[[str, str], Path]
) -> None:
    install(entry, module)
    with pytest.warns(RuntimeWarning, match=f"'plugged' of highlights-and-more 1.2 is left out: .*{said}"):
        assert registry_with([]) == REGISTRY


@pytest.mark.filterwarnings("default")
def test_the_command_tells_of_a_failing_plug_in_in_one_line_and_goes_on(install: Callable[[str, str], Path]) -> None:
    install("mine:SPEC", "raise RuntimeError('broken')\n")
    shown = CliRunner().invoke(main, ["shader", "lyon:dot:8", "--alpha", "50"])
    assert shown.exit_code == 0
    assert shown.stderr.splitlines() == [
        "phongbench: the plug-in 'plugged' of highlights-and-more 1.2 is left out: RuntimeError: broken"
    ]


def test_help_loads_no_plug_in(install: Callable[[str, str], Path]) -> None:
    install("mine:SPEC", "raise SystemExit('loaded')\n")
    assert CliRunner().invoke(main, ["shader", "--help"]).exit_code == 0
    assert "mine" not in sys.modules


@pytest.mark.parametrize(
    "line", ["from phongbench.spec import Approximation", "from phongbench import powers", "import phongbench.vectors"]
)
def test_a_file_for_modules_that_have_moved_is_told_the_new_import(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError) as caught:
        load_file(written(tmp_path, f"{line}\n"))
    assert caught.value.where == f"{tmp_path / 'mine.py'}:1"
    assert "import phongbench as pb" in str(caught.value.fix)


def written(folder: Path, text: str, name: str = "mine.py") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_a_file_of_our_shape_is_taken_like_ours_and_passes_our_checks(tmp_path: Path) -> None:
    (spec,) = load_file(written(tmp_path, GOOD))
    assert evaluate(spec, Setting(4.0), np.array([0.0, 0.25, 1.0])).tolist() == [1, 0.25, 0]
    for check in CHECKS:
        check(spec)


def test_the_registry_with_files_holds_ours_and_theirs_and_leaves_ours_alone(tmp_path: Path) -> None:
    extended = registry_with([written(tmp_path, GOOD)])
    assert set(extended) == {*REGISTRY, "parabola"}
    assert "parabola" not in REGISTRY
    assert registry_with([]) == REGISTRY


def test_a_file_may_hold_several(tmp_path: Path) -> None:
    several = GOOD + "from dataclasses import replace\nSPECS = (SPEC, replace(SPEC, name='other'))\n"
    assert [s.name for s in load_file(written(tmp_path, several))] == ["parabola", "other"]


def refusal(path: Path) -> tuple[str, str]:
    with pytest.raises(InputError) as caught:
        load_file(path)
    assert caught.value.fix
    return caught.value.what, str(caught.value.where)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none.py"
    assert refusal(path) == ("cannot read the file of the formula: No such file or directory", str(path))


def test_a_file_that_is_not_python_by_name_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD, "mine.txt")
    assert refusal(path) == ("not a Python file", str(path))


@pytest.mark.parametrize("text", ["", "SPEC = 3\n", "SPECS = ()\n", "SPECS = 4\n", "SPECS = ('lyon',)\n"])
def test_a_file_without_an_approximation_is_refused(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    assert refusal(path) == ("no approximation in this file", str(path))


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("x = 1\nif x\n", 2, "expected ':'"),
        ("import phongbench\nraise RuntimeError('no')\n", 2, "RuntimeError: no"),
        ("import no_such_module\n", 1, "ModuleNotFoundError: No module named 'no_such_module'"),
        ("def f():\n    return 1 / 0\n\nf()\n", 2, "ZeroDivisionError: division by zero"),
        (GOOD.replace("cosine_deficit: float, ", "angle: float, "), 18, "the kernel of 'parabola' must take cosine"),
        (GOOD.replace("s.alpha}", "s.beta}"), 20, "AttributeError: 'Setting' object has no attribute 'beta'"),
    ],
)
def test_what_goes_wrong_while_it_runs_is_reported_with_its_line(
    tmp_path: Path, text: str, line: int, message: str
) -> None:
    path = written(tmp_path, text)
    what, where = refusal(path)
    assert what.startswith(message)
    assert where == f"{path}:{line}"


def test_a_name_of_ours_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD.replace('name="parabola"', 'name="lyon"'))
    assert refusal(path) == ("phongbench has an approximation 'lyon'", str(path))


def test_the_same_name_from_two_files_is_refused(tmp_path: Path) -> None:
    files = [written(tmp_path, GOOD, "one.py"), written(tmp_path, GOOD, "two.py")]
    with pytest.raises(InputError, match="'parabola' is loaded twice"):
        registry_with(files)


def test_a_name_that_would_not_do_in_files_and_addresses_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD.replace('name="parabola"', 'name="My Parabola"'))
    assert refusal(path)[0] == "'My Parabola' is not a name"


def test_coefficients_that_do_not_fit_the_kernel_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD.replace('{"alpha": s.alpha}', '{"beta": s.alpha}'))
    assert refusal(path)[0] == "the coefficients of 'parabola' are ['beta'], but its kernel takes ['alpha']"


def test_a_kernel_that_cannot_be_compiled_is_refused_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD.replace("return elementary", "alpha = alpha ** 2\n    return elementary"))
    with pytest.raises(KernelError) as caught:
        load_file(path)
    assert caught.value.where == f"{path}:16"


def test_an_edited_file_is_compiled_anew_in_the_next_process(tmp_path: Path) -> None:
    """Compiled kernels are kept between processes; one of an older version of the file must not be found."""
    program = (
        "import sys, numpy as np; from phongbench.formulas.kernel import evaluate\n"
        "from phongbench.formulas.user_files import load_file; from phongbench.formulas.spec import Setting\n"
        "print(evaluate(load_file(sys.argv[1])[0], Setting(4.0), np.array([0.25]))[0])\n"
    )
    environment = {**os.environ, "PHONGBENCH_CACHE": str(tmp_path / "cache")}
    values = []
    for text in (GOOD, GOOD.replace("0.5 * alpha", "0.25 * alpha"), GOOD):
        path = written(tmp_path, text)
        command = [sys.executable, "-c", program, str(path)]
        values.append(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)
    assert [float(v) for v in values] == [0.25, 0.75**2, 0.25]
