"""One thread's share of a picture: tiles of rays, followed from the camera until nothing reflects any more."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.scenes import camera, ray_kernels
from phongbench.scenes.geometry import Geometry
from phongbench.scenes.scene import Scene
from phongbench.scenes.skips import Tally, Thrift
from phongbench.shading import tiles
from phongbench.shading.prepared import Shader

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
        lost = np.zeros((job.depth + 1, len(job.shaders)), np.float32)
        self.job, self.tally = job, Tally(lost=lost)
        self.here, self.next = Wave(capacity), Wave(capacity)
        # of a shadow ray, the weight is how far its light is, and the pixel the point it comes from
        self.shadow = Wave(capacity)
        self.t, self.t_shadow, self.spare = (np.empty(capacity, np.float32) for _ in range(3))
        self.which, self.which_shadow, self.group, self.ray_of = (np.empty(capacity, np.int32) for _ in range(4))
        self.uv = np.zeros((2, capacity), np.float32)
        self.points, self.normals, self.seen, self.colours = (np.empty((capacity, 3), np.float32) for _ in range(4))
        objects = job.geometry.spheres.shape[1] + job.geometry.planes.shape[1]
        self.every = np.arange(objects, dtype=np.int32)
        self.seen_spheres = np.empty(job.geometry.spheres.shape[1], np.int32)
        self._set_lights()

    def _set_lights(self) -> None:
        """The lights as kernels take them, and how far away a shadow is asked for: negative asks everywhere."""
        lights, thrift = self.job.scene.lights, self.job.thrift
        places = [(*(light.position or light.direction or ()), light.position is None) for light in lights]
        self.lights = np.array(places, np.float32).reshape(-1, 4)
        reaches = [np.inf if light.reach is None or not thrift.shading.reach else light.reach for light in lights]
        self.spans = np.array(reaches if thrift.shadow_rays else [-1.0] * len(lights), np.float32)

    def draw(self, first: tuple[int, int], shape: tuple[int, int], picture: Array) -> None:
        """Draw one tile.

        first    column and row of its upper left pixel
        shape    columns and rows
        picture  float32 (rows * columns, 3)  in and out: light is added
        """
        job, s = self.job, self.job.samples
        places, pixels = camera.pixel_order(*shape, s)
        wave = self.here
        wave.count = len(places)
        corner, size = (first[0] * s, first[1] * s), (job.size[0] * s, job.size[1] * s)
        camera.primary_rays(job.view, corner, places, size, wave.rays)
        wave.pixels[: wave.count] = pixels
        wave.weights[: wave.count] = 1 / s**2
        wanted = self._in_sight(corner, (shape[0] * s, shape[1] * s), size)
        for bounce in range(job.depth + 1):
            if not self.here.count:
                break
            self._bounce(picture, bounce, self.every if bounce else wanted)
            self.here, self.next = self.next, self.here

    def _in_sight(self, corner: tuple[int, int], shape: tuple[int, int], size: tuple[int, int]) -> Array:
        """The objects that the camera's rays through a tile may hit: spheres that its cone touches, and all planes."""
        g = self.job.geometry
        if not self.job.thrift.objects:
            return self.every
        count = int(camera.in_sight(self.job.view, g.spheres, corner, shape, size, self.seen_spheres))
        return np.concatenate([self.seen_spheres[:count], self.every[g.spheres.shape[1] :]])

    def _bounce(self, picture: Array, bounce: int, objects: Array) -> None:
        """Trace the wave against these objects, shade what it found, and make the next one."""
        wave, tally = self.here, self.tally
        started = time.perf_counter()
        sizes = self._trace(wave, objects)
        tally.rays += wave.count
        tally.tracing += time.perf_counter() - started
        self.next.count = 0
        first = 0
        for group, count in enumerate(sizes):
            if count:
                self._group(group, first, int(count), picture, bounce)
            first += int(count)

    def _trace(self, wave: Wave, objects: Array) -> Array:
        """What each ray hits of these objects, sorted by group; returns the groups' sizes."""
        g, count = self.job.geometry, wave.count
        spheres = np.ascontiguousarray(g.spheres[:, objects[: len(objects) - g.planes.shape[1]]])
        ray_kernels.nearest(wave.rays, count, spheres, objects, g.planes, self.t, self.which, self.spare)
        self.tally.tests += count * len(self.every)
        self.tally.objects += count * (len(self.every) - len(objects))
        self._triangles(wave)
        sizes = np.zeros(2 * len(self.job.shaders) + 1, np.int64)
        ray_kernels.sort(
            wave.rays,
            count,
            self.t,
            self.which,
            g.planes,
            g.boards,
            g.materials,
            g.spheres.shape[1],
            g.modes,
            self.group,
            sizes,
        )
        starts = np.cumsum(sizes) - sizes
        ray_kernels.gather(
            wave.rays,
            count,
            self.t,
            self.which,
            self.uv,
            g.spheres,
            g.planes,
            g.corners,
            g.normals,
            g.modes,
            self.group,
            starts,
            self.points,
            self.normals,
            self.seen,
            self.ray_of,
        )
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
        if group < 2 * names:
            k = np.float32(job.scene.materials[group % names].reflectivity)
        if group < names:
            self._shade(group, part, bounce)
        elif group < 2 * names:
            offset = job.geometry.spheres.shape[1] + job.geometry.planes.shape[1]
            ray_kernels.blend(job.vertex, self.which, offset, self.uv, self.ray_of, first, colours)
        else:
            if job.thrift.background:
                tally.background += count
            else:  # the honest alternative: lit like anything else, and thrown away
                self._shade(0, part, bounce)
            colours[:] = job.scene.background
        wave = self.here
        ray_kernels.accumulate(
            colours, first, count, np.float32(1) - k, self.ray_of, wave.weights, wave.pixels, picture
        )
        tally.shading += time.perf_counter() - started
        if bounce < job.depth:
            self._reflect(first, count, k, reflects=group < 2 * names)

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
        ahead.count = int(
            ray_kernels.reflect(
                self.points,
                self.normals,
                self.seen,
                first,
                count,
                k,
                least,
                self.ray_of,
                here.weights,
                here.pixels,
                ahead.rays,
                ahead.weights,
                ahead.pixels,
                before,
            )
        )
        tally.cutoff += count - (ahead.count - before)
        tally.tracing += time.perf_counter() - started

    def _shade(self, material: int, part: slice, bounce: int) -> None:
        """The colours of a group's points."""
        points, normals = self.points[part], self.normals[part]
        counts = np.zeros(tiles.COUNTS, np.int64)
        shader = self.job.shaders[material]
        shader.shade(
            points,
            normals,
            self.colours[part],
            counts,
            self.tally.lost[bounce, material : material + 1],
            towards=self.seen[part] if bounce else None,
            visible=self.visible(points, normals),
        )
        self.tally.add_pairs(shader.pairs(len(points), counts))

    def visible(self, points: Array, normals: Array) -> Array | None:
        """Which points see which light; None without shadows."""
        job, g, tally = self.job, self.job.geometry, self.tally
        if not job.shadows:
            return None
        started = time.perf_counter()
        visible = np.empty((len(self.lights), len(points)), np.bool_)
        rays, limit, point_of = self.shadow.rays, self.shadow.weights, self.shadow.pixels
        scratch = (self.t_shadow, self.which_shadow, self.spare)
        if g.embree is None:
            count = int(
                ray_kernels.shadows(
                    points,
                    normals,
                    self.lights,
                    self.spans,
                    rays,
                    limit,
                    point_of,
                    g.spheres,
                    self.every,
                    g.planes,
                    *scratch,
                    visible,
                )
            )
        else:
            count = 0
            for row, light, span in zip(visible, self.lights, self.spans, strict=True):
                mine = int(ray_kernels.shadow_rays(points, normals, light, bool(light[3]), span, rays, limit, point_of))
                ray_kernels.nearest(rays, mine, g.spheres, self.every, g.planes, *scratch)
                self._hidden_by_triangles(mine)
                ray_kernels.hide(self.t_shadow, limit, point_of, mine, row)
                count += mine
        tally.shadow_rays += len(self.lights) * len(points)
        tally.shadow_rays_saved += len(self.lights) * len(points) - count
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
