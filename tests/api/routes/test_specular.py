"""POST /v1/specular: the same values as the library's, in every form, and 4xx for everything else."""

import io
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from phongbench.compiler.lowering import PRECISIONS
from phongbench.formulas.kernel import highlights
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Setting
from phongbench_api.http import arrays, media
from phongbench_api.work import evaluation

QUERY = {"approximation": "lyon", "lambda": "cross", "gamma": "8", "alpha": "50"}


def directions(n: int, seed: int = 1) -> np.ndarray:
    draw = np.random.default_rng(seed).normal(size=(2, n, 3))
    draw[1] = draw[0] + 0.3 * draw[1]
    return draw / np.linalg.norm(draw, axis=2, keepdims=True)


def body_of(spec: Any, pairs: np.ndarray, **more: Any) -> dict[str, Any]:
    setting = example(spec)
    body = {"approximation": spec.name, "alpha": setting.alpha, "a": pairs[0].tolist(), "b": pairs[1].tolist()}
    return body | ({"gamma": setting.gamma} if setting.gamma else {}) | more


@pytest.mark.parametrize("spec", REGISTRY.values(), ids=REGISTRY)
def test_every_formula_answers_what_the_library_computes(client: TestClient, spec: Any) -> None:
    pairs = directions(50)
    answer = client.post("/v1/specular", json=body_of(spec, pairs, compare=True))
    assert answer.status_code == 200, answer.text
    form, setting = spec.lambda_forms[0], example(spec)
    expected = highlights(spec, form, setting, *pairs, layout="aos")
    told = answer.json()
    assert np.array_equal(np.float32(told["values"]), expected)
    exact = np.maximum(0, np.einsum("ij,ij->i", *pairs)) ** setting.alpha
    if setting.space == "reflect":
        assert np.allclose(told["exact"], exact, atol=1e-12)
    error = np.abs(expected - np.array(told["exact"]))
    assert told["max_abs_error"] == error.max() == error[told["worst_index"]]


def test_half_space_is_compared_with_phong_at_twice_the_angle(client: TestClient) -> None:
    half = np.radians(10.0)
    body = {
        "approximation": "lyon",
        "gamma": 8,
        "alpha": 50,
        "space": "half",
        "compare": True,
        "a": [[0, 0, 1]],
        "b": [[np.sin(half), 0, np.cos(half)]],
    }
    assert client.post("/v1/specular", json=body).json()["exact"] == [pytest.approx(np.cos(2 * half) ** 50)]


@pytest.mark.parametrize("dtype", ["f4", "f8"])
@pytest.mark.parametrize("n", [0, 1, 1000, 3 * evaluation.TILE + 5])
def test_octets_npy_and_json_agree_bit_for_bit(client: TestClient, dtype: str, n: int) -> None:
    pairs = directions(n).astype(arrays.DTYPES[dtype])
    query = QUERY | {"precision": {"f4": "float32", "f8": "float64"}[dtype], "dtype": dtype}
    raw = client.post("/v1/specular", params=query, content=pairs.tobytes(), headers={"content-type": media.OCTETS})
    assert raw.status_code == 200, raw.text
    assert raw.headers["content-type"] == media.OCTETS
    assert raw.headers["phongbench-dtype"] == dtype
    values = np.frombuffer(raw.content, arrays.DTYPES[dtype])
    setting = Setting(50.0, 8, "taylor")
    precision = PRECISIONS[query["precision"]]
    assert np.array_equal(
        values, highlights(REGISTRY["lyon"], "cross", setting, *pairs, precision=precision, layout="aos")
    )
    file = io.BytesIO()
    np.save(file, pairs)
    npy = client.post("/v1/specular", params=query, content=file.getvalue(), headers={"content-type": media.NPY})
    assert np.array_equal(np.load(io.BytesIO(npy.content)), values)
    asked = {"content-type": media.OCTETS, "accept": media.JSON}
    told = client.post("/v1/specular", params=query, content=pairs.tobytes(), headers=asked)
    assert np.array_equal(np.array(told.json()["values"], arrays.DTYPES[dtype]), values)


