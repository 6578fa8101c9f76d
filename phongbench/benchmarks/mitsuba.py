"""A scene as Mitsuba 3 draws it: camera, textures, rays and film are its own, Phong and mirrors written for it.

It ships neither Phong's reflection nor mirrors without noise, but lets users write integrators in Python, which Dr.Jit
compiles as it compiles Mitsuba's own: with LLVM, for every core. The same light falls on the same surfaces, so that the
picture can be held against ours. Imported only when asked for, and never by the process that measures.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from phongbench.benchmarks.scene_peers import BOARD, VARIANT, Drawing, Wishes
from phongbench.compiler.precisions import Array
from phongbench.scenes.geometry import axes
from phongbench.scenes.scene import Camera, Plane, Scene, Sphere, SurfaceMaterial
from phongbench.shading.lighting import Light

#: the colours of a material, as attributes of the shape that wears it
COLOURS = ("ambient", "diffuse", "specular")


def described(scene: Scene, size: tuple[int, int]) -> dict[str, Any]:
    """The scene as Mitsuba's dictionary, transforms as 4 x 4 arrays; lights are the integrator's."""
    width, height = size
    film = {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": scene.camera.field_of_view,
            "fov_axis": "y",
            "film": film,
            "to_world": _looking(scene.camera),
            "sampler": {"type": "stratified", "sample_count": 1, "jitter": False},  # the middle of each pixel
        },
        **{f"object{index}": _shape(thing, scene.materials) for index, thing in enumerate(scene.objects)},
    }


def _looking(camera: Camera) -> Array:
    """Columns: left, up, forward, position."""
    position = np.array(camera.position)
    forward = np.array(camera.target) - position
    forward /= np.linalg.norm(forward)
    left = np.cross(camera.up, forward)
    left /= np.linalg.norm(left)
    return _placed(left, np.cross(forward, left), forward, position)


def _placed(x: Array, y: Array, z: Array, origin: Array) -> Array:
    placed = np.eye(4)
    placed[:3] = np.stack([x, y, z, origin], axis=1)
    return placed


def _shape(thing: Any, materials: tuple[SurfaceMaterial, ...]) -> dict[str, Any]:
    if isinstance(thing, Sphere):
        worn = _worn((materials[thing.material],))
        return {"type": "sphere", "center": list(thing.centre), "radius": thing.radius, **worn}
    assert isinstance(thing, Plane)
    pattern = thing.pattern
    half = BOARD * (pattern.side if pattern else 1.0)
    across, along = axes(thing)
    placed = _placed(half * across, half * along, np.array(thing.normal), np.array(thing.point))
    names = (pattern.even, pattern.odd) if pattern else (thing.material,)
    return {"type": "rectangle", "to_world": placed, **_worn(tuple(materials[name] for name in names))}


def _worn(materials: tuple[SurfaceMaterial, ...]) -> dict[str, Any]:
    """A texture for each part of a material; of two materials, chequerboards."""
    shades: dict[str, list[Any]] = {}
    for name in COLOURS:
        shades[name] = [[float(v) for v in getattr(m.reflection, name)] for m in materials]
    shades["shininess"] = [float(m.reflection.shininess) for m in materials]
    shades["reflectivity"] = [float(m.reflectivity) for m in materials]
    return {name: _texture(values) for name, values in shades.items()}


def _texture(values: list[Any]) -> dict[str, Any]:
    first = values[0]
    if len(values) == 1:
        colour = {"type": "srgb", "color": first, "unbounded": True}
        return colour if isinstance(first, list) else {"type": "uniform", "value": first}
    named = [{"type": "rgb", "value": v} if isinstance(v, list) else v for v in values]
    scale = np.diag([BOARD, BOARD, 1.0, 1.0])  # a period of two squares
    return {"type": "checkerboard", "color0": named[0], "color1": named[1], "to_uv": scale}


def drawing(scene: Scene, wishes: Wishes) -> Drawing:
    """Mitsuba, ready to draw. Raises ImportError if it or its LLVM is missing."""
    mi, dr = import_module("mitsuba"), import_module("drjit")
    mi.set_variant(VARIANT)
    loaded = mi.load_dict(_loadable(mi, described(scene, wishes.size)))
    whitted = _integrator(mi, dr, scene, wishes)
    depths = mi.load_dict({"type": "aov", "aovs": "distance:depth"})

    def distances() -> Array:
        found = np.array(mi.render(loaded, integrator=depths, spp=1))[..., -1]
        return np.where(found > 0, found, np.inf)

    version = f"{mi.__version__} with Dr.Jit {dr.__version__}"
    return Drawing(version, lambda: np.array(mi.render(loaded, integrator=whitted, spp=1)), distances)


def _loadable(mi: Any, tree: Any) -> Any:
    """The dictionary with Mitsuba's own transforms."""
    if isinstance(tree, dict):
        return {name: _loadable(mi, value) for name, value in tree.items()}
    return mi.ScalarTransform4f(tree) if isinstance(tree, np.ndarray) else tree


