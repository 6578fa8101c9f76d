"""POST /v1/render: whatever cannot be drawn is a 4xx that names the field, and repeats nothing that was sent."""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import pytest
from picture_requests import MINE, SECRET, ask, changed, decoded, refused
from starlette.testclient import TestClient

from phongbench_api.http import media

# a path and the value put there; the field and index that the answer names, and a word it says
WRONG = [
    (SECRET, 1, "scene.(unknown)", None, "unknown key"),
    (f"objects.0.{SECRET}", 1, "scene.objects[0].(unknown)", 0, "unknown key"),
    (f"materials.{SECRET}", SECRET, "scene.materials[3]", 3, "materials[3] is not an object"),
    (f"materials.{SECRET}", {SECRET: 1}, "scene.materials[3].(unknown)", 3, "unknown key"),
    (f"materials.{SECRET}", {"shininess": -1}, "scene.materials[3].shininess", 3, "outside"),
    ("materials.white.like", SECRET, "scene.materials[0].like", 0, "unknown like"),
    ("materials.board.chequerboard", [SECRET, "white"], "scene.materials[2].chequerboard", 2, "no material"),
    ("materials.board.chequerboard", [[SECRET], "white"], "scene.materials[2].chequerboard", 2, "two materials"),
    ("materials.white.approximation", SECRET, "scene.materials[0].approximation", 0, "unknown"),
    ("materials.white.approximation", "lyon:dot", "scene.materials[0].approximation", 0, "gamma"),
    ("materials.white.approximation", f"lyon:{SECRET}:8", "scene.materials[0].approximation", 0, "lambda form"),
    (
        "materials.white.approximation",
        f"lyon:dot:8:{SECRET}",
        "scene.materials[0].approximation",
        0,
        "unknown beta policy",
    ),
    ("materials.white.approximation", "lyon:dot:" + "9" * 5000, "scene.materials[0].approximation", 0, "whole number"),
    ("objects.0.material", SECRET, "scene.objects[0].material", 0, "no material of that name"),
    ("objects.0.material!", None, "scene.objects[0].material", 0, "material is missing"),
    ("objects.0.radius", SECRET, "scene.objects[0].radius", 0, "not a number"),
    ("objects.0.centre", [0, 0, 1, SECRET], "scene.objects[0].centre", 0, "list of 3"),
    ("objects.0.shape", SECRET, "scene.objects[0].shape", 0, "unknown shape"),
    ("objects.2.scale", [1, 0, 1], "scene.objects[2].scale", 2, "singular"),
    ("objects.2.matrix", [[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]], "scene.objects[2].matrix", 2, "singular"),
    ("objects.2.matrix", [[1, 0, 0, 0], SECRET, [0, 0, 1, 0]], "scene.objects[2].matrix[1]", 2, "list of 4 numbers"),
    ("objects.2.degrees", 0.5, "scene.objects[2].degrees", 2, "outside"),
    ("objects", [], "scene.objects", None, "needs an object"),
    ("objects", SECRET, "scene.objects", None, "not a list"),
    ("camera.target", [0, 1, 5], "scene.camera.target", None, "looks at itself"),
    ("camera.up", [0, 0.5, 5], "scene.camera.up", None, "along up"),
    ("camera.position", [0, 0.8, 0.1], "scene.camera.position", None, "inside or on the sphere objects[0]"),
    ("camera.position", [3, 1, 0], "scene.camera.position", None, "inside or on the mesh objects[2]"),
    ("camera!", None, "scene.camera", None, "missing"),
    ("lights.0.direction", [0, 0, 0], "scene.lights[0].direction", 0, "no direction"),
    ("lights.1.position", [1e300, 0, 0], "scene.lights[1].position[0]", 1, "outside"),
    ("materials.white.shininess", 1e-9, "scene.materials[0].shininess", 0, "alpha"),
    ("lights.1.attenuation", [0, 0, 0], "scene.lights[1].attenuation", 1, "attenuation"),
    ("picture", {"size": [8.5, 4]}, "scene.picture.size", None, "two whole numbers"),
    ("picture", {"size": [1 << 20, 1 << 20]}, "scene.picture.size", None, "pixels"),
]


@pytest.mark.parametrize(("path", "value", "field", "index", "words"), WRONG)
def test_what_cannot_be_drawn_is_refused_by_its_field(
    client: TestClient, path: str, value: Any, field: str, index: int | None, words: str
) -> None:
    (told,) = refused(ask(client, changed(path, value)))["errors"]
    assert told["field"] == field
    assert told.get("index") == index
    assert words in told["detail"]


