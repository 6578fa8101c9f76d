"""The slow obvious twin: a ray tracer as one writes it in NumPy, for spheres and planes under exact Phong.

It is what the compiled one is tested against, and what it is compared with: whole arrays, a mask where it matters,
nothing else left out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.scenes.scene import Camera, Mesh, Plane, Scene, Sphere

#: share of its distance that a light is taken to be nearer, so that a lamp on a surface is not hidden by it
_NEARER = 1e-5
#: how far from its surface a ray starts, as a share of what it is computed from:
#: thousands of roundings in float64, as rays that graze spheres need, and hundreds in float32, which has no more
_ROUNDING = {"float64": 1e-12, "float32": 4e-5}


def trace(
    scene: Scene,
    *,
    size: tuple[int, int] | None = None,
    depth: int | None = None,
    shadows: bool | None = None,
    dtype: Any = np.float64,
) -> tuple[Array, int]:
    """The picture (height, width, 3) in linear light, and how many rays it took, shadow rays not counted.

    Raises InputError for scenes with meshes.
    """
    if scene.of(Mesh):
        raise InputError("the plain tracer knows spheres and planes only", scene.name, "choose a scene without meshes")
    wanted = scene.picture
    width, height = size or wanted.size
    tracer = _Tracer(scene, wanted.shadows if shadows is None else shadows, dtype)
    origins, directions = tracer.camera(width, height)
    picture = tracer.follow(origins, directions, wanted.depth if depth is None else depth)
    return picture.reshape(height, width, 3), tracer.rays


def distances(scene: Scene, size: tuple[int, int]) -> Array:
    """How far away what each pixel's middle shows is: float64 (height, width), infinite where there is nothing."""
    tracer = _Tracer(scene, shadows=False, dtype=np.float64)
    width, height = size
    return tracer.nearest(*tracer.camera(width, height))[0].reshape(height, width)


def directions(camera: Camera, width: int, height: int) -> Array:
    """Where the pixels' middles are, seen from the camera: float64 unit vectors (height, width, 3)."""
    forward = _unit(np.subtract(camera.target, camera.position))
    right = _unit(np.cross(forward, camera.up))
    up = np.cross(right, forward)
    half = np.tan(np.radians(camera.field_of_view) / 2)
    y, x = np.mgrid[0:height, 0:width]
    across = ((2 * x + 1) / width - 1) * half * width / height
    along = (1 - (2 * y + 1) / height) * half
    return _unit(forward + across[..., None] * right + along[..., None] * up)


