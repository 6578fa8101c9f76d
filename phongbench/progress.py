"""How long work tells what it is doing; the command line draws it, the library only speaks."""


class Progress:
    """Told of stages and steps; this one keeps silent."""

    def stage(self, text: str, total: float | None = None) -> None:
        """A new stage begins; `total` steps of it are expected if known."""

    def advance(self, steps: float = 1) -> None:
        """Steps of the current stage are done."""

    def note(self, text: str) -> None:
        """Something worth telling that is not an error."""
