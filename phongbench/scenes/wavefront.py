"""One thread's share of a picture: tiles of rays, followed from the camera until nothing reflects any more."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.scenes import camera, ray_kernels, shadow_kernels, surface_kernels
from phongbench.scenes.geometry import Geometry
from phongbench.scenes.scene import Scene
from phongbench.scenes.skips import SceneSkips, Tally
from phongbench.shading import tiles
from phongbench.shading.lighting import Light
from phongbench.shading.prepared import PreparedShading

#: embreex takes no infinity for "as far as there is"
_FARTHEST = np.float32(1e37)


@dataclass(frozen=True, eq=False)
class RenderJob:
    """What is to be drawn, the same for every thread. Places are those of the geometry's eye space.

    scene     its picture settings are those asked for
    lights    the scene's, in eye space
    shadings  one for each material
    vertex    float32 (9, t)  colours of the triangles' corners, for Gouraud shading
    view      of camera.frame
    """

    scene: Scene
    geometry: Geometry
    lights: Sequence[Light]
    shadings: Sequence[PreparedShading]
    vertex: Array
    view: Array
    skips: SceneSkips


class Wave:
    """Rays that are followed together: where they start, what they weigh, which pixel they belong to."""

    def __init__(self, capacity: int) -> None:
        self.rays = np.empty((6, capacity), np.float32)
        self.weights = np.empty(capacity, np.float32)
        self.pixels = np.empty(capacity, np.int32)
        self.count = 0

    @property
    def arrays(self) -> tuple[Array, Array, Array]:
        """As kernels take them."""
        return self.rays, self.weights, self.pixels


class Worker:
    """Draws tiles; its buffers are made once, for the largest tile."""

    def __init__(self, job: RenderJob, capacity: int) -> None:
        self.job, self.settings, g = job, job.scene.picture, job.geometry
        self.tally = Tally(lost=np.zeros((self.settings.depth + 1, len(job.shadings)), np.float32))
        self.here, self.next = Wave(capacity), Wave(capacity)
        # of a shadow ray, the weight is how far its light is, and the pixel the point it comes from
        self.shadow = Wave(capacity)
        self.t, self.t_shadow, self.spare = (np.empty(capacity, np.float32) for _ in range(3))
        self.which, self.which_shadow, self.group, self.ray_of = (np.empty(capacity, np.int32) for _ in range(4))
        self.uv = np.zeros((2, capacity), np.float32)
        rows = [np.empty((capacity, 3), np.float32) for _ in range(5)]
        self.points, self.starts, self.normals, self.seen, self.colours = rows
        self.hits = self.t, self.which, self.uv
        self.surface = self.points, self.starts, self.normals, self.seen, self.ray_of
        self.triangles_from = g.spheres.shape[1] + g.planes.shape[1]
        self.every = np.arange(self.triangles_from, dtype=np.int32)
        self.seen_spheres = np.empty(g.spheres.shape[1], np.int32)
        self.solids = g.spheres, g.planes, self.every
        self._set_lights()

    def _set_lights(self) -> None:
        """The lights as kernels take them, and how far away a shadow is asked for: negative asks everywhere."""
        lights, skips = self.job.lights, self.job.skips
        places = [(*(light.position or light.direction or ()), light.position is None) for light in lights]
        self.lights = np.array(places, np.float32).reshape(-1, 4)
        reaches = [np.inf if light.reach is None or not skips.shading.reach else light.reach for light in lights]
        self.spans = np.array(reaches if skips.shadow_rays else [-1.0] * len(lights), np.float32)

    def draw(self, first: tuple[int, int], shape: tuple[int, int], picture: Array) -> None:
        """Draw one tile.

        first    column and row of its upper left pixel
        shape    columns and rows
        picture  float32 (rows * columns, 3)  in and out: light is added
        """
        job, s, (width, height) = self.job, self.settings.supersampling, self.settings.size
        places, pixels = camera.pixel_order(*shape, s)
        wave = self.here
        wave.count = len(places)
        corner, size = (first[0] * s, first[1] * s), (width * s, height * s)
        camera.primary_rays(job.view, corner, places, size, wave.rays)
        wave.pixels[: wave.count] = pixels
        wave.weights[: wave.count] = 1 / s**2
        wanted = self._in_sight(corner, (shape[0] * s, shape[1] * s), size)
        for bounce in range(self.settings.depth + 1):
            if not self.here.count:
                break
            self._bounce(picture, bounce, self.every if bounce else wanted)
            self.here, self.next = self.next, self.here

    def _in_sight(self, corner: tuple[int, int], shape: tuple[int, int], size: tuple[int, int]) -> Array:
        """The objects that the camera's rays through a tile may hit: spheres that its cone touches, and all planes."""
        g = self.job.geometry
        if not self.job.skips.objects:
            return self.every
        count = int(camera.in_sight(self.job.view, g.spheres, corner, shape, size, self.seen_spheres))
        return np.concatenate([self.seen_spheres[:count], self.every[g.spheres.shape[1] :]])

    def _bounce(self, picture: Array, bounce: int, objects: Array) -> None:
        """Trace the wave against these objects, shade what it hit, and make the next one."""
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
        ray_kernels.nearest(wave.rays, count, (spheres, g.planes, objects), (self.t, self.which, self.spare))
        self.tally.tests += count * len(self.every)
        self.tally.objects += count * (len(self.every) - len(objects))
        self._triangles(wave)
        sizes = np.zeros(2 * len(self.job.shadings) + 1, np.int64)
        surface_kernels.sort(wave.rays, count, self.hits, g.arrays, self.group, sizes)
        ends = np.cumsum(sizes) - sizes
        background = not self.job.skips.background
        surface_kernels.gather(wave.rays, count, self.hits, g.arrays, self.group, ends, self.surface, background)
        if g.embree is not None:
            surface_kernels.gather_triangles(wave.rays, count, self.hits, g.arrays, self.surface)
        return sizes

    def _triangles(self, wave: Wave) -> None:
        """Ask Embree for triangles that are nearer than what was hit."""
        g, count = self.job.geometry, wave.count
        if g.embree is None:
            return
        origins, directions = (np.ascontiguousarray(wave.rays[a : a + 3, :count].T) for a in (0, 3))
        answer = g.embree(origins, directions, np.minimum(self.t[:count], _FARTHEST), output=1)
        hit = answer["primID"] >= 0
        self.which[:count][hit] = answer["primID"][hit] + self.triangles_from
        self.t[:count][hit] = answer["tfar"][hit]
        self.uv[0, :count], self.uv[1, :count] = answer["u"], answer["v"]

    def _group(self, group: int, first: int, count: int, picture: Array, bounce: int) -> None:
        """Shade a group, add its light to the picture, and reflect its rays."""
        job, tally, wave = self.job, self.tally, self.here
        names = len(job.shadings)
        part = slice(first, first + count)
        started = time.perf_counter()
        hit = group < 2 * names
        k = np.float32(job.scene.materials[group % names].reflectivity if hit else 0)
        colours = self.colours[part]
        if group < names:
            self._shade(group, part, bounce)
        elif hit:
            surface_kernels.blend(job.vertex, self.which, self.triangles_from, self.uv, self.ray_of, first, colours)
        else:
            if job.skips.background:
                tally.background += count
            else:  # the honest alternative: lit like anything else, and thrown away
                self._shade(0, part, bounce)
            colours[:] = job.scene.background
        direct = np.float32(1) - k
        surface_kernels.accumulate(colours, first, count, direct, self.ray_of, wave.weights, wave.pixels, picture)
        tally.shading += time.perf_counter() - started
        if bounce < self.settings.depth and hit:
            self._reflect(first, count, k)

    def _reflect(self, first: int, count: int, k: np.float32) -> None:
        """Append the reflected rays of a group to the next wave."""
        skips, tally, ahead = self.job.skips, self.tally, self.next
        tally.reflections += count
        if k == 0 and skips.reflectivity:
            tally.reflectivity += count
            return
        started = time.perf_counter()
        least = np.float32(skips.cutoff / self.settings.supersampling**2)
        before, waves = ahead.count, (self.here.arrays, ahead.arrays)
        ahead.count = int(ray_kernels.reflect(self.surface, first, count, k, least, *waves, before))
        tally.cutoff += count - (ahead.count - before)
        tally.tracing += time.perf_counter() - started

    def _shade(self, material: int, part: slice, bounce: int) -> None:
        """The colours of a group's points."""
        points, normals = self.points[part], self.normals[part]
        visible = self.visible((points, self.starts[part], normals))
        counts, lost = np.zeros(tiles.COUNTS, np.int64), self.tally.lost[bounce, material : material + 1]
        shading, towards = self.job.shadings[material], self.seen[part] if bounce else None
        shading.shade(points, normals, self.colours[part], counts, lost, towards=towards, visible=visible)
        self.tally.add_pairs(shading.skipped(len(points), counts))

    def visible(self, surface: tuple[Array, Array, Array]) -> Array | None:
        """Which points see which light; None without shadows.

        surface  points, where rays that leave them start, normals
        """
        g, tally = self.job.geometry, self.tally
        if not self.settings.shadows:
            return None
        started, points = time.perf_counter(), len(surface[0])
        visible = np.empty((len(self.lights), points), np.bool_)
        rays, limit, point_of = wave = self.shadow.arrays
        hits = self.t_shadow, self.which_shadow, self.spare
        if g.embree is None:
            args = self.lights, self.spans, wave, self.solids, hits, visible
            count = int(shadow_kernels.shadows(surface, *args))
        else:
            count = 0
            for row, light, span in zip(visible, self.lights, self.spans, strict=True):
                mine = int(shadow_kernels.shadow_rays(surface, light, bool(light[3]), span, rays, limit, point_of))
                ray_kernels.nearest(rays, mine, self.solids, hits)
                self._hidden_by_triangles(mine)
                shadow_kernels.hide(self.t_shadow, limit, point_of, mine, row)
                count += mine
        tally.shadow_rays += len(self.lights) * points
        tally.shadow_rays_saved += len(self.lights) * points - count
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
        hit = g.embree(origins, directions, np.minimum(self.shadow.weights[:count], _FARTHEST), query="OCCLUDED")
        self.t_shadow[:count][hit == 0] = 0
