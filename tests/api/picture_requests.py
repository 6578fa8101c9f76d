"""A scene as an untrusted client sends it, and what tests of /v1/render ask and expect."""

import io
from copy import deepcopy
from typing import Any

import numpy as np
from PIL import Image
from starlette.testclient import TestClient

from phongbench.formulas.formula import Formula

LYON = Formula.of("lyon", "difference", 8)
SIZE = (32, 18)
#: a ball over a chequerboard and a mesh, as somebody sends it
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
