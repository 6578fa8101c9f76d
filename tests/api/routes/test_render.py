"""POST /v1/render: the library's picture and ledger, and 4xx that names the field for everything else."""

import io
import json
import tomllib
from collections.abc import Callable
from copy import deepcopy
from importlib import resources
from typing import Any

import numpy as np
import pytest
from PIL import Image
from starlette.testclient import TestClient

from phongbench.formulas.formula import Formula
from phongbench.scenes import images
from phongbench.scenes.render import TILE, render
from phongbench.scenes.requests import render_request
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skips import SceneSkips
from phongbench.support import image_files
from phongbench_api.http import media
from phongbench_api.http.problems import Cancelled
from phongbench_api.routes.render import Rendering
from phongbench_api.work import render_cost

LYON = Formula.of("lyon", "difference", 8)
SIZE = (32, 18)
#: a ball over a chequerboard and a mesh, as a stranger sends it
MINE: dict[str, Any] = {
    "camera": {"position": [0, 1, 5], "target": [0, 0.5, 0]},
    "materials": {
        "white": {"diffuse": [0.8, 0.8, 0.8], "specular": [0.5, 0.5, 0.5], "shininess": 20},
        "mirror": {"diffuse": [0.1, 0.1, 0.2], "specular": [0.9, 0.9, 0.9], "shininess": 90, "reflectivity": 0.6},
        "board": {"chequerboard": ["white", "mirror"]},
    },
    "lights": [{"direction": [-1, 2, 1]}, {"position": [1, 2, 2], "attenuation": [0.5, 0.2, 0.1], "reach": 20}],
    "objects": [
        {"shape": "sphere", "centre": [0, 0.8, 0], "radius": 0.8, "material": "mirror"},
        {"shape": "plane", "material": "board"},
        {"shape": "mesh", "surface": "icosphere", "degrees": 30, "material": "white", "translate": [3, 1, 0]},
    ],
}
SECRET = "zzSECRETzz"


def ask(client: TestClient, scene: Any = "chequerboard", accept: str = "*/*", **more: Any) -> Any:
    body = {"scene": scene, "size": list(SIZE)} | more
    return client.post("/v1/render", json=body, headers={"accept": accept})


def decoded(answer: Any) -> np.ndarray:
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "image/png"
    image = Image.open(io.BytesIO(answer.content))
    assert (image.format, image.mode) == ("PNG", "RGB")
    return np.asarray(image)


def refused(answer: Any, status: int = 422) -> dict[str, Any]:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert SECRET not in answer.text
    told: dict[str, Any] = answer.json()
    return told


@pytest.mark.parametrize("name", examples())
def test_a_shipped_scene_is_the_librarys_picture(client: TestClient, name: str) -> None:
    answer = ask(client, name, specular="lyon:difference:8")
    expected = render(read_scene(name), size=SIZE, specular=LYON)
    assert decoded(answer).tolist() == image_files.codes(expected.picture).tolist()
    skipped = json.loads(answer.headers["phongbench-skipped"])
    assert skipped == {line.name: line.skipped for line in expected.ledger}
    assert "kernel;dur=" in answer.headers["server-timing"]


def test_a_scene_that_is_sent_is_drawn_like_its_file(client: TestClient) -> None:
    text = (resources.files("phongbench.scenes") / "examples" / "chequerboard.toml").read_text()
    assert ask(client, tomllib.loads(text)).content == ask(client, "chequerboard").content


def test_a_formula_is_written_as_text_or_as_an_object(client: TestClient) -> None:
    formula = {"approximation": "lyon", "lambda": "difference", "gamma": 8}
    whole, text = (ask(client, MINE, specular=told).content for told in (formula, "lyon:difference:8"))
    assert whole == text != ask(client, MINE).content
    assert ask(client, MINE, specular=formula | {"beta": "minimax"}).content != whole


def test_json_tells_the_librarys_ledger(client: TestClient) -> None:
    wishes = {"depth": 2, "shadows": True, "supersampling": 2, "model": "blinn-phong"}
    told = ask(client, "chequerboard", media.JSON, **wishes, skip="exact").json()
    found = render(read_scene("chequerboard"), size=SIZE, **wishes, skips=SceneSkips.exact()).as_dict()
    assert told.pop("seconds").keys() == found.pop("seconds").keys()
    assert told == found | {"scene": "chequerboard"}


@pytest.mark.parametrize(
    ("skip", "skips"), [("all", SceneSkips()), ("exact", SceneSkips.exact()), ("none", SceneSkips.none())]
)
def test_what_may_be_left_out_is_asked_for(client: TestClient, skip: str, skips: SceneSkips) -> None:
    ledger = ask(client, "many-lights", media.JSON, skip=skip).json()["ledger"]
    expected = render(read_scene("many-lights"), size=SIZE, skips=skips).ledger
    assert ledger == [line.as_dict() for line in expected]
    assert (sum(line["skipped"] for line in ledger) == 0) == (skip == "none")


