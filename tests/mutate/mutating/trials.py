"""Changes in a copy of the checkout, each against the tests that run its statement; what was found is kept.

Every test is run once, to see which statements of the product it runs. A change is tried against those that meet it:
first those of files named like its module, then those of its room, and what survives them against those of ring after
ring of other folders.
"""

import compileall
import contextlib
import hashlib
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import click
from mutating import choice, session
from mutating.changes import Change
from mutating.session import Ended, read, write

#: what a copy holds
_PARTS = ("phongbench", "api", "reports", "tests", "pyproject.toml", "constraints.txt", "Makefile", ".gitignore", ".ci")
_PAGES = ("README.md", "CONTRIBUTING.md", "DECISIONS.md", "CHANGELOG.md", "LICENSE")
#: folders and files of tests below tests/, ring after ring: near rooms, then who reads what they make
RINGS: Sequence[Sequence[str]] = (
    ("phongbench/support", "phongbench/results", "phongbench/inputs", "phongbench/analysis", "phongbench/cli"),
    ("house/test_values.py", "phongbench/face", "api/routes", "reports/tables"),
    (
        "phongbench/scenes/test_images.py",
        "phongbench/scenes/test_render_command.py",
        "phongbench/scenes/test_scene_files.py",
        "phongbench/inverse/test_picture_files.py",
        "phongbench/accuracy/test_sweep.py",
        "phongbench/study/test_run.py",
    ),
)
#: how long the tests of one change take together in its own room, and in each ring, where nothing is wrong
MOST_SECONDS = 40.0
#: a file is traced for so long; what it has not run by then is not asked
_TRACED_SECONDS = 240.0
#: pytest's codes that mean a change was noticed: a test failed, or could not even be collected
_NOTICED = (1, 2, 3, 4)


