"""A picture on a cluster: runs of its tiles go to workers, each drawn as one machine draws it."""

import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from threading import Lock

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.results.arithmetic import arithmetic, difference
from phongbench.scenes.render import Order, Painter, Tile
from phongbench.scenes.skips import Tally
from phongbench.study.cluster.connection import checked, connected
from phongbench.study.cluster.work import Work
from phongbench.study.cluster.worker import registry_of, texts_of
from phongbench.support.progress import Progress

#: parts, which are runs of tiles, for each thread of the cluster: tiles differ more than blocks of a sweep do
EACH = 16
_FIX = "draw again, there or without --cluster"
_PREPARING = Lock()


@dataclass(frozen=True)
class PictureJob:
    """What all tiles of a picture have in common.

    key         tells it from others
    files       names and texts of the user's own files
    arithmetic  of the client: a worker whose colours could differ refuses
    """

    key: str
    order: Order = field(compare=False)
    files: tuple[tuple[str, str], ...] = field(compare=False)
    arithmetic: tuple[tuple[str, str], ...] = field(compare=False)


@dataclass(frozen=True, eq=False)
class Drawn:
    """Some tiles of a picture, and what was counted on the way; `refused` as of `work.Answer`."""

    worker: str
    colours: Sequence[Array] = ()
    tally: Tally | None = None
    refused: str | None = None

    def same(self, other: "Drawn") -> bool:
        """True if another worker got the same bits."""
        return len(self.colours) == len(other.colours) and all(
            np.array_equal(one.view(np.uint32), two.view(np.uint32))
            for one, two in zip(self.colours, other.colours, strict=True)
        )


class PictureCluster:
    """Draws the tiles of pictures on a cluster; see `engine.Cluster` for address and files, and for what it raises.

    compared  runs of tiles that a second worker drew, too
    """

    def __init__(self, address: str, files: Sequence[Path] = ()) -> None:
        self.address, self.files, self.compared = checked(address), texts_of(files), 0

    def __call__(
        self, order: Order, progress: Progress, threads: int
    ) -> Iterator[tuple[Sequence[Tile], Sequence[Array], Tally]]:
        """Runs of tiles as they are drawn."""
        key, tiles = uuid.uuid4().hex, order.tiles
        job = PictureJob(key, order, self.files, tuple(_arithmetic().items()))
        with connected(self.address, threads, fix=_FIX, progress=progress) as connection:
            count = min(len(tiles), EACH * connection.threads)
            ends = [len(tiles) * number // count for number in range(count + 1)]
            pieces = [tiles[first:stop] for first, stop in pairwise(ends)]
            work = Work(connection, draw, job, pieces, seed=len(tiles), noun="part", progress=progress)
            for index, drawn in work.answers():
                yield pieces[index], drawn.colours, drawn.tally or Tally()
                progress.advance(len(pieces[index]))
            self.compared += work.compared
            work.raise_failures()


def draw(job: PictureJob, tiles: Sequence[Tile]) -> Drawn:
    """What a worker does: draws these tiles."""
    from distributed import get_worker

    here = str(get_worker().address)
    if changed := difference(dict(job.arithmetic), _arithmetic()):
        return Drawn(here, refused=changed)
    with _PREPARING:  # threads of a worker share what is made ready
        painter = _prepared(job)
    return Drawn(here, *painter.draw(tiles))


@lru_cache(maxsize=1)
def _prepared(job: PictureJob) -> Painter:
    return Painter(job.order, registry_of(job.files))


def _arithmetic() -> dict[str, str]:
    """What decides the bits of a colour here: that of kernels, and what finds triangles."""
    try:
        embree = version("embreex")
    except PackageNotFoundError:
        embree = "none"
    return {**arithmetic(), "embreex": embree}
