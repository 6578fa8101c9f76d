"""Claim l: stopping reflections when their contribution is small saves work."""

import pandas as pd

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.words import codes, percent, sentence
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.citations import HYPERGRAPH

#: a share of the rays below this is no saving worth a switch
WORTH = 0.05


def judge(rows: Rows) -> Finding:
    """What stopping reflections below a contribution saves where scenes reflect, against following them all up to the
    depth that the rows name: the share of rays that are not traced, and the largest change of a colour. Holds if in
    every such scene a contribution whose picture changes by at most 1/255 saves at least 5 % of the rays; holds under
    conditions if one does so in some scene, or if one saves that much at the price of a larger change; else fails.
    """
    cut = at(rows.skips, name="cutoff")
    if cut.empty:
        raise LackingRowsError(
            "what stopping reflections saves shows in traced scenes only", "trace them: phongbench run --scenes"
        )
    records = [_record(row) for _, row in cut.iterrows()]
    scenes = list(dict.fromkeys(one["scene"] for one in records))
    saved = {scene: max(_saved(records, scene, VISIBLE), default=0.0) for scene in scenes}
    worth = [share >= WORTH for share in saved.values()]
    dear = any(max(_saved(records, scene, float("inf"))) >= WORTH for scene in scenes)
    verdict = grade(all(worth), any(worth) or dear)
    parts = [_sentence(scene, saved[scene], [one for one in records if one["scene"] == scene]) for scene in scenes]
    return Finding(verdict, sentence(*parts), tuple(records), evidence("skips", "largest_change", cut), "traced")


def _saved(records: list[Record], scene: str, most: float) -> list[float]:
    """Shares of rays saved in a scene by contributions that change no colour by more than `most`."""
    return [one["rays_saved"] for one in records if one["scene"] == scene and one["largest_change"] <= most]


def _sentence(scene: str, saved: float, records: list[Record]) -> str:
    top = max(records, key=lambda one: one["contribution"])
    return (
        f"{scene}: stopping saves {percent(saved)} of the rays at 1/255 of change, and "
        f"{percent(top['rays_saved'])} below a contribution of {top['contribution']:.3g}, which changes a colour by "
        f"{codes(top['largest_change'])}"
    )


def _record(row: pd.Series) -> Record:
    return {
        "scene": str(row["scene"]),
        "depth": int(row["depth"]),
        "contribution": float(row["setting"]),
        "rays": int(row["of"]),
        "rays_saved": float(row["skipped"] / row["of"]) if row["of"] else 0.0,
        "largest_change": float(row["largest_change"]),
        "bound": float(row["bound"]),
    }


CLAIM = Claim(
    "l",
    "Stopping reflections when their contribution has become small saves work",
    HYPERGRAPH,
    judge,
    ("skips",),
    "reflections",
)
