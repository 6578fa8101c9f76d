"""Rows over HTTP: the same as pandas filters, sorts and slices."""

import io
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from phongbench_api.runs import row_query, table_columns
from phongbench_api.runs.table_cache import TableCache, column_kinds

RUN = "20260101-000000-0123abcd"
URL = f"/v1/runs/{RUN}/accuracy"


def expected(frame: pd.DataFrame, filters: dict[str, list[Any]], sort: list[str]) -> pd.DataFrame:
    for name, values in filters.items():
        kept = frame[name].isin(values)  # `none` is the name of a lambda form, too
        frame = frame[kept | frame[name].isna() if "none" in values else kept]
    for name in reversed(sort):
        frame = frame.sort_values(name.lstrip("-"), ascending=not name.startswith("-"), kind="stable")
    return frame


def words(values: list[Any]) -> list[str]:
    return [str(v).lower() if isinstance(v, bool) else str(v) for v in values]


FILTERS: dict[str, list[Any]] = {
    "approximation": ["phong", "lyon", "gaussian", "nobody"],
    "lambda_form": ["dot", "cross", "none"],
    "alpha": [10.0, 50.0, 51.0],
    "gamma": [4, 8, "none"],
    "gated": [True, False],
    "stratum": ["highlight", "hostile"],
    "truth": ["angle", "given"],
    "length_error": [0.0, 0.01],
}
ORDERS = st.sampled_from(["max_abs", "-max_abs", "approximation", "-alpha", "gamma"])


@settings(max_examples=60, deadline=None)
@given(
    st.dictionaries(st.sampled_from(sorted(FILTERS)), st.integers(1, 7), max_size=4),
    st.lists(
        st.sampled_from(["max_abs", "-max_abs", "approximation", "-alpha", "gamma"]),
        max_size=2,
        unique_by=lambda s: s.lstrip("-"),
    ),
)
def test_rows_are_those_that_pandas_finds(
    client: TestClient, accuracy: pd.DataFrame, picks: dict[str, int], sort: list[str]
) -> None:
    filters = {name: [v for i, v in enumerate(FILTERS[name]) if pick >> i & 1] for name, pick in picks.items()}
    filters = {name: values for name, values in filters.items() if values}
    query = [(name, word) for name, values in filters.items() for word in words(values)]
    answer = client.get(
        URL, params=[*query, ("sort", ",".join(sort)), ("limit", "40"), ("columns", "approximation,gamma,max_abs")]
    )
    assert answer.status_code == 200, answer.text
    told, frame = answer.json(), expected(accuracy, filters, sort)
    assert told["total"] == len(frame)
    cut = frame.head(40)
    assert [row["approximation"] for row in told["rows"]] == cut["approximation"].tolist()
    assert [row["gamma"] for row in told["rows"]] == [None if pd.isna(g) else g for g in cut["gamma"]]
    assert np.array_equal([float(row["max_abs"]) for row in told["rows"]], cut["max_abs"], equal_nan=True)


def test_pages_put_together_are_the_whole(client: TestClient, accuracy: pd.DataFrame) -> None:
    cursor, seen = None, []
    while True:
        query = {"approximation": "lyon", "sort": "-max_abs", "limit": "100", "columns": "max_abs"}
        told = client.get(URL, params=query | ({"cursor": cursor} if cursor else {})).json()
        seen += [float(row["max_abs"]) for row in told["rows"]]
        cursor = told["next"]
        if cursor is None:
            break
    whole = accuracy[accuracy["approximation"] == "lyon"]["max_abs"].sort_values(ascending=False)
    assert np.array_equal(seen, whole, equal_nan=True)


def test_a_cursor_belongs_to_its_question(client: TestClient) -> None:
    cursor = client.get(URL, params={"limit": 5, "sort": "max_abs"}).json()["next"]
    assert client.get(URL, params={"limit": 5, "sort": "max_abs", "cursor": cursor}).status_code == 200
    for other in ({"sort": "-max_abs"}, {"sort": "max_abs", "approximation": "lyon"}, {}):
        assert client.get(URL, params={"limit": 5, "cursor": cursor} | other).status_code == 422


