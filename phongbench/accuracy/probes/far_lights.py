"""How far is far enough to hold L.N and R.V constant over a polygon: a square, with light and viewer moving away."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from phongbench.compiler.precisions import Array
from phongbench.inputs.plan import Plan
from phongbench.results.schema import FAR
from phongbench.shading.lighting import WHITE, Light, Material, Skips, Viewer
from phongbench.shading.shade import shade

#: the plan's exponents nearest to these are asked about
ALPHAS = (10.0, 50.0, 200.0, 1000.0)
#: of light and viewer from the square's middle, in its sides
DISTANCES = tuple(4.0**n for n in range(10))
#: degrees of the light from the normal, and of the plane of incidence from the square's side
INCIDENCES, TURNS = (0.0, 30.0, 60.0), (0.0, 45.0)
#: of the viewer from the mirrored light, in units of 1 / sqrt(alpha): the lobe's peak, its steepest place, its foot
OFFSETS = (0.0, 0.5, 1.0, 2.0)
#: points along a side, corners included
SIDE = 17
#: what is constant, per term: the diffuse one does not see the viewer
HELD = {"diffuse": ("light",), "specular": ("light", "viewer", "both")}
_NOTHING = Skips.none()


@dataclass(frozen=True)
class Placement:
    """Unit directions from the square's middle to light and viewer, and the angles they were made of, in degrees."""

    light: Array
    viewer: Array
    incidence: float
    offset: float


def placements(alpha: float) -> Iterator[Placement]:
    """Where light and viewer stand: at several incidences, the viewer in the lobe and on its flank."""
    for incidence in INCIDENCES:
        for turn in TURNS:
            for offset in OFFSETS:
                degrees = math.degrees(offset / math.sqrt(alpha))
                # the viewer is beside the mirrored light, towards the normal, so that it stays above the square
                pair = (_direction(incidence, turn), _direction(degrees - incidence, turn))
                yield Placement(*pair, incidence, degrees)


def measure(plan: Plan) -> pd.DataFrame:
    """The rows of far.parquet, in the order of terms, exponents, what is held, and distances."""
    terms = [("diffuse", math.nan), *(("specular", alpha) for alpha in alphas(plan))]
    rows = [
        row
        for term, alpha in terms
        for held in HELD[term]
        for row in (_row(held, term, alpha, distance) for distance in DISTANCES)
    ]
    return FAR.frame(rows)


def alphas(plan: Plan) -> list[float]:
    """The plan's exponents nearest to ALPHAS, by their ratio; each once, ascending."""
    return sorted({min(plan.alphas, key=lambda a: (abs(math.log(a / wanted)), a)) for wanted in ALPHAS})


def error(placement: Placement, held: str, term: str, alpha: float, distance: float) -> float:
    """The largest change on the square by holding directions as at its middle; of a term at full strength."""
    true = _term(placement, "nothing", term, alpha, distance)
    return float(np.abs(_term(placement, held, term, alpha, distance) - true).max())


@cache
def square() -> tuple[Array, Array]:
    """Points (n, 3) of a square with a side of 1 around the origin, and their normals."""
    steps = np.linspace(-0.5, 0.5, SIDE)
    x, y = (v.ravel() for v in np.meshgrid(steps, steps))
    return np.stack([x, y, np.zeros_like(x)], axis=1), np.tile([0.0, 0.0, 1.0], (len(x), 1))


def _row(held: str, term: str, alpha: float, distance: float) -> dict[str, Any]:
    """The worst of all placements. The diffuse term has no lobe: any exponent places a viewer that it does not see."""
    places = list(placements(1.0 if term == "diffuse" else alpha))
    errors = [error(place, held, term, alpha, distance) for place in places]
    worst = int(np.argmax(errors))
    return {
        "held": held,
        "term": term,
        "alpha": alpha,
        "distance": distance,
        "placements": len(places),
        "samples": len(places) * SIDE**2,
        "max_abs": errors[worst],
        "incidence_degrees": places[worst].incidence,
        "offset_degrees": places[worst].offset if term == "specular" else math.nan,
    }


def _term(placement: Placement, held: str, term: str, alpha: float, distance: float) -> Array:
    """Values of one term at all points, its light or viewer at a place, or in a direction where it is held."""
    light, viewer = (tuple(map(float, direction)) for direction in (placement.light, placement.viewer))
    there = [tuple(distance * c for c in direction) for direction in (light, viewer)]
    lit = Light(direction=light) if held in ("light", "both") else Light(position=there[0])
    seen = Viewer(direction=viewer) if held in ("viewer", "both") else Viewer(position=there[1])
    material = Material(diffuse=WHITE) if term == "diffuse" else Material(specular=WHITE, shininess=alpha)
    points, normals = square()
    return shade(points, normals, material=material, lights=[lit], viewer=seen, skips=_NOTHING).colours[:, 0]


def _direction(from_normal: float, turn: float) -> Array:
    a, t = math.radians(from_normal), math.radians(turn)
    return np.array([math.sin(a) * math.cos(t), math.sin(a) * math.sin(t), math.cos(a)])
