"""Claim i: far away, L.N and V.R may be held constant over a polygon."""

from phongbench.claims.claim import SCENES, Claim, Finding, LackingRowsError
from phongbench.claims.cuts import Rows
from phongbench.sources import HYPERGRAPH


def judge(rows: Rows) -> Finding:
    """Waits for scenes: the error of holding L.N and V.R constant over a polygon, against the distance of light and
    viewer in polygon sizes; where it comes within 1/255 is how far is far enough.
    """
    raise LackingRowsError(
        "how far is far enough shows on polygons in a scene only",
        None,
        "no run measures it yet: it takes scenes whose lights and viewer move away",
    )


CLAIM = Claim(
    "i",
    "With light and viewer far away, L.N and V.R may be held constant over a polygon",
    HYPERGRAPH,
    judge,
    (SCENES,),
)
