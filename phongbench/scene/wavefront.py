"""One thread's share of a picture: tiles of rays, followed from the camera until nothing reflects any more."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import tiles
from phongbench.lighting import Light
from phongbench.scene import tracing, views
from phongbench.scene.geometry import Geometry
from phongbench.scene.parts import Scene
from phongbench.scene.shader import Shader
from phongbench.scene.thrift import Tally, Thrift

Array = NDArray[Any]

#: embreex takes no infinity for "as far as there is"
_FARTHEST = np.float32(1e37)
#: distance of a shadow ray's start from the light that it ends before, as a share of the distance
_SHORT = np.float32(1 - 1e-4)


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be drawn, the same for every thread.

    shaders  one for each material
    vertex   float32 (9, t)  colours of the triangles' corners, for Gouraud shading
    size     of the picture, in pixels
    """

    scene: Scene
    geometry: Geometry
    shaders: Sequence[Shader]
    vertex: Array
    view: Array
    size: tuple[int, int]
    depth: int
    samples: int
    shadows: bool
    thrift: Thrift


class Wave:
    """Rays that are followed together: where they start, what they weigh, which pixel they belong to."""

    def __init__(self, capacity: int) -> None:
        self.rays = np.empty((6, capacity), np.float32)
        self.weights = np.empty(capacity, np.float32)
        self.pixels = np.empty(capacity, np.int32)
        self.count = 0


