"""Every fault of the disk and every moment of a kill: what a command leaves is whole, and done again it gives the same.

Commands are `run` and `run --resume` of a small plan, `merge` of its two shards, `report` and `render`. After each
fault the folder is looked at, then the command is done again without one.
"""

import contextlib
import gc
import hashlib
import importlib
import io
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from soaking.faulty_disk import KILLED, Ended, Fault, call

from phongbench.analysis.rows import Rows
from phongbench.cli.main import EXIT_CODES, main
from phongbench.errors import PhongbenchError, StorageError
from phongbench.results import runs

#: the plan of `run`: a cell, two blocks of work that its two shards share, a probe, no timing
PLAN = """alphas = [10]
gammas = [8]
approximations = ["lyon"]
slopes = ["taylor"]
spaces = ["reflect"]
lambda_forms = ["dot"]
precisions = ["float32"]
strata = ["peak"]
samples = 300_000
probes = ["hostile"]
timing = false
"""
DISK = next(code for kind, code in EXIT_CODES if kind is StorageError)
_TOLD = 20


@dataclass(frozen=True)
class Command:
    """A command that is tried.

    start   what its folder holds before; None: nothing, not even the folder
    words   of the command, given its folder
    again   of the command that goes on, given what the folder holds
    broken  what is half-written in the folder; with True, also what it lacks as the command's whole result
    """

    name: str
    start: Path | None
    words: Callable[[Path], list[str]]
    again: Callable[[Path], list[str]]
    broken: Callable[[Path, bool], Iterator[str]]


@dataclass
class Tries:
    """What came of a command's tries.

    calls   to the disk, by kind, when nothing fails
    ends    how tries ended, by the fault and what the command made of it
    states  different folders that were left: from each the command went on once
    faults  in words
    """

    calls: dict[str, int] = field(default_factory=dict)
    ends: Counter[str] = field(default_factory=Counter)
    states: set[str] = field(default_factory=set)
    faults: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        told = {
            "points": sum(self.calls.values()),
            "calls": self.calls,
            "tries": self.ends.total(),
            "states": len(self.states),
        }
        return told | {"ends": dict(sorted(self.ends.items())), "faults": self.faults[:_TOLD]}


