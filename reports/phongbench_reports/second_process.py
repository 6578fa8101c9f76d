"""A second process that draws some of a report's figures: drawing is Python, which runs on one core at a time.

It gets ready while the first process makes the tables, and gives the same figures, byte for byte. Where it fails, the
first process draws them itself, and meets the same failure if there is one.
"""

import pickle
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from matplotlib.figure import Figure

from phongbench.analysis.rows import Rows
from phongbench.results import runs
from phongbench_reports.figures import FIGURES
from phongbench_reports.plots import Plate, ink, svg_pair
from phongbench_reports.table import Absent, Part

#: not `-m`: what is pickled would be of __main__, which is another module over here
_CHILD = f"import sys; from {__name__} import answer; sys.stdout.buffer.write(answer(*sys.argv[1:]))"
#: name of a figure -> what was drawn
Figures = Mapping[str, "Drawn"]


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
    content = entry.make(study)
    return Drawn(content, svg_pair(content.figure, entry.name) if isinstance(content, Plate) else None)


@contextmanager
def beside(path: Path, names: Iterable[str]) -> Iterator[Callable[[], Figures]]:
    """While it lasts, another process draws these figures of the run in this folder.

    What is yielded waits for them; it gives those that came, none if the process failed.
    """
    words = [sys.executable, "-c", _CHILD, str(path), *names]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        try:
            yield lambda: _received(process)
        finally:
            process.kill()


def _received(process: subprocess.Popen[bytes]) -> Figures:
    answer, _ = process.communicate()
    figures: Figures = pickle.loads(answer) if process.returncode == 0 else {}
    return figures


def answer(path: str, *names: str) -> bytes:
    """What the other process writes: what it drew of the run in this folder, by name."""
    study, figures = Rows(runs.load(Path(path))), {}
    with ink():
        for entry in FIGURES:
            if entry.name in names:
                one = drawn(study, entry)
                # the figure itself is large, and nobody needs it once it is SVG
                bare = replace(one.content, figure=Figure()) if isinstance(one.content, Plate) else one.content
                figures[entry.name] = replace(one, content=bare)
    return pickle.dumps(figures)