class Worker:
    """Draws tiles; its buffers are made once, for the largest tile."""

    def __init__(self, job: Job, capacity: int) -> None:
        self.job, self.tally = job, Tally()
        self.here, self.next = Wave(capacity), Wave(capacity)
        # of a shadow ray, the weight is how far its light is, and the pixel the point it comes from
        self.shadow = Wave(capacity)
        self.t, self.t_shadow, self.spare = (np.empty(capacity, np.float32) for _ in range(3))
        self.which, self.which_shadow, self.group, self.ray_of = (np.empty(capacity, np.int32) for _ in range(4))
        self.uv = np.zeros((2, capacity), np.float32)
        self.points, self.normals, self.seen, self.colours = (np.empty((capacity, 3), np.float32) for _ in range(4))
        self.lights = [_light_row(light) for light in job.scene.lights]

    def draw(self, first: tuple[int, int], shape: tuple[int, int], picture: Array) -> None:
        """Draw one tile.

        first    column and row of its upper left pixel
        shape    columns and rows
        picture  float32 (rows * columns, 3)  in and out: light is added
        """
        job, s = self.job, self.job.samples
        places, pixels = views.pixel_order(*shape, s)
        wave = self.here
        wave.count = len(places)
        corner, size = (first[0] * s, first[1] * s), (job.size[0] * s, job.size[1] * s)
        views.primary_rays(job.view, corner, places, size, wave.rays)
        wave.pixels[: wave.count] = pixels
        wave.weights[: wave.count] = 1 / s**2
        for bounce in range(job.depth + 1):
            if not self.here.count:
                break
            self._bounce(picture, bounce)
            self.here, self.next = self.next, self.here

    def _bounce(self, picture: Array, bounce: int) -> None:
        """Trace the wave, shade what it found, and make the next one."""
        wave, tally = self.here, self.tally
        started = time.perf_counter()
        sizes = self._trace(wave)
        tally.rays += wave.count
        tally.tracing += time.perf_counter() - started
        self.next.count = 0
        first = 0
        for group, count in enumerate(sizes):
            if count:
                self._group(group, first, int(count), picture, bounce)
            first += int(count)

    def _trace(self, wave: Wave) -> Array:
        """What each ray hits, sorted by group; returns the groups' sizes."""
        g, count = self.job.geometry, wave.count
        tracing.nearest(wave.rays, count, g.spheres, g.planes, self.t, self.which, self.spare)
        self._triangles(wave)
        sizes = np.zeros(len(self.job.shaders) + 2, np.int64)
        tracing.sort(
            wave.rays, count, self.t, self.which, g.planes, g.boards, g.materials, g.spheres.shape[1], g.modes,
            self.group, sizes,
        )  # fmt: skip
        starts = np.cumsum(sizes) - sizes
        tracing.gather(
            wave.rays, count, self.t, self.which, self.uv, g.spheres, g.planes, g.corners, g.normals, g.modes,
            self.group, starts, self.points, self.normals, self.seen, self.ray_of,
        )  # fmt: skip
        return sizes

    def _triangles(self, wave: Wave) -> None:
        """Ask Embree for triangles that are nearer than what was found."""
        g, count = self.job.geometry, wave.count
        if g.embree is None:
            return
        origins, directions = (np.ascontiguousarray(wave.rays[a : a + 3, :count].T) for a in (0, 3))
        found = g.embree(origins, directions, np.minimum(self.t[:count], _FARTHEST), output=1)
        hit = found["primID"] >= 0
        self.which[:count][hit] = found["primID"][hit] + (g.spheres.shape[1] + g.planes.shape[1])
        self.t[:count][hit] = found["tfar"][hit]
        self.uv[0, :count], self.uv[1, :count] = found["u"], found["v"]

    def _group(self, group: int, first: int, count: int, picture: Array, bounce: int) -> None:
        """Shade a group, add its light to the picture, and reflect its rays."""
        job, tally = self.job, self.tally
        names = len(job.shaders)
        part = slice(first, first + count)
        started = time.perf_counter()
        k = np.float32(0)
        colours = self.colours[part]
        if group < names:
            k = np.float32(job.scene.materials[group].reflectivity)
            self._shade(group, part, bounce)
        elif group == names:
            offset = job.geometry.spheres.shape[1] + job.geometry.planes.shape[1]
            tracing.blend(job.vertex, self.which, offset, self.uv, self.ray_of, first, colours)
        else:
            if job.thrift.background:
                tally.background += count
            else:  # the honest alternative: lit like anything else, and thrown away
                self._shade(0, part, bounce)
            colours[:] = job.scene.background
        wave = self.here
        tracing.accumulate(
            colours, first, count, np.float32(1) - k, self.ray_of, wave.weights, wave.pixels, picture
        )  # fmt: skip
        tally.shading += time.perf_counter() - started
        if bounce < job.depth:
            self._reflect(first, count, k, reflects=group < names)

    def _reflect(self, first: int, count: int, k: np.float32, *, reflects: bool) -> None:
        """Append the reflected rays of a group to the next wave."""
        thrift, tally, here, ahead = self.job.thrift, self.tally, self.here, self.next
        if not reflects:
            return
        tally.reflections += count
        if k == 0 and thrift.reflectivity:
            tally.reflectivity += count
            return
        started = time.perf_counter()
        least = np.float32(thrift.cutoff / self.job.samples**2)
        before = ahead.count
        ahead.count = int(tracing.reflect(
            self.points, self.normals, self.seen, first, count, k, least, self.ray_of, here.weights, here.pixels,
            ahead.rays, ahead.weights, ahead.pixels, before,
        ))  # fmt: skip
        tally.cutoff += count - (ahead.count - before)
        tally.tracing += time.perf_counter() - started

    def _shade(self, material: int, part: slice, bounce: int) -> None:
        """The colours of a group's points."""
        points, normals = self.points[part], self.normals[part]
        counts = np.zeros(tiles.COUNTS, np.int64)
        shader = self.job.shaders[material]
        shader.shade(
            points, normals, self.colours[part], counts, towards=self.seen[part] if bounce else None,
            visible=self._visible(points, normals),
        )  # fmt: skip
        self.tally.add_pairs(shader.pairs(len(points), counts))

    def _visible(self, points: Array, normals: Array) -> Array | None:
        """Which points see which light; None without shadows."""
        job, g, tally = self.job, self.job.geometry, self.tally
        if not job.shadows:
            return None
        started = time.perf_counter()
        visible = np.empty((len(self.lights), len(points)), np.bool_)
        rays, limit, point_of, t = self.shadow.rays, self.shadow.weights, self.shadow.pixels, self.t_shadow
        for row, (place, far, reach) in zip(visible, self.lights, strict=True):
            span = np.float32(-1)
            if job.thrift.shadow_rays:
                span = reach if job.thrift.shading.reach else tracing.FAR
            count = int(tracing.shadow_rays(points, normals, place, far, span, rays, limit, point_of))
            tally.shadow_rays += len(points)
            tally.shadow_rays_saved += len(points) - count
            tracing.nearest(rays, count, g.spheres, g.planes, t, self.which_shadow, self.spare)
            self._hidden_by_triangles(count)
            tracing.hide(t, limit, point_of, count, row)
        spent = time.perf_counter() - started
        tally.tracing += spent
        tally.shading -= spent
        return visible

    def _hidden_by_triangles(self, count: int) -> None:
        """Set t of the shadow rays that a triangle stops to 0."""
        g = self.job.geometry
        if g.embree is None or not count:
            return
        rays = self.shadow.rays
        origins, directions = (np.ascontiguousarray(rays[a : a + 3, :count].T) for a in (0, 3))
        far = np.minimum(self.shadow.weights[:count], _FARTHEST) * _SHORT
        hit = g.embree(origins, directions, far, query="OCCLUDED")
        self.t_shadow[:count][hit == 0] = 0


def _light_row(light: Light) -> tuple[Array, bool, np.float32]:
    """A light as the kernels take it: place or direction, whether it is far away, how far it shines."""
    far = light.position is None
    place = np.array(light.direction if far else light.position, np.float32)
    return place, far, np.float32(np.inf if light.reach is None else light.reach)
