"""Claim m: across a cylinder an intensity has two normals, so that prior information is needed."""

import numpy as np

from phongbench.analysis.claims.claim import Claim, Finding, Record, grade
from phongbench.analysis.claims.words import listed, percent, sentence
from phongbench.analysis.rows import Rows
from phongbench.formulas.citations import BOOM_2009
from phongbench.inverse.line import invert_line
from phongbench.inverse.line_model import LineModel

#: lights to the right of the viewer, in degrees; intensities of each, evenly from dark to straight light
SLANTS, SAMPLES = (0.0, 20.0, 45.0, 70.0), 999
#: normals further apart than this, in degrees, are two
APART = 1.0
#: the surface faces the viewer up to this angle
SEEN = 90.0


def judge(rows: Rows) -> Finding:
    """By formula, not by a run's rows: for lights 0, 20, 45 and 70 degrees from the viewer and 999 intensities between
    darkness and straight light, how often both solutions of the line across a cylinder face the viewer and lie more
    than 1 degree apart. Holds if that is so somewhere for every light, fails if nowhere; with the share for which it
    is: elsewhere the other solution is turned from the viewer, which decides.
    """
    records = tuple(map(_record, SLANTS))
    open_ = [one["open_share"] > 0 for one in records]
    parts = [f"{percent(one['open_share'])} at {one['light_degrees']:g} degrees" for one in records]
    because = sentence(
        f"of all intensities under a light so far from the viewer, both solutions face him for {listed(parts)}",
        "elsewhere the second one is turned away from him, which is prior information, too",
    )
    least = min(records, key=lambda one: one["open_share"])
    brief = f"with the light {least['light_degrees']:g} degrees from the viewer"
    brief += f" {percent(least['open_share'])} of the intensities leave two normals that face him"
    return Finding(grade(all(open_), any(open_)), because, records, (), "law", brief=sentence(brief))


def _record(slant: float) -> Record:
    """How many intensities leave two visible normals."""
    turn = np.radians(slant)
    model = LineModel(0.0, 1.0, (float(np.sin(turn)), float(np.cos(turn))))
    line = invert_line(np.arange(1, SAMPLES + 1) / (SAMPLES + 1), model, prior="towards-viewer")
    two = (np.abs(line.angles - line.others) > APART) & (np.abs(line.others) < SEEN) & (np.abs(line.angles) < SEEN)
    return {"light_degrees": slant, "open_share": float(two.mean())}


CLAIM = Claim("m", "Intensity and a cylinder leave two normals: prior information is needed", BOOM_2009, judge, ())
