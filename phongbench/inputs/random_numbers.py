"""Random numbers that are pure functions of a seed and a place: splitmix64 of a counter."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler import intrinsics, jit


def uniforms(seed: int, start: int, count: int, streams: int) -> NDArray[np.float64]:
    """Numbers start .. start + count of independent streams, uniform in [0, 1); shape (streams, count).

    Column i is a pure function of (seed, start + i, streams).
    """
    out = np.empty((streams, count))
    _uniforms(key_of(seed), start, out)
    return out


_MASK = 0xFFFFFFFFFFFFFFFF


@cache
def key_of(seed: int) -> np.uint64:
    """A 64-bit key from any seed, by splitmix64's finaliser."""
    z = (seed + 0x9E3779B97F4A7C15) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return np.uint64(z ^ (z >> 31))


_GOLDEN, _MIX_1, _MIX_2 = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S12 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(12)
_ONE_BITS = np.uint64(0x3FF0000000000000)


@jit.inline
def uniform(key: Any, counter: Any) -> Any:
    """A number in [0, 1) with 52 random bits: splitmix64 of the counter."""
    z = key + counter * _GOLDEN
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    z = z ^ (z >> _S31)
    return intrinsics.float64_from_bits(np.int64((z >> _S12) | _ONE_BITS)) - 1.0


@jit.driver
def _uniforms(key: Any, start: int, out: Any) -> None:
    streams = np.uint64(out.shape[0])
    for i in range(out.shape[1]):
        counter = streams * (np.uint64(start) + np.uint64(i))
        for stream in range(out.shape[0]):
            out[stream, i] = uniform(key, counter + np.uint64(stream))
