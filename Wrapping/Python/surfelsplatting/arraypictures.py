# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of numpy arrays, for those who have no scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from .arraypoints import SCALARS, add_scalars, polydata_of_arrays
from .backend import vtk
from .checks import check_names, finite_triple, number_in, with_checked_init
from .clouds.cloud import Cloud
from .colormaps import color_by
from .lens import Lens, focus_on_point
from .lighting import BACKDROP, LIGHT_GREY, needs_light, set_lights
from .pictures import rgb_bytes, straight_bytes
from .problems import UserProblem
from .shapes.precision import warn_of_steps
from .shapes.samples import Samples
from .surfels import make_surfels, needs_hierarchy
from .views.backs import share_facing_away
from .views.cameras import View, check_view
from .views.focus import focused_on_front
from .views.framing import complete_view
from .views.vtkcamera import make_camera
from .vtkmessages import update
from .vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

LARGEST_SIDE = 65536  # px
OF_COMMAND_LINE = {"blur": "give lens=surfelsplatting.Lens(coc=...), the blur of very distant points in pixels",
                   "colormap": "it is called cmap here", "range": "it is called clim here"}


@with_checked_init
@dataclass(frozen=True)
class Camera:
    """A perspective camera. What is not given is chosen so that the whole cloud is seen.

    Parameters
    ----------
    position, focal_point : sequence[float], optional
        Where the camera is, and what it looks at; world units.

    view_up : sequence[float], optional
        The direction that is up in the picture.

    view_angle : float, default: 30.0
        Angle of the picture's height, in degrees.

    Examples
    --------
    >>> import surfelsplatting
    >>> camera = surfelsplatting.Camera(position=(0, 0, 5), focal_point=(0, 0, 0))
    >>> camera.view_angle
    30.0

    """

    position: Sequence[float] | None = None
    focal_point: Sequence[float] | None = None
    view_up: Sequence[float] | None = None
    view_angle: float = 30.0

    def __post_init__(self) -> None:
        for name in ("position", "focal_point", "view_up"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, finite_triple(value, f"the camera's {name}"))
        if number_in(self.view_angle, 0, 180, "the camera's view_angle") in (0, 180):
            raise ValueError(f"the camera's view_angle is {self.view_angle!r}; it must be between "
                             "0 and 180 degrees")


