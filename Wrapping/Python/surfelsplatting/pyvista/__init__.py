# SPDX-License-Identifier: BSD-3-Clause
"""What PyVista finds by its entry points: ``dataset.surfels``, ``plotter.surfels``, ``.pcd`` files."""

import os

from ..backend import VTK_PACKAGE

# The notebooks' interactive backend, trame-vtk, does not know which VTK PyVista uses.
os.environ.setdefault("VTK_MODULE_NAME", VTK_PACKAGE)
