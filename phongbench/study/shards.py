"""How the sweep of a plan is cut into shards, the same on every machine: runs of blocks of about equal predicted cost.

A block is one slab of one batch. Blocks are numbered in the order of the sweep, and a shard is a run of them, so what
two shards share is at most a batch, whose blocks are then kept one by one: sums are merged in slab order, whoever
measured which, and the rows are those of one machine, bit for bit.
"""

import re
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

from phongbench.accuracy.batches import Batch
from phongbench.accuracy.sweep import SLAB, slabs
from phongbench.errors import InputError

#: picoseconds, in whole numbers so that every machine cuts alike: of a pair with its coordinates and exact value, and
#: of a cell on a pair; only their ratio matters
PAIR_COST, CELL_COST = 25_000, 4_000
#: how many times as long a cell takes where every step is rounded by software
ROUNDED_BY_SOFTWARE = 4
HARDWARE = ("float16", "float32", "float64")
#: shards for each thread of a cluster, and at least, since its end waits for the last and one of a hundred is measured
#: twice; but as long as each thread has one, none that is predicted to take fewer picoseconds than this, for handing
#: it out takes time, too
EACH, LEAST, SHORTEST = 8, 128, 400_000_000_000

#: a batch, and the pair at which its slab begins
Block = tuple[Batch, int]


@dataclass(frozen=True, slots=True)
class ShardName:
    """Which of how many shards: `index` counts from 1 to `count`, as `--shard 2/8` does."""

    index: int
    count: int

    @staticmethod
    def parsed(text: str) -> "ShardName":
        """`2/8` -> ShardName(2, 8). InputError for anything else."""
        words = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text.strip(), re.ASCII)
        name = ShardName(int(words[1]), int(words[2])) if words else None
        if name is None or not 1 <= name.index <= name.count:
            raise InputError(f"{text!r} is no shard", "--shard", "write which of how many, e.g. 1/8 up to 8/8")
        return name

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"


def pairs(block: Block) -> int:
    """How many pairs a block has."""
    batch, start = block
    return min(start + SLAB, batch.samples) - start


def cost(batch: Batch, start: int) -> int:
    """What a block is predicted to take, in picoseconds of one thread."""
    cell = CELL_COST * (1 if batch.precision.name in HARDWARE else ROUNDED_BY_SOFTWARE)
    return pairs((batch, start)) * (PAIR_COST + cell * len(batch.cells))


def number(batches: Sequence[Batch], threads: int) -> int:
    """Into how many shards these batches are cut for so many threads."""
    blocks = [(batch, start) for batch in batches for start in slabs(batch)]
    worth = sum(cost(*block) for block in blocks) // SHORTEST
    return min(len(blocks), max(EACH * threads, LEAST), max(worth, threads, EACH))


def cut(batches: Sequence[Batch], count: int) -> list[list[Block]]:
    """The blocks of these batches in `count` runs of about equal cost, none of them empty.

    Raises InputError where there are fewer blocks than shards.
    """
    blocks: list[Block] = [(batch, start) for batch in batches for start in slabs(batch)]
    if count > len(blocks):
        fix = f"at most {len(blocks)}"
        raise InputError(f"{count} shards are more than the plan has blocks of work", "--shard", fix)
    reached = list(accumulate(cost(*block) for block in blocks))
    ends = [0]
    for index in range(1, count + 1):
        end = bisect_left(reached, reached[-1] * index // count) + 1
        ends.append(min(max(end, ends[-1] + 1), len(blocks) - (count - index)))
    return [blocks[first:stop] for first, stop in pairwise(ends)]


def whole_batches(blocks: Sequence[Block]) -> set[int]:
    """The indices of the batches all of whose blocks are among these."""
    numbers: dict[int, int] = {}
    for batch, _ in blocks:
        numbers[batch.index] = numbers.get(batch.index, 0) + 1
    return {batch.index for batch, _ in blocks if numbers[batch.index] == len(slabs(batch))}


def evaluations(blocks: Iterable[Block]) -> int:
    """(sample, cell) pairs of these blocks."""
    return sum(pairs(block) * len(block[0].cells) for block in blocks)
