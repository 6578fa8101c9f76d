"""Optical constants of two materials, at the wavelengths that stand for red, green and blue.

Copper is JOHNSON_CHRISTY_1972, measured on evaporated films; tables of other authors differ: one in common use gives
copper .27105 .67693 1.3164 / 3.6092 2.6248 2.2921, a green of .721 at normal incidence instead of .624.
"""

from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.formulas.fresnel.f82 import DIP
from phongbench.formulas.fresnel.reflectance import CHANNELS, Fresnel

#: nanometres of red, green and blue
WAVELENGTHS = (650.0, 550.0, 450.0)
#: JOHNSON_CHRISTY_1972 around them: nanometres, n, k
_COPPER = (
    (659.5, 0.22, 3.747),
    (616.8, 0.30, 3.205),
    (582.1, 0.70, 2.704),
    (548.6, 1.02, 2.577),
    (450.9, 1.24, 2.397),
    (430.5, 1.25, 2.305),
)


def _between(wavelength: float) -> tuple[float, float]:
    """n and k of copper at a wavelength, on the straight line between the two that were measured around it."""
    for (long, n0, k0), (short, n1, k1) in zip(_COPPER[::2], _COPPER[1::2], strict=True):
        if short <= wavelength <= long:
            t = (long - wavelength) / (long - short)
            return n0 + t * (n1 - n0), k0 + t * (k1 - k0)
    raise ValueError(wavelength)


#: exact, copper in air
COPPER = Fresnel("conductor", n=[_between(w)[0] for w in WAVELENGTHS], k=[_between(w)[1] for w in WAVELENGTHS])
#: exact, window glass in air: the round number of textbooks
GLASS = Fresnel("dielectric", n=[1.5] * 3)
#: what a material is called -> its exact reflectance
EXACT = {"glass": GLASS, "copper": COPPER}


def in_terms_of(exact: Fresnel, kind: str) -> Fresnel | None:
    """The reflectance of the same material by another formula: its f0, and its f82 at a cosine of 1/7, are the exact's.

    None for a formula that lacks what the material has: no dielectric has the k of a metal.
    """
    places = {"f0": 1.0, "f82": DIP}
    given: dict[str, list[float]] = {}
    for parameter in KINDS[kind].parameters:
        name = parameter.name
        if name in places:
            given[name] = [float(exact.bound(channel)(places[name])) for channel in range(len(CHANNELS))]
        elif kind == exact.kind:
            given[name] = list(getattr(exact, name))
        elif kind == "conductor" and exact.kind == "dielectric":
            given[name] = list(exact.n or ()) if name == "n" else [0.0] * len(CHANNELS)
        else:
            return None
    return Fresnel(kind, **given)