@pytest.mark.parametrize("table", ["accuracy", "timing"])
def test_csv_and_parquet_hold_the_same_rows(client: TestClient, table: str) -> None:
    url = f"/v1/runs/{RUN}/{table}"
    query = {"approximation": "lyon", "limit": "20"}
    plain = client.get(url, params=query).json()
    csv = client.get(url, params=query, headers={"accept": "text/csv"})
    parquet = client.get(url, params=query, headers={"accept": "application/vnd.apache.parquet"})
    assert csv.headers["content-type"].startswith("text/csv")
    assert csv.headers["phongbench-total"] == str(plain["total"])
    read = pd.read_csv(io.StringIO(csv.text))
    stored = pq.read_table(io.BytesIO(parquet.content)).to_pylist()
    for name in ("approximation", "gamma", "precision"):
        told = [row[name] for row in plain["rows"]]
        assert read[name].tolist() == told
        assert [row[name] for row in stored] == told


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("limit=0", "limit"),
        ("limit=50001", "limit"),
        ("limit=-1", "limit"),
        ("limit=1e3", "limit"),
        ("limit=" + "9" * 400, "limit"),
        ("alpha=x", "alpha"),
        ("alpha=nan", "alpha"),
        ("gamma=8.5", "gamma"),
        ("gated=maybe", "gated"),
        ("sort=nothing", "sort"),
        ("sort=max_abs,max_abs", "sort"),
        ("columns=", "columns"),
        ("columns=max_abs,max_abs", "columns"),
        ("max_abs=1", "(unknown)"),
        ("limit=1&limit=2", "limit"),
        ("cursor=AAAA", "cursor"),
        ("cursor=%F0%9F%98%80", "cursor"),
        ("gamma=" + "9" * 400, "gamma"),
        ("&".join(["alpha=1"] * 65), "(query)"),
    ],
)
def test_a_wrong_parameter_is_named(client: TestClient, query: str, field: str) -> None:
    answer = client.get(f"{URL}?{query}")
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, field)


def test_a_table_that_the_run_does_not_have_is_404(client: TestClient) -> None:
    assert client.get(f"/v1/runs/{RUN}/meshes").status_code == 404


def test_columns_are_kept_within_their_bound(runs: Any) -> None:
    path = runs / RUN / "accuracy.parquet"
    kept = TableCache(20_000)
    names = list(column_kinds(path))
    for name in names * 2:
        assert kept.table(path, "same", [name]).num_rows == pq.read_metadata(path).num_rows
        assert kept.held <= 20_000
    assert set(row_query.KEYS["accuracy"]) <= set(names)


@pytest.mark.parametrize("accept", ["application/json", "text/csv", "image/png"])
def test_a_format_in_the_query_counts_before_accept(client: TestClient, accuracy: pd.DataFrame, accept: str) -> None:
    headers = {"accept": accept}
    csv = client.get(f"{URL}?format=csv&limit=3&columns=max_abs", headers=headers)
    assert csv.headers["content-type"].startswith("text/csv")
    assert pd.read_csv(io.BytesIO(csv.content))["max_abs"].tolist() == accuracy["max_abs"].head(3).tolist()
    parquet = client.get(f"{URL}?format=parquet&limit=3", headers=headers).content
    assert pq.read_table(io.BytesIO(parquet)).num_rows == 3
    assert len(client.get(f"{URL}?format=json&limit=3", headers=headers).json()["rows"]) == 3


@pytest.mark.parametrize("query", ["format=", "format=xml", "format=CSV", "format=csv&format=json"])
def test_a_format_that_there_is_not_is_refused(client: TestClient, query: str) -> None:
    answer = client.get(f"{URL}?{query}")
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "format")


@pytest.mark.parametrize("table", ["accuracy", "timing"])
def test_columns_are_described_with_the_values_that_filters_take(client: TestClient, runs: Any, table: str) -> None:
    told = client.get(f"/v1/runs/{RUN}/columns?table={table}").json()
    frame = pd.read_parquet(runs / RUN / f"{table}.parquet")
    assert told["rows"] == len(frame)
    assert [column["name"] for column in told["columns"]] == list(frame.columns)
    for column in told["columns"]:
        name, values = column["name"], column["values"]
        assert column["filter"] == (name in row_query.KEYS[table])
        assert column["key"] <= column["filter"]
        assert column["meaning"]
        distinct = frame[name].drop_duplicates()
        if values is None:
            assert not column["filter"] or len(distinct) > table_columns.FEW
            continue
        assert sorted(map(str, values)) == sorted("None" if pd.isna(v) else str(v) for v in distinct.tolist())
        words = ["none" if value is None else str(value).lower() for value in values]
        totals = [client.get(f"/v1/runs/{RUN}/{table}?{name}={word}&limit=1").json()["total"] for word in words]
        assert sum(totals) >= len(frame) > max(totals, default=0) or len(values) == 1


@pytest.mark.parametrize(
    ("query", "status"), [("table=worst", 404), ("table=no", 422), ("", 422), ("table=a&x=1", 422)]
)
def test_columns_of_no_table(client: TestClient, query: str, status: int) -> None:
    assert client.get(f"/v1/runs/{RUN}/columns?{query}").status_code == status


@pytest.mark.parametrize(
    ("run", "status"), [("latest", 200), (RUN, 200), ("20260101-000000-ffffffff", 404), ("..", 404)]
)
def test_the_page_of_rows_is_that_of_a_run(client: TestClient, run: str, status: int) -> None:
    answer = client.get(f"/runs/{run}/rows")
    assert answer.status_code == status
    assert ('id="rows"' in answer.text) == (status == 200)
