"""Which tests a change is tried against: those that run its statement, or statements that use what it makes."""

import ast
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mutating.changes import FUNCTIONS, Change, bound, head

#: file of the product -> lines
Lines = Mapping[str, Collection[int]]
#: tests that run no statement of the product but read its sources, or the declarations of its commands
READERS = ("tests/house/test_values.py", "tests/phongbench/cli/test_options.py")
_PRODUCT = ("phongbench", "api/phongbench_api", "reports/phongbench_reports")
#: what is made of a constant may be made into something else: so many steps are followed
_STEPS = 3


@dataclass(frozen=True)
class Test:
    """A test: its name, its own seconds, the lines that it runs, the fixtures of many tests that it needs."""

    name: str
    seconds: float
    lines: Lines
    needs: tuple[str, ...]

    @property
    def file(self) -> str:
        """Where it stands."""
        return self.name.partition("::")[0]


@dataclass(frozen=True)
class Fixture:
    """What several tests share: seconds to make it, and the lines that run meanwhile."""

    seconds: float
    lines: Lines
    needs: tuple[str, ...]


class Uses:
    """Where the product uses each name, in statements that run when somebody calls them."""

    def __init__(self, copy: Path) -> None:
        self._lines: dict[str, dict[str, set[int]]] = {}
        self._made: dict[str, set[str]] = {}
        for root in _PRODUCT:
            for path in sorted((copy / root).rglob("*.py")):
                self._read(ast.parse(path.read_bytes()), path.relative_to(copy).as_posix(), (), "")

    def lines(self, names: Iterable[str]) -> Lines:
        """The statements that use one of these names, or what is made of it at import."""
        known, fresh = set(names), set(names)
        for _ in range(_STEPS):
            fresh = {made for name in fresh for made in self._made.get(name, ())} - known
            known |= fresh
        found: dict[str, set[int]] = {}
        for name in known:
            for file, lines in self._lines.get(name, {}).items():
                found.setdefault(file, set()).update(lines)
        return found

    def _read(self, node: ast.AST, file: str, around: tuple[str, ...], function: str) -> None:
        """What a statement uses: a call of it if it stands in a function, else what it makes of that."""
        for statement in ast.iter_child_nodes(node):
            if not isinstance(statement, ast.stmt):
                if isinstance(statement, ast.ExceptHandler | ast.match_case):
                    self._read(statement, file, around, function)
                continue
            made = (*bound(statement), *around)
            names = _names(statement)
            if function:
                for name in {*names, function}:
                    self._lines.setdefault(name, {}).setdefault(file, set()).add(head(statement)[0])
            else:
                for name in names.difference(made):
                    self._made.setdefault(name, set()).update(made)
            inner = statement.name if isinstance(statement, FUNCTIONS) else function
            of = (statement.name,) if isinstance(statement, ast.ClassDef) else around
            self._read(statement, file, of, inner)


def _names(statement: ast.stmt) -> set[str]:
    """The names in a statement, without those in its body."""
    return set(_mentioned(statement))


def _mentioned(node: ast.AST) -> Iterator[str]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt):
            continue
        if isinstance(child, ast.Name):
            yield child.id
        elif isinstance(child, ast.Attribute):
            yield child.attr
        elif isinstance(child, ast.keyword) and child.arg:
            yield child.arg
        yield from _mentioned(child)


@dataclass(frozen=True)
class Traces:
    """What is known of some test files: their tests, and the fixtures of many tests by their keys."""

    tests: tuple[Test, ...]
    fixtures: Mapping[str, Fixture]

    @staticmethod
    def of(told: Iterable[Mapping[str, Any]]) -> "Traces":
        """From what a tracer wrote."""
        tests, fixtures = [], {}
        for one in told:
            seconds, lines, needs = one["seconds"], one["lines"], tuple(one["needs"])
            if "test" in one:
                tests.append(Test(one["test"], seconds, lines, needs))
            elif one["fixture"] not in fixtures or lines:
                fixtures[one["fixture"]] = Fixture(seconds, lines, needs)
        return Traces(tuple(tests), fixtures)

    def needed(self, keys: Iterable[str]) -> set[str]:
        """Fixtures, with those that they need themselves."""
        found: set[str] = set()
        left = [key for key in keys if key in self.fixtures]
        while left:
            if (key := left.pop()) not in found:
                found.add(key)
                left += [inner for inner in self.fixtures[key].needs if inner in self.fixtures]
        return found

    def chosen(
        self,
        change: Change,
        uses: Uses,
        seconds: float,
        asked: Collection[str] = (),
        named: Collection[str] = (),
        free: Collection[str] = (),
    ) -> list[str]:
        """The tests that meet a change, those of the file named like its module first, then the quickest, then the rest
        of that file: what runs when its module is imported, no test runs.

        seconds  how long they take together at most; the first is asked whatever it takes
        asked    those that are left out
        named    files of tests that name what a change at import makes, which count as meeting it, though last
        free     fixtures that need not be made
        """
        wanted, like = where(change, uses), f"test_{Path(change.file).stem}.py"
        meeting = []
        for test in self.tests:
            keys = self.needed(test.needs)
            lines = (test.lines, *(self.fixtures[key].lines for key in keys))
            alike = Path(test.file).name == like or test.file in READERS
            met = test.file in READERS or any(meets(each, wanted) for each in lines)
            if test.name not in asked and (met or alike or (change.names and test.file in named)):
                dear = test.seconds + sum(self.fixtures[key].seconds for key in keys.difference(free))
                meeting.append((not met, not alike, dear, test.name, test, keys))
        found: list[str] = []
        paid: set[str] = set()
        for *_, test, keys in sorted(meeting, key=lambda one: one[:4]):
            price = test.seconds + sum(self.fixtures[key].seconds for key in keys.difference(paid, free))
            if not found or price <= seconds:
                found.append(test.name)
                paid |= keys
                seconds -= price
        return found


def where(change: Change, uses: Uses) -> Lines:
    """The lines that a test must run to meet a change: its statement, or users of what it makes at import."""
    first, last = change.lines
    if not change.names:
        return {change.file: range(first, last + 1)}
    return uses.lines(change.names)


def meets(lines: Lines, wanted: Lines) -> bool:
    """Whether one of the wanted lines is among these."""
    return any(line in among for file, among in wanted.items() for line in lines.get(file, ()))


def mentioning(copy: Path, files: Iterable[str], names: Collection[str]) -> list[str]:
    """Those test files whose text holds one of these names."""
    pattern = re.compile(rf"\b(?:{'|'.join(map(re.escape, names))})\b") if names else None
    return [name for name in files if pattern and pattern.search((copy / name).read_text())]
