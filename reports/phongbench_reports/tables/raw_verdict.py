"""The answer for raw vectors: at each exponent the cheapest recipe from N, L and V of any length."""

from typing import Any

import pandas as pd

from phongbench.analysis.choice import Choice
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.raw_vectors import USUAL, cheapest, configurations, in_words, steps
from phongbench.analysis.rows import Rows, nearest
from phongbench.formulas.recipes import RECIPES
from phongbench.results.frames import with_raw
from phongbench.results.records import Records, Row
from phongbench_reports.figures.speed import SETS
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.by_target import ALPHAS
from phongbench_reports.text import INTERVAL, alpha_is, interval, label, number


def raw_verdict(study: Rows, precision: str, budget: float, name: str) -> Table | Absent:
    """For some swept exponents the cheapest recipe within the budget, and its gain on normalising everything.

    budget  largest absolute error allowed
    name    the budget in words, "1/255"
    """
    accuracy, timing = (Records.of(with_raw(study.raw(name))) for name in ("accuracy", "timing"))
    mine, timed = configurations(accuracy, precision), timing.at(precision=precision, recipe=tuple(RECIPES))
    if not (mine and timed):
        return Absent(f"No recipe from N, L and V was measured and timed in {precision}.", "Run the quick preset.")
    answers = {
        alpha: cheapest(mine, timing, Budget.of(alpha, budget, precision=precision, working_set="l1"), study.name)
        for alpha in sorted({nearest(mine.distinct("alpha"), wanted) for wanted in ALPHAS})
    }
    rows = tuple(_row(alpha, *answer, withheld=bool(study.twin_differs)) for alpha, answer in answers.items())
    data = pd.DataFrame([_data(alpha, *answer) for alpha, answer in answers.items()])
    cost = in_words(steps(timing, precision=precision))
    source = f"{precision}, vectors {SETS['l1']}; N, L and V of lengths from 0.001 to 1000, all incidences and azimuths"
    source = f"{source}; errors: proven bounds; each step, beyond a power of the cosine of unit vectors: {cost}"
    headings = ("α", "recipe", "at most, 8-bit codes", "ns / element", f"faster than {USUAL}", INTERVAL)
    return Table(headings, rows, data, _sentence(data, name), source, frozenset({0, 2, 3, 4, 5}))


def _gain(best: Row, usual: Row | None) -> tuple[float, float, float] | None:
    """How many times faster than the usual recipe, with an interval that holds whatever both intervals leave open."""
    if usual is None:
        return None
    low, high = usual["ratio_low"] / best["ratio_high"], usual["ratio_high"] / best["ratio_low"]
    return usual["ratio"] / best["ratio"], low, high


def _row(alpha: float, choice: Choice, usual: Row | None, *, withheld: bool) -> tuple[str, ...]:
    best = choice.best
    if best is None:
        return f"{alpha:g}", "nothing fits", "–", "–", "–", "–"
    gain = None if withheld else _gain(best, usual)
    shown = ("–", "–") if gain is None else (f"{number(gain[0])} ×", interval(*gain[1:]))
    return f"{alpha:g}", label(pd.Series(best)), number(255 * float(best["bound"])), number(best["ns"]), *shown


def _data(alpha: float, choice: Choice, usual: Row | None) -> dict[str, Any]:
    best = choice.best
    gain = None if best is None else _gain(best, usual)
    named = dict(zip(("gain", "gain_low", "gain_high"), gain or (None, None, None), strict=True))
    wanted = ("bound", "coverage", "ns", "ratio", "ratio_low", "ratio_high")
    return (
        {"alpha": alpha, "recipe": None if best is None else label(pd.Series(best))}
        | {key: None if best is None else best[key] for key in wanted}
        | named
    )


def _sentence(data: pd.DataFrame, name: str) -> str:
    known = data.dropna(subset=["gain"])
    if known.empty:
        return f"From raw vectors nothing that was timed is within {name}."
    best = known.sort_values(["gain", "alpha"], kind="stable").iloc[-1]
    where = f"{best['recipe']} at {alpha_is(best['alpha'])}"
    return f"Within {name}, the largest gain on normalising everything is {number(best['gain'])} times: {where}."
