"""Policies for the slope of a highlight: how far above themselves the exponents of copy and original are counted."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from phongbench.formulas import error_laws

#: policy -> offset c(exponent), in the order in which they are offered
OFFSETS: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {
        "taylor": lambda exponent: 0.0,
        # below 2 the law's 1/n term is no longer a correction: it would send the slope to infinity
        "minimax": lambda exponent: float(error_laws.minimax_offset(max(exponent, 2.0))),
        "energy": lambda exponent: 1.0,
    }
)


def sharpness(policy: str, exponent: float) -> float:
    """The rate s at which exp(-s lambda) stands for (1 - lambda)^exponent: the exponent and its offset.

    taylor   equal value and slope at the peak
    minimax  least largest error, about 2.2 times smaller than taylor's
    energy   the same light in total
    """
    return exponent + OFFSETS[policy](exponent)


def beta(policy: str, exponent: float, gamma: float) -> float:
    """The slope b at which (1 - b lambda)^gamma stands for (1 - lambda)^exponent: the ratio of their sharpnesses."""
    return sharpness(policy, exponent) / sharpness(policy, gamma)
