"""How a pair is made from what a shader holds: the recipe of a formula, from N, L and V to the two directions.

Scalar bodies for single components, lowered to every working precision; their composition stands once for compiled code
and once in plain Python, which is its oracle.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from phongbench.compiler import jit
from phongbench.compiler.lowering import Body, Precision, lower
from phongbench.formulas.lambda_forms import dot
from phongbench.formulas.normalising import reciprocal_length, scaled


def doubled_cosine(nx: float, ny: float, nz: float, lx: float, ly: float, lz: float) -> float:
    """2 N.L."""
    return 2.0 * dot(nx, ny, nz, lx, ly, lz)


def mirrored(n: float, light: float, twice: float) -> float:
    """A component of R = 2 (N.L) N - L, for a unit N; `twice` is 2 N.L."""
    return twice * n - light


def mirrored_lengthwise(n: float, light: float, twice: float, square: float) -> float:
    """A component of R = 2 (N.L) N - (N.N) L: the mirror direction for any length of N, with length |N|^2 |L|."""
    return twice * n - square * light


def halfway(light: float, p: float, view: float, q: float) -> float:
    """A component of H = L/|L| + V/|V|; p and q are 1/|L| and 1/|V|. H is as long as twice the angle's cosine."""
    return light * p + view * q


@dataclass(frozen=True)
class Recipe:
    """One way from N, L and V to a pair.

    space  the pair that it makes: reflect (R, V) or half (N, H)
    text   for people
    """

    space: str
    text: str


#: the recipes from N, L and V, by the name that a formula's spelling gives after its @
RECIPES: dict[str, Recipe] = {
    "reflect": Recipe("reflect", "R = 2 (N.L) N - L, N normalised first"),
    "lengthwise": Recipe("reflect", "R = 2 (N.L) N - (N.N) L, nothing normalised"),
    "halfway": Recipe("half", "H = L/|L| + V/|V|"),
}
#: the recipe of a formula that is given its two directions
PAIR = "pair"

Nine = tuple[Any, ...]


@cache
def pair_of(recipe: str, precision: Precision) -> Body:
    """Compiled: the nine components of N, L and V to the six of the pair."""
    return jit.inline(_composed(recipe, lambda body: lower(body, precision)), 6 * (precision.carrier,))


def plain(recipe: str) -> Callable[..., Nine]:
    """The same in plain Python, for any kind of number."""
    return _composed(recipe, lambda body: body)


def _composed(recipe: str, made: Callable[[Body], Body]) -> Callable[..., Nine]:
    inverse, times, doubled, product = made(reciprocal_length), made(scaled), made(doubled_cosine), made(dot)
    mirror, lengthwise, half = made(mirrored), made(mirrored_lengthwise), made(halfway)

    def reflect(nx: Any, ny: Any, nz: Any, lx: Any, ly: Any, lz: Any, vx: Any, vy: Any, vz: Any) -> Nine:
        p = inverse(nx, ny, nz)
        x, y, z = times(nx, p), times(ny, p), times(nz, p)
        twice = doubled(x, y, z, lx, ly, lz)
        return mirror(x, lx, twice), mirror(y, ly, twice), mirror(z, lz, twice), vx, vy, vz

    def at_length(nx: Any, ny: Any, nz: Any, lx: Any, ly: Any, lz: Any, vx: Any, vy: Any, vz: Any) -> Nine:
        twice, square = doubled(nx, ny, nz, lx, ly, lz), product(nx, ny, nz, nx, ny, nz)
        rx, ry = lengthwise(nx, lx, twice, square), lengthwise(ny, ly, twice, square)
        return rx, ry, lengthwise(nz, lz, twice, square), vx, vy, vz

    def middle(nx: Any, ny: Any, nz: Any, lx: Any, ly: Any, lz: Any, vx: Any, vy: Any, vz: Any) -> Nine:
        p, q = inverse(lx, ly, lz), inverse(vx, vy, vz)
        return nx, ny, nz, half(lx, p, vx, q), half(ly, p, vy, q), half(lz, p, vz, q)

    return {"reflect": reflect, "lengthwise": at_length, "halfway": middle}[recipe]
