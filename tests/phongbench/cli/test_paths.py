"""Every path that a command takes, wrong in every way: exit code 2 and a short message that names it."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import click
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from phongbench.cli.main import main
from phongbench.inputs.plan import preset
from phongbench.results import runs, schema
from phongbench.study.shard_run import own_arithmetic

#: what a command is given beside the path under test: its arguments, and options that keep it from long work
COMMANDS: dict[str, tuple[list[str], list[str]]] = {
    "run": ([], ["--no-timing", "--no-report", "--samples", "1"]),
    "merge": (["good-shard"], ["--out", "joined"]),
    "report": (["good-run"], []),
    "show": (["good-run"], []),
    "verify": (["good-run"], []),
    "claims": (["good-run"], []),
    "front": (["good-run"], ["--alpha", "10"]),
    "recommend": ([], ["--max-error", "0.1", "--alpha", "10"]),
    "compare": (["good-run", "good-run"], []),
    "shade": (["good.json"], []),
    "shader": (["lyon:dot:8"], ["--alpha", "50"]),
    "render": (["chequerboard"], []),
    "approximations": ([], []),
    "bench": ([], []),
    "serve": ([], []),
}
#: parameters that name a run, a request or a scene: texts to click, as each may be no path
NAMES = {"run_name", "run_a", "run_b", "request_file", "scene"}
#: those of them that are folders
RUNS = NAMES - {"request_file", "scene"} | {"runs", "folders"}
#: how a path can be wrong that is read, and one that is written to
READ = ("missing", "folder", "below-a-file", "broken-link", "link-to-itself", "long", "empty-name")
WRITTEN = ("below-a-file", "link-to-itself", "below-a-link-to-itself", "long", "empty-name")
#: suffixes that say what a file is, where a command looks at them before anything else
SUFFIXES = {"scene": ".toml", "files": ".py", "shade": ".json", "render": ".png", "bench": ".json"}


def parameters() -> Iterator[tuple[str, click.Parameter]]:
    """Every parameter of every command that names a file or a folder."""
    for name, command in main.commands.items():
        for parameter in command.params:
            if isinstance(parameter.type, click.Path) or parameter.name in NAMES:
                yield name, parameter


def cases() -> Iterator[tuple[str, click.Parameter, str]]:
    """Each of these with each way to be wrong."""
    for name, parameter in parameters():
        folder = (name, parameter.name) in {("run", "out"), ("merge", "out"), ("report", "out")}
        ways = (*WRITTEN, "a-file" if folder else "folder") if parameter.name == "out" else READ
        if name == "serve":  # where no run is yet, there is nothing to refuse
            ways = ("a-file", "broken-link", "empty-name")
        for way in ways:
            yield name, parameter, way


def wrong(way: str, suffix: str) -> str:
    """Make a path that is wrong in this way."""
    path = Path(f"{way}{suffix}")
    if way == "folder":
        path.mkdir()
    elif way == "broken-link":
        path.symlink_to(f"nowhere{suffix}")
    elif way.endswith("link-to-itself"):
        Path(f"link-to-itself{suffix}").symlink_to(f"link-to-itself{suffix}")
        path = Path(f"link-to-itself{suffix}/{path}" if way.startswith("below") else path)
    elif way.endswith("a-file"):
        Path("a-file").write_text("")
        path = Path("a-file", f"x{suffix}") if way.startswith("below") else Path("a-file")
    elif way == "long":
        path = Path("x" * 300 + suffix)
    return "" if way == "empty-name" else str(path)


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Run a command in a folder with a run and a request that are good enough to get to the path."""
    monkeypatch.chdir(tmp_path)
    folder = Path("good-run")
    folder.mkdir()
    columns = {column.name: ["x", "y"] if column.kind == "str" else [0, 1] for column in schema.ACCURACY.columns}
    rows = pd.DataFrame(columns).astype(schema.ACCURACY.types).assign(device=schema.CPU)
    known = {"schema": runs.SCHEMA, "plan": preset("quick").as_dict(), "code": "", "provenance": {}, "seed": 1}
    files = {"accuracy.parquet": runs.write_table(folder, "accuracy", rows)}
    runs.write_manifest(folder, {**known, "run": folder.name, "state": "complete", "files": files})
    shard = {"index": 1, "count": 1, "arithmetic": own_arithmetic([]), "failures": {}, "parts": {}}
    whole = {**known, "run": "good-shard", "state": "partial", "files": {}, "shard": shard}
    Path("good-shard").mkdir()
    runs.write_manifest(Path("good-shard"), whole)
    Path("good.json").write_text("{}")
    return lambda *words: CliRunner().invoke(main, list(words))