def render(points: ArrayLike, *, colors: ArrayLike | None = None, normals: ArrayLike | None = None,
           scalars: ArrayLike | None = None, cmap: str = "viridis",
           clim: Sequence[float] | None = None,
           camera: Camera | Sequence[Sequence[float]] | None = None,
           lens: Lens | float | None = None, size: tuple[int, int] = (800, 600),
           background: Sequence[float] | None = BACKDROP, lighting: bool | None = None,
           **estimation: Any) -> NDArray[np.uint8]:
    """Render points as a picture with depth of field.

    Neither a window nor OpenGL is needed.

    Parameters
    ----------
    points : array_like[float]
        Points of a surface, of shape ``(n, 3)``, in world units. Masked ones are left out.

    colors : array_like, optional
        RGB or RGBA of each point, of shape ``(n, 3)`` or ``(n, 4)``, or one of shape ``(3,)`` or
        ``(4,)`` for all: integers from 0 to 255, or floats from 0 to 1. Points without colors are
        light grey.

    normals : array_like[float], optional
        Outward normals, of shape ``(n, 3)``. Without them they are estimated.

    scalars : array_like[float], optional
        A number for each point, such as its height or intensity, that colors it instead of ``colors``.

    cmap : str, default: 'viridis'
        Color map of the scalars: viridis, plasma, inferno, magma, cividis, turbo, coolwarm, gray, or one
        of matplotlib if that is installed.

    clim : sequence[float], optional
        The scalars that get the first and the last color. By default they are the smallest and the
        largest.

    camera : surfelsplatting.Camera | sequence[sequence[float]], optional
        The camera; or its position, focal point and view-up, as in PyVista. Without it, the whole
        cloud is seen.

    lens : surfelsplatting.Lens | float, optional
        The lens; or the radius of its blur of very distant points, in pixels. Without it,
        everything is sharp.

    size : tuple[int, int], default: (800, 600)
        Width and height of the picture in pixels.

    background : sequence[float], optional
        RGB from 0 to 1. With ``None`` the picture gets an alpha channel and has no background.

    lighting : bool, optional
        Whether lights shade the points, the brightest one from the upper left. By default they shade all
        but colors as varied as those of photographs, which have light in them already.

    **estimation
        ``cleaning``, ``sides``, ``viewpoint``, ``neighbors`` and ``hierarchy``: how points become
        surfels, as in ``cloud.surfels.estimate()``. By default they get a hierarchy only with a lens,
        or if they are more than 10 million: a sharp picture of fewer takes less time without.
        Unless ``sides`` or ``viewpoint`` is given, both sides are drawn where the camera would see mostly
        backs, as from inside of a tunnel.

    Returns
    -------
    numpy.ndarray
        The picture, of type ``uint8`` and shape ``(height, width, 3)``, or 4 without a
        background, with its top row first. Alpha is straight.

    Examples
    --------
    A sphere, and the part of the picture that it covers.

    >>> import numpy as np
    >>> import surfelsplatting
    >>> rng = np.random.default_rng(1)
    >>> points = rng.normal(size=(20000, 3))
    >>> points /= np.linalg.norm(points, axis=1)[:, None]
    >>> picture = surfelsplatting.render(points, colors=np.abs(points), size=(300, 200),
    ...                                  background=None)
    >>> picture.shape
    (200, 300, 4)
    >>> float((picture[..., 3] > 127).mean().round(1))
    0.4

    By height.

    >>> picture = surfelsplatting.render(points, scalars=points[:, 2], cmap='magma', size=(300, 200))

    Through a lens that is focused on a point.

    >>> lens = surfelsplatting.Lens(coc=20, focus=(0, 0, 1))
    >>> picture = surfelsplatting.render(points, camera=[(0, 0, 6), (0, 0, 0), (0, 1, 0)],
    ...                                  lens=lens, size=(300, 200))
    >>> picture.shape
    (200, 300, 3)

    """
    known = [name for name in (*render.__kwdefaults__, *make_surfels.__kwdefaults__) if name != "watch"]
    of_lens = Lens.__dataclass_fields__.keys() & estimation.keys()
    check_names(estimation, known, "render", f"give lens=surfelsplatting.Lens({min(of_lens)}=...)"
                if of_lens else f"it has {', '.join(known)}", OF_COMMAND_LINE)
    lens = _as_lens(lens)
    asked = _as_view(camera, checked_size(size, "size"))
    cloud = polydata_of_arrays(points, colors, normals)
    limits = add_scalars(cloud, scalars, colors, clim)
    has_lens = bool(lens.coc or lens.diameter)
    surfels = make_surfels(cloud, **{"hierarchy": needs_hierarchy(cloud, has_lens), **estimation})
    warn_of_steps(cloud, surfels)
    try:
        check_view(asked)
        view = complete_view(asked, Cloud(cloud), surfels)
        renderer = renderer_of(surfels, view, colors is not None, lighting, limits and (cmap, limits))
        if not _has_known_sides(estimation) and share_facing_away(Samples(surfels), [view]):
            renderer.GetActors().GetLastActor().GetMapper().ShowBacksOn()
    except UserProblem as problem:
        raise ValueError(str(problem)) from None
    if lens.focus is None and has_lens:
        view = focused_on_front(asked, view, renderer, lambda _: update(renderer, "rendering"))
        renderer.GetCamera().SetFocalDistance(view.focal_distance)
    if background is not None:
        renderer.SetBackground([number_in(value, 0, 1, f"background {background!r}: a value")
                                for value in finite_triple(background, "background")])
        renderer.SetBackgroundAlpha(1.0)
    _set_lens(renderer, lens)
    update(renderer, "rendering")
    picture = renderer.GetOutput()
    if background is None:
        return straight_bytes(picture)
    return np.ascontiguousarray(rgb_bytes(picture).reshape(*asked.size[::-1], 3)[::-1])


