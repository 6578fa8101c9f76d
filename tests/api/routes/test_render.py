"""POST /v1/render: the library's picture and ledger, and what they are predicted to cost."""

import io
import json
import tomllib
from copy import deepcopy
from importlib import resources
from typing import Any

import numpy as np
import pytest
from picture_requests import LYON, MINE, SIZE, ask, changed, decoded, refused
from starlette.testclient import TestClient

from phongbench.formulas.formula import Formula
from phongbench.scenes import images, triples
from phongbench.scenes.render import TILE, render
from phongbench.scenes.requests import render_request
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skips import SceneSkips
from phongbench.support import image_files
from phongbench_api.http import media
from phongbench_api.http.problems import Cancelled
from phongbench_api.routes.render import Rendering
from phongbench_api.work import render_cost


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
    triple = decoded(ask(client, "test-card", specular="lyon:difference:8", compare=True))
    assert triple.tolist() == triples.triple(exact, mine, ("exact Phong", "lyon:difference:8")).tolist()


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
