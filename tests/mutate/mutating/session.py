"""One session of pytest on the copy, in a process of its own, forked from one that has loaded what all tests need."""

import contextlib
import json
import os
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Collection, Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from mutating.tracing import Tracer

#: what every session is told: no plugin but one, and equal examples for all
_OPTIONS = (
    "-q",
    "--tb=line",
    "--disable-plugin-autoload",
    "-p_hypothesis_pytestplugin",
    "-pno:cacheprovider",
    "--hypothesis-seed=1",
)


@dataclass(frozen=True)
class Ended:
    """How a session ended: its code, or None if it ran out of time; the first test that failed; its words; seconds."""

    code: int | None
    failed: str
    said: str
    seconds: float


class Chosen:
    """A plugin of pytest: only these tests, file by file in this order; tells which one failed first."""

    def __init__(self, names: Sequence[str], failed: Path) -> None:
        self.rank = {name: place for place, name in enumerate(names)}
        self.failed = failed

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave out the others."""
        first: dict[Path, int] = {}
        for item in sorted((item for item in items if item.nodeid in self.rank), key=lambda i: self.rank[i.nodeid]):
            first.setdefault(item.path, len(first))
        chosen = [item for item in items if item.nodeid in self.rank]
        items[:] = sorted(chosen, key=lambda item: (first[item.path], self.rank[item.nodeid]))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Tell which one failed."""
        if report.failed and not self.failed.exists():
            self.failed.write_text(report.nodeid)


class Placed:
    """A plugin of pytest: what tests/conftest.py keeps for other processes lies there, if it is known already."""

    def __init__(self, pickles: Iterable[Path]) -> None:
        self.pickles = tuple(pickles)

    @pytest.hookimpl(wrapper=True, trylast=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Generator[None, Any, Any]:
        """Place it where the fixture says that it would lie."""
        result = yield
        if fixturedef.argname == "common_folder":
            for path in self.pickles:
                shutil.copy2(path, result)
        return result


def run(
    copy: Path, names: Sequence[str], seconds: float, told: Path | None = None, pickles: Collection[Path] = ()
) -> Ended:
    """Pytest on some tests, or files, of the copy; the process and what it started are killed after so many seconds.

    told     where to write what each of the tests runs; then none is left out, and none ends the session
    pickles  see Placed
    """
    with tempfile.TemporaryDirectory(prefix="pb-mutate-", ignore_cleanup_errors=True) as folder:
        box, began = Path(folder), time.monotonic()
        process = os.fork()
        if not process:
            _session(copy, names, box, told, pickles)
        handle = os.pidfd_open(process)
        in_time = bool(select.select([handle], [], [], seconds)[0])
        os.close(handle)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process, signal.SIGKILL)  # what the tests started, too
        code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        said, failed = ((box / name) for name in ("said", "failed"))
        words = said.read_text(errors="replace") if said.exists() else ""
        first = failed.read_text() if failed.exists() else ""
        return Ended(code if in_time else None, first, words, time.monotonic() - began)


def _session(copy: Path, names: Sequence[str], box: Path, told: Path | None, pickles: Collection[Path]) -> None:
    """In the forked process, which ends with pytest's code."""
    code = 70
    try:
        os.setsid()
        for stream in (1, 2):
            os.dup2(os.open(box / "said", os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
        os.chdir(copy)
        paths = [str(copy), str(copy / "api"), str(copy / "reports")]
        sys.path[:0] = paths
        os.environ |= {"PYTHONPATH": os.pathsep.join(paths), "TMPDIR": str(box)}
        os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(box / "hypothesis")
        tempfile.tempdir = None
        options = [*_OPTIONS, f"--rootdir={copy}"]  # pytest may find another above it, and names tests from there
        if told is not None:
            tracer = Tracer(copy, box, told, pickles)
            code = int(pytest.main([*options, *names], plugins=[Placed(pickles), tracer]))
        else:
            sys.dont_write_bytecode = True  # no change may outlive its trial
            os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
            files = dict.fromkeys(name.partition("::")[0] for name in names)
            chosen = Chosen(names, box / "failed")
            code = int(pytest.main([*options, "-x", *files], plugins=[Placed(pickles), chosen]))
    except BaseException:  # noqa: BLE001 - whatever it is, the process that forked must not go on twice
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def read(path: Path) -> Any:
    """A JSON file, or nothing."""
    return json.loads(path.read_text()) if path.exists() else {}


def write(path: Path, data: Any) -> None:
    """A JSON file, whole."""
    fresh = path.with_suffix(".partial")
    fresh.write_text(json.dumps(data))
    fresh.replace(path)