def test_compared_the_error_is_told_and_shown(client: TestClient) -> None:
    scene = read_scene("test-card")
    exact, mine = (render(scene, size=SIZE, specular=formula).picture for formula in (Formula(), LYON))
    told = ask(client, "test-card", media.JSON, specular="lyon:difference:8", compare=True).json()
    assert told["error"] == images.compare(exact, mine, flip=False).as_dict()
    assert told["error"]["max_codes"] > 0
    assert told["amplification"] == images.amplification(exact, mine)
    triple = decoded(ask(client, "test-card", specular="lyon:difference:8", compare=True))
    assert triple.tolist() == images.triple(exact, mine).tolist()


def test_a_materials_own_formula_is_compared_with_exact_phong_too(client: TestClient) -> None:
    scene = deepcopy(MINE)
    scene["materials"]["white"]["approximation"] = "lyon:dot:4"
    error = ask(client, scene, media.JSON, compare=True).json()["error"]
    assert error["max_abs"] > 0
    plain = ask(client, MINE, media.JSON, compare=True).json()["error"]
    assert (plain["max_abs"], plain["psnr"]) == (0, None)


def test_npy_is_linear_light(client: TestClient) -> None:
    answer = ask(client, "chequerboard", media.NPY)
    found = np.load(io.BytesIO(answer.content), allow_pickle=False)
    assert found.dtype == np.float32
    assert np.array_equal(found, render(read_scene("chequerboard"), size=SIZE).picture)


def test_a_mirror_box_ends_at_the_depth_limit(client: TestClient) -> None:
    scene = deepcopy(MINE)
    scene["materials"] = {"mirror": {"reflectivity": 1.0}}
    walls = [(axis, side) for axis in range(3) for side in (-6, 6)]
    scene["objects"] = [
        {
            "shape": "plane",
            "material": "mirror",
            "point": [side * (k == axis) for k in range(3)],
            "normal": [float(k == axis) for k in range(3)],
        }
        for axis, side in walls
    ]
    told = ask(client, scene, media.JSON, depth=64, size=[8, 8]).json()
    assert told["rays"] == 8 * 8 * 65 == render_request({"scene": scene, "depth": 64, "size": [8, 8]}).rays
    problem = refused(ask(client, scene, depth=65))
    assert problem["errors"][0]["field"] == "depth"


@pytest.mark.parametrize("scene", examples())
@pytest.mark.parametrize("wishes", [{}, {"depth": 9, "shadows": True}, {"skip": "none", "depth": 4}])
def test_no_picture_takes_more_rays_than_predicted(scene: str, wishes: dict[str, Any]) -> None:
    asked = render_request({"scene": scene, "size": [16, 9]} | wishes)
    assert asked.draw().done.rays <= asked.rays


def changed(path: str, value: Any) -> dict[str, Any]:
    """The scene with another value at a path; a key that ends in ! is taken away."""
    scene = deepcopy(MINE)
    *steps, last = (int(step) if step.isdecimal() else step for step in path.split("."))
    inside: Any = scene
    for step in steps:
        inside = inside[step]
    if isinstance(last, str) and last.endswith("!"):
        del inside[last[:-1]]
    else:
        inside[last] = value
    return scene


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


def test_the_prediction_grows_with_pixels_depth_lights_and_objects() -> None:
    def cost(**wishes: Any) -> float:
        return render_cost.seconds(render_request({"scene": MINE, "size": [640, 360], "depth": 1} | wishes))

    least = cost()
    more = [
        cost(**wish)
        for wish in (
            {"size": [1280, 720]},
            {"depth": 4},
            {"shadows": True},
            {"compare": True},
            {"supersampling": 2},
            {"scene": changed("lights", MINE["lights"] * 9)},
            {"scene": changed("objects", MINE["objects"] * 9)},
        )
    ]
    assert min(more) > least
    assert cost(size=[1280, 720]) == pytest.approx(4 * least, rel=0.05)


def test_a_client_that_is_gone_stops_its_picture(client: TestClient) -> None:
    service: Any = client.app.state.service  # type: ignore[attr-defined]
    asked = render_request({"scene": "chequerboard", "size": [640, 360]})
    looks: list[bool] = []

    def gone() -> bool:
        looks.append(True)
        return len(looks) > 3

    work = Rendering(asked, media.PNG, service)
    with pytest.raises(Cancelled):
        work.evaluate(gone)
    assert len(looks) == 4


def test_tiles_are_smaller_the_longer_they_take() -> None:
    scenes = [changed("objects", MINE["objects"][:2] * count) for count in (1, 500, 2000)]
    asked = [{"scene": scene, "size": [640, 360], "depth": 64, "shadows": True} for scene in scenes]
    sides = [render_cost.tile(render_request(one)) for one in asked]
    assert TILE == sides[0] > sides[1] > sides[2] >= 8


def test_a_shipped_scene_is_warm(client: TestClient) -> None:
    kernels: Any = client.app.state.service.kernels  # type: ignore[attr-defined]
    asked = render_request({"scene": "chequerboard", "size": [16, 9]})
    assert (
        kernels.render_cost(asked)
        < 0.3
        < kernels.render_cost(
            render_request({"scene": changed("materials.white.approximation", "table-u:dot"), "size": [16, 9]})
        )
    )
