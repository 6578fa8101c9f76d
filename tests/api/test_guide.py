"""The examples of the guide's page on the service, run against a server."""

import re
from pathlib import Path

import httpx2 as httpx
import pytest
from curl_words import HERE, sent

PAGE = Path(__file__).resolve().parents[2] / "reports" / "docs" / "service.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)


def curls() -> list[str]:
    lines = [line for block in blocks("console") for line in block.splitlines()]
    return [line.removeprefix("$ ") for line in lines if line.startswith("$ curl ")]


@pytest.mark.parametrize("command", curls())
def test_a_curl_shown_is_answered(live: httpx.Client, command: str) -> None:
    method, path, options, out = sent(command)
    answer = live.request(method, path, **options)
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
