"""Nothing in the repository names a machine or a package index, and nothing is left half merged."""

import re
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

# Folders that belong to some machine, and the addresses and options of package indexes and local wheel stores.
# Each is written so that it does not match itself.
MACHINE = re.compile(r"(?<![\w.~-])/(?:home|Users|root|opt|mnt|work)/\w|file:/{2}")
INDEX = re.compile(r"pypi\.(?:org|python)|pythonhosted\.|/simpl[e]/|index-ur[l]|find-link[s]")
CONFLICT = re.compile(r"^(?:<{7}|>{7}) ")
PIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*==[0-9][A-Za-z0-9.!+]*")


@pytest.fixture(scope="module")
def texts(root: Path, files: list[Path]) -> dict[Path, str]:
    """Every file that is text, whole."""
    contents = {file: (root / file).read_bytes() for file in files}
    return {file: content.decode() for file, content in contents.items() if b"\0" not in content}


def matches(pattern: re.Pattern[str], texts: dict[Path, str]) -> list[str]:
    """Where the pattern occurs, as file:line: text."""
    return [
        f"{file}:{number}: {line.strip()}"
        for file, text in texts.items()
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]


def test_no_file_names_a_package_index(texts: dict[Path, str]) -> None:
    assert matches(INDEX, texts) == []


def test_no_file_names_a_path_of_a_machine(root: Path, texts: dict[Path, str]) -> None:
    assert matches(MACHINE, texts) == []
    # The checkout's own path, unless it is too short to mean anything, such as /src.
    if len(root.parts) > 2:
        assert matches(re.compile(rf"(?<![\w.~-]){re.escape(str(root))}\b"), texts) == []


def test_no_file_holds_both_sides_of_a_merge(texts: dict[Path, str]) -> None:
    assert matches(CONFLICT, texts) == []


def test_there_is_one_lock_and_it_is_constraints_txt(files: list[Path]) -> None:
    others = {"uv.lock", "poetry.lock", "pdm.lock", "Pipfile.lock", "pylock.toml", "requirements.txt"}
    assert not others & {file.name for file in files}


def test_every_constraint_is_an_exact_pin(root: Path) -> None:
    lines = (root / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert not [line for line in pins if not PIN.fullmatch(line)]
    names = [normal(pin.partition("==")[0]) for pin in pins]
    assert len(set(names)) == len(names)


def test_every_dependency_is_pinned(root: Path) -> None:
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    # Peers are what we compare with: nothing needs them, so no lock holds them.
    extras = [names for extra, names in project["optional-dependencies"].items() if extra != "peers"]
    wanted = sum(extras, project["dependencies"])
    pinned = {normal(line.partition("==")[0]) for line in (root / "constraints.txt").read_text().splitlines()}
    assert not {normal(re.split(r"[<>=!~\[; ]", name)[0]) for name in wanted} - pinned - {normal(project["name"])}


def test_the_halves_that_are_installed_at_once_are_all_that_a_run_needs_and_share_no_package(root: Path) -> None:
    told = re.search(r"^HALVES +=((?:.*\\\n)*.*)$", (root / "Makefile").read_text(), re.MULTILINE)
    assert told
    first, second = (with_all_they_need(half.split()) for half in re.findall(r'"([^"]+)"', told[1].replace("\\\n", "")))
    assert first & second == set()
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    needed = [*project["dependencies"], *project["optional-dependencies"]["certify"]]
    assert {normal(Requirement(one).name) for one in needed} - first - second == set()


def with_all_they_need(names: list[str]) -> set[str]:
    """These packages, and what they need in turn, as they are installed here."""
    found: set[str] = set()
    while names:
        name = normal(names.pop())
        if name not in found:
            found.add(name)
            needed = map(Requirement, distribution(name).requires or ())
            names += [one.name for one in needed if one.marker is None or one.marker.evaluate({"extra": ""})]
    return found


def normal(name: str) -> str:
    """A distribution's name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()
