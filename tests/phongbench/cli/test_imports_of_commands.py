"""A command imports what its answer needs: the compiler where something is evaluated, tables where rows are read."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

#: not llvmlite: its list of the processor's features tells whether two machines are of one kind
COMPILER = {"numba", "scipy"}
TABLES = {"pandas", "pyarrow"}
OTHERS = {"fastapi", "jinja2", "matplotlib", "mpmath"}
WITHOUT = [
    pytest.param("front latest --alpha 50", COMPILER | {"pandas"} | OTHERS, id="front"),
    pytest.param("show latest", COMPILER | {"pandas"} | OTHERS, id="show"),
    pytest.param("recommend --alpha 50 --max-error 1/255", COMPILER | {"pandas"} | OTHERS, id="recommend"),
    pytest.param("list", COMPILER | TABLES | OTHERS, id="list"),
    pytest.param("shader lyon:dot:8 --alpha 50", COMPILER | TABLES | OTHERS, id="shader"),
    pytest.param("shader gaussian --alpha 50 --target rdna2", COMPILER | TABLES | OTHERS, id="shader of a target"),
]
# the modules go to stderr, because stdout is the command's
RUN_COMMAND = """
import sys
from phongbench.cli.main import main
try:
    main(prog_name="phongbench")
finally:
    print("modules:", *sys.modules, file=sys.stderr)
"""


@pytest.mark.parametrize(("words", "spared"), WITHOUT)
def test_a_command_imports_what_its_answer_needs(
    words: str, spared: set[str], stored: Callable[..., Any], tmp_path: Path
) -> None:
    stored()
    assert not spared & _imported(words, tmp_path)


@pytest.mark.parametrize("words", ["front latest --alpha 50", "show latest", "recommend --alpha 50 --max-error 1/255"])
def test_an_answer_that_is_given_again_needs_no_tables(words: str, stored: Callable[..., Any], tmp_path: Path) -> None:
    stored()
    _imported(words, tmp_path)  # in a process of its own: what other tests did here is no part of an answer
    assert not (COMPILER | TABLES | OTHERS) & _imported(words, tmp_path)


def _imported(words: str, folder: Path) -> set[str]:
    """The top-level names of what this command imports, run in a folder."""
    command = [sys.executable, "-c", RUN_COMMAND, *words.split()]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    done = subprocess.run(command, check=False, capture_output=True, text=True, cwd=folder, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    imported = {name.partition(".")[0] for name in done.stderr.rpartition("modules:")[2].split()}
    assert "phongbench" in imported
    return imported


def test_the_machine_is_the_same_before_and_after_numba_is_loaded() -> None:
    """Or a run's times would be another machine's to whoever reads them without compiling anything."""
    code = (
        "import sys\n"
        "from phongbench.compiler import late_numba\n"
        "from phongbench.results.arithmetic import arithmetic\n"
        "from phongbench.results.provenance import flags\n"
        "before = flags(), dict(arithmetic())\n"
        "assert 'numba' not in sys.modules\n"
        "late_numba.load()\n"
        "arithmetic.cache_clear()\n"
        "assert before == (flags(), dict(arithmetic()))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_waits_for_numba_is_told_once_and_later_things_at_once() -> None:
    """In a process of its own: here numba is loaded already."""
    code = (
        "import sys\n"
        "from phongbench.compiler import late_numba\n"
        "told = []\n"
        "types = late_numba.Late('numba.types')\n"
        "late_numba.when_loaded(lambda: told.append(str(types.float32)))\n"
        "assert not told and 'numba' not in sys.modules\n"
        "assert str(types.float64) == 'float64' and told == ['float32']\n"
        "late_numba.when_loaded(lambda: told.append('late'))\n"
        "late_numba.load()\n"
        "assert told == ['float32', 'late'], told\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
