"""The request for a picture as a JSON document: what it may say, and what the answer tells.

Strict as scene files are. It is untrusted: errors name the field and repeat nothing of what was sent, and the
scene names no files.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import MODELS, Formula
from phongbench.scenes import images, triples
from phongbench.scenes.render import TILE, Rendered, render
from phongbench.scenes.scene import MOST_DEPTH, MOST_SUPERSAMPLING, MOST_TRIANGLES, Mesh, Scene
from phongbench.scenes.scene_files import examples, read_scene, scene_of, wanted_size
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.requests import read_formula
from phongbench.shading.specular_term import EXACT, formula_for
from phongbench.support.document_paths import UNTRUSTED
from phongbench.support.documents import Table

#: what may be left out, by the word a request says
SKIPS: Mapping[str, SceneSkips] = {"all": SceneSkips(), "exact": SceneSkips.exact(), "none": SceneSkips.none()}


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture and, where they are compared, exact Phong's and what the two are called."""

    scene: str
    done: Rendered
    exact: Rendered | None = None
    names: tuple[str, str] = ("", "")

    @property
    def picture(self) -> Array:
        """Linear light; or, compared, the codes of exact Phong, this formula and their difference side by side."""
        if self.exact is None:
            return self.done.picture
        return triples.triple(self.exact.picture, self.done.picture, self.names)

    def as_dict(self) -> dict[str, Any]:
        """Size, rays, seconds and ledger; compared, the picture's error.

        FLIP is left out (None): it takes longer than the pictures.
        """
        result: dict[str, Any] = {"scene": self.scene, **self.done.as_dict()}
        if self.exact is not None:
            both = self.exact.picture, self.done.picture
            result["error"] = images.compare(*both, flip=False).as_dict()
        return result


@dataclass(frozen=True, eq=False)
class RenderRequest:
    """A request, checked.

    scene     its picture settings are those asked for
    specular  formula of materials that name none
    compare   whether exact Phong is drawn too
    """

    scene: Scene
    specular: Formula = EXACT
    model: str = "phong"
    skips: SceneSkips = SKIPS["all"]
    compare: bool = False

    @property
    def pixels(self) -> int:
        """Of the picture."""
        width, height = self.scene.picture.size
        return width * height

    @property
    def rays(self) -> int:
        """The most that one picture may take, shadow rays not counted: every ray reflects until the cut-off."""
        wanted, k = self.scene.picture, max((m.reflectivity for m in self.scene.materials), default=0.0)
        bounces = wanted.depth if k > 0 or not self.skips.reflectivity else 0
        if 0 < k < 1 and self.skips.cutoff > 0:
            bounces = min(bounces, math.ceil(math.log(self.skips.cutoff) / math.log(k)))
        return self.pixels * wanted.supersampling**2 * (1 + bounces)

    @property
    def triangles(self) -> int:
        """Of all meshes."""
        return sum(len(mesh.faces) for mesh in self.scene.of(Mesh))

    def draw(
        self, *, threads: int | None = None, tile: int = TILE, cancelled: Callable[[], bool] | None = None
    ) -> Drawn:
        """Draw; see `render` for the arguments and errors."""
        options: dict[str, Any] = {
            "model": self.model,
            "skips": self.skips,
            "threads": threads,
            "tile": tile,
            "cancelled": cancelled,
        }
        done = render(self.scene, specular=self.specular, **options)
        exact = render(self.scene.exact(), specular=EXACT, **options) if self.compare else None
        return Drawn(self.scene.name, done, exact, triples.names(self.scene, self.specular, self.model))


def render_request(document: Any, most_triangles: int = MOST_TRIANGLES) -> RenderRequest:
    """Read a request.

    document  what JSON gives: an object with `scene`, the name of a shipped one or the data of a scene file; optional
              are size, depth, supersampling and shadows (the scene's own), specular (a spelling such as lyon:dot:8, or
              an object of approximation, lambda, gamma, beta), model, skip ("all", "exact" or "none") and compare
    Raises InputError or UnknownNameError naming the path of the field, such as scene.objects[2].radius.
    """
    top = Table.of(document, UNTRUSTED, "render request")
    specular, model = read_formula(top), top.text("model", "phong", MODELS)
    skips, compare = SKIPS[top.text("skip", "all", SKIPS)], top.flag("compare", False)
    scene = _with_settings(_scene(top, most_triangles), top)
    top.finish()
    request = RenderRequest(scene, specular, model, skips, compare)
    _check_formulas(request, document["scene"])
    return request


@cache
def _shipped(name: str) -> Scene:
    return read_scene(name)


@cache
def _names() -> tuple[str, ...]:
    return tuple(examples())


def _scene(top: Table, most_triangles: int) -> Scene:
    given = top.value("scene")
    if isinstance(given, dict):
        return scene_of(top.table("scene"), "scene", None, most_triangles)
    if not isinstance(given, str):
        raise top.error(
            "a scene is the name of a shipped one, or an object", "scene", f"shipped: {', '.join(_names())}"
        )
    return _shipped(top.text("scene", among=_names()))


def _with_settings(scene: Scene, top: Table) -> Scene:
    """The scene with the size, depth, supersampling and shadows that are asked for."""
    wanted = scene.picture
    return replace(
        scene,
        picture=replace(
            wanted,
            size=wanted_size(top, wanted.size),
            depth=top.whole("depth", wanted.depth, 0, MOST_DEPTH),
            supersampling=top.whole("supersampling", wanted.supersampling, 1, MOST_SUPERSAMPLING),
            shadows=top.flag("shadows", wanted.shadows),
        ),
    )


def _check_formulas(request: RenderRequest, given: Any) -> None:
    """Raise InputError where a formula does not fit a material, which an untrusted scene calls by its number."""
    names = [] if isinstance(given, str) else list(given["materials"])
    for material in request.scene.materials:
        place = f"scene.materials[{names.index(material.name)}]" if names else f"materials.{material.name}"
        with _at("specular" if material.specular is None else place, place):
            for formula in (material.specular or request.specular, *((EXACT,) if request.compare else ())):
                formula_for(formula, material.reflection, request.model)


@contextmanager
def _at(field: str, place: str) -> Iterator[None]:
    """Errors inside are about this field; what is wrong with a material's exponent names the material."""
    try:
        yield
    except UnknownNameError as problem:
        raise UnknownNameError(problem.kind, problem.name, problem.known, field) from problem
    except InputError as problem:
        raise InputError(f"does not fit {place}: {problem.what}", field, problem.fix) from problem
