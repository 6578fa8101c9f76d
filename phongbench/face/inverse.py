"""Normals and heights from shading."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from phongbench.inverse.line import InverseLine, LineModel, invert_line


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
