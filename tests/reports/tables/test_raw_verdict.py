"""The answer for raw vectors: what fits by promise, and what it gains on normalising everything."""

from raw_runs import MadeUp

from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.raw_verdict import raw_verdict

RECIPES = {
    "phong@reflect/each": (1e-5, 3.0),
    "phong@lengthwise/once": (1e-5, 2.0),
    "lyon:cross:32:minimax@lengthwise/once": (0.0048, 1.5),
    "blinn:minimax@halfway/once": (0.0001, 0.5),
}


def table(recipes=RECIPES, budget=1 / 255):
    return raw_verdict(Rows(MadeUp(recipes)), "float32", budget, "the budget")


def test_the_cheapest_promise_is_named_with_its_gain() -> None:
    shown = table()
    assert isinstance(shown, Table)
    (row,) = shown.rows
    assert row[:2] == ("50", "phong@lengthwise/once")
    assert row[4] == "1.50 ×"
    assert shown.data.loc[0, "gain_low"] < 1.5 < shown.data.loc[0, "gain_high"]
    assert "1.50 times: phong@lengthwise/once" in shown.takeaway
    assert table(budget=0.005).rows[0][1] == "lyon:cross:32:minimax@lengthwise/once"


def test_what_only_samples_vouch_for_never_fits() -> None:
    only = table({name: RECIPES[name] for name in ("phong@reflect/each", "blinn:minimax@halfway/once")})
    assert only.rows[0][1] == "phong@reflect/each"
    assert table(budget=1e-9).rows[0][1:] == ("nothing fits", "–", "–", "–", "–")


def test_a_run_without_recipes_says_how_to_get_them() -> None:
    assert isinstance(table({}), Absent)
