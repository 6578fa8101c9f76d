"""The strata: which kinds of pairs (a, b) approximations are measured on. `sampling` draws them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from phongbench.formulas.lambda_forms import lengths_of
from phongbench.inputs.length_errors import ANY, BY_NAME, CAUSES, Cause

#: relative length errors: a 12-bit reciprocal root errs by 3.7e-4, one Newton step of the classic bit trick by 1.75e-3
LENGTH_ERRORS = (1e-4, 3.7e-4, 1.75e-3, 1e-2, 5e-2, 0.1)
#: the highlight stratum fills alpha * lambda = 0 .. 12; exp(-12) = 6e-6 is dark
HIGHLIGHT_REACH = 12.0
#: the cutoff stratum spans this many units in the last place on either side of the cut
CUTOFF_ULPS = 8

Scale = Literal["none", "alpha", "cutoff"]


@dataclass(frozen=True, slots=True)
class Stratum:
    """One kind of input.

    name          str      uniform, highlight, peak, cutoff, grazing, lengths, normalised or hostile; configurations of
                           N, L and V
    scale         str      what the deficits are scaled by: nothing, 1 / alpha, or the cell's own cutoff
    perturbation  str      none, a, both or opposite: whose length is wrong; or one of causes.CAUSES: why; any: lengths
                           from 0.001 to 1000. In configurations `both` means all three
    length_error  float    relative and signed; 0.01 is 1 % too long (for `opposite`: a too long, b too short); 0 where
                           a cause decides
    """

    name: str
    scale: Scale = "none"
    perturbation: str = "none"
    length_error: float = 0.0

    @property
    def unnormalised(self) -> bool:
        """True if the two truths differ."""
        return self.perturbation != "none" or self.name == "hostile"

    @property
    def reaches_back(self) -> bool:
        """True if the gate on a.b > 0 is what this stratum tests."""
        return self.name in ("grazing", "hostile")

    @property
    def cause(self) -> Cause | None:
        """What makes the lengths wrong, where that is not a mere factor."""
        return BY_NAME.get(self.perturbation)

    @property
    def largest_length_error(self) -> float:
        """The largest relative length error, signed; a cause's is computed by running it."""
        return self.length_error if self.cause is None else self.cause.length_error

    @property
    def share(self) -> float:
        """The share of a plan's samples that it gets: what many causes do is smooth, and they come in a row."""
        return 1.0 if self.cause is None else 0.25

    @property
    def lengths(self) -> tuple[float, float]:
        """|a| and |b| before any cause."""
        return lengths_of(self.perturbation, self.length_error)


def _length_strata() -> Iterator[Stratum]:
    for size in LENGTH_ERRORS:
        for perturbation in ("a", "both"):
            for signed in (size, -size):
                yield Stratum("lengths", "alpha", perturbation, signed)
        yield Stratum("lengths", "alpha", "opposite", size)
    for cause in CAUSES:
        yield Stratum("lengths", "alpha", cause.name)


def _configurations() -> Iterator[Stratum]:
    yield Stratum("configurations", "alpha")
    for size in (1e-3, 1e-2, 5e-2):
        for signed in (size, -size):
            yield Stratum("configurations", "alpha", "both", signed)
    yield Stratum("configurations", "alpha", ANY.name)


STRATA: tuple[Stratum, ...] = (
    Stratum("uniform"),
    Stratum("highlight", "alpha"),
    Stratum("peak"),
    Stratum("cutoff", "cutoff"),
    Stratum("grazing"),
    *_length_strata(),
    Stratum("normalised", "alpha"),
    Stratum("hostile"),
    Stratum("lengths", "alpha", ANY.name),
    *_configurations(),
)
#: where N, L and V are drawn, of which formulas of (N, H) see no angle between R and V
CONFIGURATIONS = "configurations"
STRATUM_NAMES = tuple(dict.fromkeys(s.name for s in STRATA))
#: what a study measures that does not ask for more; what normalising adds to a largest error is proven without samples
USUAL_STRATA = tuple(name for name in STRATUM_NAMES if name != "normalised")
