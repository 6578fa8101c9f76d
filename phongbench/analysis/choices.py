"""What a run chooses: its fronts, and the cheapest formula within a budget at each exponent, each made once."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from phongbench.analysis.choice import Choice, choose, promised
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.front import UNIT, front
from phongbench.compiler.precisions import in_order
from phongbench.formulas.user_files import installed
from phongbench.results.records import Records, Row
from phongbench.results.runs import Run
from phongbench.results.schema import EXACT, TWIN


@dataclass(frozen=True)
class Choices:
    """The choices among formulas that take their pair of vectors as it is.

    accuracy, timing, costs  rows of a run
    """

    accuracy: Records
    timing: Records
    costs: Records

    @staticmethod
    def of(run: Run) -> "Choices":
        """Those of a stored run."""
        return Choices(*(run.records(name).as_given() for name in ("accuracy", "timing", "costs")))

    @cached_property
    def alphas(self) -> list[float]:
        """The swept exponents, ascending."""
        return self.accuracy.distinct("alpha")

    @cached_property
    def precisions(self) -> list[str]:
        """The swept precisions, float32 first."""
        swept = in_order(set(self.accuracy.distinct("precision")) - {EXACT})
        first = [name for name in ("float32", "float16", "float64") if name in swept]
        return [*first, *(name for name in swept if name not in first)]

    @property
    def precision(self) -> str:
        """The precision that claims are judged and single-precision views are drawn at: float32 where it was swept."""
        return self.precisions[0] if self.precisions else "float32"

    @cached_property
    def working_set(self) -> str:
        """The smallest working set that was timed, or "" without timing."""
        timed = self.timing.distinct("working_set")
        return next((name for name in ("l1", "l2", "memory") if name in timed), "")

    @cached_property
    def twin_differs(self) -> list[str]:
        """Working sets in which identical code was found to differ in time: their speed claims are withheld."""
        rows = self.timing.at(approximation=TWIN).rows(["working_set", "verdict"])
        return sorted({row["working_set"] for row in rows if row["verdict"] != "unresolved"})

    @cached_property
    def mirrored(self) -> Records:
        """Errors of formulas of (R, V) in the highlight, on unit vectors."""
        return self.accuracy.at(**UNIT, stratum="highlight", space="reflect")

    def front(self, alpha: float, precision: str) -> Sequence[Row]:
        """The error/time front of formulas of (R, V) at one exponent in the smallest timed working set.

        Formulas of (N, H) are another lobe, and judged apart.
        """
        key = (alpha, precision)
        if key not in self._kept:
            question = {"precision": precision, "working_set": self.working_set}
            self._kept[key] = front(self.mirrored, self.timing, alpha=alpha, **question)
        kept: Sequence[Row] = self._kept[key]
        return kept

    def choice(self, alpha: float, precision: str, max_error: float) -> Choice:
        """The cheapest formula of that front for an error budget, by the promise that `recommend` decides by."""
        key = (alpha, precision, max_error)
        if key not in self._kept:
            judge = promised(Budget.of(alpha, max_error, precision=precision), installed())
            self._kept[key] = choose(self.front(alpha, precision), max_error, judge)
        kept: Choice = self._kept[key]
        return kept

    @cached_property
    def _kept(self) -> dict[Any, Any]:
        """Fronts and choices that were asked for before."""
        return {}
