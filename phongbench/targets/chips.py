"""All compiled targets by name."""

from collections.abc import Mapping
from types import MappingProxyType

from phongbench.errors import UnknownNameError
from phongbench.targets import radv
from phongbench.targets.target import Target

TARGETS: Mapping[str, Target] = MappingProxyType({target.name: target for target in (*radv.TARGETS,)})


def target_named(name: str) -> Target:
    """The target of this name; UnknownNameError lists those there are."""
    if name not in TARGETS:
        raise UnknownNameError("target", name, TARGETS, "target")
    return TARGETS[name]