def _integrator(mi: Any, dr: Any, scene: Scene, wishes: Wishes) -> Any:
    """Direct light by Phong, and what mirrors add: (1 - k) direct + k reflected."""
    lit = _lighting(mi, dr, scene, wishes.shadows)
    background = mi.Color3f(*scene.background)

    class Whitted(mi.SamplingIntegrator):  # type: ignore[misc]
        """Follows each ray from mirror to mirror."""

        def sample(self, rays: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            """The colour along a ray, whether it counts, and nothing else."""

            def bounce(colour: Any, weight: Any, done: Any, ray: Any, active: Any) -> tuple[Any, ...]:
                si = rays.ray_intersect(ray, active)
                hit = active & si.is_valid()
                k = dr.select(hit, si.shape.eval_attribute("reflectivity", si, hit).x, 0)
                colour += weight * dr.select(hit, (1 - k) * lit(rays, si, hit), background)
                reflected = si.spawn_ray(si.to_world(mi.reflect(si.wi)))
                return colour, weight * k, done + 1, reflected, hit & (weight * k > 0) & (done < wishes.depth)

            start = mi.Color3f(0), mi.Float(1), mi.UInt32(0), mi.Ray3f(ray), mi.Bool(active)
            # a loop that is compiled: a packet of rays leaves it when none of them is reflected any more
            colour, *_ = dr.while_loop(start, lambda *state: state[-1], bounce)
            return colour, mi.Bool(True), []

    return Whitted(mi.Properties())


def _lighting(mi: Any, dr: Any, scene: Scene, shadows: bool) -> Callable[[Any, Any, Any], Any]:
    """I = ka ia + sum of att [kd (L.N) id + ks (R.V)^alpha is], where a surface and a light face each other."""

    def reaching(light: Light, si: Any) -> tuple[Any, Any, Any]:
        """Towards the light, how much of it arrives, and the ray that may find something in between."""
        if light.position is None:
            towards = mi.Vector3f(*(light.direction or ()))
            return towards, 1.0, si.spawn_ray(towards)
        place = mi.Point3f(*light.position)
        distance = dr.norm(place - si.p)
        constant, linear, quadratic = light.attenuation
        fade = 1 / (constant + distance * (linear + distance * quadratic))
        return (place - si.p) / distance, fade, si.spawn_ray_to(place)

    def lit(rays: Any, si: Any, hit: Any) -> Any:
        ambient, diffuse, specular = (mi.Color3f(si.shape.eval_attribute(name, si, hit)) for name in COLOURS)
        # a chequerboard of numbers gives the other square's where it is asked for one number (seen in 3.9)
        shininess = si.shape.eval_attribute("shininess", si, hit).x
        normal, mirrored = si.to_world(mi.Vector3f(0, 0, dr.sign(si.wi.z))), si.to_world(mi.reflect(si.wi))
        colour = ambient * mi.Color3f(*scene.ambient_light)
        for light in scene.lights:
            towards, fade, between = reaching(light, si)
            facing, x = dr.dot(normal, towards), dr.dot(mirrored, towards)
            seen = hit & (facing > 0)
            if shadows:
                seen &= ~rays.ray_test(between, seen)
            highlight = dr.select(x > 0, dr.power(x, shininess), 0)
            both = facing * diffuse * mi.Color3f(*light.diffuse) + highlight * specular * mi.Color3f(*light.specular)
            colour += dr.select(seen, fade * both, 0)
        return colour

    return lit
