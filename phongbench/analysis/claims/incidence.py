"""Claim k: specular reflection varies with the angle of incidence, so a constant ks is an approximation."""

import pandas as pd

from phongbench.analysis.claims.claim import Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.words import codes, sentence
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.citations import HYPERGRAPH

#: beyond this, surfaces are seen edge-on only
GRAZING = 85.0
#: the formula that shaders put in the constant's place
USUAL = "schlick"


def judge(rows: Rows) -> Finding:
    """The constant ks, equal to the reflectance at normal incidence, against the exact reflectance of glass and copper
    (Fresnel's, unpolarised), for light of full intensity, in the channel that errs most. Holds if the difference
    exceeds 1/255 somewhere up to 85 degrees of incidence for every material, fails if for none, else holds under
    conditions; with the incidence up to which a constant ks errs by at most 1/255, and what Schlick's formula leaves.
    """
    measured = rows.judged_incidence
    constant = at(measured, reflectance="constant")
    if constant.empty:
        raise LackingRowsError(
            "no reflectance was measured against incidence", "measure it: phongbench run --probe incidence"
        )
    records = tuple(
        _record(str(material), mine, at(measured, material=material, reflectance=USUAL))
        for material, mine in constant.groupby("material", sort=False)
    )
    seen = [one["within_degrees"] < GRAZING for one in records]
    parts = [
        f"{one['material']}: at most 1/255 up to {one['within_degrees']:.3g} degrees, off by "
        f"{codes(one['error_at_60_degrees'])} at 60 and {codes(one['error_at_85_degrees'])} at 85, where Schlick's "
        f"formula errs by at most {codes(one['max_error_of_schlick'])} anywhere"
        for one in records
    ]
    because = sentence(f"a constant ks against the exact reflectance, {parts[0]}", *parts[1:])
    first = records[0]
    brief = sentence(
        f"for {first['material']} a constant ks errs by at most 1/255 up to {first['within_degrees']:.3g} degrees",
        f"at 85 degrees by {codes(first['error_at_85_degrees'])}",
    )
    rows_that_decide = evidence("incidence", "error_85", constant)
    return Finding(grade(all(seen), any(seen)), because, records, rows_that_decide, brief=brief)


def _record(material: str, constant: pd.DataFrame, schlick: pd.DataFrame) -> Record:
    """What a constant leaves of a material, in the channel that errs most at each place."""
    return {
        "material": material,
        "within_degrees": float(constant["within_degrees"].min()),
        "error_at_60_degrees": float(constant["error_60"].max()),
        "error_at_85_degrees": float(constant["error_85"].max()),
        "max_error": float(constant["max_abs"].max()),
        "max_error_of_schlick": float(schlick["max_abs"].max()),
    }


CLAIM = Claim(
    "k",
    "Specular reflection varies with the angle of incidence: a constant ks is an approximation",
    HYPERGRAPH,
    judge,
    ("incidence",),
    "copper",
)
