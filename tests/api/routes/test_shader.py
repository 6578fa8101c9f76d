"""GET /v1/shader: the library's source text, as text or in JSON, with the bound that is proven of it."""

import pytest
from starlette.testclient import TestClient

from phongbench.analysis.promises import bound_at
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.shader_code.export import LANGUAGES, shader

QUERY = {"approximation": "lyon", "lambda": "cross", "gamma": "8", "alpha": "50", "beta": "minimax"}


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", REGISTRY)
def test_it_is_the_librarys(client: TestClient, name: str, language: str) -> None:
    setting = example(REGISTRY[name])
    query = {"approximation": name, "alpha": setting.alpha, "language": language}
    query |= {"gamma": setting.gamma} if setting.gamma else {}
    formula = Formula.of(name, gamma=setting.gamma)
    bound = bound_at(formula, setting.alpha)
    assert bound is not None
    expected = shader(formula, setting.alpha, language, bound=bound)
    answer = client.get("/v1/shader", params=query)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/plain; charset=utf-8"
    assert answer.text == expected.text
    as_json = client.get("/v1/shader", params=query, headers={"accept": "application/json"})
    assert as_json.json() == expected.as_dict()


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"language": "basic"}, "language"),
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
