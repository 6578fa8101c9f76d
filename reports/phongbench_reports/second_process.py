"""A second process that draws some of a report's figures: drawing is Python, which runs on one core at a time.

It begins while the first process makes the tables, and gives the same figures, byte for byte. Where it fails, the first
process draws them itself, and meets the same failure if there is one.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:  # what draws takes two seconds of a core to import: the other process begins before
    from phongbench.analysis.rows import Rows
    from phongbench_reports.plots import Plate
    from phongbench_reports.table import Absent, Part

#: not `-m`: what is pickled would be of __main__, which is another module over here
_CHILD = f"import sys; from {__name__} import serve; serve(sys.argv[1], sys.stdin, sys.stdout.buffer)"
#: name of a figure -> what was drawn
Figures = Mapping[str, "Drawn"]
Process = subprocess.Popen[bytes]


@dataclass(frozen=True)
class Drawn:
    """A figure as the page takes it.

    content  Plate or Absent
    pair     its SVG for light and for dark pages; None for an absent one
    """

    content: Plate | Absent
    pair: tuple[bytes, bytes] | None


def drawn(study: Rows, entry: Part) -> Drawn:
    """One figure of a study; call it inside `ink`."""
    from phongbench_reports.plots import Plate, svg_pair

    content = entry.make(study)
    return Drawn(content, svg_pair(content.figure, entry.name) if isinstance(content, Plate) else None)


class Shared:
    """Figures that two processes draw, each the next one that is left: this one from the front, the other from the end.

    names    figures, in the order in which this process would draw them
    process  the other one, see `serve`
    """

    @property
    def left(self) -> int:
        """How many figures neither process has begun."""
        return len(self._left)

    def __init__(self, names: Iterable[str], process: Process) -> None:
        self._left = deque(names)
        self._theirs: dict[str, Drawn] = {}
        self._thread = threading.Thread(target=self._ask, args=(process,), daemon=True)
        self._thread.start()

    def mine(self) -> Iterator[str]:
        """The figures for this process to draw; each is handed out when it is asked for."""
        while self._left:
            with suppress(IndexError):  # the other process was quicker
                yield self._left.popleft()

    def theirs(self) -> Figures:
        """Waits for what the other process draws; only what came, if it failed."""
        self._thread.join()
        return self._theirs

    def _ask(self, process: Process) -> None:
        if process.stdin is None or process.stdout is None:
            return
        while self._left:
            with suppress(IndexError, OSError, EOFError, pickle.UnpicklingError):
                name = self._left.pop()
                process.stdin.write(f"{name}\n".encode())
                process.stdin.flush()
                self._theirs[name] = pickle.load(process.stdout)
                continue
            return


@contextmanager
def begun(path: Path | None) -> Iterator[Process | None]:
    """While it lasts there is a process for figures of the run in this folder, for `beside`; none without a folder."""
    if path is None:
        yield None
        return
    words = [sys.executable, "-c", _CHILD, str(path)]
    pipe = subprocess.PIPE
    process = subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def beside(process: Process, names: Iterable[str]) -> Iterator[Shared]:
    """While it lasts, that process draws some of these figures; it ends with it."""
    shared = Shared(names, process)
    try:
        yield shared
    finally:
        process.kill()
        shared.theirs()


def serve(path: str, asked: Iterable[str], out: IO[bytes]) -> None:
    """What the other process does: it draws figures of the run in this folder as they are asked for.

    asked  lines, each the name of a figure
    out    receives each one, pickled
    """
    from matplotlib.figure import Figure

    from phongbench.analysis.rows import Rows
    from phongbench.results import runs
    from phongbench_reports.figures import FIGURES
    from phongbench_reports.plots import Plate, ink

    study, entries = Rows(runs.load(Path(path))), {entry.name: entry for entry in FIGURES}
    with ink():
        for line in asked:
            one = drawn(study, entries[line.strip()])
            # the figure itself is large, and nobody needs it once it is SVG
            bare = replace(one.content, figure=Figure()) if isinstance(one.content, Plate) else one.content
            pickle.dump(replace(one, content=bare), out)
            out.flush()
