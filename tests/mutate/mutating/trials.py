"""Changes in a copy of the checkout, each against the test files that run its lines; what was found is kept.

Every test file is run once, to see which statements of the product it runs. A change is then tried against those that
met its statement: first the file named like the module, then the quickest, MOST_SECONDS of them.
"""

import ast
import builtins
import compileall
import contextlib
import hashlib
import importlib.machinery
import json
import os
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from mutating.changes import ROOMS, Change, is_compiled

#: what a copy holds
_PARTS = ("phongbench", "api", "reports", "tests", "pyproject.toml", "README.md", "Makefile")
#: how long the tests of one change take together where nothing is wrong
MOST_SECONDS = 40.0
#: pytest's codes that mean a change was noticed: a test failed, or could not even be collected
_NOTICED = (1, 2, 3, 4)
#: a test file -> its seconds, and the lines that it runs of each file of the product
Traces = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Ended:
    """How one run of pytest ended: its code, or None where it ran out of time; what it said; seconds."""

    code: int | None
    said: str
    seconds: float


class Bench:
    """A copy of the checkout, and what is known of it, in a folder that a later call goes on with."""

    def __init__(self, checkout: Path, state: Path) -> None:
        self.checkout, self.state, self.copy = checkout, state, state / "copy"
        state.mkdir(parents=True, exist_ok=True)
        self._renew()

    def _renew(self) -> None:
        """Take the checkout as it is now; what was traced and found with another product is forgotten."""
        fresh = self.state / "fresh"
        shutil.rmtree(fresh, ignore_errors=True)
        for part in _PARTS:
            if (source := self.checkout / part).is_dir():
                shutil.copytree(source, fresh / part, ignore=shutil.ignore_patterns("__pycache__"))
            elif source.is_file():
                shutil.copy2(source, fresh / part)
        shutil.rmtree(self.copy, ignore_errors=True)
        fresh.rename(self.copy)
        compileall.compile_dir(self.copy, quiet=2, workers=1)

    def traces(self, rooms: Sequence[str], say: Callable[[str], None]) -> Traces:
        """The trace of every test file of these rooms; a file is traced again when it or the product changes."""
        product = _digest(self.copy / "phongbench")
        known: Traces = _read(self.state / "traces.json")
        found: Traces = {}
        folders = sorted({folder for room in rooms for folder in ROOMS[room]})
        files = [path for folder in folders for path in sorted((self.copy / _FOLDER / folder).rglob("test_*.py"))]
        for path in files:
            name = path.relative_to(self.copy).as_posix()
            key = product + _digest(path)
            if known.get(name, {}).get("key") != key:
                say(f"tracing {name}")
                known[name] = self._traced(name) | {"key": key}
                _write(self.state / "traces.json", known)
            found[name] = known[name]
        return found

    def _traced(self, name: str) -> dict[str, Any]:
        lines = self.state / "lines.json"
        lines.unlink(missing_ok=True)
        ended = self.run([name], 1200.0, lines)
        if ended.code not in (0, 5):
            raise click.ClickException(f"{name} fails without a change: {ended.said[-2000:]}")
        return {"seconds": ended.seconds, "lines": _read(lines)}

    def run(self, files: Sequence[str], seconds: float, lines: Path | None = None) -> Ended:
        """Pytest on some files of the copy, in a process of its own that is killed after so many seconds.

        lines  where to write the lines of the product that ran, by file
        """
        with tempfile.TemporaryDirectory(prefix="pb-mutate-", ignore_cleanup_errors=True) as box:
            said, began = Path(box) / "said", time.monotonic()
            process = os.fork()
            if not process:
                _test(self.copy, files, Path(box), lines)
            handle = os.pidfd_open(process)
            in_time = bool(select.select([handle], [], [], seconds)[0])
            os.close(handle)
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process, signal.SIGKILL)  # what the tests started, too
            code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
            text = said.read_text(errors="replace") if said.exists() else ""
            return Ended(code if in_time else None, text, time.monotonic() - began)

    @contextlib.contextmanager
    def changed(self, change: Change) -> Iterator[None]:
        """The copy with this change, as long as the block lasts; the file's time tells Python that it is another."""
        path = self.copy / change.file
        source, times = path.read_bytes(), path.stat()
        path.write_bytes(change.applied(source))
        try:
            yield
        finally:
            path.write_bytes(source)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def tried(self, change: Change, traces: Traces) -> dict[str, Any]:
        """What came of a change: its end, the tests that were asked, and the one that noticed."""
        files = chosen(change, traces)
        found = {name: getattr(change, name) for name in ("name", "room", "file", "line", "kind", "before", "after")}
        if not files:
            return found | {"end": "survived", "note": "no test of its room runs it", "tests": [], "seconds": 0.0}
        limit = 60.0 + 5.0 * sum(traces[name]["seconds"] for name in files)
        with self.changed(change):
            ended = self.run(files, limit)
        end = (
            "out of time"
            if ended.code is None
            else "caught"
            if ended.code in _NOTICED or ended.code < 0
            else "survived"
        )
        first = next((line for line in ended.said.splitlines() if line.startswith(("FAILED", "ERROR"))), "")
        return found | {"end": end, "note": first[:300], "tests": files, "seconds": round(ended.seconds, 1)}

    def results(self, changes: Sequence[Change], again: bool) -> dict[str, dict[str, Any]]:
        """What earlier calls found of these changes, in files that are the same today; without survivors on demand."""
        known = _read(self.state / "results.json")
        digests = {change.file: _digest(self.copy / change.file) for change in changes}
        return {
            name: one
            for name, one in known.items()
            if digests.get(one["file"]) == one["digest"] and not (again and one["end"] == "survived")
        }

    def keep(self, results: dict[str, dict[str, Any]], name: str, found: dict[str, Any]) -> None:
        """Add what came of a change, on disk too."""
        results[name] = found | {"digest": _digest(self.copy / found["file"])}
        _write(self.state / "results.json", results)


