"""The request for a picture as a JSON schema, for the OpenAPI document; phongbench.scenes.requests is what reads it."""

from typing import Any

from phongbench.formulas.formula import MODELS
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import GAMMA
from phongbench.inputs import meshes
from phongbench.scenes import scene
from phongbench.scenes.mesh_objects import COARSEST, FINEST_AFAR, SMOOTH
from phongbench.scenes.requests import SKIPS
from phongbench.scenes.scene_files import BRIGHTEST, examples
from phongbench.support.documents import LARGEST
from phongbench_api import rendering
from phongbench_api.http import media


def _number(low: float = -LARGEST, high: float = LARGEST) -> dict[str, Any]:
    return {"type": "number", "minimum": low, "maximum": high}


def _list(count: int, of: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": of, "minItems": count, "maxItems": count}


def _object(properties: dict[str, Any], *required: str) -> dict[str, Any]:
    members: dict[str, Any] = {"type": "object", "additionalProperties": False, "properties": properties}
    return members | ({"required": list(required)} if required else {})


def _whole(low: int, high: int) -> dict[str, Any]:
    return {"type": "integer", "minimum": low, "maximum": high}


def _named(*names: str) -> dict[str, Any]:
    return {"type": "string", "enum": list(names)}


_THREE, _COLOUR, _FLAG = _list(3, _number()), _list(3, _number(0, 1)), {"type": "boolean"}
_TEXT, _LENGTH = {"type": "string", "minLength": 1}, _number(1e-6)
_SIZE = _list(2, _whole(1, scene.MOST_PIXELS))
_DEPTH, _SAMPLES = _whole(0, scene.MOST_DEPTH), _whole(1, scene.MOST_SUPERSAMPLING)
_FORMULA = {"type": "string", "description": "NAME, NAME:FORM or NAME:FORM:GAMMA", "examples": ["lyon:difference:8"]}
_SPECULAR = _object(
    {
        "approximation": _named(*REGISTRY),
        "lambda": _named(*LAMBDA_FORMS, "none"),
        "gamma": _whole(int(GAMMA.low), int(GAMMA.high)),
        "beta": {"type": ["string", "number"], "description": "a policy, or the slope itself"},
    }
)
_CAMERA = _object(
    {"position": _THREE, "target": _THREE, "up": _THREE, "field_of_view": _number(1, 170)}, "position", "target"
)
_MATERIAL = _object(
    {
        "like": _TEXT | {"description": "a classic OpenGL material, such as gold"},
        "ambient": _COLOUR,
        "diffuse": _COLOUR,
        "specular": _COLOUR,
        "shininess": _number(0, 1e5),
        "reflectivity": _number(0, 1),
        "approximation": _FORMULA,
    }
)
_BOARD = _object({"chequerboard": _list(2, _TEXT), "side": _LENGTH}, "chequerboard")
_LIGHT = _object(
    {
        "direction": _THREE | {"description": "towards a light that is far away"},
        "position": _THREE,
        "attenuation": _list(3, _number(0)),
        "reach": _LENGTH,
        "colour": _COLOUR,
        "highlight": _COLOUR,
        "intensity": _number(0, BRIGHTEST),
    }
)
_SPHERE = _object(
    {"shape": _named("sphere"), "centre": _THREE, "radius": _LENGTH, "material": _TEXT},
    "shape",
    "centre",
    "radius",
    "material",
)
_PLANE = _object({"shape": _named("plane"), "point": _THREE, "normal": _THREE, "material": _TEXT}, "shape", "material")
_MATRIX = {"type": "array", "items": _list(4, _number()), "minItems": 3, "maxItems": 4}
_MESH = _object(
    {
        "shape": _named("mesh"),
        "surface": _named(*meshes.TESSELLATIONS),
        "degrees": _number(FINEST_AFAR, COARSEST),
        "material": _TEXT,
        "matrix": _MATRIX,
        "scale": {"anyOf": [_number(), _THREE]},
        "rotate": _THREE,
        "translate": _THREE,
        "normals": _named("unit", "raw"),
        "smooth": _named(*SMOOTH),
    },
    "shape",
    "surface",
    "material",
)
_SCENE = _object(
    {
        "camera": _CAMERA,
        "materials": {"type": "object", "additionalProperties": {"anyOf": [_MATERIAL, _BOARD]}},
        "lights": {"type": "array", "items": _LIGHT, "maxItems": scene.MOST_LIGHTS},
        "ambient_light": _COLOUR,
        "objects": {
            "type": "array",
            "items": {"oneOf": [_SPHERE, _PLANE, _MESH]},
            "minItems": 1,
            "maxItems": scene.MOST_OBJECTS,
        },
        "background": _list(3, _number(0, BRIGHTEST)),
        "picture": _object({"size": _SIZE, "depth": _DEPTH, "supersampling": _SAMPLES, "shadows": _FLAG}),
    },
    "camera",
    "materials",
    "objects",
) | {"description": "the data of a scene file"}
_REQUEST = _object(
    {
        "scene": {"anyOf": [_named(*examples()), _SCENE]},
        "size": _SIZE,
        "depth": _DEPTH,
        "supersampling": _SAMPLES,
        "shadows": _FLAG,
        "specular": {"anyOf": [_FORMULA, _SPECULAR]},
        "model": _named(*MODELS),
        "skip": _named(*SKIPS) | {"description": "what may be left out; exact: what changes no bit"},
        "compare": _FLAG | {"description": "draw exact Phong too"},
    },
    "scene",
)
REQUEST_BODY = {"required": True, "content": {media.JSON: {"schema": _REQUEST, "example": rendering.EXAMPLE}}}
