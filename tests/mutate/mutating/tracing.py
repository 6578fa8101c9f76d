"""Which statements of the product each test runs: they tell it themselves, in processes that tests start, too.

A trace by the interpreter would make the compiling of kernels take minutes. So what is imported while tests are traced
has a call before every statement, but for sources that are compiled.
"""

import ast
import atexit
import builtins
import importlib.machinery
import json
import os
import shutil
import time
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from mutating.changes import is_compiled

#: what is traced: no room with bodies that are compiled from elsewhere
_TRACED = ("support", "results", "inputs", "targets", "timing", "accuracy", "analysis", "study", "cli", "face")
_FOLDERS = (*(f"phongbench/{room}/" for room in _TRACED), "api/phongbench_api/", "reports/phongbench_reports/")
#: what statements call; a builtin, so that every module knows it
_PROBE = "phongbench_statement_runs"
#: put on PYTHONPATH of the processes that tests start
_FOLLOW = "import sys\nsys.path.append({tools!r})\nfrom mutating.tracing import follow\nfollow({root!r}, {box!r})\n"
#: file of the product -> lines where statements begin
Lines = dict[str, list[int]]


class Recorder:
    """The statements of the product below `root` that run in this process, from now on."""

    def __init__(self, root: str) -> None:
        self.root, self.seen = f"{root}/", set[tuple[str, int]]()
        loader: Any = importlib.machinery.SourceFileLoader
        plain = loader.get_code

        def get_code(self_: Any, module: str) -> Any:
            path = str(self_.get_filename(module))
            name = path.removeprefix(self.root)
            if not name.startswith(_FOLDERS) or is_compiled(source := self_.get_data(path)):
                return plain(self_, module)
            tree = ast.fix_missing_locations(_Probes(name).visit(ast.parse(source)))
            return compile(tree, path, "exec", dont_inherit=True)

        loader.get_code = get_code
        setattr(builtins, _PROBE, lambda name, line: self.seen.add((name, line)))

    @contextmanager
    def apart(self) -> Iterator[set[tuple[str, int]]]:
        """What runs in the block, and does not count for what is around it."""
        around, self.seen = self.seen, set()
        try:
            yield self.seen
        finally:
            self.seen = around


def follow(root: str, box: str) -> None:
    """Record what this process runs, a process of a test, into a file of a folder when it ends."""
    recorder, file = Recorder(root), Path(box) / f"{os.getpid()}-{time.monotonic_ns()}"

    def tell() -> None:
        file.with_suffix(".partial").write_text(json.dumps(sorted(recorder.seen)))
        file.with_suffix(".partial").rename(file.with_suffix(".lines"))

    atexit.register(tell)


class _Probes(ast.NodeTransformer):
    """Puts before every statement of a file a call that says that it runs."""

    def __init__(self, file: str) -> None:
        self.file = file

    def generic_visit(self, node: ast.AST) -> ast.AST:
        super().generic_visit(node)
        for member in ("body", "orelse", "finalbody"):
            if isinstance(statements := getattr(node, member, None), list):
                setattr(node, member, [each for one in statements for each in self._told(one)])
        return node

    def _told(self, statement: ast.stmt) -> list[ast.stmt]:
        constant = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
        if constant or (isinstance(statement, ast.ImportFrom) and statement.module == "__future__"):
            return [statement]  # a docstring stays the first
        told: list[ast.expr] = [ast.Constant(self.file), ast.Constant(statement.lineno)]
        call = ast.Expr(ast.Call(ast.Name(_PROBE, ast.Load()), told, []))
        return [ast.copy_location(call, statement), statement]


class Tracer:
    """A plugin of pytest that writes a line of JSON for each test that passes, and for each fixture of many tests.

    test      its name, seconds, lines, and the fixtures of many tests that it needs
    fixture   its key, seconds, lines, the fixtures that it needs; `pickled`, the files that it left to other processes,
              which are kept beside `told`
    """

    def __init__(self, root: Path, box: Path, told: Path, placed: Iterable[Path] = ()) -> None:
        self.recorder, self.box, self.told = Recorder(str(root)), box, told
        self.failed, self.elsewhere, self.pickled = False, 0.0, {path.name for path in placed}
        self.common: Path | None = None
        hook = box / "hook"
        hook.mkdir()
        tools = str(root / "tests" / "mutate")
        (hook / "sitecustomize.py").write_text(_FOLLOW.format(tools=tools, root=str(root), box=str(box)))
        os.environ["PYTHONPATH"] = os.pathsep.join([str(hook), os.environ["PYTHONPATH"]])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, Any, Any]:
        """A test with the fixtures that it alone has."""
        self.failed, self.elsewhere, began = False, 0.0, time.monotonic()
        with self.recorder.apart() as seen:
            result = yield
            self._add_processes(seen)
        if not self.failed:
            seconds = time.monotonic() - began - self.elsewhere
            needs = [_key(defined[-1]) for defined in _defined(item) if defined[-1].scope != "function"]
            self._tell(test=item.nodeid, seconds=seconds, lines=_by_file(seen), needs=needs)
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Generator[None, Any, Any]:
        """A fixture that several tests share, told apart from the one that happens to come first."""
        if fixturedef.scope == "function":
            return (yield)
        began, before = time.monotonic(), self.elsewhere
        with self.recorder.apart() as seen:
            result = yield
            self._add_processes(seen)
        own = time.monotonic() - began - (self.elsewhere - before)
        self.elsewhere += own
        if fixturedef.argname == "common_folder":
            self.common = result
        left = [path for path in self.common.glob("*.pickle") if path.name not in self.pickled] if self.common else []
        for path in left:
            shutil.copy2(path, self.told.parent)
        pickled = [path.name for path in left]
        self.pickled |= set(pickled)
        others = [request._get_active_fixturedef(name) for name in fixturedef.argnames if name != "request"]
        self._tell(
            fixture=_key(fixturedef), seconds=own, lines=_by_file(seen), needs=[*map(_key, others)], pickled=pickled
        )
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """What fails, or is skipped, tells nothing about a change."""
        self.failed |= not report.passed

    def _add_processes(self, seen: set[tuple[str, int]]) -> None:
        for file in self.box.glob("*.lines"):
            seen.update((name, line) for name, line in json.loads(file.read_text()))
            file.unlink()

    def _tell(self, **what: Any) -> None:
        with self.told.open("a") as file:
            file.write(json.dumps(what) + "\n")


def _key(fixture: Any) -> str:
    return f"{fixture.baseid}::{fixture.argname}"


def _defined(item: pytest.Item) -> Iterator[Any]:
    known = getattr(item, "_fixtureinfo", None)
    yield from known.name2fixturedefs.values() if known else ()


def _by_file(seen: set[tuple[str, int]]) -> Lines:
    lines: Lines = {}
    for name, line in sorted(seen):
        lines.setdefault(name, []).append(line)
    return lines
