"""POST /v1/shade: the library's colours and ledger, as JSON and as a form with a .npy, and 4xx for everything else."""

import io
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from starlette.testclient import TestClient

from phongbench.formulas.registry import REGISTRY, example
from phongbench.shading.requests import shaded_json, shading_request
from phongbench_api.http import media, multipart
from phongbench_api.http.problems import Cancelled
from phongbench_api.routes.shade import EXAMPLE, MATERIAL, Shading
from phongbench_api.work.warm_kernels import shading_key

COMMON = {name: value for name, value in EXAMPLE.items() if name not in ("points", "normals")}
SCENE = COMMON | {
    "ambient_light": [0.2, 0.3, 0.4],
    "lights": [
        {"direction": [1, 2, 3], "diffuse": [0.5, 0.6, 0.7], "specular": [1, 0.9, 0.8]},
        {"position": [0, 0, 2], "attenuation": [1, 0.1, 0.01], "diffuse": [1, 1, 1], "specular": [1, 1, 1]},
        {"direction": [0, 0, -1], "diffuse": [1, 1, 1], "specular": [1, 1, 1]},
    ],
    "viewer": {"position": [0, 1, 5]},
}


def vectors(n: int, dtype: str = "<f4", seed: int = 1) -> np.ndarray:
    draw = np.random.default_rng(seed).normal(size=(2, n, 3))
    draw[1, :, 2] = np.abs(draw[1, :, 2]) + 0.1
    return draw.astype(dtype)


def npy(array: np.ndarray) -> bytes:
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def form(client: TestClient, request: Any, body: bytes, **headers: str) -> Any:
    text = request if isinstance(request, str) else json.dumps(request)
    files = {"request": (None, text, "application/json"), "vectors": ("vectors.npy", body, media.NPY)}
    return client.post("/v1/shade", files=files, headers=headers)


@pytest.mark.parametrize("model", ["phong", "blinn-phong"])
@pytest.mark.parametrize("name", [name for name, spec in REGISTRY.items() if "reflect" in spec.spaces])
def test_json_is_answered_as_the_command_answers_it(client: TestClient, name: str, model: str) -> None:
    setting = example(REGISTRY[name])
    specular = {"approximation": name} | ({"gamma": setting.gamma} if setting.gamma else {})
    points, normals = vectors(40).tolist()
    document = SCENE | {"model": model, "specular": specular, "points": points, "normals": normals}
    document["material"] = MATERIAL | {"shininess": setting.alpha}
    answer = client.post("/v1/shade", json=document)
    assert answer.status_code == 200, answer.text
    assert answer.json() == json.loads(shaded_json(shading_request(document).shade()))
    assert answer.json()["skipped"]["pairs"] == 120


@pytest.mark.parametrize("dtype", ["<f4", "<f8"])
def test_a_form_holds_the_vectors_as_npy_and_gets_npy(client: TestClient, dtype: str) -> None:
    both = vectors(1000, dtype)
    answer = form(client, SCENE, npy(both))
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == media.NPY
    expected = shading_request(SCENE, (both[0], both[1])).shade()
    colours = np.load(io.BytesIO(answer.content))
    assert colours.dtype == both.dtype
    assert np.array_equal(colours, expected.colours)
    assert json.loads(answer.headers["phongbench-skipped"]) == expected.ledger.as_dict()
    told = form(client, SCENE, npy(both), accept=media.JSON)
    assert np.array_equal(np.array(told.json()["colours"], dtype), colours)
    raw = form(client, SCENE, npy(both), accept=media.OCTETS)
    assert np.array_equal(np.frombuffer(raw.content, dtype).reshape(-1, 3), colours)


def test_json_may_be_answered_by_npy(client: TestClient) -> None:
    answer = client.post("/v1/shade", json=EXAMPLE, headers={"accept": media.NPY})
    assert np.allclose(np.load(io.BytesIO(answer.content)), [[1.7, 1.6, 1.5]])


def test_a_formula_may_be_spelled(client: TestClient) -> None:
    parts = EXAMPLE | {"specular": {"approximation": "lyon", "lambda": "dot", "gamma": 8, "beta": "minimax"}}
    spelled = client.post("/v1/shade", json=EXAMPLE | {"specular": "lyon:dot:8:minimax"})
    assert spelled.status_code == 200, spelled.text
    assert spelled.json() == client.post("/v1/shade", json=parts).json()


