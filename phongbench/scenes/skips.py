"""What a renderer may leave out, and the ledger of what it did leave out."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.errors import InputError
from phongbench.shading.lighting import Skips

#: the weight below which a reflection is not followed: half an 8-bit code of the brightest light
CUTOFF = 1 / 510


@dataclass(frozen=True)
class SceneSkips:
    """What may be left out, one switch each.

    Exact, the picture is the same bits: `objects` asking the camera's rays through a tile for spheres that lie beside
    it; `background` shading rays that hit nothing; `reflectivity` reflections of
    surfaces that reflect nothing; `shadow_rays` asking for shadows where a light does not reach or is behind.
    Bounded: `cutoff` reflections whose accumulated weight is below it change a sample by at most cutoff * brightest
    (0: all are followed).
    shading  the same for light on surfaces; see there
    """

    objects: bool = True
    background: bool = True
    reflectivity: bool = True
    shadow_rays: bool = True
    cutoff: float = CUTOFF
    shading: Skips = field(default_factory=Skips)

    def __post_init__(self) -> None:
        if not 0 <= self.cutoff < 1:
            raise InputError(f"cutoff = {self.cutoff} is not from 0 to 1", "cutoff", "give e.g. 0.002")

    @classmethod
    def none(cls) -> "SceneSkips":
        """Nothing is left out."""
        return cls(False, False, False, False, 0.0, Skips.none())

    @classmethod
    def exact(cls) -> "SceneSkips":
        """Only what changes no bit."""
        return cls(cutoff=0.0, shading=Skips.exact())


@dataclass
class Tally:
    """What one renderer's thread counts; see the ledger's lines for the meaning.

    lost  float32 (bounces, materials)  the most that lights out of reach took from a colour, each time it was asked
    """

    rays: int = 0
    tests: int = 0
    objects: int = 0
    background: int = 0
    reflections: int = 0
    reflectivity: int = 0
    cutoff: int = 0
    shadow_rays: int = 0
    shadow_rays_saved: int = 0
    tracing: float = 0.0
    shading: float = 0.0
    pairs: dict[str, int] = field(default_factory=dict)
    lost: NDArray[np.float32] = field(default_factory=lambda: np.zeros((1, 1), np.float32))

    def add_pairs(self, pairs: dict[str, int]) -> None:
        """Add what the shading left out."""
        for name, number in pairs.items():
            self.pairs[name] = self.pairs.get(name, 0) + number

    def loss(self, reflectivities: Sequence[float]) -> float:
        """The most that shading took from a picture's sample, which mixes (1 - k) direct + k reflected light."""
        most = 0.0
        for bounce in self.lost[::-1].tolist():
            most = max((1 - k) * mine + k * most for k, mine in zip(reflectivities, bounce, strict=True))
        return most

    def add(self, other: "Tally") -> None:
        """Add what another thread counted."""
        for f in fields(self):
            if f.name not in ("pairs", "lost"):
                setattr(self, f.name, getattr(self, f.name) + getattr(other, f.name))
        self.add_pairs(other.pairs)
        self.lost = np.maximum(self.lost, other.lost)


@dataclass(frozen=True)
class Skipped:
    """One line of the ledger.

    name     the switch
    kind     "exact" or "bounded"
    unit     what is counted
    of       how many there are
    skipped  how many of them were left out
    bound    what leaving them out may change in a colour at most; 0 where it is exact
    """

    name: str
    kind: str
    unit: str
    of: int
    skipped: int
    bound: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def variants() -> dict[str, SceneSkips]:
    """Everything left out, then one switch off each, one on, then only exact skips, then none; the first is shipped."""
    full = SceneSkips()
    found = {"all": full}
    for name in ("objects", "background", "shadow_rays"):
        switched: dict[str, Any] = {name: False}
        found[f"without {name}"] = replace(full, **switched)
    found["without cutoff"] = replace(full, cutoff=0.0)
    # a cutoff alone leaves out what reflects nothing, too
    found["without reflectivity, cutoff"] = replace(full, reflectivity=False, cutoff=0.0)
    for f in fields(Skips):
        if f.type is bool:
            found[f"without {f.name}"] = replace(full, shading=replace(full.shading, **{f.name: False}))
    return {**found, "exact": SceneSkips.exact(), "none": SceneSkips.none()}
