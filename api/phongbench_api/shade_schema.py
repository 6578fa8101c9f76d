"""The shading request as a JSON schema, for the OpenAPI document; phongbench.shading.requests is what reads it."""

from typing import Any

from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import ALPHA, GAMMA
from phongbench_api import shading
from phongbench_api.http import media

_NUMBER = {"type": "number"}
_THREE = {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}
_COLOUR = {"type": "array", "items": {"type": "number", "minimum": 0}, "minItems": 3, "maxItems": 3}
_VECTORS = {"type": "array", "items": _THREE}


def _object(properties: dict[str, Any], *required: str) -> dict[str, Any]:
    members: dict[str, Any] = {"type": "object", "additionalProperties": False, "properties": properties}
    return members | ({"required": list(required)} if required else {})


_SPECULAR = _object(
    {
        "approximation": {"type": "string", "enum": list(REGISTRY)},
        "lambda": {"type": ["string", "null"], "enum": [*LAMBDA_FORMS, "none", None]},
        "gamma": {"type": ["integer", "null"], "minimum": GAMMA.low, "maximum": GAMMA.high},
        "beta": {"type": ["string", "number", "null"], "description": "a policy, or the slope itself"},
    }
)
_MATERIAL = _object(
    {
        "ambient": _COLOUR,
        "diffuse": _COLOUR,
        "specular": _COLOUR,
        "shininess": {"type": "number", "minimum": ALPHA.low, "maximum": ALPHA.high},
    },
    "ambient",
    "diffuse",
    "specular",
    "shininess",
)
_LIGHT = _object(
    {
        "direction": _THREE | {"description": "from the surface to the light"},
        "position": _THREE,
        "attenuation": _COLOUR | {"description": "c, l, q of 1 / (c + l d + q d^2)"},
        "diffuse": _COLOUR,
        "specular": _COLOUR,
        "reach": {"type": "number", "minimum": 0},
    }
)
_COMMON: dict[str, Any] = {
    "model": {"type": "string", "enum": ["phong", "blinn-phong"], "default": "phong"},
    "specular": _SPECULAR,
    "material": _MATERIAL,
    "ambient_light": _COLOUR,
    "lights": {"type": "array", "items": _LIGHT},
    "viewer": _object({"position": _THREE, "direction": _THREE}),
    "normalise": {"type": "boolean", "default": True},
}
_BULK = {"points": _VECTORS, "normals": _VECTORS, "precision": {"type": "string", "enum": ["float32", "float64"]}}
_PLAIN = _object(_COMMON | _BULK, "material", "lights", "viewer", "points", "normals")
_FORM = _object(
    {"request": _object(_COMMON, "material", "lights", "viewer"), "vectors": {"type": "string", "format": "binary"}},
    "request",
    "vectors",
)
REQUEST_BODY = {
    "required": True,
    "content": {
        media.JSON: {"schema": _PLAIN, "example": shading.EXAMPLE},
        media.MULTIPART: {
            "schema": _FORM,
            "encoding": {"request": {"contentType": media.JSON}, "vectors": {"contentType": media.NPY}},
        },
    },
}
