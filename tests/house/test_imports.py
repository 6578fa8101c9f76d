"""Importing costs what it must: the command's help is quick, and the library needs neither web nor drawing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = {"llvmlite", "matplotlib", "numba", "numpy", "pandas", "pyarrow"}
# Run in a fresh interpreter; the modules go to stderr because stdout is the command's.
RUN_COMMAND = """
import sys
sys.argv[0] = "phongbench"
try:
    from phongbench.cli.main import main
    main(prog_name="phongbench")
finally:
    print(*sys.modules, file=sys.stderr)
"""
# What house.md lists; anything else at the top is a dot-file.
TOP_LEVEL = {
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "DECISIONS.md",
    "LICENSE",
    "Makefile",
    "README.md",
    "api",
    "constraints.txt",
    "phongbench",
    "pyproject.toml",
    "reports",
    "tests",
}


def interpreter(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs code in a fresh interpreter that stands outside the checkout's reach."""
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, env={**os.environ, **environment})


def roots(modules: str) -> set[str]:
    """The top-level names among the modules listed."""
    return {module.partition(".")[0] for module in modules.split()}


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["run", "--help"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    done = interpreter(RUN_COMMAND, *arguments)
    assert done.returncode == 0, done.stderr
    assert "phongbench" in done.stdout
    assert not HEAVY & roots(done.stderr)


def test_tab_completion_imports_nothing_heavy() -> None:
    request = {"_PHONGBENCH_COMPLETE": "bash_complete", "COMP_WORDS": "phongbench r", "COMP_CWORD": "1"}
    done = interpreter(RUN_COMMAND, **request)
    assert done.returncode == 0, done.stderr
    assert "plain,run" in done.stdout.splitlines()
    assert not HEAVY & roots(done.stderr)


def test_importing_the_library_imports_neither_web_nor_drawing() -> None:
    done = interpreter("import sys, phongbench, phongbench.formulas.approximations; print(*sys.modules)")
    assert done.returncode == 0, done.stderr
    assert not {"fastapi", "jinja2", "matplotlib", "starlette", "uvicorn"} & roots(done.stdout)


@pytest.mark.parametrize("folder", ["api", "reports", "tests"])
def test_folders_that_are_not_packages_stay_so(root: Path, folder: str) -> None:
    # A package named api, reports or tests would shadow its users' own.
    assert (root / folder).is_dir()
    assert not (root / folder / "__init__.py").exists()


def test_test_folders_are_not_packages(files: list[Path]) -> None:
    assert not [file for file in files if file.parts[0] == "tests" and file.name == "__init__.py"]


def test_the_top_level_holds_what_the_house_lists_and_dot_files(files: list[Path]) -> None:
    names = {file.parts[0] for file in files}
    assert {name for name in names if not name.startswith(".")} == TOP_LEVEL
