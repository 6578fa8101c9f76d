"""Normals and heights from shading."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.face.highlight import formula_of
from phongbench.formulas.formula import Formula
from phongbench.formulas.spec import Approximation
from phongbench.inverse.line import InverseLine, invert_line
from phongbench.inverse.line_model import LineModel
from phongbench.inverse.photometric import Normals, invert_pictures
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel


def inverse_line(
    intensity: ArrayLike,
    *,
    ambient: float,
    diffuse: float,
    light: Sequence[float],
    x: ArrayLike | None = None,
    prior: str | ArrayLike = "convex",
    noise: float = 0.0,
    rule: str = "simpson",
    start: str = "left",
    bridge: bool = False,
    unit_light: bool = False,
) -> InverseLine:
    """Normals and heights across a cylinder from intensities along a line: both solutions, the prior's, and heights.

    x to the right, z and heights to the viewer; (I - ambient) / diffuse = Lx Nx + Lz Nz.

    intensity   (n,) in 0 .. 1
    light       (Lx, Lz), Lz >= 0   towards the light; its length counts, unless `unit_light` makes it 1
    x           (n,) growing        where the samples are  [default: 1 apart]
    prior       convex, concave, continuous, towards-viewer, or the angles (n,) expected, in degrees from the viewer's
                direction towards x
    noise       standard deviation of intensities, for the band of the heights
    rule        of the heights' integral: simpson or trapezoid
    start       where heights are 0: left, right, or both, which are then known to be equally high
    bridge      whether heights go on across samples in shadow, saturated or brighter than the light can make them
    returns     InverseLine: `normals`, `other`, `angles`, `height`, `height_low`, `height_high`, `marks`, `notes`, and
                all of it as the DataFrame `frame`; missing values are NaN
    Raises InputError, or UnknownNameError for names, saying what was expected.

    >>> line = pb.inverse_line([0.6, 0.8, 0.6], ambient=0.1, diffuse=0.7, light=(0, 1))
    >>> line.angles.round(1)
    array([-44.4,   0. ,  44.4])
    """
    model = LineModel(ambient, diffuse, light, noise)  # type: ignore[arg-type]  # it makes two numbers of any sequence
    options = {"x": x, "prior": prior, "rule": rule, "start": start, "bridge": bridge}
    return invert_line(intensity, model.unit() if unit_light else model, **options)  # type: ignore[arg-type]


def inverse_photometric(
    pictures: ArrayLike,
    lights: Sequence[Sequence[float]] | Array,
    formula: str | Formula = "phong",
    *,
    alpha: float = 50.0,
    ambient: float = 0.0,
    diffuse: float = 1.0,
    specular: float = 0.0,
    intensities: Sequence[float] | Array | None = None,
    mask: ArrayLike | None = None,
    albedo: bool = False,
    gloss: bool = False,
    saturation: float = np.inf,
    shadow: float | None = None,
    threads: int = 1,
    own: Sequence[Approximation] = (),
) -> Normals:
    """Normals from three or more pictures of one view under known lights far away, by the full reflection model.

    x to the right, y up (rows go down), z to the viewer.

    pictures    (k, h, w)     linear intensities
    lights      (k, 3)        towards each light; made unit
    formula     of the highlight at exponent `alpha`, in place of max(0, R.V)^alpha
    ambient, diffuse, specular   strengths of the terms, for lights of intensity 1
    intensities (k,)          of the lights  [default: 1]
    mask        (h, w)        pixels that are wanted
    albedo, gloss             whether to solve for a factor of the diffuse, and of the specular term in each pixel
    saturation, shadow        intensities from the one on, and up to the other above ambient, are not used
    returns     Normals: `normals` (h, w, 3), NaN where nothing is known, `diffuse`, `specular`, `residual`, `steps`;
                `heights()` gives heights (h, w) towards the viewer
    Raises InputError naming the argument, the picture or the light.

    >>> lights = [(0.5, 0, 1), (-0.5, 0, 1), (0, 0.5, 1)]
    >>> pictures = [[[0.6261]]] * 3  # 0.7 times the cosine of each light, of a plane that faces the viewer
    >>> pb.inverse_photometric(pictures, lights, diffuse=0.7).normals.round(3) + 0.0
    array([[[0., 0., 1.]]])
    """
    chosen, registry = formula_of(formula, own)
    strengths = np.ones(len(lights)) if intensities is None else intensities
    if len(strengths) != len(lights):
        raise InputError(f"{len(strengths)} intensities for {len(lights)} lights", "intensities", "give one for each")
    known = [PhotometricLight.of(v, e, f"lights[{i}]") for i, (v, e) in enumerate(zip(lights, strengths, strict=True))]
    model = SurfaceModel(ambient, diffuse, specular, alpha, chosen, registry)
    inside = None if mask is None else np.asarray(mask)
    options = {"albedo": albedo, "gloss": gloss, "saturation": saturation, "shadow": shadow, "threads": threads}
    return invert_pictures(np.asarray(pictures), known, model, mask=inside, **options)  # type: ignore[arg-type]
