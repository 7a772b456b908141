# SPDX-License-Identifier: BSD-3-Clause
"""Files that PyVista reads with this package."""

from __future__ import annotations

import pyvista as pv

from ..surfels import update
from ..vtkSurfelReaders import vtkPointCloudReader


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
    reader = vtkPointCloudReader()
    reader.SetFileName(str(path))
    update(reader, str(path))
    return pv.wrap(reader.GetOutput())