def test_all_that_is_left_out_is_the_formulas_own_default(client: TestClient) -> None:
    pairs = directions(20)
    spec = REGISTRY["lyon"]
    short = client.post("/v1/specular", json=body_of(spec, pairs)).json()
    more = {"lambda": spec.lambda_forms[0], "beta": spec.slopes[0], "space": spec.spaces[0], "precision": "float32"}
    assert client.post("/v1/specular", json=body_of(spec, pairs, **more)).json() == short


@pytest.mark.parametrize(
    ("spelling", "parts"),
    [
        ("lyon:cross:8", {"approximation": "lyon", "lambda": "cross", "gamma": 8}),
        ("lyon:dot:16:minimax", {"approximation": "lyon", "lambda": "dot", "gamma": 16, "beta": "minimax"}),
        ("lyon:cross:8@half", {"approximation": "lyon", "lambda": "cross", "gamma": 8, "space": "half"}),
    ],
)
def test_a_spelling_is_its_parts(client: TestClient, spelling: str, parts: dict[str, Any]) -> None:
    pairs = directions(30)
    body = {"alpha": 50, "a": pairs[0].tolist(), "b": pairs[1].tolist()}
    by_parts, by_spelling = (client.post("/v1/specular", json=body | how) for how in (parts, {"formula": spelling}))
    assert by_spelling.status_code == 200, by_spelling.text
    assert by_spelling.json() == by_parts.json()
    octets = pairs.astype("<f4").tobytes()
    query, kind = {"formula": spelling, "alpha": "50"}, {"content-type": media.OCTETS, "accept": media.JSON}
    assert client.post("/v1/specular", params=query, content=octets, headers=kind).json() == by_parts.json()


def test_a_slope_may_be_a_number_and_needs_no_loop_of_its_own(client: TestClient) -> None:
    from phongbench.compiler import jit

    pairs = directions(30)
    body = {"alpha": 50, "a": pairs[0].tolist(), "b": pairs[1].tolist()}
    own, given, flat = (body | {"formula": f"lyon:cross:8{slope}"} for slope in ("", ":6.25", ":5.5"))
    values = client.post("/v1/specular", json=given).json()
    assert values == client.post("/v1/specular", json=own).json()
    with jit.compilations() as compiled:
        assert client.post("/v1/specular", json=flat).json() != values
    assert compiled == []


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"formula": "nobodys:8"}, "formula"),
        ({"formula": "lyon:8"}, "formula"),
        ({"formula": "lyon:cross:7"}, "formula"),
        ({"formula": "lyon:cross:8:taylor:surplus"}, "formula"),
        ({"formula": "lyon:cross:8:nan"}, "formula"),
        ({"formula": "lyon:cross:8", "gamma": 8}, "formula"),
        ({"formula": "lyon:" * 20}, "formula"),
        ({"formula": 8}, "formula"),
        ({}, "approximation"),
        ({"formula": "gaussian:dot", "alpha": -1}, "alpha"),
    ],
)
def test_what_is_wrong_with_a_spelling_is_named_and_not_repeated(
    client: TestClient, change: dict[str, Any], field: str
) -> None:
    answer = client.post("/v1/specular", json={"alpha": 50, "a": [[0, 0, 1]], "b": [[0, 0, 1]]} | change)
    assert answer.status_code == 422, answer.text
    assert [error["field"] for error in answer.json()["errors"]] == [field]
    assert "nobodys" not in answer.text
    assert "surplus" not in answer.text


