"""The arrays that everybody in a comparison works on."""

import numpy as np

from phongbench.compiler.lowering import FLOAT32
from phongbench.compiler.precisions import Array
from phongbench.timing import timed_kernels
from phongbench.timing.blocks import aligned_rows, elements_of
from phongbench.timing.epoch_loop import spin


class Arena:
    """Pairs as a timing session lays them out, but writable: some peers insist on that."""

    def __init__(self, total_bytes: int, seed: int) -> None:
        self.elements = elements_of(total_bytes, FLOAT32)
        rows = aligned_rows(*timed_kernels.highlight_pairs(FLOAT32, seed, self.elements))
        self.a, self.b = rows[:3], rows[3:6]
        self.out: Array = rows[6]
        self.scratch = np.zeros(16, np.int64)

    def spin(self) -> float:
        """Nanoseconds of a fixed chain of instructions, by its second run: the first may follow 512-bit vectors."""
        spin(self.scratch)
        return float(spin(self.scratch))
