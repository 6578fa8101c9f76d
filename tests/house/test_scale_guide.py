"""The page on several machines: its compose file is one, and its batch script asks for what `run` takes."""

import os
import re
import shlex
import subprocess
from pathlib import Path

import dask.config
import pytest
import yaml
from click.testing import CliRunner
from distributed.cli import dask_scheduler, dask_worker

from phongbench.cli.main import main
from phongbench.study.cluster.connection import QUIET

PAGE = (Path(__file__).resolve().parents[2] / "reports" / "docs" / "scale.md").read_text()


def block(language: str) -> str:
    """The page's fenced block of this language, of which there is one."""
    (text,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
    return str(text)


def test_the_compose_file_starts_a_scheduler_and_workers_that_find_it() -> None:
    services = yaml.safe_load(block("yaml"))["services"]
    assert services["worker"]["build"] == services["scheduler"]["build"]
    assert services["worker"]["depends_on"] == ["scheduler"]
    for service, module in (("scheduler", dask_scheduler), ("worker", dask_worker)):
        program, name, *words = shlex.split(services[service]["command"])
        assert (program, name) == ("dask", service)
        known = {option for each in module.main.params for option in each.opts}
        assert {word for word in words if word.startswith("--")} <= known
    port = services["scheduler"]["command"].split("--port ")[1]
    assert f"tcp://scheduler:{port}" in services["worker"]["command"]
    assert services["scheduler"]["ports"] == [f"{port}:{port}"]


def test_the_workers_of_the_compose_file_watch_themselves_as_little_as_ours() -> None:
    told = yaml.safe_load(block("yaml"))["services"]["worker"]["environment"]
    ours: dict[str, object] = {}
    with dask.config.set(QUIET, config=ours):
        assert dask.config.collect_env(told) == ours


def test_the_batch_script_begins_its_part_and_goes_on_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shim = tmp_path / "phongbench"
    shim.write_text('#!/bin/sh\necho "$@"\n')
    shim.chmod(0o755)
    smaller = (
        "--preset quick --only lyon --alpha 10 --gamma 8 --samples 500 --precision float32 --probe none --no-timing"
    )
    for started in range(3):
        env = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "SLURM_ARRAY_TASK_ID": "2"}
        told = subprocess.run(["sh", "-c", block("sh")], env=env, capture_output=True, text=True, check=True).stdout
        assert ("--resume" in told) == (started > 0)
        words = told.replace("--preset full", smaller).replace("2/64", "2/2")
        found = CliRunner().invoke(main, words.split())
        assert found.exit_code == 0, found.output
    assert (tmp_path / "part-2" / "manifest.json").exists()
