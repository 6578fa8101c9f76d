"""Claim j: an exponent of 200 or more is a near-perfect reflector."""

import math

from phongbench.analysis.claims.claim import Claim, Finding, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.words import percent, rounded, sentence
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.citations import HYPERGRAPH

#: the exponent that the textbooks name, and larger ones that formats and renderers know
CLAIMED, FURTHER = 200.0, (1000.0, 2048.0, 10000.0, 100000.0)
#: half the angle of the sun's disc, in degrees: what a mirror shows sharply outdoors
SUN = 0.267
#: what the eye resolves, in degrees
EYE = 1 / 60


def judge(rows: Rows) -> Finding:
    """By formula, not by a run's rows: the angle at which the lobe cos^n has fallen to a half, acos(0.5^(1/n)). A
    reflector is near-perfect if it blurs a point of light to no more than the sun's disc, a half width of 0.267
    degrees. Holds if n = 200 is; holds under conditions if a larger exponent of up to 100000 is; else fails.
    """
    records = tuple(_record(n) for n in (CLAIMED, *FURTHER))
    needed = {"half_width_degrees": SUN, "alpha_from": exponent_of(SUN)}
    eye = {"half_width_degrees": EYE, "alpha_from": exponent_of(EYE)}
    sharp = [one["alpha"] for one in records if one["half_width_degrees"] <= SUN]
    verdict = grade(CLAIMED in sharp, sharp)
    first = records[0]
    because = sentence(
        f"at n = {CLAIMED:g} the lobe's half width is {first['half_width_degrees']:.3g} degrees, "
        f"{first['half_width_degrees'] / SUN:.3g} times that of the sun's disc, and holds "
        f"{percent(first['energy_within_half_width'])} of its energy; 99 % of it lies within "
        f"{first['energy_99_within_degrees']:.3g} degrees",
        f"as sharp as the sun's disc takes n >= {rounded(needed['alpha_from'])}, as the eye resolves "
        f"{rounded(eye['alpha_from'])}",
    )
    exact = at(rows.largest_errors, approximation="phong", alpha=CLAIMED)
    return Finding(verdict, because, (*records, needed, eye), evidence("accuracy", "max_abs", exact), "law")


def half_width(n: float) -> float:
    """Degrees from the peak at which cos^n is a half; n >= 1."""
    return math.degrees(math.acos(0.5 ** (1.0 / n)))


def exponent_of(degrees: float) -> float:
    """The exponent whose lobe has this half width."""
    return math.log(0.5) / math.log(math.cos(math.radians(degrees)))


def energy_within(n: float, degrees: float) -> float:
    """Share of the lobe's integral over directions that lies within an angle of the peak: 1 - cos^(n + 1)."""
    return float(1.0 - math.cos(math.radians(degrees)) ** (n + 1.0))


def _record(n: float) -> Record:
    width = half_width(n)
    return {
        "alpha": n,
        "half_width_degrees": width,
        "energy_within_half_width": energy_within(n, width),
        "energy_99_within_degrees": math.degrees(math.acos(0.01 ** (1.0 / (n + 1.0)))),
    }


CLAIM = Claim("j", "An exponent n of 200 or more is a near-perfect reflector", HYPERGRAPH, judge, (), "error_angle")
