"""What leaving normalising out saves: times of formulas on raw vectors beside those that remove lengths first.

Ratios are of two timed kernels over exact Phong in the same run. Their quotient's interval reaches from the least to
the largest value that both intervals allow, so it is at least as sure as either.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import pandas as pd

from phongbench.analysis.rows import Rows
from phongbench.compiler.lowering import FLOAT32
from phongbench.formulas.formula import Formula
from phongbench.results.schema import BASELINE, DISTANT
from phongbench.timing.statistics import Interval, verdict

PLACES = ("l1", "l2", "memory")
#: how users call what was timed; other targets have no rows of recipes yet
TARGET = "cpu"
#: what a shader holds -> a form that leaves lengths in, and exact Phong with one root for both
FROM_PAIR = ("lyon:cross:8", "phong/once")
FROM_N_L_V = ("lyon:cross:8@lengthwise", "phong@lengthwise/once")
#: Lyon's own way of removing lengths, one division and no root, beside the same
DIVIDED = ("lyon:cross:8/once", "phong/once")
QUESTION = "Is the cross form without normalising faster than exact Phong with one root?"
_ASKED = {"given R and V": FROM_PAIR, "from N, L and V": FROM_N_L_V, "dividing by both lengths squared": DIVIDED}
#: what tells timed kernels of one precision and place apart
Key = tuple[str, str, str, int | None, str, str]


@dataclass(frozen=True)
class Race:
    """The time of one formula over that of another.

    one, other           spellings
    ratio                time of one / time of the other, with the interval low .. high
    verdict              "faster" where one surely is, "slower", or "unresolved"
    ns, other_ns         least nanoseconds of each
    target, precision, working_set   where
    """

    one: str
    other: str
    target: str
    precision: str
    working_set: str
    ratio: float
    ratio_low: float
    ratio_high: float
    verdict: str
    ns: float
    other_ns: float

    def as_dict(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


def races(rows: Rows, pairs: Iterable[tuple[str, str]], precision: str | None = None) -> list[Race]:
    """Each pair of spellings in each working set in which both were timed; in order of the pairs, then of the places.

    precision  the rows' own by default
    Where identical code differed in time, nothing is settled: every verdict of that working set is "unresolved".
    """
    precision = precision or rows.precision
    times = rows.raw_times
    by_key = {(*_key(row), str(row["working_set"])): row for row in _records(times[times["precision"] == precision])}
    found = []
    for one, other in pairs:
        keys = [_of(spelling) for spelling in (one, other)]
        for place in PLACES:
            mine, theirs = (by_key.get((*key, place)) for key in keys)
            if mine is not None and theirs is not None:
                sure = place not in rows.twin_differs
                found.append(_race((one, mine), (other, theirs), precision, place, sure=sure))
    return found


def timing_rows(rows: Rows, raced: Sequence[Race]) -> pd.DataFrame:
    """The timing rows that these races were made of, in the order of the table."""
    times = rows.raw_times
    run = {(*_of(name), race.precision, race.working_set) for race in raced for name in (race.one, race.other)}
    mine = [(*_key(row), str(row["precision"]), str(row["working_set"])) in run for row in _records(times)]
    kept: pd.DataFrame = times[mine] if len(times) else times
    return kept


def answer(rows: Rows) -> dict[str, Any]:
    """Is cross without normalising faster than exact with one root? Per working set, in float32, on the timed target.

    returns  question, precision, target, `sentence`, and `races`: one record for each way and working set, with `way`
             ("given R and V", "from N, L and V", or Lyon's division) and the fields of Race
    """
    told = {way: races(rows, [pair], FLOAT32.name) for way, pair in _ASKED.items()}
    parts = [f"{way}, {_settled(mine)}: {in_words(mine)}" for way, mine in told.items() if mine]
    return {
        "question": QUESTION,
        "precision": FLOAT32.name,
        "target": TARGET,
        "sentence": f"On the {TARGET}, in {FLOAT32.name}: {'; '.join(parts)}." if parts else "This was not timed.",
        "races": [{"way": way, **race.as_dict()} for way, mine in told.items() for race in mine],
    }


def in_words(raced: Sequence[Race]) -> str:
    """Races of the same two formulas, at least one: "lyon:cross:8 takes 0.41 (0.4 .. 0.42) of phong/once's time in l1"
    and so on.
    """
    times = [f"{race.ratio:.3g} ({race.ratio_low:.3g} .. {race.ratio_high:.3g})" for race in raced]
    (first, *rest), (place, *further) = times, [race.working_set for race in raced]
    more = "".join(f", {ratio} in {where}" for ratio, where in zip(rest, further, strict=True))
    return f"{raced[0].one} takes {first} of {raced[0].other}'s time in {place}{more}"


def _settled(raced: Sequence[Race]) -> str:
    """ "yes in l1 and l2, not settled in memory"."""
    said = {"faster": "yes", "slower": "no", "unresolved": "not settled"}
    places = {word: [race.working_set for race in raced if race.verdict == word] for word in said}
    return ", ".join(f"{said[word]} in {' and '.join(there)}" for word, there in places.items() if there)


def _race(one: tuple[str, Any], other: tuple[str, Any], precision: str, place: str, *, sure: bool) -> Race:
    (mine, row), (theirs, rival) = one, other
    # the baseline's own ratio is 1 by definition; what its row tells as interval is that of nothing
    own, against = (_interval(r) for r in (row, rival))
    quotient = Interval(own.middle / against.middle, own.low / against.high, own.high / against.low)
    settled = verdict(quotient) if sure else "unresolved"
    ends = (quotient.middle, quotient.low, quotient.high)
    return Race(mine, theirs, TARGET, precision, place, *ends, settled, float(row["ns_min"]), float(rival["ns_min"]))


def _interval(row: Any) -> Interval:
    if _key(row) == _of(BASELINE):
        return Interval(1.0, 1.0, 1.0)
    return Interval(float(row["ratio"]), float(row["ratio_low"]), float(row["ratio_high"]))


def _of(spelling: str) -> Key:
    far = DISTANT * spelling.startswith(DISTANT)
    f = Formula.parse(spelling.removeprefix(DISTANT))
    return far + f.approximation, f.lambda_form, f.space, f.gamma, f.recipe, f.normalise


def _key(row: Any) -> Key:
    gamma = None if pd.isna(row["gamma"]) else int(row["gamma"])
    name, form, space, recipe, way = (
        str(row[column]) for column in ("approximation", "lambda_form", "space", "recipe", "normalise")
    )
    return name, form, space, gamma, recipe, way


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]
