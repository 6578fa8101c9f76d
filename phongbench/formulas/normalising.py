"""How wrong lengths are removed from a pair of vectors: the axis `normalise` of a formula, beside its lambda form.

Each way is written as scalar bodies of the six components, lowered to every working precision like the lambda forms, so
that its accuracy (the lengths' part gone, the rounding part grown) and its time come from one source.

No way guards against lengths whose square leaves the precision's range: a zero vector or a NaN gives 0 through the gate
on a.b > 0, and squares that overflow (in float16 from a length of 256, in float32 of 1.8e19) or underflow give what a
shader gives too; they are counted as any other value that is not finite.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from phongbench.compiler import elementary, jit
from phongbench.compiler.lowering import Body, Precision, lower
from phongbench.formulas import lambda_forms, reciprocal_roots
from phongbench.formulas.lambda_forms import dot, squared_cross

Vector = tuple[Any, Any, Any]


def reciprocal_length(x: float, y: float, z: float) -> float:
    """1 / |v|, root and division correctly rounded."""
    return 1.0 / elementary.square_root(dot(x, y, z, x, y, z))


def fast_reciprocal_length(x: float, y: float, z: float) -> float:
    """1 / |v| by the bit trick with one Newton step: at most 1.8e-3 too small. Source LOMONT_2003."""
    return reciprocal_roots.bit_trick(dot(x, y, z, x, y, z))


def estimated_reciprocal_length(x: float, y: float, z: float) -> float:
    """1 / |v| by a table of 12 bits, as a processor's estimate gives it: within 1.5 * 2^-12."""
    return reciprocal_roots.estimate(dot(x, y, z, x, y, z))


def instructed_reciprocal_length(x: float, y: float, z: float) -> float:
    """1 / |v| by the processor's own estimate, which differs among processors: timed, and no error is told of it."""
    return reciprocal_roots.instruction(dot(x, y, z, x, y, z))


def scaled(component: float, factor: float) -> float:
    """One component of a vector times a number."""
    return component * factor


def cosine_once(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """The cosine of the angle between a and b with one root: a.b / sqrt((a.a)(b.b))."""
    squares = dot(ax, ay, az, ax, ay, az) * dot(bx, by, bz, bx, by, bz)
    return dot(ax, ay, az, bx, by, bz) / elementary.square_root(squares)


def deficit_once(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Lambda form `dot` with one root: 1 - a.b / sqrt((a.a)(b.b))."""
    return 1.0 - cosine_once(ax, ay, az, bx, by, bz)


def cross_once(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Lambda form `cross` without a root: |a x b|^2 / (2 (a.a)(b.b)). Source LYON_1993."""
    squares = dot(ax, ay, az, ax, ay, az) * dot(bx, by, bz, bx, by, bz)
    return 0.5 * squared_cross(ax, ay, az, bx, by, bz) / squares


def cosine_squared(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """The square of the cosine without a root, (a.b)^2 / ((a.a)(b.b)): for powers, at half the exponent."""
    x = dot(ax, ay, az, bx, by, bz)
    return x * x / (dot(ax, ay, az, ax, ay, az) * dot(bx, by, bz, bx, by, bz))


@dataclass(frozen=True)
class Normalise:
    """One way of removing lengths.

    text         for people
    reciprocal   1 / |v| of each vector's components, where each vector is made unit first
    forms        lambda form (none: the cosine) -> the body that stands for it, where the pair is treated as a whole
    precisions   in which it makes sense; empty for all
    instruction  what is timed where `reciprocal` stands for an instruction: that has the same values everywhere, but a
                 table's time
    """

    text: str
    reciprocal: Body | None = None
    forms: tuple[tuple[str, Body], ...] = ()
    precisions: tuple[str, ...] = ()
    instruction: Body | None = None


#: the ways, by the name that a formula's spelling gives after its slash
NORMALISE: dict[str, Normalise] = {
    "none": Normalise("takes the vectors as they are"),
    "each": Normalise("v * (1 / sqrt(v.v)) for both", reciprocal_length),
    "once": Normalise(
        "the pair together: one root for a.b, one division and no root for |a x b|^2",
        forms=(("none", cosine_once), ("dot", deficit_once), ("cross", cross_once)),
    ),
    "squared": Normalise("the square of the cosine, no root", forms=(("none", cosine_squared),)),
    "fast": Normalise("each, by the bit trick with one Newton step", fast_reciprocal_length, precisions=("float32",)),
    "estimate": Normalise(
        "each, by a 12-bit estimate of the root; errors by a table, times by the processor's own",
        estimated_reciprocal_length,
        precisions=("float32",),
        instruction=instructed_reciprocal_length,
    ),
}


@cache
def pair_bodies(form: str, normalise: str, precision: Precision, timed: bool = False) -> tuple[Body, Body]:
    """The coordinate of a pair and what its gate asks, as compiled functions of the six components.

    form       a lambda form, or none for formulas of the cosine
    normalise  a name in NORMALISE that takes this form
    timed      True for a way's instruction instead of what stands for it
    returns    (coordinate, gate): the gate is open where it is positive. Where the pair is treated as a whole, that is
               a.b as it is: no length changes its sign
    """
    way = NORMALISE[normalise]
    if way.forms:
        return lower(dict(way.forms)[form], precision), lower(dot, precision)
    coordinate = lower(dot if form == "none" else lambda_forms.LAMBDA_FORMS[form], precision)
    cosine = lower(dot, precision)
    reciprocal = way.instruction if timed and way.instruction else way.reciprocal
    if reciprocal is None:
        return coordinate, cosine
    return _of_unit(coordinate, reciprocal, precision), _of_unit(cosine, reciprocal, precision)


def _of_unit(body: Body, reciprocal: Body, precision: Precision) -> Body:
    """The body on vectors that are made unit first."""
    inverse, times = lower(reciprocal, precision), lower(scaled, precision)

    def of_unit(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any) -> Any:
        p, q = inverse(ax, ay, az), inverse(bx, by, bz)
        return body(times(ax, p), times(ay, p), times(az, p), times(bx, q), times(by, q), times(bz, q))

    return jit.inline(of_unit, precision.carrier)


def plain(form: str, normalise: str) -> Callable[[Vector, Vector], tuple[Any, Any]]:
    """The same in plain Python: (a, b) -> coordinate and gate, for any kind of number; the oracle of the compiled."""
    way, body = NORMALISE[normalise], dot if form == "none" else lambda_forms.LAMBDA_FORMS[form]

    def of_pair(a: Vector, b: Vector) -> tuple[Any, Any]:
        if way.forms:
            return dict(way.forms)[form](*a, *b), dot(*a, *b)
        if way.reciprocal is not None:
            p, q = way.reciprocal(*a), way.reciprocal(*b)
            a, b = (a[0] * p, a[1] * p, a[2] * p), (b[0] * q, b[1] * q, b[2] * q)
        return body(*a, *b), dot(*a, *b)

    return of_pair
