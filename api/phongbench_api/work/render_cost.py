"""What a picture is predicted to cost, from its pixels, depth, lights and objects, and which loops it needs."""

import math
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec

from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.scenes.render import TILE
from phongbench.scenes.requests import RenderRequest, render_request
from phongbench.scenes.scene import Mesh, SurfaceMaterial
from phongbench.shading.lighting import Material

#: seconds on the machine they were measured on, which `measured` compares with the machine at hand:
#: a picture of no pixels; a ray; a ray and an object; a ray and Embree; a ray and a light; one shadow ray beyond those
_PICTURE, _RAY, _OBJECT, _EMBREE, _LIGHT, _SHADOW = 2e-3, 1.2e-7, 7e-10, 4e-7, 5e-9, 1e-8
#: a triangle put into Embree's tree, and a pixel turned into codes and packed
_TRIANGLE, _PIXEL = 3e-6, 1.5e-7
#: reading a scene: a byte, and a mesh or more in it
_BYTE, _MESHES = 2e-6, 0.1
#: predicted seconds of a tile, after which it is request whether the client is still there; no smaller side than this
_TILE_SECONDS, _SMALLEST_TILE = 0.1, 8
#: for measuring and compiling: long enough to be more than its beginning, short enough for a start
_TRIAL = {"scene": "chequerboard", "size": [320, 180], "depth": 3, "shadows": True}
_TINY = (16, 9)


def reading(body: bytes) -> float:
    """Predicted seconds of reading a request."""
    return 1e-3 + _BYTE * len(body) + _MESHES * (b'"mesh"' in body)


def seconds(request: RenderRequest) -> float:
    """Predicted seconds of drawing, at most: rays times what each may meet; twice where exact Phong is drawn too."""
    once = request.rays * _ray(request) + _TRIANGLE * request.triangles + _PICTURE
    return once * (2 if request.compare else 1) + _PIXEL * request.pixels * (4 if request.compare else 1)


def _ray(request: RenderRequest) -> float:
    """Predicted seconds of a ray, its shading and its shadow rays."""
    scene = request.scene
    meeting = _OBJECT * len(scene.objects) + _EMBREE * (request.triangles > 0)
    return _RAY + meeting + len(scene.lights) * (_LIGHT + (_SHADOW + meeting) * scene.picture.shadows)


def tile(request: RenderRequest) -> int:
    """The side of tiles so small that a core is free soon after its client left."""
    samples = request.pixels * request.scene.picture.supersampling**2
    return max(_SMALLEST_TILE, min(TILE, int(math.sqrt(_TILE_SECONDS * samples / request.rays / _ray(request)))))


def kinds(request: RenderRequest) -> set[object]:
    """What decides which loops are compiled: of each material its formula, and the kinds of lights and objects."""
    scene, picture = request.scene, request.scene.picture
    lights = frozenset(
        (light.position is None, tuple(light.attenuation)[1:] == (0, 0), max(light.ambient) > 0)
        for light in scene.lights
    )
    shared = (request.model, picture.shadows, lights, bool(scene.of(Mesh)), request.compare)
    return {("picture", _formula(request, material), *shared) for material in scene.materials}


def _formula(request: RenderRequest, material: SurfaceMaterial) -> object:
    fresnel = material.reflection.fresnel and material.reflection.fresnel.kind
    return loops_of(material.specular or request.specular, material.reflection), fresnel


def loops_of(formula: Formula, material: Material) -> object:
    """What decides which loops a formula's value and coordinate take for a material."""
    exponent = material.highlight_exponent if _knows_exponent(formula.approximation) else None
    pair = (formula.recipe, formula.normalise)
    return formula.approximation, formula.lambda_form, formula.gamma, type(formula.slope) is float, exponent, pair


def _knows_exponent(name: str) -> bool:
    """Whether its loop is compiled for one exponent."""
    return bool(set(REGISTRY[name].knowns) - {"n"})


def smallest(request: RenderRequest) -> RenderRequest:
    """The request for a picture that is just large enough to need every loop."""
    picture = replace(request.scene.picture, size=_TINY, supersampling=1)
    return replace(request, scene=replace(request.scene, picture=picture))


def usual() -> Iterator[RenderRequest]:
    """Pictures whose loops are compiled before the server is ready: all kinds of lights, and meshes with Embree."""
    for scene in ("chequerboard", "many-lights", *(("tessellation",) if find_spec("embreex") else ())):
        for shadows in (False, True):
            yield smallest(render_request({"scene": scene, "shadows": shadows}))


def measured() -> float:
    """How much slower this machine is than predictions say; its prediction takes the rays that there really were."""
    request = render_request(_TRIAL)
    done = min((request.draw(threads=1).done for _ in range(3)), key=lambda one: one.seconds["total"])
    return done.seconds["total"] / (seconds(request) - _PIXEL * request.pixels) * request.rays / done.rays
