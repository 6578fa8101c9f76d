"""What `import phongbench` offers: cheap to import, complete, and each example of its documentation runs."""

import doctest
import inspect
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import phongbench as pb
from phongbench.errors import InputError, UnknownNameError

#: names of the contract that are functions: each shows an example
FUNCTIONS = (
    "specular",
    "curve",
    "shade",
    "render",
    "run",
    "load",
    "recommend",
    "front",
    "shader",
    "moments",
    "inverse_line",
    "inverse_photometric",
    "load_file",
)
OTHERS = ("Approximation", "Cost", "ALPHA", "GAMMA", "Source", "Formula", "Run", "Picture", "elementary")
TINY = {
    "alphas": [10], "gammas": [8], "approximations": ["lyon"], "precisions": ["float32"], "samples": 2000, "probes": [],
}  # fmt: skip
OWN = '''\
"""A reciprocal power."""

import phongbench as pb


def rational(cosine_deficit: float, beta: float, n: int) -> float:
    return 1.0 / pb.elementary.squared(1.0 + beta * cosine_deficit, n)


SPEC = pb.Approximation(
    name="rational",
    title="Reciprocal power",
    kind="approximation",
    formula="1 / (1 + beta lambda)^gamma, gamma = 2^n",
    source=pb.Source("OWN", "An example", 2026),
    kernel=rational,
    coefficients=lambda s: {"beta": s.exponent / 2**s.n, "n": s.n},
    domain="large gamma",
    cost=pb.Cost("one division"),
    parameters=(pb.ALPHA, pb.GAMMA),
)
'''


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an own formula and a study of a few kernels, timed."""
    folder = tmp_path_factory.mktemp("face")
    (folder / "rational.py").write_text(OWN)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        pb.run(**TINY, timing_budget=1.0, jobs=2)
    return folder


@pytest.fixture
def here(home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(home)
    return home


def test_importing_it_imports_nothing_heavy() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "import sys, phongbench; print(*sys.modules)"],
        check=True,
        capture_output=True,
        text=True,
    )
    assert not {"numpy", "numba", "pandas", "click", "typing"} & set(done.stdout.split())


def test_it_offers_what_is_promised_and_nothing_else() -> None:
    assert sorted(pb.__all__) == sorted((*FUNCTIONS, *OTHERS))
    assert set(pb.__all__) <= set(dir(pb))
    assert all(getattr(pb, name) is not None for name in pb.__all__)
    with pytest.raises(AttributeError, match="no attribute 'speculr'"):
        pb.speculr  # noqa: B018


@pytest.mark.parametrize("name", [*FUNCTIONS, "Approximation", "Cost", "Formula", "Run", "Picture"])
def test_each_is_documented(name: str) -> None:
    assert len(inspect.getdoc(getattr(pb, name)) or "") > 60


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_example_runs_as_shown(name: str, here: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in ("run", "recommend"):
        monkeypatch.chdir(tmp_path)
    found = doctest.DocTestFinder(recurse=False).find(getattr(pb, name), name, globs={"pb": pb})
    assert [len(test.examples) > 0 for test in found] == [True]
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    told: list[str] = []
    runner.run(found[0], out=told.append)
    assert runner.failures == 0, "".join(told)


def test_a_run_has_tables_and_answers(here: Path) -> None:
    run = pb.load()
    assert run.path.parent.name == "phongbench-runs"
    assert set(run.accuracy["approximation"]) == {"phong", "lyon"}
    assert not run.timing.empty
    front = run.front(alpha=10)
    assert {"phong", "lyon:dot:8", "lyon:cross:8:minimax"} <= set(front["name"])
    assert front.attrs["run"] == run.id
    best = run.recommend(alpha=10, max_error=0.05)
    assert best.loc[0, "why"]
    assert best.attrs["basis"] == "run"
    none = pb.recommend(alpha=10, max_error=1e-9, run=run)
    assert none.empty
    assert none.attrs["nearest_miss"] is not None
    assert run.id in run._repr_html_()
    assert (pb.load(run.path).id, pb.load(run.id).id) == (run.id, run.id)


def test_a_report_is_drawn(here: Path, tmp_path: Path) -> None:
    # The one report of a measured run that has all figures: other tests draw a few, those of reports a made-up run.
    page = pb.load().report(tmp_path / "report", single_file=True)
    assert page.parent == tmp_path / "report"
    assert page.read_text().startswith("<!DOCTYPE html>")


def test_an_own_formula_is_evaluated_drawn_and_measured(here: Path, tmp_path: Path) -> None:
    own = pb.load_file("rational.py")
    exact = pb.specular([0, 0, 1], [0, 0.6, 0.8], alpha=10)
    value = pb.specular([0, 0, 1], [0, 0.6, 0.8], "rational:dot:64", alpha=10, own=own)
    assert value == pytest.approx((1 + 10 / 64 * 0.2) ** -64)
    assert value != exact
    assert "highlight" in pb.shader("rational:dot:8", alpha=10, own=own)
    assert pb.curve("rational:dot:8", alpha=10, own=own)["error"].max() > 0
    assert pb.render("chequerboard", specular="rational:dot:8", size=(16, 9), own=own).array.shape == (9, 16, 3)
    measured = pb.run(**TINY | {"approximations": ["rational"]}, timing=False, own=own, out=tmp_path / "study")
    assert "rational" in set(measured.accuracy["approximation"])
    with pytest.raises(UnknownNameError, match="rational"):
        pb.specular([0, 0, 1], [0, 0, 1], "rational:dot:8", alpha=10)


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ({"alpha": [10]}, "unknown field of a plan 'alpha'"),
        ({"alphas": ["ten"]}, "alphas"),
        ({"gammas": [2.5]}, "gammas"),
        ({"gammas": [7]}, "power of two"),
        ({"timing": 1}, "timing"),
        ({"samples": "many"}, "samples"),
        ({"preset": "huge"}, "quick"),
    ],
)
def test_a_plan_that_cannot_be_is_refused(plan: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        pb.run(out=tmp_path / "none", **plan)
    assert not (tmp_path / "none").exists()


def equal(value: float) -> Any:
    return np.full(3, float(value))


def test_shading_takes_numpys_numbers_and_names_the_field_at_fault() -> None:
    scene = {
        "material": {"ambient": (0, 0, 0), "diffuse": equal(0.5), "specular": equal(1), "shininess": 50},
        "lights": [{"direction": equal(1)}],
        "viewer": {"direction": equal(1)},
    }
    up = equal(1)[None] / 3**0.5
    assert pb.shade(up, up, **scene).tolist() == [pytest.approx([1.5, 1.5, 1.5])]
    assert pb.shade(up.astype("f4"), up.astype("f4"), **scene).dtype == "f4"
    for change, field in (
        ({"viewer": {}}, "viewer"),
        ({"lights": [{"position": 3}]}, "lights"),
        ({"colour": 1}, "colour"),
    ):
        with pytest.raises(InputError, match=field):
            pb.shade(up, up, **scene | change)


def test_a_picture_is_shown_and_saved(tmp_path: Path) -> None:
    picture = pb.render("chequerboard", size=(16, 9), specular="lyon:dot:8:minimax")
    assert picture._repr_png_().startswith(b"\x89PNG")
    picture.save(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes() == picture._repr_png_()
    assert "skipped" in picture.ledger
