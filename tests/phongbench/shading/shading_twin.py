"""A slow float64 twin of shading, as books write the model, and the scenes that tests shade."""

from typing import Any

import numpy as np

from phongbench.formulas import normalising, recipes
from phongbench.shading.shade import Formula, Light, Material, Viewer

Array = np.ndarray[Any, Any]

GREY = Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.9, 0.8, 0.7), 50.0)
ABOVE = Light(direction=(0, 0, 1))
LAMP = Light(position=(1.0, -2.0, 3.0), attenuation=(0.5, 0.2, 0.1), diffuse=(1, 0.5, 0.25), specular=(0.5, 1, 1))
EYE = Viewer(position=(0.5, 0.5, 6.0))
AFAR = Viewer(direction=(0.3, 0.1, 2.0))
LYON, EXACT_PHONG = Formula.of("lyon", "dot", 8), Formula()


def cloud(count: int, dtype: Any = np.float64, seed: int = 1, spread: float = 1.0) -> tuple[Array, Array]:
    """Points near the origin, normals around +z, of lengths near 1; a small spread makes coherent blocks."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    normals = rng.normal(size=(count, 3)) * spread + (0, 0, 1)
    return points.astype(dtype), normals.astype(dtype)


def wave(count: int, dtype: Any = np.float64) -> tuple[Array, Array]:
    """Points along a path around the unit sphere: neighbours have nearly the same normal, as in an image."""
    t = np.linspace(0, 1, count)
    z, angle = np.cos(np.pi * t), 9 * np.pi * t
    n = np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)
    return n.astype(dtype), n.astype(dtype)


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v))


def twin(
    points: Array,
    normals: Array,
    *,
    material: Material,
    lights: Any,
    viewer: Viewer,
    ambient_light: Any = (0, 0, 0),
    model: str = "phong",
    specular: Formula = EXACT_PHONG,
    normalise: bool = True,
    visible: Any = None,
) -> Array:
    """The reflection model as it is written in books: one point after the other, one light after the other."""
    spec, form, setting = specular.spec(), specular.lambda_form, specular.setting(material.shininess)
    space = "half" if model == "blinn-phong" else specular.space
    body = spec.bound(setting)
    colours = np.empty((len(points), 3))
    for i, (p, n) in enumerate(zip(points.astype(float), normals.astype(float), strict=True)):
        N = unit(n) if normalise else n
        V = np.array(viewer.direction) if viewer.position is None else unit(np.array(viewer.position) - p)
        total = np.multiply(material.ambient, ambient_light)
        for k, light in enumerate(lights):
            away = 0.0 if light.position is None else float(np.linalg.norm(np.array(light.position) - p))
            c, linear, q = light.attenuation
            total = total + np.multiply(material.ambient, light.ambient) / (c + linear * away + q * away * away)
            if visible is not None and not visible[k][i]:
                continue
            L, att = np.array(light.direction or (0, 0, 0)), 1.0
            if light.position is not None:
                d = float(np.linalg.norm(np.array(light.position) - p))
                c, linear, q = light.attenuation
                L, att = (np.array(light.position) - p) / d, 1 / (c + linear * d + q * d * d)
            if N @ L <= 0:
                continue
            total = total + att * (N @ L) * np.multiply(material.diffuse, light.diffuse)
            a, b = (2 * (N @ L) * N - L, V) if space == "reflect" else (N, unit(L + V))
            if specular.recipe != "pair":
                six = recipes.plain(specular.recipe)(*N, *L, *V)
                a, b = six[:3], six[3:]
            x, gate = normalising.plain(form, specular.normalise)(a, b)
            if gate > 0:
                colour = np.multiply(material.specular, light.specular)
                if material.fresnel is not None:
                    incidence = np.sqrt((1 + L @ V) / 2)
                    colour = colour * [float(material.fresnel.bound(c)(incidence)) for c in range(3)]
                total = total + att * float(body(x)) * colour
        colours[i] = total
    return colours


def scene(**changes: Any) -> dict[str, Any]:
    return {"material": GREY, "lights": (ABOVE, LAMP), "viewer": EYE, "ambient_light": (1, 1, 1), **changes}


def tolerance(dtype: Any, sharpness: float) -> float:
    """Rounding of the directions, which the exponent multiplies, and of the fast power."""
    return float(np.finfo(dtype).eps) * (64 + 16 * sharpness)
