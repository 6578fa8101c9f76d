"""A scene as PyVista draws it: VTK's rasteriser, its Phong lighting, spheres of triangles, no shadows and no mirrors.

A mirror's direct light is drawn, weighted by 1 - k as everywhere. Imported only when asked for, and never by the
process that measures.
"""

import re
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from phongbench.benchmarks.numpy_tracer import directions
from phongbench.benchmarks.scene_peers import BOARD, SHARPEST, Drawing, Wishes
from phongbench.compiler.precisions import Array
from phongbench.scenes.geometry import axes
from phongbench.scenes.scene import Plane, Scene, Sphere, SurfaceMaterial
from phongbench.support.documents import Vector

#: triangles around a sphere, and from pole to pole
AROUND, DOWN = 256, 128
#: where the view begins and ends, as shares of the distance of what is looked at
_NEAR, _FAR = 0.01, 1e4


@dataclass(frozen=True, eq=False)
class Look:
    """A material as VTK takes it: colours with light and 1 - k in them, and an exponent."""

    ambient: Vector
    diffuse: Vector
    specular: Vector
    power: float


@dataclass(frozen=True, eq=False)
class Quad:
    """A large square of a plane.

    corners  float64 (4, 3)
    places   float64 (4, 2)     texture coordinates there, a unit for two squares of a board
    shown    uint8 (2, 2, 4)    texels: opaque where the squares wear this look
    """

    corners: Array
    places: Array
    normal: Vector
    shown: Array


def described(scene: Scene) -> list[tuple[Sphere | Quad, Look]]:
    """What is drawn and how it looks; a chequerboard is two quads, each with holes for the other."""
    found: list[tuple[Sphere | Quad, Look]] = []
    for thing in scene.objects:
        if isinstance(thing, Sphere):
            found.append((thing, _look(scene, scene.materials[thing.material])))
        elif isinstance(thing, Plane):
            p = thing.pattern
            worn = ((thing.material, (0, 1)),) if p is None else ((p.even, (0,)), (p.odd, (1,)))
            for material, parities in worn:
                found.append((_quad(thing, parities), _look(scene, scene.materials[material])))
    return found


def _look(scene: Scene, material: SurfaceMaterial) -> Look:
    share, made = 1 - material.reflectivity, material.reflection
    ambient, diffuse, specular = (share * np.array(c) for c in (made.ambient, made.diffuse, made.specular))
    return Look(
        tuple(ambient * scene.ambient_light), tuple(diffuse), tuple(specular), min(SHARPEST, float(made.shininess))
    )


def _quad(plane: Plane, parities: tuple[int, ...]) -> Quad:
    across, along = axes(plane)
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    half = BOARD * (plane.pattern.side if plane.pattern else 1.0)
    corners = plane.point + half * (signs @ np.stack([across, along]))
    shown = np.full((2, 2, 4), 255, np.uint8)
    # PyVista's first row of texels is the last of the picture
    shown[::-1, :, 3] = np.where(np.isin(np.indices((2, 2)).sum(axis=0) % 2, parities), 255, 0)
    return Quad(corners, signs * BOARD / 2, plane.normal, shown)


def drawing(scene: Scene, wishes: Wishes) -> Drawing:
    """PyVista with a window that nobody sees, ready to draw. Raises ImportError if it or its OpenGL is missing."""
    pv = import_module("pyvista")
    plotter = pv.Plotter(off_screen=True, window_size=wishes.size, lighting=None)
    plotter.set_background(scene.background)
    for thing, look in described(scene):
        _add(pv, plotter, thing, look)
    _light(pv, plotter, scene)
    plotter.disable_anti_aliasing()
    plotter.render_window.SetMultiSamples(0)  # a sample for each pixel, as the others take
    camera, wanted = plotter.camera, scene.camera
    camera.position, camera.focal_point, camera.up = wanted.position, wanted.target, wanted.up
    camera.view_angle = wanted.field_of_view
    away = float(np.linalg.norm(np.subtract(wanted.target, wanted.position)))
    plotter.show(auto_close=False)
    camera.clipping_range = (_NEAR * away, _FAR * away)  # `show` chooses its own

    def draw() -> Array:
        plotter.render()
        return np.asarray(plotter.image)[..., :3]

    def distances() -> Array:
        depth = -plotter.get_image_depth(reset_camera_clipping_range=False)  # along the camera's axis
        depth /= directions(wanted, *wishes.size) @ np.subtract(wanted.target, wanted.position) / away
        return np.where(depth < 0.5 * _FAR * away, depth, np.inf)

    return Drawing(f"{pv.__version__} on {_renderer(plotter)}", draw, distances)


def _renderer(plotter: Any) -> str:
    """What draws for OpenGL: a graphics card, or a program on the processor."""
    found = re.search(r"OpenGL renderer string:\s*(.+)", plotter.render_window.ReportCapabilities())
    return found[1].strip() if found else "an unknown OpenGL"


def _add(pv: Any, plotter: Any, thing: Sphere | Quad, look: Look) -> None:
    if isinstance(thing, Sphere):
        ball = pv.Sphere(radius=thing.radius, center=thing.centre, theta_resolution=AROUND, phi_resolution=DOWN)
        actor = plotter.add_mesh(ball, smooth_shading=True)
    else:
        flat = pv.PolyData(thing.corners, faces=[4, 0, 1, 2, 3])
        flat.point_data.active_normals = np.tile(thing.normal, (4, 1))
        flat.active_texture_coordinates = thing.places
        texture = pv.Texture(thing.shown)
        texture.repeat, texture.interpolate, texture.mipmap = True, False, False
        actor = plotter.add_mesh(flat, texture=texture)
        actor.SetForceOpaque(True)  # holes are left out, not blended
    skin = actor.prop
    skin.SetInterpolationToPhong()
    for name in ("Ambient", "Diffuse", "Specular"):
        getattr(skin, f"Set{name}")(1.0)
        getattr(skin, f"Set{name}Color")(*getattr(look, name.lower()))
    skin.SetSpecularPower(look.power)


def _light(pv: Any, plotter: Any, scene: Scene) -> None:
    for wanted in scene.lights:
        light = pv.Light(light_type="scene light")
        light.positional = wanted.position is not None
        light.position, light.focal_point = wanted.position or wanted.direction, (0.0, 0.0, 0.0)
        if light.positional:
            light.cone_angle = 180.0  # no spotlight
            light.attenuation_values = wanted.attenuation
        light.SetDiffuseColor(*wanted.diffuse)
        light.SetSpecularColor(*wanted.specular)
        plotter.add_light(light)
