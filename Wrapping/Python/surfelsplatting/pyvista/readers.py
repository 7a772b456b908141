# SPDX-License-Identifier: BSD-3-Clause
"""Files that PyVista reads with this package."""

from __future__ import annotations

import os
from pathlib import Path

import pyvista as pv

from ..formats.e57 import read_e57_cloud
from ..formats.las import read_las_cloud
from ..formats.ptx import read_ptx_cloud
from ..formats.sog import read_sog_capture
from ..formats.sogfiles import folder_meta
from ..formats.text import read_text_cloud
from ..notes import note_scan, note_up
from ..problems import UserProblem, warn_user
from ..vtkmessages import update
from ..vtkSurfelReaders import vtkGaussianSplatReader, vtkPointCloudReader


def read_pcd(path: str) -> pv.PolyData:
    """Read a ``.pcd`` file of the Point Cloud Library.

    Parameters
    ----------
    path : str
        Path of the file.

    Returns
    -------
    pyvista.PolyData
        The points with their colors (``RGB``), normals and other fields. The field data has the
        place of the sensor and the width of a depth image, where the file has them;
        ``estimate()`` uses both.

    Examples
    --------
    >>> from pathlib import Path
    >>> import tempfile
    >>> import pyvista as pv
    >>> header = '''VERSION .7
    ... FIELDS x y z
    ... SIZE 4 4 4
    ... TYPE F F F
    ... COUNT 1 1 1
    ... WIDTH 2
    ... HEIGHT 1
    ... VIEWPOINT 0 0 5 1 0 0 0
    ... POINTS 2
    ... DATA ascii
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / 'two.pcd'
    ...     _ = path.write_text(header + '0 0 0\\n1 2 3\\n')
    ...     cloud = pv.read(path)
    >>> cloud.n_points
    2

    """
    return _read(vtkPointCloudReader(), path)


def read_capture(path: str | Path) -> pv.PolyData:
    """Read a capture of 3D Gaussian splatting, a ``.splat``, ``.spz``, ``.sog`` or ``.ply`` file.

    :func:`pyvista.read` calls this for ``.splat``, ``.spz`` and ``.sog`` files. It reads no more than
    the points of a ``.ply`` file.

    Parameters
    ----------
    path : str | Path
        Path of the file, or of the ``meta.json`` of a ``.sog`` capture in a folder, or of this folder.

    Returns
    -------
    pyvista.PolyData
        The Gaussians: ``GaussianCovariance``, ``GaussianOpacity``, and ``RGB`` of a
        ``.splat`` file or ``GaussianHarmonics`` of the others.

    Examples
    --------
    >>> from surfelsplatting.pyvista.readers import read_capture
    >>> capture = read_capture('capture.ply')  # doctest: +SKIP
    >>> capture.surfels.plot(coc=15)  # doctest: +SKIP

    """
    path = folder_meta(str(path))
    if path.lower().endswith((".sog", ".json")):
        return _cloud_of(lambda name: read_sog_capture(name)[0], path)
    return _read(vtkGaussianSplatReader(), path)


def read_las(path: str) -> pv.PolyData:
    """Read a ``.las`` or ``.laz`` file, with the wheel's extra ``las``.

    Parameters
    ----------
    path : str
        Path of the file.

    Returns
    -------
    pyvista.PolyData
        The points with their colors (``RGB``) and intensities, where the file has them.

    Examples
    --------
    >>> import pyvista as pv
    >>> cloud = pv.read('scan.laz')  # doctest: +SKIP

    """
    return _cloud_of(read_las_cloud, path)


def read_e57(path: str) -> pv.PolyData:
    """Read an ``.e57`` file, with the wheel's extra ``e57``.

    Parameters
    ----------
    path : str
        Path of the file.

    Returns
    -------
    pyvista.PolyData
        The points of all scans with their colors (``RGB``) and intensities, and the vectors to
        their scanners (``ToScanner``) where the file has the places; ``estimate()`` uses them, also
        of clouds that were merged or clipped.

    Examples
    --------
    >>> import pyvista as pv
    >>> cloud = pv.read('scan.e57')  # doctest: +SKIP

    """
    return _scan_of(read_e57_cloud, path)


def read_ptx(path: str) -> pv.PolyData:
    """Read a ``.ptx`` file of a laser scanner.

    Parameters
    ----------
    path : str
        Path of the file.

    Returns
    -------
    pyvista.PolyData
        The points that were seen, of all scans in their places, with their intensities, and their
        colors (``RGB``) where the file has them, and the vectors to their scanners
        (``ToScanner``); ``estimate()`` uses them, also of clouds that were merged or clipped.

    Examples
    --------
    >>> import pyvista as pv
    >>> cloud = pv.read('scan.ptx')  # doctest: +SKIP

    """
    return _scan_of(read_ptx_cloud, path)


def read_text(path: str) -> pv.PolyData:
    """Read points in columns of text, such as an ``.xyz``, ``.asc``, ``.csv`` or ``.txt`` file.

    The columns are told by their names, or else by their values, with a warning where these may be
    misread. Longitudes and latitudes become metres from their middle.

    Parameters
    ----------
    path : str
        Path of the file.

    Returns
    -------
    pyvista.PolyData
        The points with their colors (``RGB``) and normals, where the file has them, and its other
        columns of numbers.

    Examples
    --------
    >>> from pathlib import Path
    >>> import tempfile
    >>> import pyvista as pv
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / 'two.xyz'
    ...     _ = path.write_text('0 0 0 255 0 0\\n1 2 3 0 255 0\\n')
    ...     cloud = pv.read(path)
    >>> cloud.n_points
    2

    """
    def read(name):
        data, columns = read_text_cloud(name)
        if columns.unsure:
            warn_user(f"{name}: {columns}")
        if columns.are_degrees:
            note_up(data, (0, 0, 1))
        return data

    return _cloud_of(read, path)


def _read(reader, path):
    reader.SetFileName(os.fsencode(path))
    update(reader, str(path))
    return pv.wrap(reader.GetOutput())


def _scan_of(read, path):
    """The cloud of a function that also tells the place of the scanner"""
    def noted(name):
        cloud, viewpoint, *_ = read(name)
        note_scan(cloud, viewpoint)
        return cloud

    return _cloud_of(noted, path)


def _cloud_of(read, path):
    try:
        return pv.wrap(read(str(path)))
    except UserProblem as problem:
        raise ValueError(str(problem)) from None
