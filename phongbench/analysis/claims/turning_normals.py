"""Claim n: without a cylinder, normals may rotate around the view vector."""

import numpy as np

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, Record, grade
from phongbench.analysis.claims.words import codes, sentence
from phongbench.analysis.rows import Rows
from phongbench.compiler.precisions import Array
from phongbench.formulas.citations import BOOM_2009

#: lights beside the viewer, normals' angle from him, and turns, in degrees
SLANTS, TILT, TURNS = (0.0, 10.0, 30.0, 60.0), 30.0, np.arange(0.0, 360.0)
#: a change of intensity that is rounding
_ROUNDING = 1e-12


def judge(rows: Rows) -> Finding:
    """By formula, not by a run's rows: a normal 30 degrees from the viewer is turned around the view vector, and around
    the light, by every whole degree, under matt light of full strength 0, 10, 30 and 60 degrees from the viewer. Holds
    if turning around the view vector changes no intensity by more than 1/255, holds under conditions if it does so for
    some lights only, else fails; with what turning around the light changes, which L.N = const leaves free.
    """
    records = tuple(map(_record, SLANTS))
    free = [one["change_around_view"] <= VISIBLE for one in records]
    worst = max(records, key=lambda one: one["change_around_view"])
    around = "nothing" if all(one["change_around_light"] < _ROUNDING for one in records) else "something, too"
    because = sentence(
        f"turning around the view vector changes the intensity by {codes(worst['change_around_view'])} for a light "
        f"{worst['light_degrees']:g} degrees from the viewer, and by nothing only if the light comes from there",
        f"turning around the light changes {around}: normals are free on a cone around the light, not around the view",
    )
    brief = sentence(
        f"turning around the view vector changes the intensity by up to {codes(worst['change_around_view'])}",
        f"turning around the light changes {around}",
    )
    return Finding(grade(all(free), any(free)), because, records, (), "law", brief=brief)


def _turned(vector: Array, axis: Array) -> Array:
    """The vector (3,) turned around a unit axis by each of TURNS (n, 3), by Rodrigues' formula."""
    turn = np.radians(TURNS)[:, None]
    along = axis * (axis @ vector) * (1 - np.cos(turn))
    return np.asarray(vector * np.cos(turn) + np.cross(axis, vector) * np.sin(turn) + along)


def _record(slant: float) -> Record:
    """The largest changes of the intensity for a light at this angle from the viewer."""
    light, normal = (np.array([np.sin(np.radians(d)), 0.0, np.cos(np.radians(d))]) for d in (slant, TILT))
    shade = np.maximum(normal @ light, 0.0)
    changes = [
        float(np.abs(np.maximum(_turned(normal, axis) @ light, 0.0) - shade).max())
        for axis in (np.array([0.0, 0.0, 1.0]), light)
    ]
    return {"light_degrees": slant, "change_around_view": changes[0], "change_around_light": changes[1]}


CLAIM = Claim("n", "Without a cylinder, normals may rotate around the view vector", BOOM_2009, judge, ())