def test_a_highlight_may_depend_on_incidence_and_a_light_have_an_ambient_term(client: TestClient) -> None:
    copper = {"kind": "conductor", "n": [0.2378, 1.0066, 1.2404], "k": [3.6264, 2.5823, 2.3929]}
    document = EXAMPLE | {"material": MATERIAL | {"fresnel": copper}}
    document["lights"] = [{**document["lights"][0], "ambient": [0.5, 0.5, 0.5]}]
    answer = client.post("/v1/shade", json=document)
    assert answer.status_code == 200, answer.text
    plain = np.array(client.post("/v1/shade", json=EXAMPLE).json()["colours"][0])
    # normal incidence: 1 becomes the reflectance of copper; 0.5 of ambient light comes on top, of which 0.1 is seen
    assert answer.json()["colours"][0] == pytest.approx(plain - 1 + (0.9352, 0.6235, 0.5383) + 0.05, abs=1e-4)


def test_what_another_reflectance_or_ambient_light_needs_is_compiled_first() -> None:
    """Their loops are of their own: a request of a new kind is predicted to take longer, and never compiled inline."""

    def key(material: dict[str, Any], light: dict[str, Any]) -> object:
        document = EXAMPLE | {"material": MATERIAL | material, "lights": [{"position": [0, 0, 3]} | light]}
        return shading_key(shading_request(document))

    schlick = {"fresnel": {"kind": "schlick", "f0": [0.5, 0.5, 0.5]}}
    edge = {"fresnel": {"kind": "f82", "f0": [0.5, 0.5, 0.5], "f82": [0.6, 0.6, 0.6]}}
    assert len({key({}, {}), key(schlick, {}), key(edge, {}), key({}, {"ambient": [1, 1, 1]})}) == 4
    assert key(schlick, {}) == key({"fresnel": {"kind": "schlick", "f0": [0, 0, 0.1]}}, {})


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"material": MATERIAL | {"fresnel": {"kind": "dielectric", "n": [-1, 1, 1]}}}, "material.fresnel.n"),
        ({"material": MATERIAL | {"fresnel": {"kind": "glass"}}}, "material.fresnel.kind"),
        ({"material": MATERIAL | {"fresnel": {"kind": "conductor", "n": [1, 1, 1]}}}, "material.fresnel.k"),
        ({"model": "lambert"}, "model"),
        ({"specular": {"approximation": "nobodys"}}, "specular.approximation"),
        ({"specular": {"approximation": "lyon"}}, "specular.gamma"),
        ({"specular": {"approximation": "lyon", "gamma": 7}}, "specular.gamma"),
        ({"material": 1}, "material"),
        ({"material": MATERIAL | {"shininess": -1}}, "material.shininess"),
        ({"material": MATERIAL | {"diffuse": [1, 1]}}, "material.diffuse"),
        ({"lights": [{"direction": [0, 0, 0]}]}, "lights[0].direction"),
        ({"lights": [{}]}, "lights[0].direction"),
        ({"lights": "none"}, "lights"),
        ({"viewer": {"direction": [0, 0, "1"]}}, "viewer.direction[2]"),
        ({"ambient_light": [-1, 0, 0]}, "ambient_light"),
        ({"normals": []}, "normals"),
        ({"points": [[0, 0]]}, "points[0]"),
        ({"normalise": 1}, "normalise"),
        ({"surprise": 1}, "(unknown)"),
    ],
)
def test_what_is_wrong_is_named_by_its_path(client: TestClient, change: dict[str, Any], field: str) -> None:
    answer = client.post("/v1/shade", json=EXAMPLE | change)
    assert answer.status_code == 422, answer.text
    assert answer.json()["errors"][0]["field"].startswith(field)


@pytest.mark.parametrize(("which", "field"), [(0, "points"), (1, "normals")])
def test_the_first_point_that_cannot_be_shaded_is_named(client: TestClient, which: int, field: str) -> None:
    both = vectors(5000)
    both[which, 4321:] = np.nan
    [error] = form(client, SCENE, npy(both)).json()["errors"]
    assert (error["field"], error["index"]) == (f"{field}[4321]", 4321)


