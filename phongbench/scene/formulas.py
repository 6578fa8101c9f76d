"""What an error in a lobe means in a picture: every formula's picture of a scene beside that of exact Phong."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import kernels
from phongbench.errors import InputError
from phongbench.lighting import Specular
from phongbench.progress import Progress
from phongbench.scene import pictures
from phongbench.scene.bounds import Bounds
from phongbench.scene.parts import Material, Scene
from phongbench.scene.rendering import render
from phongbench.scene.thrift import Thrift

Array = NDArray[Any]

#: what is drawn where nobody asks for others; what a scene's exponents do not allow is left out and told
USUAL = (
    *(Specular("lyon", form, gamma) for gamma in (4, 8, 16, 32) for form in ("dot", "cross")),
    Specular("lyon", "dot", 8, "minimax"),
    Specular("lyon-quadratic", "dot", 4),
    Specular("gaussian", "dot"),
    Specular("schlick"),
    Specular("blinn"),
    Specular("table-u", "dot"),
)
#: cosines at which a lobe is looked at; a fine grid near 1, where narrow lobes live
_GRID = 1 - np.concatenate([np.linspace(0, 1, 4001), np.logspace(-7, 0, 8001)])
_SILENT = Progress()


def compare(
    scene: Scene, formulas: Iterable[Specular] = USUAL, *, rounds: int = 3, progress: Progress = _SILENT, **wishes: Any
) -> list[dict[str, Any]]:
    """A row for each formula: its picture's error, what the lobe's error promised, and its time over exact Phong's.

    rounds   pictures of each that are timed, in turn with exact Phong's; the time is all of a picture, rays included;
             0: none is, and seconds and ratio are None
    wishes   of `render`: size, depth, ...
    returns  rows of name, lambda_form, gamma, beta; the fields of PictureError; `lobe_error`, a bound on a pixel's
             error from the lobe's error, the lights and the materials; seconds and ratio; `left_out`, why a formula
             could not be drawn, in which case the numbers are None
    """
    chosen = list(formulas)
    progress.stage(f"formulas of {scene.name}", len(chosen))
    exact = render(scene, specular=Specular(), thrift=Thrift.exact(), **wishes)
    rows = []
    for formula in chosen:
        row: dict[str, Any] = {
            "approximation": formula.approximation, "lambda_form": formula.lambda_form, "gamma": formula.gamma,
            "beta": formula.beta,
        }  # fmt: skip
        try:
            rows.append(row | _measured(scene, formula, exact.picture, rounds, wishes))
        except InputError as problem:
            rows.append(row | {"left_out": f"{problem.where}: {problem.what}" if problem.where else problem.what})
        progress.advance()
    return rows


def why_not(scene: Scene, formula: Specular) -> str | None:
    """Why a formula does not fit a material of the scene, naming it; None if it fits all."""
    try:
        for material in scene.materials:
            (material.specular or formula).resolved("phong", material.reflection.highlight_exponent)
    except InputError as problem:
        return f"materials.{material.name}: {problem.what}"
    return None


def name_of(row: Mapping[str, Any]) -> str:
    """A formula as the command line writes it, and its beta policy if it is not the usual one."""
    parts = [row["approximation"], row["lambda_form"], row["gamma"]]
    name = ":".join(str(part) for part in parts if part is not None)
    return f"{name} {row['beta']}" if row["beta"] else name


def _measured(scene: Scene, formula: Specular, exact: Array, rounds: int, wishes: dict[str, Any]) -> dict[str, Any]:
    picture = render(scene, specular=formula, thrift=Thrift.exact(), **wishes).picture
    own: list[float] = []
    plain: list[float] = []
    for _ in range(rounds):
        own.append(render(scene, specular=formula, **wishes).seconds["total"])
        plain.append(render(scene, specular=Specular(), **wishes).seconds["total"])
    return {
        **pictures.compare(exact, picture).as_dict(),
        "lobe_error": lobe_error(scene, formula),
        "seconds": min(own, default=None),
        "ratio": float(np.median(np.divide(own, plain))) if own else None,
        "left_out": None,
    }


def lobe_error(scene: Scene, formula: Specular) -> float:
    """The most that a formula may change a pixel: each material's lobe error, times its highlight under all lights.

    Holds for unit normals in reflect space; a formula of (N, H) is taken at coplanar vectors, and may exceed it.
    """
    bounds = Bounds(scene)
    lit = (bounds.fades[:, None] * [light.specular for light in scene.lights]).sum(axis=0) if scene.lights else 0.0
    return max((_of_material(m, m.specular or formula, lit) for m in scene.materials), default=0.0)


def _of_material(material: Material, formula: Specular, lit: Any) -> float:
    """The lobe's largest error times the material's highlight, under lights that are `lit` together."""
    reflection = material.reflection
    if max(reflection.specular) == 0:
        return 0.0
    spec, form, setting, _ = formula.resolved("phong", reflection.shininess)
    wrong = float(np.abs(kernels.curve(spec, form, setting, _GRID) - np.maximum(_GRID, 0) ** setting.alpha).max())
    return wrong * float(np.max(np.multiply(reflection.specular, lit)))
