"""How far work is, on stderr. NO_COLOR is honoured."""

from types import TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from phongbench.cli.layout import INDENT, wrapped
from phongbench.support.progress import Progress


class TerminalProgress(Progress):
    """Progress bars with rate and time left on a terminal; single lines for each stage elsewhere."""

    def __init__(self, *, quiet: bool = False, verbose: bool = False) -> None:
        self.verbose, self.count, self.begun, self.last, self.title = verbose, 0, 0, "", ""
        self.console = Console(stderr=True, quiet=quiet)
        self.bars = Bars(
            TextColumn("{task.description:<36}", markup=False),
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

    def stages(self, count: int) -> None:
        """From now on stages are counted, "3 of 7"; one that begins again keeps its number."""
        self.count, self.begun, self.last = count, 0, ""

    def stage(self, text: str, total: float | None = None) -> None:
        """Begin a stage: a new bar, or a line where there is no terminal."""
        self.begun += text != self.last
        self.last = text
        self.title = text = f"{self.begun} of {self.count}  {text}" if self.begun <= self.count else text
        if self.task is not None:
            self.bars.remove_task(self.task)
        self.task = self.bars.add_task(text, total=total, rate="")
        if self.bars.disable:
            self.console.print(text, style="dim", highlight=False, markup=False, soft_wrap=True)

    def advance(self, steps: float = 1) -> None:
        """Move the bar; large steps are evaluations, whose rate is shown."""
        if self.task is not None:
            speed = next((t.speed for t in self.bars.tasks if t.id == self.task), None)
            rate = f"{speed / 1e9:.2f} billion evaluations/s" if speed and speed > 1e6 else ""
            self.bars.update(self.task, advance=steps, rate=rate)

    def status(self, text: str) -> None:
        """Say it in the bar, after the stage; where there is no terminal it would be a line each time."""
        if self.task is not None:
            self.bars.update(self.task, description=f"{self.title}: {text}")

    def note(self, text: str) -> None:
        """Print a remark above the bar."""
        for line in wrapped(text, self.console.width if self.console.is_terminal else None, INDENT):
            self.console.print(line, highlight=False, markup=False, soft_wrap=True)

    def detail(self, text: str) -> None:
        """The same where every remark is wanted."""
        if self.verbose:
            self.note(text)
