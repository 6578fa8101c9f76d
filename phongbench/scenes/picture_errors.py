"""What an error in a lobe means in a picture: every formula's picture of a scene beside that of exact Phong."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas import curves
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY, guarded
from phongbench.scenes import images
from phongbench.scenes.render import render
from phongbench.scenes.scene import Scene, SurfaceMaterial
from phongbench.scenes.skip_bounds import Bounds
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.specular_term import EXACT
from phongbench.support.progress import Progress

#: of a formula that has them
GAMMAS, FORMS = (4, 8, 16, 32), ("dot", "cross")
#: what is drawn where nobody names others; what a scene's exponents do not allow is left out, with the reason
USUAL = (
    *(Formula.of("lyon", form, gamma) for gamma in GAMMAS for form in FORMS),
    *map(
        Formula.parse, ("lyon:dot:8:minimax", "lyon-quadratic:dot:4", "gaussian:dot", "schlick", "blinn", "table-u:dot")
    ),
)
#: cosines at which a lobe is looked at; a fine grid near 1, where narrow lobes live
_GRID = 1 - np.concatenate([np.linspace(0, 1, 4001), np.logspace(-7, 0, 8001)])
_SILENT = Progress()


def own(registry: Registry, names: Iterable[str] | None = None) -> list[Formula]:
    """What is drawn of the user's own formulas: each of the usual lambda forms and gammas that it takes.

    names  only those; None: all that the registry has beyond ours
    """
    specs = [spec for name, spec in registry.items() if name not in REGISTRY and (names is None or name in names)]
    return [
        Formula(spec.name, form, gamma, spec.slopes[0], spec.spaces[0])
        for spec in specs
        for gamma in (GAMMAS if spec.uses_gamma else (None,))
        for form in [form for form in FORMS if form in spec.lambda_forms] or spec.lambda_forms[:1]
    ]


def compare(
    scene: Scene,
    formulas: Iterable[Formula] = USUAL,
    *,
    progress: Progress = _SILENT,
    registry: Registry = REGISTRY,
    **options: Any,
) -> list[dict[str, Any]]:
    """A row for each formula: its picture's error, and what the lobe's error promised.

    registry the approximations that formulas and materials may name
    options   of `render`: size, depth, ...
    returns  rows of formula (its spelling), approximation, lambda_form, gamma, beta; the fields of PictureError;
             `lobe_error`, a bound on a pixel's error from the lobe's error, the lights and the materials; `left_out`,
             why a formula could not be drawn, in which case there are no numbers: it does not fit a material, a user's
             own raises, or its picture is not finite
    """
    chosen = list(formulas)
    progress.stage(f"formulas of {scene.name}", len(chosen))
    options["registry"] = registry
    exact = render(scene.exact(), specular=EXACT, skips=SceneSkips.exact(), **options)
    rows = []
    for formula in chosen:
        row: dict[str, Any] = {
            "formula": formula.spelled(registry),
            "approximation": formula.approximation,
            "lambda_form": formula.lambda_form,
            "gamma": formula.gamma,
            "beta": formula.slope,
        }
        try:
            rows.append(row | _errors(scene, formula, exact.picture, options))
        except InputError as problem:
            rows.append(row | {"left_out": f"{problem.where}: {problem.what}" if problem.where else problem.what})
        progress.advance()
    return rows


def _errors(scene: Scene, formula: Formula, exact: Array, options: dict[str, Any]) -> dict[str, Any]:
    picture = render(scene, specular=formula, skips=SceneSkips.exact(), **options).picture
    return {
        **images.compare(exact, picture).as_dict(),
        "lobe_error": lobe_error(scene, formula, options["registry"]),
        "left_out": None,
    }


def lobe_error(scene: Scene, formula: Formula, registry: Registry = REGISTRY) -> float:
    """The most that a formula may change a pixel: each material's lobe error, times its highlight under all lights.

    Holds for unit normals in reflect space; a formula of (N, H) is taken at coplanar vectors, and may exceed it.
    """
    bounds = Bounds(scene)
    lit = (bounds.fades[:, None] * [light.specular for light in scene.lights]).sum(axis=0) if scene.lights else 0.0
    return max((_of_material(m, m.specular or formula, lit, registry) for m in scene.materials), default=0.0)


def _of_material(material: SurfaceMaterial, formula: Formula, lit: Any, registry: Registry) -> float:
    """The lobe's largest error times the material's highlight, under lights that are `lit` together."""
    reflection = material.reflection
    if max(reflection.specular) == 0:
        return 0.0
    spec, setting = formula.spec(registry), formula.setting(reflection.shininess)
    with guarded(spec):
        curve = curves.curve(spec, formula.lambda_form, setting, _GRID)
    if not np.isfinite(curve).all():
        angle = np.degrees(np.arccos(_GRID[~np.isfinite(curve)].max()))
        raise InputError(f"its lobe is not finite at {angle:.3g} degrees", f"materials.{material.name}")
    wrong = float(np.abs(curve - curves.exact(setting.alpha, _GRID)).max())
    return wrong * float(np.max(np.multiply(reflection.specular, lit)))
