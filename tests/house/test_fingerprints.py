"""A change of any source changes the code's fingerprint, and of a compiled one the kernel cache's key too.

Stale kernels would be silent: both are rooted at the package, and this is what says so.
"""

import shutil
from pathlib import Path

import pytest

import phongbench
from phongbench.compiler.jit import key_of_sources
from phongbench.results.provenance import digest_of_sources

PACKAGE = Path(phongbench.__file__).parent
#: one source of each room that is compiled, or inlined into what is
COMPILED = (
    "compiler/intrinsics.py",
    "compiler/elementary.py",
    "compiler/kernel_source.py",
    "compiler/polynomials.py",
    "formulas/coordinate_kernels.py",
    "formulas/lambda_forms.py",
    "formulas/pair_kernels.py",
    "inputs/pairs.py",
    "inverse/solver.py",
    "timing/epoch_loop.py",
    "shading/tile_loop.py",
    "scenes/ray_kernels.py",
    "accuracy/reductions.py",
)
#: one source of each room that is not
PLAIN = (
    "errors.py",
    "support/documents.py",
    "results/schema.py",
    "targets/harness.py",
    "analysis/front.py",
    "benchmarks/false_alarms.py",
    "study/forecast.py",
    "cli/main.py",
    "face/run.py",
)


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package whose sources may be changed."""
    package = tmp_path_factory.mktemp("sources") / "phongbench"
    return Path(shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__")))


@pytest.mark.parametrize(("name", "compiled"), [*((n, True) for n in COMPILED), *((n, False) for n in PLAIN)])
def test_a_changed_source_changes_what_it_must(copied: Path, name: str, compiled: bool) -> None:
    text = (copied / name).read_text()
    key, code = key_of_sources(copied), digest_of_sources(copied)
    try:
        (copied / name).write_text(text + "# another line\n")
        assert digest_of_sources(copied) != code
        assert (key_of_sources(copied) != key) is compiled
    finally:
        (copied / name).write_text(text)
    assert (key_of_sources(copied), digest_of_sources(copied)) == (key, code)


def test_every_room_is_asked() -> None:
    rooms = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert rooms == {Path(name).parts[0] for name in (*COMPILED, *PLAIN) if "/" in name}


def test_a_source_that_moves_changes_both(copied: Path) -> None:
    key, code = key_of_sources(copied), digest_of_sources(copied)
    (copied / "inputs/pairs.py").rename(copied / "shading/pairs.py")
    try:
        assert key_of_sources(copied) != key
        assert digest_of_sources(copied) != code
    finally:
        (copied / "shading/pairs.py").rename(copied / "inputs/pairs.py")
