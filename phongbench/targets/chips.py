"""All compiled targets by name."""

from collections.abc import Mapping
from types import MappingProxyType

from phongbench.errors import UnknownNameError
from phongbench.targets import clang_mca, nvidia, radv
from phongbench.targets.target import Target

_FAMILIES = (radv.TARGETS, nvidia.TARGETS, clang_mca.TARGETS)
TARGETS: Mapping[str, Target] = MappingProxyType({target.name: target for family in _FAMILIES for target in family})


def target_named(name: str) -> Target:
    """The target of this name; UnknownNameError lists those there are."""
    if name not in TARGETS:
        raise UnknownNameError("target", name, TARGETS, "target")
    return TARGETS[name]