_FOLDER = "tests/phongbench"
#: what statements call while a test file is traced; a builtin, so that every module knows it
_PROBE = "phongbench_statement_runs"


def chosen(change: Change, traces: Traces) -> list[str]:
    """The test files that a change is tried against, first the one that is the likeliest to notice."""
    first, last = change.lines
    meeting = [
        (f"test_{Path(change.file).stem}" != Path(name).stem, trace["seconds"], name)
        for name, trace in traces.items()
        if any(first <= line <= last for line in trace["lines"].get(change.file, ()))
    ]
    files: list[str] = []
    left = MOST_SECONDS
    for _, seconds, name in sorted(meeting):
        if not files or seconds <= left:
            files.append(name)
            left -= seconds
    return files


def _test(copy: Path, files: Sequence[str], box: Path, lines: Path | None) -> None:
    """Pytest in this process, which ends with its code."""
    code = 70
    try:
        os.setsid()
        for stream in (1, 2):
            os.dup2(os.open(box / "said", os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
        os.chdir(copy)
        sys.dont_write_bytecode = True  # no change may outlive its trial
        paths = [str(copy), str(copy / "api"), str(copy / "reports")]
        sys.path[:0] = paths
        os.environ |= {"PYTHONPATH": os.pathsep.join(paths), "TMPDIR": str(box)}
        tempfile.tempdir = None
        import pytest

        if lines is not None:
            sys.pycache_prefix = str(box)  # what is compiled there already would tell nothing
            seen = _traced_lines(f"{copy}/")
        code = int(pytest.main(["-q", "-x", "--tb=line", "-p", "no:cacheprovider", *files]))
        if lines is not None:
            _write(lines, {name: sorted(numbers) for name, numbers in seen.items()})
    except BaseException:  # noqa: BLE001 - whatever it is, the process that forked must not go on twice
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _traced_lines(root: str) -> dict[str, set[int]]:
    """File of ROOMS -> the lines where statements begin that run from now on; of what is compiled none.

    Statements tell it themselves, since a trace by the interpreter would make the compiling of kernels take minutes.
    """
    seen: dict[str, set[int]] = {}
    rooms = tuple(f"phongbench/{room}/" for room in ROOMS)
    loader: Any = importlib.machinery.SourceFileLoader
    plain = loader.source_to_code

    def source_to_code(self: Any, data: Any, path: Any, *options: Any, **named: Any) -> Any:
        name = str(path).removeprefix(root)
        if name.startswith(rooms) and not is_compiled(bytes(data)):
            data = ast.fix_missing_locations(_Probes(name).visit(ast.parse(data)))
        return plain(self, data, path, *options, **named)

    loader.source_to_code = source_to_code
    setattr(builtins, _PROBE, lambda name, line: seen.setdefault(name, set()).add(line))
    return seen


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
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            return [statement]  # a docstring stays the first
        told: list[ast.expr] = [ast.Constant(self.file), ast.Constant(statement.lineno)]
        call = ast.Expr(ast.Call(ast.Name(_PROBE, ast.Load()), told, []))
        return [ast.copy_location(call, statement), statement]


def _digest(path: Path) -> str:
    """Of a file, or of the sources below a folder."""
    digest = hashlib.sha256()
    for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
        digest.update(file.relative_to(path).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text()) if path.exists() else {}


def _write(path: Path, data: dict[str, Any]) -> None:
    fresh = path.with_suffix(".partial")
    fresh.write_text(json.dumps(data))
    fresh.replace(path)
