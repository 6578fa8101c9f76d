"""A progress that an interruption ends: it is looked for before every step."""

from collections.abc import Callable
from dataclasses import dataclass

from phongbench.support.progress import Progress


@dataclass(frozen=True)
class Checked(Progress):
    """Passes everything on to a progress, and asks first whether the user has interrupted.

    check  raises what ends the study
    """

    progress: Progress
    check: Callable[[], None]

    def stage(self, text: str, total: float | None = None) -> None:
        """A new stage, unless interrupted."""
        self.check()
        self.progress.stage(text, total)

    def advance(self, steps: float = 1) -> None:
        """Steps are done, unless interrupted."""
        self.check()
        self.progress.advance(steps)

    def stages(self, count: int) -> None:
        """So many stages will follow."""
        self.progress.stages(count)

    def status(self, text: str) -> None:
        """How far the stage is, at any time."""
        self.progress.status(text)

    def note(self, text: str) -> None:
        """A note, at any time."""
        self.progress.note(text)

    def detail(self, text: str) -> None:
        """A detail, at any time."""
        self.progress.detail(text)