@dataclass
class _Tracer:
    scene: Scene
    shadows: bool
    dtype: Any
    rays: int = 0

    def camera(self, width: int, height: int) -> tuple[Array, Array]:
        towards = directions(self.scene.camera, width, height).reshape(-1, 3).astype(self.dtype)
        return np.broadcast_to(np.array(self.scene.camera.position, self.dtype), towards.shape), towards

    def follow(self, origins: Array, directions: Array, depth: int) -> Array:
        """The colours along these rays: direct light, and what is reflected."""
        self.rays += len(origins)
        t, which = self.nearest(origins, directions)
        hit = which >= 0
        colours = np.empty_like(origins)
        colours[~hit] = self.scene.background
        if not hit.any():
            return colours
        points = origins[hit] + t[hit, None] * directions[hit]
        normals, worn = self.surface(points, directions[hit], which[hit])
        starts = self.lifted(points, normals, t[hit] + self.sizes()[which[hit]])
        k = np.array([m.reflectivity for m in self.scene.materials], self.dtype)[worn][:, None]
        direct = (1 - k) * self.lit(points, starts, normals, -directions[hit], worn)
        mirror = k[:, 0] > 0
        if depth > 0 and mirror.any():
            along = directions[hit][mirror]
            across = normals[mirror]
            # scaled again: what a direction is longer than 1, each mirror around it makes ten times as much
            reflected = _unit(along - 2 * (along * across).sum(axis=1, keepdims=True) * across)
            direct[mirror] += k[mirror] * self.follow(starts[mirror], reflected, depth - 1)
        colours[hit] = direct
        return colours

    def nearest(self, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Distance to the nearest object, and its index; infinity and -1 where there is none."""
        t = np.full(len(origins), np.inf, self.dtype)
        which = np.full(len(origins), -1)
        for index, thing in enumerate(self.scene.objects):
            found = self.distance(thing, origins, directions)
            nearer = found < t
            t[nearer], which[nearer] = found[nearer], index
        return t, which

    def distance(self, thing: Any, origins: Array, directions: Array) -> Array:
        """How far along each ray the object is; infinity where it is missed."""
        with np.errstate(divide="ignore", invalid="ignore"):
            if isinstance(thing, Sphere):
                away = origins - np.array(thing.centre, self.dtype)
                b = (away * directions).sum(axis=1)
                foot = away - b[:, None] * directions
                half = np.sqrt(self.dtype(thing.radius) ** 2 - (foot * foot).sum(axis=1))  # NaN where it is missed
                near = -b - half
                t = np.where(near > 0, near, -b + half)
            else:
                normal = np.array(thing.normal, self.dtype)
                t = ((np.array(thing.point, self.dtype) - origins) @ normal) / (directions @ normal)
            return np.asarray(np.where(t > 0, t, self.dtype(np.inf)))

    def surface(self, points: Array, directions: Array, which: Array) -> tuple[Array, Array]:
        """Normals on the rays' side, and materials."""
        normals, worn = np.empty_like(points), np.zeros(len(points), int)
        for index, thing in enumerate(self.scene.objects):
            mine = which == index
            if isinstance(thing, Sphere):
                worn[mine] = thing.material
                outward = (points[mine] - np.array(thing.centre, self.dtype)) / self.dtype(thing.radius)
                behind = (outward * directions[mine]).sum(axis=1, keepdims=True) > 0
                normals[mine] = np.where(behind, -outward, outward)
            elif isinstance(thing, Plane):
                worn[mine] = thing.material
                normal = np.array(thing.normal, self.dtype)
                normals[mine] = -np.sign(directions[mine] @ normal)[:, None] * normal
                if thing.pattern is not None:
                    worn[mine] = np.where(_odd(thing, points[mine]), thing.pattern.odd, thing.pattern.even)
        return normals, worn

    def lit(self, points: Array, starts: Array, normals: Array, views: Array, worn: Array) -> Array:
        """Direct light: I = ka ia + sum of att [ka ia + kd (L.N) id + ks F (R.V)^alpha is]."""
        made = [m.reflection for m in self.scene.materials]
        ambient, diffuse, specular = (
            np.array([getattr(m, name) for m in made], self.dtype)[worn] for name in ("ambient", "diffuse", "specular")
        )
        shininess = np.array([m.shininess for m in made], self.dtype)[worn]
        colours = ambient * np.array(self.scene.ambient_light, self.dtype)
        for light in self.scene.lights:
            towards, fade, distance = self.towards(light, points)
            colours += ambient * fade[:, None] * np.array(light.ambient, self.dtype)
            facing = (normals * towards).sum(axis=1)
            seen = facing > 0
            if self.shadows:
                seen &= ~self.hidden(starts, towards, distance)
            mirrored = 2 * facing[:, None] * normals - towards
            cosine = np.maximum((mirrored * views).sum(axis=1), 0)
            with np.errstate(under="ignore"):
                highlight = np.where(seen, fade * cosine**shininess, 0)[:, None]
            spread = np.where(seen, fade * facing, 0)[:, None]
            colours += diffuse * spread * np.array(light.diffuse, self.dtype)
            shine = specular * self.reflectance(views, towards, worn)
            colours += shine * highlight * np.array(light.specular, self.dtype)
        return np.asarray(colours)

    def reflectance(self, views: Array, towards: Array, worn: Array) -> Array:
        """F(V.H) of each point's material: 1 where that says nothing of incidence."""
        found = np.ones_like(views)
        cosine = np.sqrt(np.maximum((1 + (views * towards).sum(axis=1)) / 2, 0))
        for index, material in enumerate(self.scene.materials):
            fresnel, mine = material.reflection.fresnel, worn == index
            if fresnel is not None and mine.any():
                found[mine] = fresnel.at(cosine[mine])
        return found

    def towards(self, light: Any, points: Array) -> tuple[Array, Array, Array]:
        """Unit directions to a light, its attenuation, its distance."""
        if light.position is None:
            direction = np.broadcast_to(np.array(light.direction, self.dtype), points.shape)
            ones = np.ones(len(points), self.dtype)
            return direction, ones, np.full(len(points), np.inf, self.dtype)
        away = np.array(light.position, self.dtype) - points
        distance = np.sqrt((away * away).sum(axis=1))
        constant, linear, quadratic = light.attenuation
        return away / distance[:, None], 1 / (constant + linear * distance + quadratic * distance**2), distance

    def hidden(self, starts: Array, towards: Array, distance: Array) -> Array:
        """Where something stands between a start and the light."""
        hidden = np.zeros(len(starts), bool)
        for thing in self.scene.objects:
            hidden |= self.distance(thing, starts, towards) < distance * self.dtype(1 - _NEARER)
        return hidden

    def lifted(self, points: Array, normals: Array, sizes: Array) -> Array:
        """A little above the surface: sizes are of what the points were computed from, besides themselves."""
        return np.asarray(points + self.rounding * (np.abs(points).sum(axis=1) + sizes)[:, None] * normals)

    def sizes(self) -> Array:
        """How large each object's own numbers are."""
        solids = [thing for thing in self.scene.objects if not isinstance(thing, Mesh)]
        rows = [(*t.centre, t.radius) if isinstance(t, Sphere) else t.point for t in solids]
        return np.array([np.abs(row).sum() for row in rows], self.dtype)

    @property
    def rounding(self) -> Any:
        """A share that no sum or product here is wrong by."""
        return self.dtype(_ROUNDING[np.dtype(self.dtype).name])


def _odd(plane: Plane, points: Array) -> Array:
    """Which squares of a chequerboard are the second material's."""
    assert plane.pattern is not None
    normal = np.array(plane.normal)
    least = np.eye(3)[int(np.argmin(np.abs(normal)))]
    across = _unit(np.cross(normal, least))
    along = np.cross(normal, across)
    away = points - plane.point
    u, v = np.floor(away @ across / plane.pattern.side), np.floor(away @ along / plane.pattern.side)
    return np.asarray((u + v) % 2 == 1)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
