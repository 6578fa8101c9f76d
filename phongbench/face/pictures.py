"""The reflection model over points and lights, and ray-traced pictures of scenes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import orjson
import pandas as pd
from numpy.typing import ArrayLike

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.face.highlight import computed_in, formula_of, numbers
from phongbench.formulas.formula import Formula
from phongbench.formulas.spec import Approximation
from phongbench.scenes.render import render as draw
from phongbench.scenes.scene_files import read_scene
from phongbench.shading.requests import shading_request
from phongbench.support import image_files


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture, and what drawing it took; a notebook shows it.

    array    float32 (height, width, 3)  linear light, not limited to 1
    ledger   a row for each kind of work that was left out: of how much, how much, and what that may change
    seconds  in all, and of the threads together: tracing and shading
    """

    array: Array
    ledger: pd.DataFrame
    seconds: Mapping[str, float]

    def save(self, path: str | Path) -> None:
        """Write .png as 8-bit sRGB, .npy or .exr as linear float32; the file is there whole or not at all."""
        image_files.check_writable(Path(path))
        image_files.save(Path(path), self.array)

    def _repr_png_(self) -> bytes:
        return image_files.png(self.array)


def shade(
    points: ArrayLike,
    normals: ArrayLike,
    *,
    material: Mapping[str, Any],
    lights: Sequence[Mapping[str, Any]],
    viewer: Mapping[str, Any],
    specular: str | Formula = "phong",
    threads: int = 1,
    own: Sequence[Approximation] = (),
    **more: Any,
) -> Array:
    """The colours of points under lights: ambient, diffuse and specular terms, as `phongbench shade` computes them.

    points, normals  (N, 3)  float32 or float64 are computed as they are, other numbers in float64
    material         ambient, diffuse and specular, three numbers each, and shininess; fresnel, how much is reflected at
                     each incidence: {"kind": "schlick", "f0": [..]}, or another kind with f0, f82, n, k
    lights           each with a direction (towards it) or a position; attenuation, diffuse, specular, ambient, reach
    viewer           a direction (towards it) or a position
    specular         the formula in place of Phong's power, by its spelling
    more             model ("phong" or "blinn-phong"), ambient_light, normalise
    returns          (N, 3) linear light, not limited to 1
    Raises InputError or UnknownNameError naming the field, such as lights[2].attenuation.

    >>> plastic = {"ambient": [0, 0, 0], "diffuse": [0.5, 0.5, 0.5], "specular": [1, 1, 1], "shininess": 50}
    >>> pb.shade([[0, 0, 0]], [[0, 0, 1]], material=plastic, lights=[{"direction": [0, 0, 1]}],
    ...          viewer={"direction": [0, 0, 1]}, specular="lyon:dot:8")
    array([[1.5, 1.5, 1.5]])
    """
    formula, registry = formula_of(specular, own)
    document = _plain({"material": material, "lights": lights, "viewer": viewer} | more)
    vectors = numbers("points", points), numbers("normals", normals)
    dtype = computed_in(*vectors).dtype
    request = shading_request(document, (vectors[0].astype(dtype), vectors[1].astype(dtype)), registry)
    return replace(request, arguments={**request.arguments, "specular": formula}).shade(threads=threads).colours


def render(
    scene: str | Path,
    *,
    specular: str | Formula = "phong",
    size: tuple[int, int] | None = None,
    threads: int | None = None,
    own: Sequence[Approximation] = (),
    **more: Any,
) -> Picture:
    """Draw a scene: a TOML or JSON file, or a shipped one by its name, as `phongbench render` does.

    specular  the formula of the specular term, for materials that name none
    size      (width, height)  [default: the scene's]
    threads   None takes every core; the picture does not depend on it
    more      depth, supersampling, shadows, model
    Raises InputError or UnknownNameError for what cannot be drawn.

    >>> pb.render("chequerboard", size=(32, 18)).array.shape
    (18, 32, 3)
    """
    formula, registry = formula_of(specular, own)
    done = draw(read_scene(scene, registry), specular=formula, size=size, threads=threads, registry=registry, **more)
    return Picture(done.picture, pd.DataFrame([line.as_dict() for line in done.ledger]), done.seconds)


def _plain(document: Any) -> Any:
    """Tuples and arrays as the lists that a request is made of."""
    try:
        return orjson.loads(orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY))
    except TypeError as problem:
        raise InputError(str(problem), "request", "give numbers, texts, lists and dictionaries") from None