@pytest.mark.parametrize(
    ("request_part", "vectors_part", "status"),
    [
        ("{", npy(vectors(1)), 400),
        ("{}", npy(vectors(1)), 422),
        (json.dumps(SCENE | {"points": []}), npy(vectors(1)), 422),
        (json.dumps(SCENE), b"", 400),
        (json.dumps(SCENE), npy(vectors(1))[:-1], 400),
        (json.dumps(SCENE), npy(vectors(1).astype(">f4")), 422),
        (json.dumps(SCENE), npy(vectors(1)[:1]), 422),
    ],
)
def test_a_form_with_a_bad_part_is_refused(
    client: TestClient, request_part: str, vectors_part: bytes, status: int
) -> None:
    assert form(client, request_part, vectors_part).status_code == status


def _raw(client: TestClient, body: bytes, kind: str = "multipart/form-data; boundary=x") -> int:
    return int(client.post("/v1/shade", content=body, headers={"content-type": kind}).status_code)


def _part(name: str, content: bytes) -> bytes:
    return f'--x\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n'.encode() + content + b"\r\n"


def test_a_form_must_be_whole_and_hold_its_two_parts_once(client: TestClient) -> None:
    request, both = _part("request", json.dumps(SCENE).encode()), _part("vectors", npy(vectors(3)))
    assert _raw(client, request + both + b"--x--\r\n") == 200
    assert _raw(client, both + request + b"--x--") == 200
    for body in (
        request + both,
        request + b"--x--",
        both + b"--x--",
        request * 2 + both + b"--x--",
        b"",
        b"--x--",
        request + both + _part("more", b"") + b"--x--",
        request + both * 9 + b"--x--",
        b"junk",
    ):
        assert _raw(client, body) in (400, 422)
    assert _raw(client, request + both + b"--x--", "multipart/form-data") == 400
    assert _raw(client, request + both + b"--x--", "multipart/form-data; boundary=" + "x" * 71) == 400


@given(
    st.lists(st.sampled_from([b"\r\n", b"\r", b"\n", b"--", b"-", b"x", b"y", b"--x", b"\r\n--x", b"a"]), max_size=60)
)
def test_a_part_that_looks_like_a_boundary_survives(pieces: list[bytes]) -> None:
    content = b"".join(pieces)
    assume(b"\r\n--xy" not in b"\r\n" + content)
    body = _part("vectors", content).replace(b"--x\r\n", b"--xy\r\n", 1) + b"--xy--"
    found = multipart.parts(body, "multipart/form-data; boundary=xy", ("vectors",))
    assert bytes(found["vectors"]) == content
    assert np.shares_memory(np.frombuffer(found["vectors"], np.uint8), np.frombuffer(body, np.uint8)) or not content


def test_more_points_or_lights_than_allowed_are_refused(client_of: Callable[..., TestClient]) -> None:
    client = client_of(max_points=10, max_lights=3)
    assert form(client, SCENE, npy(vectors(10))).status_code == 200
    assert form(client, SCENE, npy(vectors(11))).status_code == 413
    more = SCENE | {"lights": [{"direction": [0, 0, 1]}] * 4}
    assert form(client, more, npy(vectors(1))).status_code == 413


def test_a_client_that_is_gone_ends_the_shading(client: TestClient) -> None:
    both = vectors(100_000)
    asked = shading_request(SCENE, (both[0], both[1]))
    service = client.app.state.service  # type: ignore[attr-defined]
    with pytest.raises(Cancelled):
        Shading(asked, media.JSON, service).evaluate(lambda: True)


def test_the_cost_grows_with_points_and_lights(client: TestClient) -> None:
    kernels = client.app.state.service.kernels  # type: ignore[attr-defined]

    def cost(points: int, lights: int) -> float:
        both, told = vectors(points), SCENE | {"lights": SCENE["lights"][:2] * lights}  # type: ignore[index]
        return float(kernels.shading_cost(shading_request(told, (both[0], both[1]))))

    assert cost(10, 1) < cost(10_000, 1) < cost(10_000, 10)
