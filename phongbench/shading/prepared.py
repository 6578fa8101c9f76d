"""A material under some lights, prepared once to shade points again and again, by the loops of shading.py."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.lowering import FLOAT32
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.formula import Specular
from phongbench.formulas.kernel import read_only
from phongbench.formulas.registry import REGISTRY
from phongbench.shading import tile_loop
from phongbench.shading import tiles as at
from phongbench.shading.lighting import BLACK, Light, Material, Skips, Viewer
from phongbench.shading.loop_arguments import formula_of, job_of
from phongbench.support.values import colour

_PHONG, _ALL = Specular(), Skips()
_NONE_SEEN = read_only(np.zeros((0, 0), np.uint8))
_NOWHERE = read_only(np.zeros(0, np.float32))


class Shader:
    """`shading.shade` in float32 for one material, without checking and preparing its arguments again each time.

    A scene calls it for every group of every tile and bounce. Its colours are those of `shade`, bit for bit.

    shadowed  whether `shade` will be told which points see which light
    boxes     whether it is found out what lights out of reach would have added
    """

    def __init__(
        self,
        material: Material,
        lights: Sequence[Light],
        viewer: Viewer,
        *,
        ambient_light: Sequence[float] = BLACK,
        model: str = "phong",
        specular: Specular = _PHONG,
        skips: Skips = _ALL,
        shadowed: bool = False,
        registry: Any = REGISTRY,
    ) -> None:
        formula = formula_of(material, model, specular, registry, FLOAT32, skips)
        self.lights, self.shadowed, self.ends = len(lights), shadowed, formula.ends
        self._job = job_of(formula, material, lights, viewer, skips, FLOAT32, shadowed=shadowed)
        self.boxes = bool(self._job.options[at.BOXES])
        self._spread = np.ascontiguousarray(self._job.lights.T).reshape(-1)
        self._limits, self._formula = at.bounds(FLOAT32), formula.arguments()
        ambient = colour(ambient_light, "ambient_light")
        self._ambient = np.array([k * i for k, i in zip(material.ambient, ambient, strict=True)], np.float32)

    def shade(
        self,
        points: Array,
        normals: Array,
        out: Array,
        counts: NDArray[np.int64],
        lost: Array,
        *,
        towards: Array | None = None,
        visible: Array | None = None,
    ) -> None:
        """Shade points.

        points, normals  (n, 3) float32, C-contiguous   normals are taken as they are
        out              (n, 3) float32                 colours, not limited to 1
        counts           int64 (tiles.COUNTS,)          what is left out is added
        lost             float32 (1,)                   raised to the most that a colour lost by reach, where `boxes`
        towards          (n, 3) float32                 unit directions to where each point is seen from, as of a
                                                        reflected ray; None: to the viewer
        visible          (lights, n) bool               which points see which light
        Raises InputError, naming the point, if one is not finite.
        """
        tiles = np.array([0, -(-len(points) // at.TILE)])
        bad = tile_loop.shade_tiles(
            read_only(points.reshape(-1)),
            read_only(normals.reshape(-1)),
            _NONE_SEEN if visible is None else read_only(visible.view(np.uint8)),
            _NOWHERE if towards is None else read_only(towards.reshape(-1)),
            self._job.lights,
            self._spread,
            self._job.plan,
            self._ambient,
            *self._formula,
            self._limits,
            self._job.options,
            tiles,
            out.reshape(-1),
            counts,
            lost,
            at.scratch(FLOAT32),
        )
        if bad >= 0:
            where = f"points[{bad}] = {points[bad].tolist()}, normal {normals[bad].tolist()}"
            raise InputError("a point that rays found cannot be shaded", where, "bring the scene nearer to the origin")

    def pairs(self, points: int, counts: NDArray[np.int64]) -> dict[str, int]:
        """What was left out of so many points, in the words of `shading.Ledger`."""
        return {
            "pairs": points * self.lights,
            "zero_colours": points * self._job.left_out,
            "out_of_reach": int(counts[at.OUT]),
            "in_shadow": int(counts[at.SHADE]),
            "lights_behind": int(counts[at.BEHIND]),
            "vectors_not_built": int(counts[at.UNBUILT]),
            "constant_directions": points * self._job.constant,
            self.ends: int(counts[at.UNLIT]),
        }