class Bench:
    """A copy of the checkout, and what is known of it, in a folder that a later call goes on with.

    sound.json    whether each test that failed passes without a change
    pickles.json  fixtures that are made once for many processes: what they run, and the files that they left in traces/
    traces/       what each test file runs
    results.json  what came of changes
    """

    def __init__(self, checkout: Path, state: Path, say: Callable[[str], None]) -> None:
        self.checkout, self.state, self.say = checkout, state, say
        self.copy, self.traced = state / "copy", state / "traces"
        self.traced.mkdir(parents=True, exist_ok=True)
        self._renew()
        self.uses = choice.Uses(self.copy)
        self._known: dict[Sequence[str], choice.Traces] = {}

    def _renew(self) -> None:
        """Take the checkout as it is now."""
        fresh = self.state / "fresh"
        shutil.rmtree(fresh, ignore_errors=True)
        for part in (*_PARTS, *_PAGES):
            if (source := self.checkout / part).is_dir():
                shutil.copytree(source, fresh / part, ignore=shutil.ignore_patterns("__pycache__"))
            elif source.is_file():
                shutil.copy2(source, fresh / part)
        shutil.rmtree(self.copy, ignore_errors=True)
        fresh.rename(self.copy)
        subprocess.run(["git", "init", "--quiet", str(self.copy)], check=True)  # tests ask git which files there are
        compileall.compile_dir(self.copy, quiet=2, workers=1)
        product = _digest(self.copy / "phongbench")
        if read(self.state / "product.json") != product:
            for made in (*self.traced.glob("*.pickle"), self.state / "pickles.json"):
                made.unlink(missing_ok=True)
            write(self.state / "product.json", product)

    # what tests run

    def traces(self, folders: Sequence[str]) -> choice.Traces:
        """What the tests of some folders run; a file is traced again when it, or what it runs, has changed."""
        if folders not in self._known:
            told: list[Mapping[str, Any]] = []
            for folder in folders:
                place = self.copy / "tests" / folder
                for path in [place] if place.is_file() else sorted(place.rglob("test_*.py")):
                    told += self._told(path.relative_to(self.copy).as_posix())
            self._known[folders] = choice.Traces.of(told)
        return self._known[folders]

    def _told(self, name: str) -> list[Mapping[str, Any]]:
        file = self.traced / f"{name.replace('/', '-')}.json"
        known = read(file)
        if not known or any(_digest(self.copy / path) != digest for path, digest in known["files"].items()):
            known = self._traced(name, file.with_suffix(f".{os.getpid()}.told"))
            write(file, known)
        told: list[Mapping[str, Any]] = known["told"]
        return told

    def _traced(self, name: str, told: Path) -> dict[str, Any]:
        told.unlink(missing_ok=True)
        ended = session.run(self.copy, [name], _TRACED_SECONDS, told, sorted(self.traced.glob("*.pickle")))
        lines = [json.loads(line) for line in told.read_text().splitlines()] if told.exists() else []
        told.unlink(missing_ok=True)
        if ended.code not in (0, 1, 5, None):
            raise click.ClickException(f"{name} cannot be traced: {ended.said[-2000:]}")
        made = read(self.state / "pickles.json")
        for one in lines:
            if "fixture" in one and one["fixture"] in made:
                one.update(made[one["fixture"]])  # it was not made again
            elif one.get("pickled"):
                write(self.state / "pickles.json", made := made | {one["fixture"]: one})
        self.say(f"traced {name}: {len(lines)} tests and fixtures in {ended.seconds:.0f} s, pytest said {ended.code}")
        files = {file for one in lines for file in one["lines"]} | {name}
        return {"told": lines, "files": {file: _digest(self.copy / file) for file in sorted(files)}}

    # trials

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

    def tried(self, change: Change) -> dict[str, Any]:
        """What came of a change: its end, how many tests were asked, and the one that noticed."""
        found = {name: getattr(change, name) for name in ("name", "room", "file", "line", "kind", "before", "after")}
        end, test, asked, seconds = "survived", "", set[str](), 0.0
        for folders in self._rings(change):
            for names, ended in self._asked(change, folders, asked):
                asked, seconds = asked | {*names}, seconds + ended.seconds
                if ended.code is None or ended.code in _NOTICED or ended.code < 0:
                    end, test = ("out of time" if ended.code is None else "caught"), ended.failed
            if end != "survived":
                break
        note = test if asked else "no test runs it"
        return found | {"end": end, "note": note, "tests": len(asked), "seconds": round(seconds, 1)}

    def _rings(self, change: Change) -> Sequence[Sequence[str]]:
        """What is asked, one after the other; first those of its files that are named like the changed module."""
        rings = ((f"phongbench/{change.room}",), *RINGS)
        tests, room, asked = self.copy / "tests", f"phongbench.{change.room}", tuple(chain(*rings))
        found = sorted(tests.rglob(f"test_{Path(change.file).stem}.py"))
        names = [path.relative_to(tests).as_posix() for path in found if room in path.read_text()]
        return (tuple(name for name in names if name.startswith(asked)), *rings)

    def _asked(
        self, change: Change, folders: Sequence[str], asked: Collection[str]
    ) -> Iterator[tuple[Sequence[str], Ended]]:
        """Ask the tests of a ring that were not asked yet; again without one that fails without the change, too."""
        traces, sound = self.traces(folders), read(self.state / "sound.json")
        left_out = {*asked, *(name for name, passes in sound.items() if not passes)}
        named = choice.mentioning(self.copy, sorted({test.file for test in traces.tests}), change.names)
        same = self._same(change, traces)
        while names := traces.chosen(change, self.uses, MOST_SECONDS, left_out, named, same):
            with self.changed(change):
                limit = 60.0 + 5.0 * MOST_SECONDS
                ended = session.run(
                    self.copy, names, limit, pickles=[path for paths in same.values() for path in paths]
                )
            if not ended.failed or self._sound(ended.failed):
                yield names, ended
                return
            left_out.add(ended.failed)

    def _same(self, change: Change, traces: choice.Traces) -> dict[str, list[Path]]:
        """Fixtures that the change leaves alone, and the files that hold what they leave to other processes."""
        wanted = choice.where(change, self.uses)
        return {
            key: [self.traced / name for name in made["pickled"]]
            for key, made in read(self.state / "pickles.json").items()
            if not choice.meets(made["lines"], wanted)
            and not any(choice.meets(traces.fixtures[one].lines, wanted) for one in traces.needed([key]))
        }

    def _sound(self, test: str) -> bool:
        """Whether a test that failed passes without a change; asked once for each."""
        known = read(self.state / "sound.json")
        if test not in known:
            known[test] = session.run(self.copy, [test], 600.0).code == 0
            write(self.state / "sound.json", known)
            if not known[test]:
                self.say(f"fails without any change: {test}")
        return bool(known[test])

    def results(self, changes: Sequence[Change], again: bool) -> dict[str, dict[str, Any]]:
        """What earlier calls found of these changes, in files that are the same today; without survivors on demand."""
        digests = {change.file: _digest(self.copy / change.file) for change in changes}
        names = {change.name for change in changes}
        return {
            name: one
            for name, one in read(self.state / "results.json").items()
            if name in names and digests[one["file"]] == one["digest"] and not (again and one["end"] == "survived")
        }

    def ever(self) -> set[str]:
        """The names of all changes that were tried, in files that may have changed since."""
        return set(read(self.state / "results.json"))

    def keep(self, results: dict[str, dict[str, Any]], name: str, found: dict[str, Any]) -> None:
        """Add what came of a change, on disk too."""
        results[name] = found | {"digest": _digest(self.copy / found["file"])}
        write(self.state / "results.json", read(self.state / "results.json") | {name: results[name]})


def _digest(path: Path) -> str:
    """Of a file, or of the sources below a folder."""
    digest = hashlib.sha256()
    for file in sorted(path.rglob("*.py")) if path.is_dir() else [path] if path.exists() else []:
        digest.update(file.relative_to(path).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()