def _has_known_sides(estimation):
    """Whether the arguments of make_surfels say which sides are visible."""
    return estimation.get("sides", "auto") != "auto" or estimation.get("viewpoint") is not None


def _as_lens(lens):
    if lens is None or isinstance(lens, Lens):
        return lens or Lens()
    if isinstance(lens, Real):
        return Lens(coc=lens)
    raise TypeError(f"lens is {lens!r}; it must be a surfelsplatting.Lens, or a radius in pixels")


def checked_size(size, what):
    """Width and height, or ValueError."""
    try:
        width, height = whole = tuple(int(value) for value in size)
        if tuple(size) == whole and 1 <= min(whole) and max(whole) <= LARGEST_SIDE:
            return width, height
    except (TypeError, ValueError, OverflowError):  # no numbers, or not two of them
        pass
    raise ValueError(f"{what} is {size!r}; it must be width and height in pixels, from 1 to "
                     f"{LARGEST_SIDE}, for example (800, 600)")


def _as_view(camera, size):
    if camera is None:
        camera = Camera()
    elif not isinstance(camera, Camera):
        if isinstance(camera, (str, dict)) or not hasattr(camera, "__len__") or len(camera) != 3:
            raise ValueError(f"camera is {camera!r}; it must be a surfelsplatting.Camera, or a "
                             "position, a focal point and a view-up")
        camera = Camera(*camera)
    return View(camera.position, camera.focal_point, camera.view_up, camera.view_angle, size)


def renderer_of(surfels, view, has_colors, lighting, colormap=None):
    """A vtkSurfelImageRenderer of surfels without a lens, seen in a complete view.

    colormap: its name and limits, if the array SCALARS colours the surfels
    """
    mapper = vtkSurfelMapper()
    mapper.SetInputData(surfels)
    mapper.SetScalarVisibility(has_colors)
    mapper.SetColorModeToDirectScalars()
    if colormap:
        color_by(mapper, SCALARS, *colormap)
    actor = vtk("vtkRenderingCore").vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(LIGHT_GREY)
    actor.GetProperty().SetLighting(needs_light(surfels) if lighting is None else bool(lighting))
    renderer = vtkSurfelImageRenderer()
    renderer.AddActor(actor)
    set_lights(renderer, actor)
    renderer.SetCamera(make_camera(view))
    renderer.SetSize(*view.size)
    return renderer


def _set_lens(renderer, lens):
    splatter, camera = renderer.GetSplatter(), renderer.GetCamera()
    if lens.focus_is_pixel:
        splatter.SetLensModeToPinhole()
        camera.SetFocalDistance(_distance_at(renderer, lens.focus))
    elif lens.focus is not None:
        focus_on_point(splatter, camera, lens.focus)
    lens.set_size(splatter, camera)


def _distance_at(renderer, pixel):
    """Distance along the view direction to what a pixel sees."""
    width, height = renderer.GetSize()
    x, y = pixel
    if not (0 <= x < width and 0 <= y < height):
        raise ValueError(f"the lens's focus {pixel} is no pixel of a picture of {width} x {height}")
    update(renderer, "rendering")
    distance = renderer.GetOutput().GetPointData().GetArray("Depth").GetValue(y * width + x)
    if not (math.isfinite(distance) and distance > 0):
        raise ValueError(f"the pixel {pixel} sees nothing, so the lens cannot focus on it; choose "
                         "a pixel that shows a surface, or give a point (x, y, z)")
    return distance
