"""A claim on speed on the targets that are compiled for: what costs less there, by the costs that a run keeps."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from phongbench.analysis.claims.claim import CONDITIONS, FAILS, HOLDS, UNMEASURED, Finding, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.quiet_times import FASTER
from phongbench.analysis.claims.words import listed, sentence
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.formula import Formula


@dataclass(frozen=True)
class OnTargets:
    """Judges a claim on compiled targets, too, after it was judged by times.

    pairs   spellings of the formula that should cost less and of the one that it should cost less than
    beside  pairs that are told with them and decide nothing
    """

    pairs: tuple[tuple[str, str], ...]
    beside: tuple[tuple[str, str], ...] = ()

    @property
    def rule_text(self) -> str:
        """The rule in words."""
        pairs = listed(f"{one} at most {FASTER:g} of {other}" for one, other in self.pairs)
        return (
            f"Besides, on every compiled target, by counts of machine code, the dot product included: {pairs}. What "
            "times leave open is graded by these counts alone; a claim that by its times holds, or fails, but not on "
            "every target holds under conditions."
        )

    def __call__(self, finding: Finding, rows: Rows) -> Finding:
        """The finding with what the costs say; as it is where the run keeps no costs of the pairs."""
        costs = rows.raw("costs")
        decisive = [record for pair in self.pairs for record in _records(costs, *pair)]
        if not decisive:
            return finding
        counted = decisive + [record for pair in self.beside for record in _records(costs, *pair)]
        cheaper = [record["cheaper"] for record in decisive]
        alone = finding.verdict == UNMEASURED
        shown = evidence("costs", "ratio", _rows_of(costs, (*self.pairs, *self.beside)))
        return replace(
            finding,
            verdict=grade(all(cheaper), any(cheaper)) if alone else _joined(finding.verdict, cheaper),
            because=f"{finding.because} {_told(counted)}",
            conditions=(*finding.conditions, *counted),
            evidence=(*finding.evidence, *shown),
            coverage="counted" if alone and not finding.evidence else f"{finding.coverage}, counted",
            lacking=None if alone else finding.lacking,
        )


def _joined(timed: str, cheaper: Sequence[bool]) -> str:
    """The verdict of both: by times, and on each target."""
    if timed == HOLDS:
        return HOLDS if all(cheaper) else CONDITIONS
    if timed == FAILS:
        return CONDITIONS if any(cheaper) else FAILS
    return timed


def _of(costs: pd.DataFrame, spelling: str) -> pd.DataFrame:
    """The formula's rows on compiled targets in a shader that does nothing else, one a target, whatever its slope."""
    f = Formula.parse(spelling)
    named = {"approximation": f.approximation, "lambda_form": f.lambda_form, "space": f.space}
    rows = at(costs, cost_kind="compiled", context=0, recipe=f.recipe, normalise=f.normalise, **named)
    rows = rows[rows["gamma"].isna()] if f.gamma is None else at(rows, gamma=f.gamma)
    return rows.drop_duplicates("target")


def _rows_of(costs: pd.DataFrame, pairs: Iterable[tuple[str, str]]) -> pd.DataFrame:
    names = dict.fromkeys(name for pair in pairs for name in pair)
    return pd.concat([_of(costs, name) for name in names], ignore_index=True)


def _records(costs: pd.DataFrame, one: str, other: str) -> list[Record]:
    """The cost of one over that of the other on each target that has both."""
    mine, theirs = (_of(costs, name).set_index("target")["ratio"] for name in (one, other))
    both: Any = (mine / theirs).dropna()
    return [
        {
            "target": str(target),
            "formula": one,
            "against": other,
            "ratio": float(ratio),
            "cheaper": bool(ratio <= FASTER),
        }
        for target, ratio in both.items()
    ]


def _told(counted: Sequence[Record]) -> str:
    """For each pair, on which targets it costs less and on which not, as a sentence."""
    parts = []
    for one, other in dict.fromkeys((record["formula"], record["against"]) for record in counted):
        mine = [record for record in counted if (record["formula"], record["against"]) == (one, other)]
        less, more = ([r for r in mine if r["cheaper"] is kind] for kind in (True, False))
        rest = f", not on {_where(more)}" if more else ""
        where = f"{_where(less)}{rest}" if less else f"none of {_where(more)}"
        parts.append(f"{one} costs at least {100 * (1 - FASTER):.0f} % less than {other} on {where}")
    return sentence("counted in machine code in float32, " + "; ".join(parts))


def _where(records: Sequence[Record]) -> str:
    """Targets with the range of their ratios: "gcn4 and gcn5 (0.667)"."""
    ratios = sorted(float(record["ratio"]) for record in records)
    ends = list(dict.fromkeys(f"{ratio:.3g}" for ratio in (ratios[0], ratios[-1])))
    return f"{listed(record['target'] for record in records)} ({' .. '.join(ends)} of it)"
