"""The words that a reader of the answer meets first, each in a line: the README's glossary, and the report's legend."""

from collections.abc import Iterable

from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.targets.chips import TARGETS

#: word -> meaning; `code` between backticks
WORDS = {
    "exact Phong": "Phong's specular term, max(0, a.b)^alpha: what every error and cost is measured against",
    "alpha, α": "the shininess, the exponent of exact Phong",
    "a, b": "the pair of directions: (R, V), mirrored light and viewer; with `@half` (N, H), normal and half-way",
    "error, code": "approximation minus exact Phong; a code is one step of an 8-bit channel, 1/255",
    "cost": "time or cycles over exact Phong's on the same target: 0.5 is half",
    "target": "where a formula runs: `cpu` is this machine, timed; the others are compiled for, and their cost counted",
    "spelling": "`NAME[:FORM][:GAMMA][:SLOPE][@RECIPE][/NORMALISE]`, the same in every command, table and request",
    "lambda form": "how 1 - cos is computed: `dot` 1 - a.b, `difference` half of |a - b|^2, `cross` half of |a x b|^2",
    "gamma, γ": "the exponent 2^n that n squarings evaluate",
    "beta, slope": (
        "the slope of an approximation at its peak: `taylor` the curve's own, `minimax` least largest error, "
        "`energy` same light"
    ),
    "recipe, normalise": (
        "how the pair is made from N, L and V (`@reflect`, ...), and how wrong lengths are removed (`/each`, `/once`, "
        "`/squared`)"
    ),
    "front": "the formulas that no other beats in both error and time",
}  # fmt: skip
#: those of a verdict table
LEGEND = ("alpha, α", "error, code", "cost", "target", "lambda form", "gamma, γ", "beta, slope")


def names(spellings: Iterable[str]) -> str:
    """What the names of formulas stand for: "`lyon` Lyon; `phong` Phong (exact)"."""
    found = sorted({Formula.parse(spelling).approximation for spelling in spellings} & set(REGISTRY))
    return "; ".join(f"`{name}` {REGISTRY[name].title}" for name in found)


def chips(targets: Iterable[str]) -> str:
    """What the names of compiled targets stand for: "`rdna2` AMD RDNA 2"."""
    return "; ".join(f"`{name}` {TARGETS[name].title}" for name in targets if name in TARGETS)
