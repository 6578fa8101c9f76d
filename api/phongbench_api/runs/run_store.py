"""The stored runs as the service sees them: looked up by id, checked once per state of their files, never written."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from phongbench.errors import CorruptRunError, PhongbenchError
from phongbench.results import runs as results
from phongbench.results.runs import MANIFEST, RUN_ID, Run
from phongbench.results.schema import TABLES
from phongbench.targets.measured import NAME, place_of
from phongbench_api.http.problems import NotFoundError

_UNKNOWN = "no run of that id is stored here"


class RunStore:
    """Runs under one folder.

    A name is compared with the folders that are there and never joined to a path; a folder behind a symbolic link does
    not count.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._lock = threading.Lock()
        self._known: dict[Path, tuple[object, Run | CorruptRunError]] = {}
        self._checked: dict[Path, tuple[object, CorruptRunError | None]] = {}

    def folders(self) -> list[Path]:
        """The folders that look like runs, newest first."""
        try:
            named = [path for path in self.root.iterdir() if RUN_ID.fullmatch(path.name) and not path.is_symlink()]
        except OSError:  # no folder yet: no run yet
            return []
        return sorted((path for path in named if (path / MANIFEST).is_file()), reverse=True)

    def runs(self) -> Iterator[Run | tuple[Path, CorruptRunError]]:
        """Every run, newest first; one whose manifest cannot be read with its error."""
        for path in self.folders():
            try:
                yield self._load(path)
            except CorruptRunError as problem:
                yield path, problem

    def summary(self, path: Path) -> dict[str, Any]:
        """The manifest of the run in this folder with its id, or that it is corrupt."""
        try:
            run = self._load(path)
        except CorruptRunError:
            return {"id": path.name, "state": "corrupt"}
        return {"id": path.name, **run.manifest, "report": (path / "report" / "index.html").is_file()}

    def find(self, name: str) -> Run:
        """The run of this id, or the newest for `latest`; NotFoundError, or CorruptRunError for its own manifest."""
        folders = self.folders()
        named = folders[:1] if name == "latest" else [path for path in folders if path.name == name]
        if named:
            return self._load(named[0])
        for run in self.runs():
            if isinstance(run, Run) and run.id == name:
                return run
        raise NotFoundError("no run is stored here" if name == "latest" else _UNKNOWN, fix="GET /v1/runs lists them")

    def intact(self, name: str) -> Run:
        """The run of this id, once its bytes are known to be those that were written."""
        run = self.find(name)
        stamp = self._stamp(run.path)
        if self._checked.get(run.path, (None, None))[0] != stamp:
            self._checked[run.path] = (stamp, _fault(run))
        fault = self._checked[run.path][1]
        if fault is not None:
            raise CorruptRunError(fault.what, fault.where, fault.fix)
        return run

    def newest_timed(self) -> Run | None:
        """The newest whole run with times whose bytes are those that were written; a corrupt one is passed over."""
        for run in self.runs():
            if isinstance(run, Run) and run.complete and run.manifest["files"].get("timing.parquet", {}).get("rows"):
                with suppress(CorruptRunError):
                    return self.intact(run.path.name)
        return None

    def stamp(self, run: Run) -> object:
        """Changes whenever a file of the run does."""
        return self._stamp(run.path)

    def added_stamp(self, target: str) -> object:
        """Changes whenever the file of a measured target does; None of any other."""
        return _state(place_of(target, self.root)) if NAME.fullmatch(target) else None

    def _load(self, path: Path) -> Run:
        stamp = _state(path / MANIFEST)
        with self._lock:
            if self._known.get(path, (None, None))[0] != stamp:
                self._known[path] = (stamp, _loaded(path))
            run = self._known[path][1]
        if isinstance(run, CorruptRunError):
            raise CorruptRunError(run.what, run.where, run.fix)
        return run

    def _stamp(self, path: Path) -> object:
        names = (MANIFEST, *(f"{table}.parquet" for table in TABLES))
        return tuple(_state(path / name) for name in names)


def _loaded(path: Path) -> Run | CorruptRunError:
    try:
        return results.load(path)
    except CorruptRunError as problem:
        return problem
    except PhongbenchError as problem:  # another program's manifest, or one that cannot be read any more
        return CorruptRunError(problem.what, str(path))


def _fault(run: Run) -> CorruptRunError | None:
    problems = [text for text in results.verify(run) if not text.startswith("the run is partial")]
    return CorruptRunError("; ".join(problems), run.id) if problems else None


def _state(path: Path) -> Any:
    try:
        facts = path.stat()
    except OSError:
        return None
    return facts.st_ino, facts.st_mtime_ns, facts.st_size
