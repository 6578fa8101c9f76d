"""The examples of the guide's page on the service, run against a server."""

import argparse
import re
import shlex
from pathlib import Path

import httpx2 as httpx
import pytest

PAGE = Path(__file__).resolve().parents[2] / "reports" / "docs" / "service.md"
HERE = "http://localhost:8000"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)


def curls() -> list[str]:
    lines = [line for block in blocks("console") for line in block.splitlines()]
    return [line.removeprefix("$ ") for line in lines if line.startswith("$ curl ")]


def as_curl(command: str, client: httpx.Client) -> tuple[httpx.Response, str | None]:
    """Send what curl would send; curl itself need not be installed."""
    words = argparse.ArgumentParser()
    words.add_argument("url")
    words.add_argument("-H", dest="headers", action="append", default=[])
    words.add_argument("-d", dest="data")
    words.add_argument("-o", dest="out")
    told = words.parse_args(shlex.split(command)[1:])
    assert told.url.startswith(HERE)
    headers = dict(header.split(": ", 1) for header in told.headers)
    method = "GET" if told.data is None else "POST"
    return client.request(method, told.url.removeprefix(HERE), headers=headers, content=told.data), told.out


@pytest.mark.parametrize("command", curls())
def test_a_curl_shown_is_answered(live: httpx.Client, command: str) -> None:
    answer, out = as_curl(command, live)
    assert answer.status_code == 200, answer.text
    assert answer.content
    assert out is None or answer.headers["content-type"].startswith("image/")


def test_there_are_examples_of_every_kind() -> None:
    assert len(curls()) >= 5
    assert len(blocks("python")) >= 2


@pytest.mark.parametrize("script", blocks("python"), ids=["specular", "shade"])
def test_a_script_shown_runs(live: httpx.Client, script: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert HERE in script
    exec(compile(script.replace(HERE, str(live.base_url).rstrip("/")), "service.md", "exec"), {})
    assert capsys.readouterr().out.startswith("(")
