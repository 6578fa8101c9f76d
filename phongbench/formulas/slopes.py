"""Policies for the slope of a highlight: how far above themselves the exponents of copy and original are counted."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from phongbench.formulas import error_laws
from phongbench.formulas.spec import Setting

#: policy -> offset c(exponent), in the order in which they are offered
OFFSETS: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {
        "taylor": lambda exponent: 0.0,
        # below 2 the law's 1/n term is no longer a correction: it would send the slope to infinity
        "minimax": lambda exponent: float(error_laws.minimax_offset(max(exponent, 2.0))),
        "energy": lambda exponent: 1.0,
        # KARIS_2013: exp2's factors 0.5 / ln 2 and 0.275 / ln 2 of 1 / roughness^2 = 2 alpha + 1
        "unreal": lambda exponent: 0.775,
    }
)
#: those of formulas with an exponent of their own; unreal's offset was chosen for the exponential alone
OF_POWERS = ("taylor", "minimax", "energy")


def sharpness(policy: str, exponent: float) -> float:
    """The rate s at which exp(-s lambda) stands for (1 - lambda)^exponent: the exponent and its offset.

    taylor   equal value and slope at the peak
    minimax  least largest error, about 2.2 times smaller than taylor's
    energy   the same light in total
    unreal   what Unreal Engine ships for the exponential
    """
    return exponent + OFFSETS[policy](exponent)


def beta(policy: str, exponent: float, gamma: float) -> float:
    """The slope b at which (1 - b lambda)^gamma stands for (1 - lambda)^exponent: the ratio of their sharpnesses."""
    return sharpness(policy, exponent) / sharpness(policy, gamma)


def at_zero(setting: Setting) -> str | None:
    """Why a formula with this slope is no constant at alpha 0; None for taylor, whose slope is 0 there."""
    return None if setting.slope == "taylor" else f"the slope {setting.slope} does not fall to 0 with alpha"
