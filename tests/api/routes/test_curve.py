"""GET /v1/curve: the library's curve as numbers, table and picture."""

import csv
import io
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from starlette.testclient import TestClient

from phongbench.formulas.curves import curve
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Setting

CURVE = "/v1/curve?approximation=lyon&lambda=cross&gamma=8&alpha=50"
COLUMNS = ["angle_degrees", "value", "exact", "error"]


@pytest.mark.parametrize("name", REGISTRY)
def test_a_curve_is_the_librarys(client: TestClient, name: str) -> None:
    spec, setting = REGISTRY[name], example(REGISTRY[name])
    query = {"approximation": name, "alpha": setting.alpha, "points": 91} | (
        {"gamma": setting.gamma} if setting.gamma else {}
    )
    answer = client.get("/v1/curve", params=query).json()
    told = {key: np.array(answer[key]) for key in COLUMNS}
    cosine = np.cos(np.radians(np.linspace(0, 90, 91)))
    assert np.allclose(told["angle_degrees"], np.arange(91))
    assert np.array_equal(told["value"], curve(spec, spec.lambda_forms[0], setting, cosine))
    assert np.allclose(told["exact"], np.maximum(cosine, 0) ** setting.alpha, rtol=1e-9, atol=1e-15)
    assert np.array_equal(told["error"], told["value"] - told["exact"])
    assert answer["max_abs_error"] == np.abs(told["error"]).max() == abs(told["error"][answer["worst_index"]])
    if answer["cutoff_degrees"] is not None:
        assert not told["value"][told["angle_degrees"] > answer["cutoff_degrees"]].any()


def test_wrong_lengths_and_low_precision_are_heard(client: TestClient) -> None:
    right = client.get(f"{CURVE}&precision=float32").json()
    long = client.get(f"{CURVE}&precision=float32&length_error=0.05&perturbation=a&lambda=dot").json()
    half = client.get(f"{CURVE}&precision=float16").json()
    assert long["value"][0] > 1 >= right["value"][0]
    assert long["exact"] == pytest.approx(right["exact"], abs=1e-5)
    assert half["max_abs_error"] != right["max_abs_error"]
    assert half["value"] == np.array(half["value"]).astype(np.float16).astype(float).tolist()


def test_beta_and_space_are_heard(client: TestClient) -> None:
    taylor, minimax = (client.get(f"{CURVE}&beta={policy}").json()["value"] for policy in ("taylor", "minimax"))
    assert taylor != minimax
    half = client.get(f"{CURVE}&space=half&points=10").json()["value"]
    cosine = np.cos(np.radians(np.linspace(0, 90, 10)))
    assert np.array_equal(half, curve(REGISTRY["lyon"], "cross", Setting(50.0, 8, "taylor", "half"), cosine))


def test_csv_holds_the_same_numbers(client: TestClient) -> None:
    told = client.get(CURVE).json()
    table = list(csv.reader(io.StringIO(client.get(CURVE, headers={"accept": "text/csv"}).text)))
    assert table[0] == COLUMNS
    assert [[float(cell) for cell in row] for row in table[1:]] == [
        list(row) for row in zip(*(told[name] for name in COLUMNS), strict=True)
    ]


def test_the_picture_is_an_svg_that_names_the_formula_and_is_the_same_each_time(client: TestClient) -> None:
    first, again = (client.get(CURVE, headers={"accept": "image/svg+xml"}) for _ in range(2))
    assert first.headers["content-type"] == "image/svg+xml"
    assert first.content == again.content
    root = ET.fromstring(first.content)
    words = " ".join(text for element in root.iter() if (text := element.text) and text.strip())
    assert "lyon:cross:8" in words
    assert not [element for element in root.iter() if element.tag.endswith("script")]


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("points=1", "points"),
        ("points=10001", "points"),
        ("degrees=0", "degrees"),
        ("degrees=181", "degrees"),
        ("space=side", "space"),
    ],
)
def test_bounds_are_kept(client: TestClient, query: str, field: str) -> None:
    answer = client.get(f"{CURVE}&{query}")
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, field)
