"""The page of a run's rows shows what the service's rows are."""

import io
from collections.abc import Callable
from typing import Any

import pandas as pd
import pytest

Visits = Callable[..., Any]
PAGE = "/runs/latest/rows"


@pytest.fixture
def table(visit: Visits, server: str) -> Callable[..., Any]:
    """A factory of visits, by the address's hash."""
    return lambda state="", **options: visit(f"{server}{PAGE}{state}", **options)


def column(seen: Any, name: str) -> list[str]:
    """The values shown of a column."""
    heads = [text.split(" ")[0] for text in seen.page.locator("#rows th").all_inner_texts()]
    return list(seen.page.locator(f"#rows td:nth-child({heads.index(name) + 1})").all_inner_texts())


def tick(seen: Any, name: str, *values: str) -> None:
    """Choose values of a filter, by keyboard and pointer as they come."""
    seen.page.locator("#filters summary").filter(has_text=f"{name}:").click()
    for value in values:
        seen.page.locator("details[open]").get_by_label(value, exact=True).check()
    seen.idle()


def stored(seen: Any, server: str, query: str) -> pd.DataFrame:
    return pd.read_csv(io.BytesIO(seen.page.request.get(f"{server}/v1/runs/latest/accuracy?{query}&format=csv").body()))


def test_filters_leave_the_rows_that_fit(table: Any, server: str) -> None:
    seen = table()
    whole = seen.page.request.get(f"{server}/v1/runs/latest/accuracy?limit=1").json()["total"]
    assert seen.page.locator("#count").inner_text() == f"{whole:,} of {whole:,} rows"
    tick(seen, "approximation", "lyon", "gaussian")
    tick(seen, "alpha", "50")
    assert set(column(seen, "approximation")) <= {"lyon", "gaussian"}
    rows = stored(seen, server, "limit=50000&approximation=lyon&approximation=gaussian&alpha=50")
    assert seen.page.locator("#count").inner_text().startswith(f"{len(rows):,} of")
    assert "alpha: 50" in seen.page.locator("#filters").inner_text()
    heads = seen.page.locator("#rows th").all_inner_texts()
    assert "alpha" not in heads, "a column of one value is no news"
    assert "max_abs" in heads
    again = table(seen.page.url.partition("rows")[2])
    assert again.page.locator("#rows tbody").inner_text() == seen.page.locator("#rows tbody").inner_text()


def test_what_is_missing_can_be_filtered_by(table: Any) -> None:
    seen = table("#gamma=none")
    assert "lyon" not in column(seen, "approximation")
    assert {"phong", "gaussian"} & set(column(seen, "approximation"))


def test_a_head_sorts_upwards_downwards_and_no_more(table: Any, server: str) -> None:
    seen = table("#approximation=lyon&limit=25&columns=stratum,max_abs")
    rows = stored(seen, server, "approximation=lyon&limit=25&sort=-max_abs&columns=max_abs")
    head = lambda: seen.page.locator("#rows th").nth(1)  # noqa: E731
    plain = column(seen, "max_abs")
    for order in ("ascending", "descending"):
        head().locator("button").click()
        seen.idle()
        assert head().get_attribute("aria-sort") == order
    titles = [float(cell.get_attribute("title")) for cell in seen.page.locator("#rows td:nth-child(2)").all()]
    assert titles == pytest.approx(rows["max_abs"].tolist(), rel=1e-12)
    head().locator("button").click()
    seen.idle()
    assert column(seen, "max_abs") == plain


def test_pages_are_turned_over_and_back(table: Any) -> None:
    seen = table("#approximation=lyon&sort=max_abs")
    first = seen.page.locator("#rows tbody").inner_text()
    assert seen.page.locator("#page").inner_text() == "1 to 25"
    assert seen.page.locator("#previous").is_disabled()
    pages = [first]
    for _ in range(2):
        seen.page.locator("#next").click()
        seen.idle()
        pages.append(seen.page.locator("#rows tbody").inner_text())
    assert seen.page.locator("#page").inner_text() == "51 to 75"
    assert len(set(pages)) == 3
    seen.page.locator("#previous").click()
    seen.idle()
    assert seen.page.locator("#rows tbody").inner_text() == pages[1]
    seen.page.locator("#first").click()
    seen.idle()
    assert seen.page.locator("#rows tbody").inner_text() == first


@pytest.mark.parametrize(("link", "read"), [("#csv", pd.read_csv), ("#parquet", pd.read_parquet)])
def test_links_give_every_row_that_fits(table: Any, server: str, link: str, read: Any) -> None:
    seen = table("#table=timing&approximation=lyon&columns=gamma,ratio&sort=ratio&limit=25")
    address = seen.page.locator(link).get_attribute("href")
    rows = read(io.BytesIO(seen.page.request.get(server + address).body()))
    assert list(rows.columns) == ["gamma", "ratio"]
    assert f"{len(rows)} of" in seen.page.locator("#count").inner_text()
    assert rows["ratio"].is_monotonic_increasing
    assert seen.page.locator(link).get_attribute("download").endswith(link.replace("#", "."))


def test_another_table_is_another_question(table: Any) -> None:
    seen = table("#approximation=lyon&sort=max_abs")
    seen.page.select_option("#table", "timing")
    seen.idle()
    assert {"ratio", "ns_min"} <= set(seen.page.locator("#rows th").all_inner_texts())
    assert "table=timing" in seen.page.url
    assert "lyon" not in seen.page.url
    assert seen.page.locator("#dictionary").get_attribute("href") == "/guide/columns.md#timing"


@pytest.mark.parametrize("state", ["#sort=nothing", "#columns=nothing", "#nothing=1", "#limit=x", "#alpha=fifty"])
def test_a_question_that_the_service_refuses_is_told(table: Any, state: str) -> None:
    seen = table(state)
    assert seen.page.locator("#problem").is_visible()
    assert seen.page.locator("#rows table").count() == 0
    seen.refused()


@pytest.mark.parametrize("state", ["#table=nothing", "#__proto__=x&table=timing", "#=&&%", "#toString=1&sort=ratio"])
def test_an_odd_address_breaks_nothing(table: Any, state: str) -> None:
    seen = table(state)
    assert seen.page.locator("#rows table, #problem b").count() == 1
    seen.errors[:] = [error for error in seen.errors if "status of 422" not in error]


def test_a_run_that_is_not_there_has_no_page(server: str, visit: Visits) -> None:
    seen = visit(f"{server}{PAGE}")
    assert seen.page.request.get(f"{server}/runs/20260101-000000-ffffffff/rows").status == 404


def test_a_list_of_values_is_left_by_escape_or_a_click_elsewhere(table: Any) -> None:
    page = table().page
    alpha = page.locator("#filters summary").filter(has_text="alpha:")
    for leave in (lambda: page.keyboard.press("Escape"), lambda: page.locator("#title").click()):
        alpha.click()
        assert page.locator(".filter[open] input").first.is_visible()
        leave()
        assert page.locator(".filter[open]").count() == 0
    page.locator("#filters summary").first.focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    assert page.locator(".filter input:checked").count() >= 1
    page.keyboard.press("Escape")
    assert page.evaluate("() => document.activeElement.tagName") == "SUMMARY"
