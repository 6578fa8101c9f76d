"""A material under some lights, prepared once to shade points again and again."""

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.lowering import FLOAT32, Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import read_only
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.shading import tile_loop
from phongbench.shading import tiles as at
from phongbench.shading.lighting import BLACK, Light, Material, Skips, Viewer
from phongbench.shading.loop_arguments import loop_arguments
from phongbench.shading.specular_term import EXACT, SpecularTerm
from phongbench.support.values import colour

_ALL = Skips()
_NONE_SEEN = read_only(np.zeros((0, 0), np.uint8))


class ShadingOptions(TypedDict, total=False):
    """What may be left out when something is shaded.

    ambient_light  (r, g, b) >= 0   ia; none
    model          "phong", the usual one, or "blinn-phong"
    specular       the formula of the specular term; exact Phong
    normalise      whether normals are made unit length first, as they are unless told otherwise; False takes them as
                   they are: short normals point R in the wrong direction, which is what studies of meshes are about
    skips          what need not be computed; where nothing may be left out, every pair is computed
    registry       the approximations that `specular` may name
    """

    ambient_light: Sequence[float]
    model: str
    specular: Formula
    normalise: bool
    skips: Skips
    registry: Mapping[str, Approximation]


class PreparedShading:
    """The loops and numbers of one material under some lights: `shade.shade` runs it once, a scene for every tile.

    shadowed   whether it will be given which points see which light
    columns    whether vectors come as (3, n), a row for each component
    precision  FLOAT32 or FLOAT64, that of the vectors
    The others are those of ShadingOptions. Raises InputError or UnknownNameError naming the field.
    """

    def __init__(
        self,
        material: Material,
        lights: Sequence[Light],
        viewer: Viewer,
        *,
        ambient_light: Sequence[float] = BLACK,
        model: str = "phong",
        specular: Formula = EXACT,
        skips: Skips = _ALL,
        shadowed: bool = False,
        columns: bool = False,
        normalise: bool = True,
        precision: Precision = FLOAT32,
        registry: Mapping[str, Approximation] = REGISTRY,
    ) -> None:
        term = SpecularTerm.of(specular, material, model, registry=registry, precision=precision, skips=skips)
        light = colour(ambient_light, "ambient_light")
        ambient = [k * i for k, i in zip(material.ambient, light, strict=True)]
        self._arguments = loop_arguments(material, lights, viewer, term, skips, ambient=ambient, shadowed=shadowed)
        options = self._arguments.arrays[at.OPTIONS_ROW]
        options[[at.COLUMNS, at.NORMALISE]] = columns, normalise
        self.precision, self.boxes = precision, bool(options[at.BOXES])
        self._lights, self._reason, self._half_left = len(lights), term.reason, term.pair == "halfway"
        self._nowhere = read_only(np.zeros(0, precision.carrier))

    @property
    def used_lights(self) -> int:
        """Lights that add anything: what the work grows with."""
        return len(self._arguments.arrays[0])

    def fill(
        self,
        points: Array,
        normals: Array,
        out: Array,
        counts: NDArray[np.int64],
        lost: Array,
        *,
        visible: Array | None = None,
        towards: Array | None = None,
        tiles: tuple[int, int] | None = None,
        scratch: Array | None = None,
    ) -> int:
        """Shade points; the index of the first that cannot be shaded, or -1. Nothing is checked.

        points, normals  (n, 3) or (3, n), C-contiguous, of the precision
        out              the same             colours, not limited to 1
        counts           int64 (at.COUNTS,)   what is left out is added
        lost             (1,)                 raised to the most that a colour lost by reach, where `boxes`
        visible          bool (lights, n)     which points see which light, where `shadowed`; None: all
        towards          as points            unit directions to where each point is seen from, as of reflected rays;
                                              None: to the viewer
        tiles            first tile of at.TILE points, and the one after the last; None: all
        scratch          of at.scratch, to be used again; None makes one
        """
        flat = [read_only(vectors.reshape(-1)) for vectors in (points, normals)]
        seen_from = self._nowhere if towards is None else read_only(towards.reshape(-1))
        vectors = (*flat, _NONE_SEEN if visible is None else read_only(visible.view(np.uint8)), seen_from)
        part = np.array(tiles or (0, -(-len(flat[0]) // (3 * at.TILE))))
        s = at.scratch(self.precision) if scratch is None else scratch
        return int(tile_loop.shade_tiles(self._arguments.arrays, vectors, part, out.reshape(-1), counts, lost, s))

    def shade(self, points: Array, normals: Array, out: Array, counts: Any, lost: Array, **options: Any) -> None:
        """As `fill`; InputError, naming the point, if one is not finite."""
        bad = self.fill(points, normals, out, counts, lost, **options)
        if bad >= 0:
            where = f"points[{bad}] = {points[bad].tolist()}, normal {normals[bad].tolist()}"
            raise InputError("a point that rays found cannot be shaded", where, "bring the scene nearer to the camera")

    def skipped(self, points: int, counts: NDArray[np.int64]) -> dict[str, int]:
        """What was left out of so many points: the fields of `shade.Ledger`."""
        pairs, unused = points * self._lights, points * self._arguments.left_out
        built = pairs - unused - int(counts[[at.BEHIND, at.OUT, at.SHADE, at.UNBUILT]].sum())
        return {
            "pairs": pairs,
            "zero_colours": unused,
            "out_of_reach": int(counts[at.OUT]),
            "in_shadow": int(counts[at.SHADE]),
            "lights_behind": int(counts[at.BEHIND]),
            "vectors_not_built": int(counts[at.UNBUILT]),
            "vectors_not_normalised": int(counts[at.LEFT_LONG]) + (built if self._half_left else 0),
            "constant_directions": points * self._arguments.constant,
            self._reason: int(counts[at.UNLIT]),
        }
