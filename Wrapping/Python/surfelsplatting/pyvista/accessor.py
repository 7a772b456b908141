# SPDX-License-Identifier: BSD-3-Clause
"""``dataset.surfels``: surfels from the points of a data set, or on the faces of a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from pyvista.core.utilities import ProgressMonitor

from ..arraypictures import checked_size
from ..checks import check_names, with_checked_names
from ..surfels import is_surfels
from .component import ADD_NAMES, ELSEWHERE
from .points import as_one, points_of, surfels_of

PLOTTER_OPTIONS = ("notebook", "off_screen", "theme", "window_size")
SHOW_OPTIONS = ("auto_close", "interactive", "jupyter_backend", "jupyter_kwargs", "return_cpos",
                "return_img", "return_viewer", "screenshot", "title")
# What pyvista.plot does for its arguments.
SCENE_OPTIONS = {"show_axes": lambda pl, shown: pl.add_axes() if shown else pl.hide_axes(),
                 "show_bounds": lambda pl, shown: pl.show_bounds() if shown else None,
                 "text": lambda pl, text: pl.add_text(text) if text else None,
                 "zoom": lambda pl, factor: None if factor is None else pl.camera.zoom(factor)}


def _progress_bar(algorithm):
    return ProgressMonitor(algorithm, message="Estimating surfels")


@pv.register_dataset_accessor("surfels", pv.MultiBlock)
@pv.register_dataset_accessor("surfels", pv.DataSet)
class SurfelAccessor:
    """Surfels from the points of a data set.

    Use it as ``dataset.surfels``.

    Parameters
    ----------
    dataset : pyvista.DataSet | pyvista.MultiBlock
        Data set with points of a surface, such as a scan, or a mesh. Blocks become one cloud.

    Examples
    --------
    >>> import pyvista as pv
    >>> cloud = pv.PolyData(pv.Sphere(theta_resolution=60, phi_resolution=60).points)
    >>> surfels = cloud.surfels.estimate()
    >>> surfels.surfels.are_estimated
    True

    """

    def __init__(self, dataset: pv.DataSet | pv.MultiBlock) -> None:
        self._dataset = dataset

    @property
    def are_estimated(self) -> bool:
        """Return whether the data set holds surfels already.

        Returns
        -------
        bool
            Whether the data set is the output of :meth:`estimate`, with its level of detail if it
            is a capture.

        Examples
        --------
        >>> import pyvista as pv
        >>> pv.Sphere().surfels.are_estimated
        False

        """
        return is_surfels(as_one(self._dataset))

    @with_checked_names("surfels.estimate")
    def estimate(self, *, cleaning: str = "full", sides: str = "auto",
                 viewpoint: Sequence[float] | None = None, neighbors: int | None = None,
                 hierarchy: bool = True, progress_bar: bool = False) -> pv.PolyData:
        """Make surfels of the points.

        Of a mesh whose vertices are too few or too uneven to tell its surface, such as
        ``pyvista.Cube()``, low-poly cars and CAD, they are made of about 200,000 points on its
        faces instead, as ``surfelsplat render`` does: below 50,000 vertices, and if half of the
        area lies in faces that are large for so many vertices. That takes about a second. Of grids,
        such as those with solid cells, the surface is a mesh. ``mesh.cast_to_pointset().surfels``
        has the vertices only.

        The surfels have the point data of the points that they are made from, in another order,
        and stay where these are in the world; in double, if float is too coarse for coordinates
        such as those of UTM. Normals of the data set are kept. On faces, real numbers and colors
        are interpolated; whole numbers, booleans and texts are those of a near corner, so that
        ``mesh['vertex'] = numpy.arange(mesh.n_points)`` tells near which vertex a picked surfel
        is. Cell data is not used; ``mesh.cell_data_to_point_data()`` makes point data of it.

        Surfels are a data set of their own: to see what is changed in the points or the mesh
        afterwards, make them anew, or change the arrays of the surfels. The Gaussians of a capture
        stay what they are and get their level of detail; the other parameters have no effect on
        them.
        Surfels whose points are moved afterwards are made anew when they are drawn; those that are
        selected get a new level of detail.

        Parameters
        ----------
        cleaning : {'full', 'outliers', 'off'}, default: 'full'
            What to do about the errors of a scan: remove stray points and move noisy points to a
            smooth surface; remove stray points only; or nothing. Clean points stay as they are.

        sides : {'auto', 'two', 'given'}, default: 'auto'
            From where surfels are seen. ``'auto'``: closed surfaces from outside, others from both
            sides; points with a ``viewpoint`` from there. Parts of a mesh, and closed parts of points
            with normals, that are inside out are turned, but for rooms. ``'two'``: all from both
            sides. ``'given'``: from where the normals of the data set, or its faces, point.

        viewpoint : sequence[float], optional
            Place of the scanner, for a scan from one place. A ``.pcd`` file may know it; then it
            is used unless the points were moved or selected since.

        neighbors : int, optional
            Number of nearest points that a normal is computed from, 4 to 256. More for noisy
            scans. By default 16, and 30 for depth images.

        hierarchy : bool, default: True
            Whether to add the level of detail that makes large clouds fast.

        progress_bar : bool, default: False
            Whether to show the progress, which needs tqdm; Ctrl-C then ends the estimation.

        Returns
        -------
        pyvista.PolyData
            Surfels, for ``plotter.surfels.add`` and :meth:`plot`. They can be saved as ``.vtp``.

        Raises
        ------
        TypeError
            If the data set is a grid without points of its own.

        ValueError
            If it has no points that give surfels, or a parameter is out of range.

        Examples
        --------
        >>> import pyvista as pv
        >>> cloud = pv.PolyData(pv.Sphere(theta_resolution=60, phi_resolution=60).points)
        >>> surfels = cloud.surfels.estimate(sides='two')
        >>> surfels.n_points == cloud.n_points
        True

        Of a mesh with few vertices, points on its faces.

        >>> pv.Cube().surfels.estimate().n_points > 190_000
        True

        """
        return surfels_of(points_of(as_one(self._dataset), sides), cleaning=cleaning, sides=sides,
                          viewpoint=viewpoint, neighbors=neighbors, hierarchy=hierarchy,
                          watch=_progress_bar if progress_bar else None)

    def plot(self, *, coc: float | None = None, focus: Sequence[float] | None = None,
             cpos: Any = None, background: Any = None, **kwargs: Any) -> Any:
        """Plot the points, or the faces of a mesh with few vertices, as surfels.

        Parameters
        ----------
        coc : float, optional
            Radius of the blur of very distant points, in pixels. Without it, everything is sharp.
            The lens has the seven cells of ``plotter.surfels.lens``.

        focus : sequence[float], optional
            Point ``(x, y, z)``, or pixel ``(x, y)`` from the lower left corner, that is in focus.
            By default it is the surface in the middle of the picture.

        cpos : str | sequence, optional
            Camera position, as for :func:`pyvista.plot`. By default the whole cloud is seen, a
            depth image from its sensor.

        background : ColorLike, optional
            Color of the background.

        **kwargs
            Keyword arguments of :class:`pyvista.Plotter` (``notebook``, ``off_screen``, ``theme``,
            ``window_size``), of :meth:`pyvista.Plotter.show` (``screenshot``, ``jupyter_backend``,
            ``return_img``, ``return_cpos`` and others), of ``plotter.surfels.add`` (``scalars``,
            ``cmap`` and others), and of :func:`pyvista.plot` ``show_axes``, ``show_bounds``,
            ``text`` and ``zoom``.

        Returns
        -------
        Any
            What :meth:`pyvista.Plotter.show` returns.

        Examples
        --------
        >>> import pyvista as pv
        >>> cloud = pv.PolyData(pv.Sphere(theta_resolution=60, phi_resolution=60).points)
        >>> cloud['height'] = cloud.points[:, 2]
        >>> cloud.surfels.plot(scalars='height', cmap='terrain', coc=20)

        """
        if cpos is not None and not isinstance(cpos, str):
            if not np.isfinite(np.asarray(list(cpos), dtype=float)).all():
                raise ValueError(f"cpos is {cpos!r}; it must be finite")
        check_names(kwargs, {*ADD_NAMES, *PLOTTER_OPTIONS, *SHOW_OPTIONS, *SCENE_OPTIONS}, "surfels.plot",
                    "a pyvista.Plotter has what else there is, with pl.surfels.add and pl.surfels.lens",
                    ELSEWHERE)
        plotter_options = {name: kwargs.pop(name) for name in PLOTTER_OPTIONS if name in kwargs}
        show_options = {name: kwargs.pop(name) for name in SHOW_OPTIONS if name in kwargs}
        scene_options = {name: kwargs.pop(name) for name in SCENE_OPTIONS if name in kwargs}
        if plotter_options.get("window_size") is not None:
            checked_size(plotter_options["window_size"], "window_size")
        pl = pv.Plotter(**plotter_options)
        try:
            if background is not None:
                pl.set_background(background)
            if cpos is not None:
                kwargs.setdefault("reset_camera", True)
            pl.surfels.add(self._dataset, **kwargs)
            if cpos is not None:
                pl.camera_position = cpos
            for name, value in scene_options.items():
                SCENE_OPTIONS[name](pl, value)
            if coc is not None:
                pl.surfels.lens(coc=coc, focus=focus)
            return pl.show(**show_options)
        except BaseException:
            pl.close()
            raise
