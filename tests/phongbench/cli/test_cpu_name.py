"""`--cpu-name`: rows for a processor that all machines of a study have."""

import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba  # noqa: F401  so that it is too late here
import pytest

from phongbench.errors import InputError
from phongbench.results import runs
from phongbench.study.merge import joinable
from phongbench.support.processor import pin

#: what `cold_start` has compiled for, and few kernels more
PLAN = """
approximations = "phong"
alphas = 10
strata = "highlight"
spaces = "reflect"
raw = "phong/each"
precisions = "float32"
samples = 500
probes = []
timing = false
"""
FEW = "--alpha 10 --gamma 8 --only lyon --lambda dot --precision float32 --probe none --samples 500 --no-timing"


def command(folder: Path, *words: str, **more: Any) -> "subprocess.CompletedProcess[str]":
    """The command in a process of its own, since a processor is chosen before the compiler is loaded."""
    whole = [sys.executable, "-m", "phongbench", *words]
    return subprocess.run(whole, cwd=folder, capture_output=True, text=True, check=False, **more)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names processors of x86")
def test_shards_for_an_older_processor_are_measured_and_joined_for_it_alone(tmp_path: Path, cold_start: Any) -> None:
    older, env = ("--cpu-name", "x86-64-v3"), cold_start.environment
    (tmp_path / "plan.toml").write_text(PLAN)
    shard = command(tmp_path, "run", "plan.toml", "--shard", "1/1", "--out", "a", *older, env=env)
    assert shard.returncode == 0, shard.stderr
    assert runs.load(tmp_path / "a").manifest["shard"]["arithmetic"]["cpu"] == "x86-64-v3"
    with pytest.raises(InputError, match=r"are of other arithmetic than this machine.*cpu .* instead of x86-64-v3"):
        joinable([tmp_path / "a"])
    joined = command(tmp_path, "merge", "a", "--out", "b", "--no-report", *older, env=env)
    assert joined.returncode == 0, joined.stderr
    assert runs.load(tmp_path / "b").complete


@pytest.mark.parametrize(
    ("name", "message"), [("no-such-chip", "the compiler knows no processor"), ("a b", "is no name of a processor")]
)
def test_an_unknown_processor_is_refused_with_advice(tmp_path: Path, name: str, message: str) -> None:
    found = command(tmp_path, "run", *FEW.split(), "--cpu-name", name)
    assert (found.returncode, found.stdout) == (2, "")
    assert message in found.stderr
    assert "x86-64-v3 or haswell" in found.stderr
    assert not list(tmp_path.iterdir())


def test_it_must_be_said_before_the_compiler_is_there() -> None:
    with pytest.raises(InputError, match="loaded already"):
        pin("haswell")