def words_for(name: str, parameter: click.Parameter, path: str) -> list[str]:
    """The command line that gives a command this path as this parameter, and all else as usual."""
    given, options = COMMANDS[name]
    if (name, parameter.name) == ("recommend", "materials"):
        options = options[:2]  # a file of materials stands instead of --alpha
    if isinstance(parameter, click.Option):
        return [name, *given, *options, parameter.opts[0], path]
    places = [one.name for one in main.commands[name].params if isinstance(one, click.Argument)]
    at = places.index(parameter.name)
    return [name, *given[:at], path, *given[at + 1 :], *options]


@pytest.mark.parametrize(("name", "parameter", "way"), list(cases()), ids=lambda part: getattr(part, "name", part))
def test_a_path_that_cannot_be_meant_is_wrong_input(
    call: Callable[..., Result], name: str, parameter: click.Parameter, way: str
) -> None:
    suffix = SUFFIXES.get(str(parameter.name), SUFFIXES.get(name, "") if parameter.name == "out" else "")
    path = wrong(way, suffix)
    before = sorted(Path().rglob("*"))
    found = call(*words_for(name, parameter, path))
    assert isinstance(found.exception, SystemExit), found.exception
    assert found.exit_code == 2, found.output
    assert found.stdout == ""
    assert any(said in found.stderr for said in ([Path(path).name, "nowhere"] if path else ["is empty"]))
    assert len(found.stderr.splitlines()) <= 4
    assert sorted(Path().rglob("*")) == before


def test_the_table_knows_every_path_of_every_command() -> None:
    """A new command, or a new path of an old one, is in this test by itself; its usual words must be added."""
    assert {name for name, _ in parameters()} == COMMANDS.keys()
    kinds = {type(parameter.type) for command in main.commands.values() for parameter in command.params}
    assert [kind for kind in kinds if issubclass(kind, click.Path | click.File)] == [click.Path]


@pytest.mark.parametrize(("name", "parameter"), list(parameters()), ids=lambda part: getattr(part, "name", part))
def test_what_may_not_be_read_is_wrong_input_and_what_may_not_be_written_to_a_fault_of_the_disk(
    call: Callable[..., Result], name: str, parameter: click.Parameter
) -> None:
    out = parameter.name == "out"
    suffix = SUFFIXES.get(str(parameter.name), SUFFIXES.get(name, "") if out else "")
    closed = Path("closed" if out else f"closed{suffix}")
    if out or parameter.name in RUNS:
        closed.mkdir()
    else:
        closed.touch()
    closed.chmod(0)
    if os.access(closed, os.R_OK):
        pytest.skip("this user may read everything")
    found = call(*words_for(name, parameter, str(closed / f"inside{suffix}" if out else closed)))
    closed.chmod(0o700)
    assert found.exit_code == (5 if out else 2), found.output
    assert "closed" in found.stderr


def test_a_folder_of_another_programs_is_no_run_and_a_damaged_run_is_corrupt(call: Callable[..., Result]) -> None:
    Path("page").mkdir()
    Path("page/manifest.json").write_text('{"name": "a web page", "icons": []}')
    assert call("show", "page").exit_code == 2
    assert call("run", "--out", "page", "--fresh").exit_code == 2
    assert json.loads(Path("page/manifest.json").read_text())["name"] == "a web page"
    Path("good-run/manifest.json").write_text("{")
    assert call("show", "good-run").exit_code == 6


@pytest.mark.parametrize("name", ["shade", "shader"])
def test_folders_that_are_missing_are_made_and_links_are_kept(call: Callable[..., Result], name: str) -> None:
    request = {"material": {"diffuse": [1, 1, 1], "ambient": [0, 0, 0], "specular": [0, 0, 0], "shininess": 1}}
    request |= {"lights": [{"direction": [0, 0, 1]}], "viewer": {"direction": [0, 0, 1]}}
    Path("good.json").write_text(json.dumps(request | {"points": [[0, 0, 0]], "normals": [[0, 0, 1]]}))
    given, options = COMMANDS[name]
    link = Path("link.json")
    link.symlink_to("a/b/answer.json")
    for out in ("deep/down/answer.json", "link.json"):
        found = call(name, *given, *options, "--out", out, *(["--language", "glsl"] if name == "shader" else []))
        assert found.exit_code == 0, found.output
        assert Path(out).is_file()
    assert link.is_symlink()
    assert Path("a/b/answer.json").read_bytes() == Path("deep/down/answer.json").read_bytes()
