"""What a textbook claim is, and what judging it gives."""

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import pandas as pd

from phongbench.analysis.claims.words import brief, sentence
from phongbench.analysis.rows import Rows
from phongbench.errors import InputError
from phongbench.formulas.citations import Source

HOLDS, CONDITIONS, FAILS_MOSTLY = "holds", "holds under conditions", "fails mostly"
FAILS, UNMEASURED = "fails", "not measured"
VERDICTS = (HOLDS, CONDITIONS, FAILS_MOSTLY, FAILS, UNMEASURED)
#: a verdict's sign: seen by its shape, not by a colour
SIGNS = dict(zip(VERDICTS, "✓◐◔✗–", strict=True))
#: a claim that is met in a smaller share of the cases fails mostly
MOSTLY = 0.5
#: a claim over exponents or gammas is judged by so many of them, at least
FEWEST = 3
#: an error that an 8-bit display can show, and one that a 10-bit display can
VISIBLE, FINE = 1 / 255, 1 / 1023

Record = Mapping[str, Any]


class LackingRowsError(InputError):
    """A run without the rows that a rule reads; `fix` names the preset or the flags that give them."""

    def __init__(self, what: str, fix: str) -> None:
        super().__init__(what, None, fix)


@dataclass(frozen=True)
class Finding:
    """What a rule gives.

    verdict     one of VERDICTS
    because     one sentence made of the numbers
    conditions  where it holds and where not: records of numbers, lists of numbers and names
    evidence    the rows that decide: each names its table, its key columns, and the column with its value
    coverage    how the numbers were got: sampled, searched, exhaustive, certified, timed, or law for what follows
                from a formula alone
    lacking     what would measure a claim that was not
    brief       the reason in at most 25 words; None where the first of `because` are
    """

    verdict: str
    because: str
    conditions: tuple[Record, ...] = ()
    evidence: tuple[Record, ...] = ()
    coverage: str = "sampled"
    lacking: str | None = None
    brief: str | None = None


class Besides(Protocol):
    """Changes a finding by rows of another kind than its rule reads."""

    @property
    def rule_text(self) -> str:
        """How, in words."""

    def __call__(self, finding: Finding, rows: Rows) -> Finding:
        """The finding afterwards."""


@dataclass(frozen=True)
class Claim:
    """One claim of the textbooks, and the rule that judges it.

    key     its letter
    title   the claim, in the textbook's words as far as its length allows
    source  who claims it
    rule    Rows -> Finding; its docstring is the rule in words, printed with every verdict. It raises LackingRowsError
            for a run without the rows it reads
    needs   what the rule reads: names of tables, or nothing where the verdict follows from a formula
    figure  name of the report's figure that shows it, or None
    besides what changes the finding afterwards, by rows of another kind; its `rule_text` is printed after the rule
    across  what the claim is about: `alphas`, `gammas`; it is judged by FEWEST of them, at least
    """

    key: str
    title: str
    source: Source
    rule: Callable[[Rows], Finding] = field(repr=False)
    needs: tuple[str, ...]
    figure: str | None = None
    besides: "Besides | None" = None
    across: tuple[str, ...] = ()

    @property
    def rule_text(self) -> str:
        """The rule in words, on one line."""
        rule = " ".join((inspect.getdoc(self.rule) or "").split())
        if self.across:
            about = " or ".join(_AXES[axis] for axis in self.across)
            rule += " Fails mostly if it would hold under conditions, but in fewer than half of the cases."
            rule += f" Not measured by fewer than {FEWEST} {about}."
        return f"{rule} {self.besides.rule_text}" if self.besides else rule

    def judge(self, rows: Rows) -> "Judgement":
        """The verdict on this claim; `not measured`, and what would measure it, where rows are missing."""
        try:
            found = self.rule(rows)
        except LackingRowsError as lacking:
            found = Finding(UNMEASURED, sentence(lacking.what), coverage="none", lacking=lacking.fix)
        return Judgement(self, self.besides(found, rows) if self.besides else found)


#: what a claim is about, and what measures more of it
_AXES = {"alphas": "exponents", "gammas": "gammas"}
_WIDER = {
    "alphas": "measure more: phongbench run without --alpha, or --alpha 5..1000",
    "gammas": "measure more: phongbench run without --gamma",
}


@dataclass(frozen=True)
class Judgement:
    """A claim with its verdict."""

    claim: Claim
    finding: Finding

    def over_enough(self, rows: Rows) -> "Judgement":
        """The judgement, without a verdict where the run has too few exponents or gammas for one."""
        for axis in self.claim.across if self.verdict != UNMEASURED else ():
            swept = len(getattr(rows, axis))
            if swept < FEWEST:
                few = f"{swept} {_AXES[axis]} are" if swept != 1 else f"1 {_AXES[axis].removesuffix('s')} is"
                what = sentence(f"{few} too few to judge this by", f"by what was measured it {self.verdict}")
                found = replace(
                    self.finding, verdict=UNMEASURED, because=f"{what} {self.because}", lacking=_WIDER[axis]
                )
                return replace(self, finding=replace(found, brief=what))
        return self

    @property
    def verdict(self) -> str:
        """One of VERDICTS."""
        return self.finding.verdict

    @property
    def because(self) -> str:
        """Why, in one sentence made of the numbers."""
        return self.finding.because

    @property
    def brief(self) -> str:
        """The same in few words."""
        return self.finding.brief or brief(self.because)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON: None for what is missing or not finite."""
        claim, found = self.claim, self.finding
        return {
            "key": claim.key,
            "claim": claim.title,
            "source": claim.source.citation,
            "verdict": found.verdict,
            "because": found.because,
            "brief": self.brief,
            "conditions": plain(found.conditions),
            "evidence": plain(found.evidence),
            "coverage": found.coverage,
            "rule": claim.rule_text,
            "figure": claim.figure,
            "needs": list(claim.needs),
            "lacking": found.lacking,
        }


def plain(value: Any) -> Any:
    """The same as dicts, lists and plain numbers that strict JSON holds."""
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    if hasattr(value, "item"):
        value = value.item()
    if value is pd.NA or (isinstance(value, float) and not math.isfinite(value)):
        return None
    return value


def grade(whole: object, some: object, share: float = 1.0) -> str:
    """The verdict on a claim that is met wholly, in some cases, or in none.

    share  of the cases in which it is met, where they can be counted
    """
    if whole:
        return HOLDS
    return FAILS if not some else CONDITIONS if share >= MOSTLY else FAILS_MOSTLY


def reach(good: list[float], measured: list[float]) -> Record:
    """Where something holds: the exponents at which it does, ascending, of those measured."""
    ends = (good[0], good[-1]) if good else (None, None)
    return {"alphas": good, "alpha_from": ends[0], "alpha_to": ends[1], "alphas_measured": len(measured)}
