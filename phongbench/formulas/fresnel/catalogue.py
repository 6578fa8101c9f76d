"""All formulas of reflectance that ship. Adding one: its file here, its name in FAMILIES."""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from phongbench.formulas.fresnel.spec import ReflectanceFormula

#: the modules of this package that hold a SPEC or SPECS, in the order in which they are shown
FAMILIES = ("constant", "schlick", "f82", "dielectric", "conductor")


def _specs(family: str) -> tuple[ReflectanceFormula, ...]:
    module = import_module(f"phongbench.formulas.fresnel.{family}")
    return tuple(getattr(module, "SPECS", ())) or (module.SPEC,)


#: what documents call `kind` -> the formula
KINDS: Mapping[str, ReflectanceFormula] = MappingProxyType({s.name: s for f in FAMILIES for s in _specs(f)})
