"""Every error phongbench raises on purpose, each carrying what happened, where, and how to fix it.

The command line and the service turn these into an exit code or a problem document, each in exactly one table.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class PhongbenchError(Exception):
    """Base of all deliberate errors.

    what   str         what went wrong, one sentence without a full stop
    where  str | None  the file, key, option or index that is at fault
    fix   str | None  what the user can do about it
    """

    def __init__(self, what: str, where: str | None = None, fix: str | None = None) -> None:
        super().__init__(what)
        self.what = what
        self.where = where
        self.fix = fix

    def __str__(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        return f"{head}\n{self.fix}" if self.fix else head


class InputError(PhongbenchError):
    """A value, file, plan or option of the user's that cannot be."""


class UnknownNameError(InputError):
    """A name that nothing is registered under; the message lists the known ones, the nearest first.

    kind   str             what was looked up, e.g. "approximation"
    name   str             the unknown name
    known  tuple[str, ..]  all valid names
    """

    def __init__(self, kind: str, name: object, known: Iterable[str], where: str | None = None) -> None:
        self.kind, self.name, self.known = kind, str(name), tuple(known)
        near = get_close_matches(self.name, self.known, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        super().__init__(f"unknown {kind} {self.name!r}", where, f"{hint}known: {', '.join(self.known)}")


class BudgetError(InputError):
    """A timing budget in which not even the shortest comparison can be measured on this machine, as busy as it is.

    needed  float  seconds that would do
    """

    def __init__(self, what: str, needed: float, where: str | None = None, fix: str | None = None) -> None:
        self.needed = needed
        super().__init__(what, where, fix)


class KernelError(InputError):
    """A scalar kernel that cannot be compiled: it uses something outside the small language of lowering.py."""


class LockedError(PhongbenchError):
    """Another process holds the run's folder."""


class StorageError(PhongbenchError):
    """The disk refused: no space, read-only, or no permission."""


class CorruptRunError(PhongbenchError):
    """A stored run whose bytes do not match its manifest, or that is no run at all."""


class InterruptedStudyError(PhongbenchError):
    """The user stopped a study. What is done is stored, and `fix` names the folder to resume."""


class MeasurementError(PhongbenchError):
    """A timing that cannot be believed.

    The timed output differs from the verified output, or a kernel compiled anew.
    """


class CancelledError(PhongbenchError):
    """Work that was given up because its client went away."""