def test_a_materials_formula_is_refused_by_its_number_even_where_the_name_says_all(client: TestClient) -> None:
    scene = deepcopy(MINE)
    scene["materials"][SECRET] = {"specular": [1, 1, 1], "shininess": 77.5}
    (told,) = refused(ask(client, scene, specular="integer-power"))["errors"]
    assert told["field"] == "specular"
    assert "scene.materials[3]" in told["detail"]


WISHES = [
    ({"size": [0, 5]}, "size[0]"),
    ({"size": [8]}, "size"),
    ({"size": [8.5, 4]}, "size"),
    ({"size": [1 << 13, 1 << 13]}, "size"),
    ({"size": SECRET}, "size"),
    ({"depth": -1}, "depth"),
    ({"depth": 1.5}, "depth"),
    ({"depth": True}, "depth"),
    ({"supersampling": 9}, "supersampling"),
    ({"shadows": 1}, "shadows"),
    ({"skip": SECRET}, "skip"),
    ({"model": SECRET}, "model"),
    ({"specular": SECRET}, "specular"),
    ({"specular": {SECRET: 1}}, "specular.(unknown)"),
    ({"specular": {"approximation": SECRET}}, "specular.approximation"),
    ({"specular": {"gamma": 0}}, "specular.gamma"),
    ({"specular": "lyon:dot:7"}, "specular"),
    ({"specular": {"approximation": "lyon", "gamma": 8, "beta": SECRET}}, "specular.beta"),
    ({"compare": SECRET}, "compare"),
    ({SECRET: 1}, "(unknown)"),
    ({"scene": 3}, "scene"),
    ({"scene": SECRET}, "scene"),
    ({"scene": "../examples/torus"}, "scene"),
]


@pytest.mark.parametrize(("wishes", "field"), WISHES)
def test_a_wish_that_cannot_be_is_refused_by_its_field(client: TestClient, wishes: dict[str, Any], field: str) -> None:
    (told,) = refused(ask(client, **wishes))["errors"]
    assert told["field"] == field


@pytest.mark.parametrize("file", ["ball.obj", "/etc/passwd", "../../secret.obj", f"{SECRET}.obj"])
def test_a_scene_that_is_sent_reads_no_file(client: TestClient, file: str) -> None:
    scene = deepcopy(MINE)
    scene["objects"][2] = {"shape": "mesh", "file": file}
    (told,) = refused(ask(client, scene))["errors"]
    assert told == {"field": "scene.objects[2].file", "detail": "a scene that was sent cannot name files", "index": 2}


def test_a_picture_brighter_than_any_number_is_white_and_has_no_error(client: TestClient) -> None:
    blinding = {"position": [0, 0.5, 3], "attenuation": [0, 0, 1e-45], "intensity": 1e6}
    scene = changed("lights.1", blinding)
    assert decoded(ask(client, scene)).max() == 255
    told = refused(ask(client, scene, media.JSON, specular="lyon:dot:8", compare=True))
    assert "not finite" in told["detail"]


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b'"chequerboard"', b"NaN"])
def test_a_body_that_is_no_request_is_refused(client: TestClient, body: bytes) -> None:
    answer = client.post("/v1/render", content=body, headers={"content-type": media.JSON})
    assert answer.status_code in (400, 422)
    assert answer.headers["content-type"] == "application/problem+json"


def test_other_media_are_refused(client: TestClient) -> None:
    toml = client.post("/v1/render", content=b"[camera]", headers={"content-type": "application/toml"})
    assert (toml.status_code, toml.headers["accept-post"]) == (415, media.JSON)
    assert ask(client, accept="image/webp").status_code == 406
    assert client.get("/v1/render").status_code == 405


def test_the_limits_are_told_and_kept(client_of: Callable[..., TestClient]) -> None:
    limits = {"max_pixels": 100, "max_lights": 2, "max_triangles": 500, "max_scene": 3000}
    small = client_of(**limits)
    assert small.get("/v1/meta").json()["limits"].items() >= limits.items()
    assert ask(small, MINE, size=[10, 10]).status_code == 200
    assert refused(ask(small, MINE, size=[10, 11]), 413)["errors"][0]["field"] == "size"
    assert refused(ask(small, "chequerboard", size=[5, 5]), 413)["errors"][0]["field"] == "scene.lights"
    (told,) = refused(ask(small, changed("objects.2.degrees", 8)))["errors"]
    assert (told["field"], told["index"]) == ("scene.objects[2]", 2)
    assert refused(ask(small, changed("note", SECRET * 400)), 413)["errors"][0]["field"] == "(body)"


def test_a_picture_that_would_take_too_long_is_refused_with_its_estimate(client_of: Callable[..., TestClient]) -> None:
    problem = refused(ask(client_of(max_cost=0.5), size=[1920, 1080], depth=64, supersampling=8), 413)
    assert "this would take about" in problem["detail"]