class Bench:
    """The commands, the folder where they are tried, and what they give when nothing fails."""

    def __init__(self, box: Path) -> None:
        self.folder, self.plan = box / "tried-here", box / "plan.toml"
        self._known: dict[tuple[str, bool, str], list[str]] = {}
        self.plan.write_text(PLAN)
        here(self._run(self.folder))  # in this process: kernels are loaded once for all tries
        self.reference, self.partial = self.folder.rename(box / "reference"), box / "partial"
        self.tables = runs.load(self.reference).manifest["files"]
        self.shards = [self._shard(box, index) for index in (1, 2)]
        self._interrupt()
        self._draw_once()
        here(self._render(box))
        self.picture = {"picture.png": _digest(box / "picture.png")}
        commands = (
            Command("run", None, self._run, self._go_on, self._broken_run),
            Command("run --resume", self.partial, self._go_on, self._go_on, self._broken_run),
            Command("merge", None, self._merge, self._go_on_merging, self._broken_run),
            Command("report", self.reference, self._report, self._report, self._broken_report),
            Command("render", None, self._render, self._render, self._broken_picture),
        )
        self.commands = {command.name: command for command in commands}
        gc.freeze()  # what is here is shared with every process to come, until one of them looks for garbage in it

    def _run(self, folder: Path) -> list[str]:
        return ["run", str(self.plan), "--no-report", "--json", "--jobs", "1", "--out", str(folder)]

    def _go_on(self, folder: Path) -> list[str]:
        return [*self._run(folder), *(["--resume"] if (folder / runs.MANIFEST).exists() else [])]

    def _shard(self, box: Path, index: int) -> str:
        """The folder of a shard, measured here."""
        folder = box / f"shard-{index}"
        here([*self._run(folder), "--shard", f"{index}/2"])
        return str(folder)

    def _merge(self, folder: Path) -> list[str]:
        return ["merge", *self.shards, "--no-report", "--json", "--jobs", "1", "--out", str(folder)]

    def _go_on_merging(self, folder: Path) -> list[str]:
        return self._go_on(folder) if (folder / runs.MANIFEST).exists() else self._merge(folder)

    @staticmethod
    def _report(folder: Path) -> list[str]:
        return ["report", str(folder), "--out", str(folder / "report")]

    @staticmethod
    def _render(folder: Path) -> list[str]:
        out = str(folder / "picture.png")
        return ["render", "chequerboard", "--size", "32x18", "--threads", "1", "--out", out]

    def ready(self, command: Command) -> Path:
        """The folder as the command finds it."""
        shutil.rmtree(self.folder, ignore_errors=True)
        if command.start is not None:
            shutil.copytree(command.start, self.folder)
        return self.folder

    def tried(self, command: Command, found: Tries, fault: Fault | None = None, seconds: float | None = None) -> None:
        """One try: the command with a fault, a look, the command again, a look."""
        folder = self.ready(command)
        ended = call(command.words(folder), folder, fault, seconds)
        name = str(fault) if fault else f"kill -9 after {seconds:.3f} s"
        state, done = _state(folder), ended.code == 0
        if (command.name, done, state) not in self._known:
            self._known[command.name, done, state] = list(self._left(command, folder, done))
        outcome = {0: "done", DISK: "refused", KILLED: "killed"}.get(ended.code, f"exit {ended.code}")
        found.ends[f"{fault.kind if fault else 'random kill'}: {outcome}"] += 1
        found.states.add(state)
        wrong = [*_wrong_end(ended, folder), *self._known[command.name, done, state]]
        found.faults += [f"{command.name}, {name}: {one}" for one in wrong]

    @staticmethod
    def _left(command: Command, folder: Path, done: bool) -> Iterator[str]:
        """What is wrong with a folder that is left, and once the command went on from it: equal ones are tried once."""
        yield from command.broken(folder, done)
        again = call(command.again(folder), folder)
        if again.code:
            yield f"does not go on: exit {again.code}, {again.said[-600:]}"
        yield from command.broken(folder, True)

    def _interrupt(self) -> None:
        """Makes the run that a kill stopped after its sweep."""
        calls = sum(call(self._run(self.folder), self.folder).calls.values())
        for at in range(calls // 2, calls, max(1, calls // 20)):
            shutil.rmtree(self.folder)
            call(self._run(self.folder), self.folder, Fault("kill -9", at))
            if not (run := runs.load(self.folder)).complete and run.manifest["files"]:
                break
        self.folder.rename(self.partial)

    def _draw_once(self) -> None:
        """Draws the report here once for all, since faults concern its writing."""
        shutil.copytree(self.reference, self.folder)
        drawing: Any = importlib.import_module("phongbench_reports.drawing")
        sections = drawing.sections_of(Rows(runs.load(self.folder)))
        drawing.sections_of = lambda *given, **more: sections
        importlib.import_module("phongbench_reports").cores = lambda: 1  # type: ignore[attr-defined]
        here(self._report(self.folder))
        self.pages = _digests(self.folder / "report")

    def _broken_run(self, folder: Path, done: bool) -> Iterator[str]:
        if not (folder / runs.MANIFEST).exists():
            yield from ["there is no run"] if done else []
            return
        try:
            run = runs.load(folder)
            yield from (line for line in runs.verify(run) if done or "partial" not in line)
        except PhongbenchError as problem:
            yield f"the folder is no run: {problem}"
            return
        for name, facts in self.tables.items():
            if run.complete and run.manifest["files"].get(name) != facts:
                yield f"{name} has other rows"
        yield from _leftovers(folder) if done else []

    def _broken_report(self, folder: Path, done: bool) -> Iterator[str]:
        yield from _differences(self.pages, folder / "report", done)
        yield from self._broken_run(folder, done)

    def _broken_picture(self, folder: Path, done: bool) -> Iterator[str]:
        yield from _differences(self.picture, folder, done)


def here(words: list[str]) -> None:
    """Run a command of phongbench in this process, and drop what it prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        main(args=words, prog_name="phongbench", standalone_mode=False)


def _wrong_end(ended: Ended, folder: Path) -> Iterator[str]:
    """What is wrong with how a command ended."""
    if "Traceback" in ended.said:
        yield f"a traceback: {ended.said[-1500:]}"
    elif ended.code not in (0, DISK, KILLED):
        yield f"exit {ended.code}: {ended.said[-600:]}"
    elif ended.code == DISK and not ("phongbench: " in ended.said and str(folder) in ended.said):
        yield f"the message names no file: {ended.said[-600:]}"


def _differences(wanted: dict[str, str], folder: Path, done: bool) -> Iterator[str]:
    """Files that are not as they should be, and those that lack, where all is done."""
    there = {name: digest for name, digest in _digests(folder).items() if not name.endswith(".partial")}
    yield from (f"{name} is half-written" for name, digest in there.items() if wanted.get(name) != digest)
    if done:
        yield from (f"{name} is missing" for name in wanted.keys() - there.keys())
        yield from _leftovers(folder)


def _leftovers(folder: Path) -> Iterator[str]:
    yield from (f"{path.relative_to(folder)} is left" for path in folder.rglob("*.partial"))
    yield from (f"{name} is left" for name in (".lock", "parts") if (folder / name).exists())


def _digests(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): _digest(path) for path in sorted(folder.rglob("*")) if path.is_file()}


def _state(folder: Path) -> str:
    """A digest of all that a folder holds, and of whether it is there."""
    there = [(str(path.relative_to(folder)), path.is_file() and _digest(path)) for path in sorted(folder.rglob("*"))]
    return hashlib.sha256(repr((folder.exists(), there)).encode()).hexdigest()


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
