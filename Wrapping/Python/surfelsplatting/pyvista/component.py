# SPDX-License-Identifier: BSD-3-Clause
"""``plotter.surfels``: surfels and a lens in a plot."""

from __future__ import annotations

from collections.abc import Sequence
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any
import weakref

import numpy as np
import pyvista as pv

from ..checks import check_names, with_checked_names
from ..lens import Lens, focus_on_point
from ..lighting import are_photographs
from ..problems import warn_user
from ..views.cameras import STILL_CELLS
from ..vtkSurfelRendering import vtkSurfelSplatter, vtkSurfelSplattingPass
from .browser import show_points_in_browsers
from .firstview import FirstView
from .focus import focus_on_middle, has_no_focus, point_at
from .mapper import SurfelMapper
from .points import are_colors, as_dataset, points_and_surfels, with_opacity, with_scalars

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

MEANINGLESS = ("edge_color", "line_width", "metallic", "pbr", "point_size", "render_lines_as_tubes",
               "render_points_as_spheres", "roughness", "show_edges", "show_vertices", "silhouette",
               "smooth_shading", "split_sharp_edges", "style", "texture")
BLUR = {"blur": "coc is the blur of very distant points, in plot and pl.surfels.lens"}


@pv.register_plotter_component("surfels")
class SurfelComponent:
    """Surfels and a lens in a plot.

    Use it as ``plotter.surfels``; it works on the active subplot.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Plotter to draw in.

    Examples
    --------
    >>> import pyvista as pv
    >>> cloud = pv.PolyData(pv.Sphere(theta_resolution=60, phi_resolution=60).points)
    >>> pl = pv.Plotter()
    >>> actor = pl.surfels.add(cloud, color='tan')
    >>> pl.surfels.lens(coc=20, focus=(0, 0, 0.5))
    >>> pl.show()

    """

    def __init__(self, plotter: pv.Plotter) -> None:
        self._plotter_ref = weakref.ref(plotter)
        self._passes: dict[int, vtkSurfelSplattingPass] = {}  # by the renderer's id()
        self._first_views: dict[int, FirstView] = {}  # until the first frame
        self._unfocused: set[int] = set()  # until the first frame

    @property
    def _plotter(self) -> pv.Plotter:
        plotter = self._plotter_ref()
        if plotter is None or plotter.render_window is None:
            raise RuntimeError("the plotter is closed; make a new pyvista.Plotter")
        return plotter

    @property
    def render_pass(self) -> vtkSurfelSplattingPass:
        """Return the render pass of the active subplot.

        The first use makes it, and turns off multisampling in the window.

        Returns
        -------
        surfelsplatting.vtkSurfelSplattingPass
            The pass, which draws surfels and meshes through one lens.

        Examples
        --------
        Leave meshes sharp, and blur surfels only.

        >>> import pyvista as pv
        >>> pl = pv.Plotter()
        >>> pl.surfels.render_pass.SetOtherPropsThroughLens(False)
        >>> pl.close()

        """
        plotter = self._plotter
        key = id(plotter.renderer)
        if key not in self._passes:
            if not self._passes:
                show_points_in_browsers()
                self._keep_passes(plotter.render_window)
                plotter.render_window.AddObserver(  # type: ignore[union-attr]
                    "AbortCheckEvent", _stop_for_button)
            made = self._passes[key] = vtkSurfelSplattingPass()
            made.GetSplatter().SetLensModeToPinhole()
            made.GetSplatter().SetLensCells(STILL_CELLS)
            # Surfels need none, and meshes would get an edge of the background in front of them.
            plotter.render_window.SetMultiSamples(0)  # type: ignore[union-attr]
        _set_pass(plotter.renderer, self._passes[key])
        return self._passes[key]

    def _keep_passes(self, window):
        """Before each frame, undoes that PyVista has replaced a pass; and before the first one, has all
        be seen that was added, and the middle be in focus."""
        reference = weakref.ref(self)

        def before_frame(_window, _event):
            component = reference()
            plotter = component and component._plotter_ref()
            for renderer in plotter.renderers if plotter else ():
                if id(renderer) in component._passes:
                    _set_pass(renderer, component._passes[id(renderer)])
                if id(renderer) in component._first_views:
                    component._first_views.pop(id(renderer)).show_others(renderer)
                if id(renderer) in component._unfocused:
                    component._unfocused.remove(id(renderer))
                    focus_on_middle(component._passes[id(renderer)].GetSplatter(), renderer)

        window.AddObserver("StartEvent", before_frame)

    @property
    def splatter(self) -> vtkSurfelSplatter:
        """Return the settings and statistics of the active subplot.

        Returns
        -------
        surfelsplatting.vtkSurfelSplatter
            Kernel, level of detail and more; ``help()`` describes them.

        Examples
        --------
        >>> import pyvista as pv
        >>> pl = pv.Plotter()
        >>> pl.surfels.splatter.SetKernelToGaussian()
        >>> pl.close()

        """
        return self.render_pass.GetSplatter()

    def add(self, cloud: pv.DataSet | pv.MultiBlock | ArrayLike | str | Path,
            scalars: str | ArrayLike | None = None, *, color: Any = None, rgb: bool | None = None,
            show_scalar_bar: bool | None = None, scalar_bar_args: dict[str, Any] | None = None,
            reset_camera: bool | None = None, render: bool = True, **kwargs: Any) -> pv.Actor:
        """Add points as surfels.

        Parameters
        ----------
        cloud : pyvista.DataSet | pyvista.MultiBlock | array_like[float] | str | Path
            Surfels from ``cloud.surfels.estimate()``; or points or a mesh, an array of points of
            shape ``(n, 3)``, or a file, of which surfels are made first, as ``estimate`` says; or a
            capture of 3D Gaussian splatting, or its ``.ply``, ``.spz``, ``.sog`` or ``.splat`` file,
            which is drawn as it is. What is changed in points or a mesh afterwards is seen when they are added
            again, under the same ``name``.

        scalars : str | array_like, optional
            Name of a point array, or an array with one row for each point, which is a vertex of a
            mesh. By default the active scalars of points are used; without any, a capture shows
            the colors of its harmonics.

        color : ColorLike, optional
            One color for all surfels.

        rgb : bool, optional
            Whether the scalars are colors. By default, those of type ``uint8`` with 3 or 4
            components are, unless ``cmap`` or ``component`` is given.

        show_scalar_bar : bool, optional
            Whether to show a scalar bar. By default as the theme says.

        scalar_bar_args : dict, optional
            Arguments of :meth:`pyvista.Plotter.add_scalar_bar`.

        reset_camera : bool, optional
            Whether to show all of the scene. By default, if no camera was set: the cloud stands
            upright, as in ``cloud.surfels.plot()``, and a depth image is seen from its sensor.

        render : bool, default: True
            Whether to render, if the plotter is shown already.

        **kwargs
            Further arguments of :meth:`pyvista.Plotter.add_mesh`, such as ``cmap``, ``clim``,
            ``opacity``, ``lighting``, ``specular`` and ``name``. RGB as varied as that of
            photographs has no ``lighting`` unless you ask for it: it has light in it already.

        Returns
        -------
        pyvista.Actor
            Actor of the surfels.

        Raises
        ------
        TypeError
            If ``cloud`` is no data set, or one of another VTK.

        ValueError
            If the scalars do not fit or belong to cells, or there are no points.

        Examples
        --------
        >>> import pyvista as pv
        >>> sphere = pv.Sphere(theta_resolution=60, phi_resolution=60)
        >>> cloud = pv.PolyData(sphere.points)
        >>> pl = pv.Plotter()
        >>> actor = pl.surfels.add(cloud, scalars=cloud.points[:, 2], cmap='viridis')
        >>> pl.show()

        """
        check_names(kwargs, ADD_NAMES, "surfels.add", "it has most of those of add_mesh", ELSEWHERE)
        if rgb is None:
            rgb = kwargs.pop("rgba", None)
        plotter = self._plotter
        points, name = with_scalars(as_dataset(cloud), scalars)
        points, opacity = with_opacity(points, kwargs.pop("opacity", None))
        points, surfels = points_and_surfels(points)
        if rgb is None and color is None and kwargs.get("cmap") is None and kwargs.get("component") is None:
            rgb = are_colors(surfels, name)
        if rgb and are_colors(surfels, name) and are_photographs(surfels.point_data[name]):
            kwargs.setdefault("lighting", False)
        if color is not None and "GaussianHarmonics" in surfels.point_data:
            surfels = surfels.copy(deep=False)
            del surfels.point_data["GaussianHarmonics"]  # they would win over the color
        if name is None and color is None:
            color = plotter.theme.color
        kwargs |= {"scalars": name if color is None else None, "color": color, "rgb": rgb, "opacity": opacity}
        actor = plotter.add_mesh(surfels, style="points", show_scalar_bar=False, reset_camera=False,
                                 render=False, **kwargs)
        mapper = SurfelMapper.like(actor.mapper)
        actor.SetMapper(mapper)
        plotter.mapper = mapper
        self.render_pass
        if show_scalar_bar is None:
            show_scalar_bar = plotter.theme.show_scalar_bar
        if show_scalar_bar and mapper.scalar_visibility and not rgb:
            plotter.add_scalar_bar(mapper=mapper, render=False,
                                   **{"title": name, **(scalar_bar_args or {})})
        self._show(actor, points, reset_camera)
        if render:
            plotter.render()
        return actor

    def _show(self, actor, points, reset_camera):
        """Moves the camera if that is asked for, or none was set."""
        renderer = self._plotter.renderer
        if reset_camera is None and not renderer.camera_set and actor.GetMatrix().IsIdentity():
            self._first_views[id(renderer)] = FirstView(renderer, actor, points)
        elif reset_camera or (reset_camera is None and not renderer.camera_set):
            renderer.reset_camera(render=False)

    @with_checked_names("surfels.lens", BLUR)
    def lens(self, coc: float | None = None, focus: Sequence[float] | None = None, *,
             diameter: float | None = None, cells: int | None = None, render: bool = True) -> None:
        """Look through a lens.

        What is not given stays as it is; at first there is no lens. A camera with parallel
        projection sees everything sharp.

        Parameters
        ----------
        coc : float, optional
            Radius of the circle of confusion of very distant points, in pixels. Nearer things
            blur less. 0 takes the lens away.

        focus : sequence[float], optional
            A point ``(x, y, z)`` of the world, or a pixel ``(x, y)`` of the window, counted from
            its lower left corner, as ``plotter.mouse_position`` is. The point, or the surface that
            the pixel sees, stays in focus when the camera moves. By default it is the surface in
            the middle of the next frame, unless the camera has a focal distance.

        diameter : float, optional
            Diameter of the lens in world units, instead of ``coc``.

        cells : int, optional
            Number of parts that the lens is divided into, whose pictures are averaged; 7 at first.
            1 is less accurate where things at different depths cover one another, and 5 times as
            fast. While the mouse turns a plot, there is one.

        render : bool, default: True
            Whether to render, if the plotter is shown already.

        Raises
        ------
        ValueError
            If the focus is a pixel that sees nothing or a point behind the camera, or a value is
            out of range.

        Examples
        --------
        >>> import pyvista as pv
        >>> cloud = pv.PolyData(pv.Sphere(theta_resolution=60, phi_resolution=60).points)
        >>> pl = pv.Plotter(off_screen=True, window_size=(400, 300))
        >>> actor = pl.surfels.add(cloud)
        >>> pl.surfels.lens(coc=20, focus=(200, 150))
        >>> picture = pl.screenshot(return_img=True)
        >>> pl.close()

        """
        renderer, splatter = self._plotter.renderer, self.splatter
        # PyVista's property would place the camera before there is anything to be seen.
        camera = self._plotter.camera if renderer.actors else renderer.camera
        lens = Lens(coc, diameter, focus, splatter.GetLensCells() if cells is None else cells)
        _check_camera(camera)
        self._unfocused.discard(id(renderer))
        if lens.focus is not None:
            point = (point_at(self._plotter, splatter, lens.focus) if lens.focus_is_pixel
                     else lens.focus)
            focus_on_point(splatter, camera if renderer.camera_set else None, point)
        if coc is not None or diameter is not None:
            lens.set_size(splatter, camera)
            if (coc or diameter) and has_no_focus(splatter, camera):
                self._unfocused.add(id(renderer))
        splatter.SetLensCells(int(lens.cells))
        if render:
            self._plotter.render()

    def __plotter_close__(self) -> None:
        """Free the render passes and what they have on the graphics card."""
        plotter = self._plotter_ref()
        if plotter is None:
            return
        passes, self._passes = self._passes, {}
        for renderer in plotter.renderers:
            if id(renderer) in passes:
                if plotter.render_window is not None:
                    passes[id(renderer)].ReleaseGraphicsResources(plotter.render_window)
                renderer.SetPass(None)

    def __plotter_deep_clean__(self) -> None:
        """Free the same."""
        self.__plotter_close__()


