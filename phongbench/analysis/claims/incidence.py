"""Claim k: specular reflection varies with the angle of incidence, so a constant ks is an approximation."""

import math

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, Record, grade
from phongbench.analysis.claims.words import codes, sentence
from phongbench.analysis.rows import Rows
from phongbench.formulas.citations import HYPERGRAPH

#: reflectance at normal incidence: glass, then metals of middling and of high reflectance
MATERIALS = {"glass": 0.04, "iron": 0.56, "silver": 0.95}
#: beyond this, surfaces are seen edge-on only
GRAZING = 85.0


def judge(rows: Rows) -> Finding:
    """By formula, not by a run's rows: Schlick's reflectance r + (1 - r) (1 - cos i)^5 of a material that reflects r at
    normal incidence, against the constant ks = r, for light of full intensity. Holds if the difference exceeds 1/255
    somewhere up to 85 degrees of incidence for glass, iron and silver alike, fails if for none, else holds under
    conditions; with the incidence up to which a constant ks changes by at most 1/255.
    """
    records = tuple(_record(name, r) for name, r in MATERIALS.items())
    seen = [one["error_at_85_degrees"] > VISIBLE for one in records]
    verdict = grade(all(seen), any(seen))
    parts = [
        f"{one['material']}: at most 1/255 up to {one['incidence_to_degrees']:.3g} degrees, off by "
        f"{codes(one['error_at_60_degrees'])} at 60 and {codes(one['error_at_85_degrees'])} at 85"
        for one in records
    ]
    return Finding(
        verdict, sentence(f"a constant ks against Schlick's reflectance, {parts[0]}", *parts[1:]), records, (), "law"
    )


def rise(normal: float, incidence_degrees: float) -> float:
    """How much more is reflected than at normal incidence: (1 - r) (1 - cos i)^5."""
    return (1.0 - normal) * (1.0 - math.cos(math.radians(incidence_degrees))) ** 5


def _record(name: str, normal: float) -> Record:
    reach = 1.0 - min(1.0, VISIBLE / (1.0 - normal)) ** 0.2
    return {
        "material": name,
        "reflectance": normal,
        "max_error": VISIBLE,
        "incidence_to_degrees": math.degrees(math.acos(reach)),
        "error_at_60_degrees": rise(normal, 60.0),
        "error_at_85_degrees": rise(normal, GRAZING),
    }


CLAIM = Claim(
    "k",
    "Specular reflection varies with the angle of incidence: a constant ks is an approximation",
    HYPERGRAPH,
    judge,
    (),
)
