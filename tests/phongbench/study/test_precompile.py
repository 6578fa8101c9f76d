"""The second process of a cold start: it compiles what the study will need, and is never left behind."""

import json
import subprocess
import sys

import pytest

from phongbench.compiler import jit
from phongbench.study import precompile


def test_it_compiles_the_drivers_and_the_timed_kernels(cold_start):
    assert any("measure_cells" in name for name in cold_start.names)
    assert any("_pairs_kernel" in name for name in cold_start.names)
    assert not any("_values_kernel" in name for name in cold_start.names), (
        "the first process compiles these: two would race"
    )


def test_it_starts_only_where_the_cache_is_cold(tmp_path, monkeypatch, cold_start):
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    process = precompile.start(cold_start.plan)
    assert process is not None
    precompile.stop(process, at_once=True)
    assert process.poll() is not None
    (tmp_path / "kernels._pairs_kernel.nbi").write_text("")
    assert precompile.start(cold_start.plan) is None


def test_it_ends_with_the_study_that_ends_early(tmp_path, monkeypatch, cold_start):
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    begun = []

    def study():
        with precompile.beside(cold_start.plan) as process:
            begun.append(process.poll())
            begun.append(process)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study()
    assert begun[0] is None
    assert begun[1].poll() is not None


def test_formulas_of_the_user_are_left_to_the_first_process(cold_start):
    given = cold_start.plan.as_dict() | {"approximations": ["phong", "my-own"]}
    code = (
        "import runpy, phongbench.accuracy.sweep as e\n"
        "e.compile_drivers = lambda sweep: None\n"
        "runpy.run_module('phongbench.study.precompile', run_name='__main__')\n"
    )
    subprocess.run([sys.executable, "-c", code], input=json.dumps(given | {"timing": False}).encode(), check=True)