def test_values_that_are_not_finite_travel_as_words(client: TestClient) -> None:
    huge = [[3e38, 3e38, 3e38]]
    body = {"approximation": "phong", "alpha": 1, "a": huge, "b": huge}
    assert client.post("/v1/specular", json=body).json()["values"] == ["Infinity"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"approximation": "nobodys"}, "approximation"),
        ({"lambda": "sine"}, "lambda"),
        ({"lambda": "none"}, "lambda"),
        ({"gamma": 7}, "gamma"),
        ({"gamma": "8"}, "gamma"),
        ({"gamma": None}, "gamma"),
        ({"alpha": -1}, "alpha"),
        ({"alpha": 5e-4}, "alpha"),
        ({"alpha": 0, "beta": "minimax"}, "alpha"),
        ({"alpha": 0}, None),
        ({"alpha": 1e9}, "alpha"),
        ({"alpha": "50"}, "alpha"),
        ({"alpha": 5}, None),
        ({"beta": "steep"}, "beta"),
        ({"beta": "matched"}, "beta"),
        ({"space": "outer"}, "space"),
        ({"precision": "float8"}, "precision"),
        ({"compare": "yes"}, "compare"),
        ({"surprise": 1}, "(unknown)"),
        ({"a": 1}, "a"),
        ({"b": [[0, 0, 1]] * 3}, "b"),
    ],
)
def test_what_is_wrong_is_named(client: TestClient, change: dict[str, Any], field: str | None) -> None:
    answer = client.post("/v1/specular", json=body_of(REGISTRY["lyon"], directions(2)) | change)
    if field is None:
        assert answer.status_code == 200
        return
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_a_formula_without_gamma_takes_none(client: TestClient) -> None:
    answer = client.post("/v1/specular", json=body_of(REGISTRY["gaussian"], directions(2), gamma=8))
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "gamma")


@pytest.mark.parametrize("index", [0, 1, evaluation.TILE, 2 * evaluation.TILE + 3])
@pytest.mark.parametrize("which", [0, 1])
def test_the_first_vector_that_is_not_finite_is_named(client: TestClient, index: int, which: int) -> None:
    pairs = directions(2 * evaluation.TILE + 10).astype("<f4")
    pairs[which, index, 2] = np.nan
    pairs[which, index + 5, 1] = np.inf
    answer = client.post("/v1/specular", params=QUERY, content=pairs.tobytes(), headers={"content-type": media.OCTETS})
    assert answer.status_code == 422
    [error] = answer.json()["errors"]
    assert (error["field"], error["index"]) == ("ab"[which], index)


def test_a_comparison_is_told_in_json_only(client: TestClient) -> None:
    answer = client.post(
        "/v1/specular", params=QUERY | {"compare": "true"}, content=b"", headers={"content-type": media.OCTETS}
    )
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "compare")


def test_more_json_than_can_be_written_at_once_is_refused_with_the_way_out(client: TestClient) -> None:
    body = directions(100_001).astype("<f4").tobytes()
    asked = {"content-type": media.OCTETS, "accept": media.JSON}
    refused = client.post("/v1/specular", params=QUERY, content=body, headers=asked)
    assert (refused.status_code, media.OCTETS in refused.json()["mend"]) == (413, True)


def test_a_media_type_that_is_not_read_is_415_and_told(client: TestClient) -> None:
    answer = client.post("/v1/specular", content=b"a=1", headers={"content-type": "application/x-www-form-urlencoded"})
    assert answer.status_code == 415
    assert media.NPY in answer.headers["accept-post"]


def test_an_answer_tells_where_its_time_went(client: TestClient) -> None:
    answer = client.post("/v1/specular", json=body_of(REGISTRY["lyon"], directions(5)))
    parts = [part.split(";dur=") for part in answer.headers["server-timing"].split(", ")]
    assert [name for name, _ in parts] == ["parse", "queue", "kernel", "encode"]
    assert all(float(milliseconds) >= 0 for _, milliseconds in parts)


def test_a_warm_kernel_is_not_compiled_again(client: TestClient) -> None:
    from phongbench.compiler import jit

    pairs = directions(10)
    for spec in REGISTRY.values():
        client.post("/v1/specular", json=body_of(spec, pairs))
    with jit.compilations() as compiled:
        for spec in REGISTRY.values():
            assert client.post("/v1/specular", json=body_of(spec, pairs, alpha=example(spec).alpha)).status_code == 200
        assert client.get("/v1/curve?approximation=lyon&gamma=8&alpha=77").status_code == 200
    assert compiled == []
