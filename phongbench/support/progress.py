"""How long work tells what it is doing; the command line draws it, the library only speaks."""


class Progress:
    """Told of stages and steps; this one keeps silent."""

    def stages(self, count: int) -> None:
        """So many stages will follow."""

    def stage(self, text: str, total: float | None = None) -> None:
        """A new stage begins; `total` steps of it are expected if known."""

    def advance(self, steps: float = 1) -> None:
        """Steps of the current stage are done."""

    def share(self, done: int, total: int) -> None:
        """A step of a stage whose whole is 1 begins: so many of so many are done."""
        self.advance(1 / total if done else 0)

    def status(self, text: str) -> None:
        """How far the current stage is, in words that replace those before."""

    def note(self, text: str) -> None:
        """Something worth telling that is not an error."""

    def detail(self, text: str) -> None:
        """Something that only those want to know who look into how numbers are got."""


class Reached:
    """Tells a progress how far a stage is whose whole is 1: called with how many steps are done, and of how many."""

    def __init__(self, progress: Progress) -> None:
        self._progress, self._last = progress, 0.0

    def __call__(self, done: int, total: int, text: str = "") -> None:
        """So many steps of so many are done; the text goes nowhere."""
        share = done / max(total, 1)
        self._progress.advance(share - self._last)
        self._last = share
