"""Claim l: stopping reflections when their contribution is small saves work."""

from phongbench.claims.claim import SCENES, Claim, Finding, LackingRowsError
from phongbench.claims.cuts import Rows
from phongbench.sources import HYPERGRAPH


def judge(rows: Rows) -> Finding:
    """Waits for scenes: the share of rays that is saved, and the largest change of the picture, where reflections stop
    below a contribution.
    """
    raise LackingRowsError(
        "what stopping reflections saves shows in traced scenes only",
        None,
        "no run measures it yet: it takes a traced scene with and without stopping",
    )


CLAIM = Claim(
    "l",
    "Stopping reflections when their contribution has become small saves work",
    HYPERGRAPH,
    judge,
    (SCENES,),
)