# Where arguments are that add and plot do not have.
ELSEWHERE = {**dict.fromkeys(MEANINGLESS, "surfels have no {}; leave it out, or use add_mesh"),
             **dict.fromkeys(("cleaning", "sides", "viewpoint", "neighbors", "hierarchy"),
                             "cloud.surfels.estimate({}=...) makes surfels, which are drawn as they are"),
             **dict.fromkeys(("coc", "diameter", "focus", "cells"),
                             "pl.surfels.lens({}=...) of a pyvista.Plotter sets it"),
             **BLUR}
# add_mesh takes some under other names, too, which its signature does not have.
ADD_NAMES = {*inspect.signature(SurfelComponent.add).parameters, "colormap", "rgba", "rng",
             *inspect.signature(pv.Plotter.add_mesh).parameters} - {"self", "mesh", "kwargs", *MEANINGLESS}


def _set_pass(renderer, render_pass):
    current = renderer.GetPass()
    if current is not None and current is not render_pass:
        name = current.GetClassName()
        warn_user(f"surfels replace the {name} of this subplot, since they need a render pass of their own"
                  + ("; pl.surfels.lens(coc=20) blurs them and meshes" if "DepthOfField" in name else ""))
    if current is not render_pass:
        renderer.SetPass(render_pass)


def _stop_for_button(window, _event):
    """A button that is pressed does not wait for the other cells of the lens."""
    if not window.GetOffScreenRendering() and window.GetEventPending():
        window.SetAbortRender(True)


def _check_camera(camera):
    for name in ("position", "focal_point", "up"):
        value = getattr(camera, name)
        if not np.isfinite(value).all():
            raise ValueError(f"the camera's {name} is {tuple(value)}; it must be finite")
