"""The least that shading and pictures can take here: their multiply-adds and bytes, over what one core gives.

What a call asks is counted from its own ledger, so only from work that was not left out: rays against objects, points,
and (point, light) pairs, each at what the textbook's vector formula multiplies. A point is read and its colour written
once. Like the bounds of loops this is from below: divisions, roots and choices between surfaces are not in it, nor the
triangles that Embree tests, nor making and sorting rays.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from phongbench.benchmarks import bounds
from phongbench.benchmarks.bounds import BYTES, PORTS, ROOM
from phongbench.compiler.lowering import FLOAT32
from phongbench.formulas.formula import Formula
from phongbench.scenes.render import Rendered
from phongbench.scenes.scene import Mesh, Plane, Scene, Sphere
from phongbench.shading.shade import Shaded
from phongbench.shading.specular_term import EXACT
from phongbench.timing.timed_kernels import TimedFormula, compiled

#: multiplications of the steps of the reflection model, and of rays
DOT = 3
#: v * (1 / sqrt(v.v))
UNIT = DOT + 3
#: 2 (N.L) N - L, doubled by an addition
REFLECTED = 3
#: a term of a light times three channels, added
COLOURED = 3
#: b = f.d, then |f - b d|^2 against r^2 (r * r is the sphere's)
SPHERE = DOT + 3 + DOT
#: n.o and n.d
PLANE = 2 * DOT
#: o + t d, and (p - c) / r
FOUND = 3 + 3
#: bytes of a float32 vector
VECTOR = 12


@dataclass(frozen=True)
class Asked:
    """What a call asks of the machine, of one thread: float32 multiply-adds, and bytes that enter or leave caches."""

    multiply_adds: float
    bytes: float


def of_pairs(points: int, skipped: Mapping[str, int], term: float, *, placed: bool = False) -> float:
    """Multiply-adds of shading: points made ready, and the terms of the pairs of points and lights that remain.

    skipped  the fields of `shade.Ledger`
    term     multiply-adds of the specular term from a pair of vectors, their product included
    placed   whether lights have positions, so that each pair has its own L
    """
    unlit = sum(skipped.get(name, 0) for name in ("zero_colours", "out_of_reach", "in_shadow", "lights_behind"))
    facing = skipped["pairs"] - unlit
    lit = facing - sum(skipped.get(name, 0) for name in ("beyond_support", "dark_tail", "vectors_not_built"))
    each = DOT + COLOURED + (UNIT if placed else 0)
    return 2 * UNIT * points + each * facing + (REFLECTED + term + COLOURED) * lit


def of_shaded(done: Shaded, term: float, *, placed: bool) -> Asked:
    """What `shade` asked for; normals are made unit, and V at each point."""
    points = len(done.colours)
    return Asked(of_pairs(points, done.ledger.as_dict(), term, placed=placed), 3 * VECTOR * points)


def of_picture(scene: Scene, done: Rendered) -> Asked:
    """What drawing a scene asked for; everything but the picture stays in caches."""
    lines = {line.name: line for line in done.ledger}
    spheres, planes = len(scene.of(Sphere)), len(scene.of(Plane))
    solids = spheres + planes
    remaining = {name: lines[name].of - lines[name].skipped for name in ("objects", "shadow_rays")}
    tests = remaining["objects"] + solids * remaining["shadow_rays"]
    test = (SPHERE * spheres + PLANE * planes) / max(1, solids)
    skipped = {line.name: line.skipped for line in done.ledger if line.unit == "point-light pairs"}
    skipped["pairs"] = max((line.of for line in done.ledger if line.unit == "point-light pairs"), default=0)
    points = skipped["pairs"] // max(1, len(scene.lights))
    placed = all(light.position is not None for light in scene.lights)
    shading = of_pairs(points, skipped, min(_terms(scene)), placed=placed)
    width, height = scene.picture.size
    return Asked(test * tests + UNIT * done.rays + FOUND * points + shading, VECTOR * width * height)


def _terms(scene: Scene) -> list[float]:
    return [term(material.specular or EXACT) for material in scene.materials]


def term(formula: Formula) -> float:
    """Multiply-adds of a specular term from a pair of vectors, counted in the code of its loop; 0 where it is not."""
    work = bounds.of_loop(compiled(TimedFormula.of(str(formula), FLOAT32)).kernel.loop)
    return 0.0 if work is None else work.multiply_adds * work.lanes


def columns(asked: Asked, seconds: float, ceilings: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """The columns of a roofline: multiply_adds, bytes, bound in seconds, over_bound, bound_by; None where unknown.

    ceilings  of `kernel_bench.bench`: multiply-adds are done in caches, bytes are moved beyond them
    """
    told: dict[str, Any] = {"multiply_adds": asked.multiply_adds, "bytes": asked.bytes}
    near, far = ceilings.get("l2"), ceilings.get("memory")
    if not near or not far:
        return told | {"bound": None, "over_bound": None, "bound_by": None}
    parts = {
        PORTS: asked.multiply_adds / (near[PORTS] * bounds.lanes()) / 1e9,
        BYTES: asked.bytes / far[BYTES] / 1e9,
    }
    unit = max(parts, key=lambda name: parts[name])
    return told | {"bound": parts[unit], "over_bound": seconds / parts[unit], "bound_by": unit}


def excuse(row: Mapping[str, Any], scene: Scene | None = None) -> str | None:
    """Why a call takes more than ROOM times its bound, as far as it is known; None where it does not."""
    if row["over_bound"] is None or row["over_bound"] <= ROOM:
        return None
    head = f"{row['name']}: {row['over_bound']:.1f} times its roofline; "
    if scene is None:
        return head + "divisions and roots of unit vectors, and tiles filled and emptied, are in no roofline"
    shares = f"tracing takes {row['tracing']:.0%} and shading {row['shading']:.0%} of it; "
    embree = "Embree's triangles, " if scene.of(Mesh) else ""
    return f"{head}{shares}{embree}roots, divisions and sorting rays by what they hit are in no roofline"
