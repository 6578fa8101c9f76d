"""How long work tells what it is doing; the command line draws it, the library only speaks."""


class Progress:
    """Told of stages and steps; this one keeps silent."""

    def stage(self, text: str, total: float | None = None) -> None:
        """A new stage begins; `total` steps of it are expected if known."""

    def advance(self, steps: float = 1) -> None:
        """Steps of the current stage are done."""

    def share(self, done: int, total: int) -> None:
        """A step of a stage whose whole is 1 begins: so many of so many are done."""
        self.advance(1 / total if done else 0)

    def note(self, text: str) -> None:
        """Something worth telling that is not an error."""
