"""What a person sees on a terminal: progress bars and tables. Talk goes to stderr, data to stdout.

NO_COLOR is honoured.
"""

from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars
from rich.table import Table

from phongbench.progress import Progress


class TerminalProgress(Progress):
    """Progress bars with rate and time left on a terminal; single lines for each stage elsewhere."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.console = Console(stderr=True, quiet=quiet)
        self.bars = Bars(
            TextColumn("{task.description:<28}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[rate]}"),
            console=self.console,
            transient=True,
            disable=quiet or not self.console.is_terminal,
        )
        self.task: Any = None

    def __enter__(self) -> "TerminalProgress":
        self.bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bars.stop()

    def stage(self, text: str, total: float | None = None) -> None:
        """Begin a stage: a new bar, or a line where there is no terminal."""
        if self.task is not None:
            self.bars.remove_task(self.task)
        self.task = self.bars.add_task(text, total=total, rate="")
        if self.bars.disable:
            self.console.print(text, style="dim", highlight=False)

    def advance(self, steps: float = 1) -> None:
        """Move the bar; large steps are evaluations, whose rate is shown."""
        if self.task is not None:
            speed = next((t.speed for t in self.bars.tasks if t.id == self.task), None)
            rate = f"{speed / 1e9:.2f} billion evaluations/s" if speed and speed > 1e6 else ""
            self.bars.update(self.task, advance=steps, rate=rate)

    def note(self, text: str) -> None:
        """Print a remark above the bar."""
        self.console.print(text, highlight=False, markup=False)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, right: Sequence[str] = ()) -> None:
    """Print a table on stdout; columns named in `right` are aligned right."""
    drawn = Table(title=title or None, box=SIMPLE, title_justify="left", pad_edge=False)
    for name in columns:
        drawn.add_column(name, justify="right" if name in right else "left", overflow="fold")
    for row in rows:
        drawn.add_row(*(cell if isinstance(cell, str) else text_of(cell) for cell in row))
    console = Console(markup=False)
    if not console.is_terminal:
        console = Console(markup=False, width=160)
    console.print(drawn)


def text_of(value: Any) -> str:
    """A number as people read it: four significant digits, nothing for what is missing."""
    if value is None or value != value:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
