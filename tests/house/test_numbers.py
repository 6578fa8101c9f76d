"""The house keeps its measure: lengths of files and functions, rooms that say what they are for, a map that is true."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

PRODUCT = ("phongbench", "api", "reports")
#: guides are in CONTRIBUTING.md; these are gates
MOST_LINES, LONGEST_FILE, LONGEST_FUNCTION, MEAN_FUNCTION, MOST_POSITIONAL, MOST_SKIPS = 56_850, 300, 60, 9.0, 8, 60
#: functions whose every argument is an array of a compiled loop, though the compiler decorates them elsewhere
LOOPS: set[str] = set()


class Function(NamedTuple):
    """A function of the product.

    lines       from `def` to its end
    code        lines that are neither empty, nor comments, nor the docstring
    positional  parameters that may be given by place, without self and cls
    compiled    whether it is a loop that the compiler compiles, or a command whose parameters click gives by name
    """

    name: str
    lines: int
    code: int
    positional: int
    compiled: bool


def sources(root: Path) -> list[Path]:
    return [path for folder in PRODUCT for path in sorted((root / folder).rglob("*.py"))]


def functions(path: Path, root: Path) -> Iterator[Function]:
    text = path.read_text()
    lines, tree = text.splitlines(), ast.parse(text)
    inner = {child for node in ast.walk(tree) if is_function(node) for child in ast.walk(node) if child is not node}
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        first = node.body[0]
        told = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) is not None else 0
        body = [line.strip() for line in lines[node.lineno - 1 : node.end_lineno]]
        names = [a.arg for a in (*node.args.posonlyargs, *node.args.args) if a.arg not in ("self", "cls")]
        decorated = any(re.search(r"\bjit\.|command\(", ast.unparse(d)) for d in node.decorator_list)
        yield Function(
            f"{path.relative_to(root)}:{node.name}",
            len(body),
            sum(bool(line) and not line.startswith("#") for line in body) - told,
            len(names),
            decorated or node in inner,
        )


def is_function(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)


@pytest.fixture(scope="module")
def every(root: Path) -> list[Function]:
    return [function for path in sources(root) for function in functions(path, root)]


def test_the_product_is_no_longer_than_it_was(root: Path) -> None:
    assert sum(len(path.read_text().splitlines()) for path in sources(root)) <= MOST_LINES


def test_no_file_is_too_long_to_read(root: Path) -> None:
    long = {str(p.relative_to(root)): n for p in sources(root) if (n := len(p.read_text().splitlines())) > LONGEST_FILE}
    assert long == {}


def test_functions_are_short(every: list[Function]) -> None:
    assert {f.name: f.lines for f in every if f.lines > LONGEST_FUNCTION} == {}
    assert sum(f.code for f in every) / len(every) <= MEAN_FUNCTION


def test_no_function_takes_many_arguments_by_place_but_compiled_loops_and_commands(every: list[Function]) -> None:
    many = {f.name: f.positional for f in every if f.positional > MOST_POSITIONAL and not f.compiled}
    assert set(many) - LOOPS == set()


def test_the_formatter_wins(root: Path, files: list[Path]) -> None:
    skips = sum(
        len(re.findall(r"# fmt: (?:skip|off)$", (root / file).read_text(), re.MULTILINE))
        for file in files
        if file.suffix == ".py"
    )
    assert skips <= MOST_SKIPS


# the rooms


def rooms(root: Path) -> dict[str, str]:
    """Room -> the sentence that its `__init__` opens with."""
    return {
        path.parent.name: (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n")[0]
        for path in sorted((root / "phongbench").glob("*/__init__.py"))
    }


def mapped(root: Path) -> dict[str, tuple[str, list[str]]]:
    """The map of CONTRIBUTING.md: room -> its sentence, and the modules that are named as its doors."""
    text = (root / "CONTRIBUTING.md").read_text()
    rows = re.findall(r"^\| `(\w+)/` \| (.*?) \| (.*) \|$", text, re.MULTILINE)
    return {room: (sentence, re.findall(r"`([\w/]+)`", doors)) for room, sentence, doors in rows}


def test_the_library_has_rooms_and_five_files(root: Path) -> None:
    names = {path.name for path in (root / "phongbench").iterdir() if path.name != "__pycache__"}
    assert names == {*rooms(root), "__init__.py", "__main__.py", "errors.py", "testing.py", "py.typed"}
    assert len(rooms(root)) <= 16


def test_every_room_says_what_it_is_for_and_the_map_says_the_same(root: Path) -> None:
    assert {room: sentence for room, (sentence, _) in mapped(root).items()} == rooms(root)
    assert all(sentence.endswith(".") for sentence in rooms(root).values())


def test_every_door_of_the_map_is_there(root: Path) -> None:
    doors = {root / "phongbench" / room / door for room, (_, doors) in mapped(root).items() for door in doors}
    assert len(doors) > 40
    assert [str(door) for door in doors if not (door.with_suffix(".py").is_file() or door.is_dir())] == []


def test_every_python_file_that_a_page_names_is_there(root: Path) -> None:
    pages = [root / page for page in ("CONTRIBUTING.md", "DECISIONS.md", "README.md")]
    for page in (*pages, *(root / "reports" / "docs").glob("*.md")):
        named = re.findall(r"`((?:phongbench|api|reports|tests)/[\w/]+\.py)`", page.read_text())
        assert [name for name in named if not (root / name).is_file()] == [], page


def test_every_test_that_the_decisions_name_is_there(root: Path) -> None:
    tests = "\n".join(path.read_text() for path in (root / "tests").rglob("*.py"))
    tests += (root / "phongbench" / "testing.py").read_text()
    known = set(re.findall(r"^ *def ((?:test|check)_\w+)", tests, re.MULTILINE))
    named = re.findall(r"`((?:test|check)_\w+)`", (root / "DECISIONS.md").read_text())
    assert [name for name in named if name not in known] == []
