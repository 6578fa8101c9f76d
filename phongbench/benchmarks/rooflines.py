"""The least that shading and pictures can take here: their multiply-adds, roots and bytes, over what one core gives.

What a call asks is counted from its own ledger, so only from work that was not left out: rays against objects, points,
and (point, light) pairs, each at what the textbook's vector formula multiplies and takes roots of. A point is read and
its colour written once. Like the bounds of loops this is from below: choices between surfaces, values kept between
steps and tiles that are not full are not in it, nor the triangles that Embree tests.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from phongbench.benchmarks import bounds
from phongbench.benchmarks.bounds import BYTES, PORTS, ROOM, ROOTS
from phongbench.compiler.lowering import FLOAT32
from phongbench.formulas.formula import Formula
from phongbench.scenes.render import Rendered
from phongbench.scenes.scene import Mesh, Plane, Scene, Sphere
from phongbench.shading.shade import Shaded
from phongbench.shading.specular_term import EXACT
from phongbench.timing.timed_kernels import TimedFormula, compiled

#: bytes of a float32 vector
VECTOR = 12


@dataclass(frozen=True)
class Asked:
    """What is asked of one thread of the machine.

    multiply_adds  float32 multiplications, with an addition or without
    roots          roots with their quotients; one of both alone is half of it
    bytes          that enter or leave caches
    """

    multiply_adds: float
    roots: float = 0.0
    bytes: float = 0.0

    def __add__(self, other: "Asked") -> "Asked":
        return Asked(self.multiply_adds + other.multiply_adds, self.roots + other.roots, self.bytes + other.bytes)

    def __mul__(self, count: float) -> "Asked":
        return Asked(count * self.multiply_adds, count * self.roots, count * self.bytes)


#: steps of the reflection model, and of rays: a product a.b; v * (1 / sqrt(v.v)); 2 (N.L) N - L, doubled by an
#: addition; a light's term times three channels, added
DOT, UNIT, REFLECTED, COLOURED = Asked(3), Asked(6, 1), Asked(3), Asked(3)
#: b = f.d and |f - b d|^2 against r^2, whose root is taken; n.o and n.d, and their quotient; o + t d and (p - c) / r
SPHERE, PLANE, FOUND = Asked(9, 0.5), Asked(6, 0.5), Asked(6)


def of_pairs(points: int, skipped: Mapping[str, int], term: float, *, unit: Asked, placed: bool) -> Asked:
    """Shading: points made ready, and the terms of the pairs of points and lights that remain.

    skipped  the fields of `shade.Ledger`
    term     multiply-adds of the specular term from a pair of vectors, their product included
    unit     what making a point's vectors unit asks for
    placed   whether lights have positions, so that each pair has its own L
    """
    unlit = sum(skipped.get(name, 0) for name in ("zero_colours", "out_of_reach", "in_shadow", "lights_behind"))
    facing = skipped["pairs"] - unlit
    lit = facing - sum(skipped.get(name, 0) for name in ("beyond_support", "dark_tail", "vectors_not_built"))
    each = DOT + COLOURED + (UNIT if placed else Asked(0))
    return unit * points + each * facing + (REFLECTED + Asked(term) + COLOURED) * lit


def of_shaded(done: Shaded, term: float, *, placed: bool) -> Asked:
    """What `shade` asked for; normals are made unit, and V at each point."""
    points = len(done.colours)
    shading = of_pairs(points, done.ledger.as_dict(), term, unit=UNIT * 2, placed=placed)
    return shading + Asked(0, 0, 3 * VECTOR * points)


def of_picture(scene: Scene, done: Rendered) -> Asked:
    """What drawing a scene asked for; everything but the picture stays in caches."""
    lines = {line.name: line for line in done.ledger}
    spheres, planes = len(scene.of(Sphere)), len(scene.of(Plane))
    remaining = {name: lines[name].of - lines[name].skipped for name in ("objects", "shadow_rays")}
    solids = max(1, spheres + planes)
    tests = remaining["objects"] + solids * remaining["shadow_rays"] if spheres + planes else 0
    tested = (SPHERE * spheres + PLANE * planes) * (tests / solids)
    skipped = {line.name: line.skipped for line in done.ledger if line.unit == "point-light pairs"}
    skipped["pairs"] = max((line.of for line in done.ledger if line.unit == "point-light pairs"), default=0)
    points = skipped["pairs"] // max(1, len(scene.lights))
    placed = all(light.position is not None for light in scene.lights)
    least = min(term(material.specular or EXACT) for material in scene.materials)
    shading = of_pairs(points, skipped, least, unit=UNIT, placed=placed)
    width, height = scene.picture.size
    return tested + UNIT * done.rays + FOUND * points + shading + Asked(0, 0, VECTOR * width * height)


def term(formula: Formula) -> float:
    """Multiply-adds of a specular term from a pair of vectors, counted in the code of its loop; 0 where it is not."""
    work = bounds.of_loop(compiled(TimedFormula.of(str(formula), FLOAT32)).kernel.loop)
    return 0.0 if work is None else work.multiply_adds * work.lanes


def columns(asked: Asked, seconds: float, ceilings: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """The columns of a roofline: what is asked, bound in seconds, over_bound, bound_by; None where it is unknown.

    ceilings  of `kernel_bench.bench`: what is computed is computed in caches, bytes are moved beyond them
    """
    told: dict[str, Any] = {"multiply_adds": asked.multiply_adds, "roots": asked.roots, "bytes": asked.bytes}
    near, far = ceilings.get("l2"), ceilings.get("memory")
    if not near or not far:
        return told | {"bound": None, "over_bound": None, "bound_by": None}
    parts = {
        PORTS: asked.multiply_adds / (near[PORTS] * bounds.lanes()) / 1e9,
        ROOTS: asked.roots / near[ROOTS] / 1e9,
        BYTES: asked.bytes / far[BYTES] / 1e9,
    }
    unit = max(parts, key=lambda name: parts[name])
    return told | {"bound": parts[unit], "over_bound": seconds / parts[unit], "bound_by": unit}


def excuse(row: Mapping[str, Any], scene: Scene | None = None) -> str | None:
    """Where a call spends its time that takes more than ROOM times its bound; None where it does not."""
    if row["over_bound"] is None or row["over_bound"] <= ROOM:
        return None
    head = f"{row['name']}: {row['over_bound']:.3g} times its roofline; "
    if scene is None:
        return head + "rows become planes, which each step of a tile reads and writes in cache: that is in no roofline"
    by = "Embree, whose triangles are not counted, and by " if scene.of(Mesh) else ""
    shares = f"{row['tracing']:.0%} of it by {by}rays and sorting what they hit, {row['shading']:.0%} by shading"
    return f"{head}{shares}, the rest before and between"
