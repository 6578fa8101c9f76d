"""Draws a finished run: a folder (or a single file) that answers "which highlight formula at my exponents?"."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from phongbench.support.process import cores, seldom_collected

__all__ = ["build"]


def build(
    run: Any,
    out: Path,
    *,
    single_file: bool = False,
    processes: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Writes the report of a run; a folder that holds it already, whole and made by the same code, is left as it is.

    run          phongbench.results.runs.Run
    out          Path     folder of the report; made if missing, its former report replaced
    single_file  bool     one file with everything in it, no figures/, data/ or style.css: `out` itself where that is
                          named .html, else index.html in that folder
    processes    int      from 2 on, where there are as many cores, another process makes some of the parts
    progress     called with (done, total) before each part that this process makes
    returns      Path     of the page
    Raises InputError for a run without accuracy rows, and for an `out` that can be no folder; StorageError.
    """
    from phongbench_reports.second_process import begun  # late, as what draws: who only looks needs neither

    alone = min(processes, cores()) < 2
    with seldom_collected(), begun(None if alone else run.path) as other:  # it imports while this one does
        from phongbench_reports.drawing import draw

        return draw(run, out, single_file=single_file, other=other, progress=progress)
