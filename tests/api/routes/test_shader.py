"""GET /v1/shader: the library's source text, as text or in JSON, with the bound that is proven of it."""

import pytest
from starlette.testclient import TestClient

from phongbench.analysis.ready_code import ready_code
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.shader_code.export import LANGUAGES, Options, shader

QUERY = {"approximation": "lyon", "lambda": "cross", "gamma": "8", "alpha": "50", "beta": "minimax"}


def written(formula: Formula, language: str) -> bool:
    """Whether the language has the words for the formula."""
    try:
        shader(formula, 32.0, Options(language))
    except InputError:
        return False
    return True


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", REGISTRY)
def test_it_is_the_librarys(client: TestClient, name: str, language: str) -> None:
    setting = example(REGISTRY[name])
    query = {"approximation": name, "alpha": setting.alpha, "language": language}
    query |= {"gamma": setting.gamma} if setting.gamma else {}
    formula = Formula.of(name, gamma=setting.gamma)
    if not written(formula, language):
        refused = client.get("/v1/shader", params=query)
        assert refused.status_code == 422
        assert "language" in refused.text
        return
    expected = ready_code(formula, setting.alpha, Options(language))
    assert expected.bound is not None
    answer = client.get("/v1/shader", params=query)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/plain; charset=utf-8"
    assert answer.text == expected.text
    as_json = client.get("/v1/shader", params=query, headers={"accept": "application/json"})
    assert as_json.json() == expected.as_dict()


def test_its_options_are_the_librarys(client: TestClient) -> None:
    query = {"formula": "lyon:dot:8", "alpha": "50", "language": "essl300", "target": "rdna2,gcn4"}
    told = Options("essl300", over_long="clamp", length_error=0.01, targets=("rdna2", "gcn4"))
    answer = client.get("/v1/shader", params=query | {"length_error": "1/100"}, headers={"accept": "application/json"})
    assert answer.json() == ready_code(Formula.parse("lyon:dot:8"), 50.0, told).as_dict()
    assert [cost["target"] for cost in answer.json()["costs"]] == ["rdna2", "gcn4"]
    del query["target"]
    assert "precision mediump float;" in client.get("/v1/shader", params={**query, "precision": "mediump"}).text


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"language": "basic"}, "language"),
        ({"precision": "float8"}, "precision"),
        ({"precision": "float16", "language": "essl300"}, "precision"),
        ({"over_long": "drop"}, "over_long"),
        ({"length_error": "0.7"}, "length_error"),
        ({"length_error": "-1"}, "length_error"),
        ({"target": "rdna9"}, "target"),
        ({"target": "cpu"}, "target"),
        ({"target": "../rdna2"}, "target"),
        ({"target": "rdna2", "over_long": "keep", "lambda": "dot"}, "target"),
        ({"gamma": "7"}, "gamma"),
        ({"alpha": "-1"}, "alpha"),
        ({"alpha": "0", "beta": "minimax"}, "alpha"),
        ({"more": "1"}, "(unknown)"),
    ],
)
def test_wrong_questions_name_their_field(client: TestClient, wrong: dict[str, str], field: str) -> None:
    answer = client.get("/v1/shader", params=QUERY | wrong)
    assert answer.status_code == 422
    assert field in answer.text
    assert client.get("/v1/shader", params=QUERY, headers={"accept": "image/png"}).status_code == 406
