# SPDX-License-Identifier: BSD-3-Clause
"""What PyVista finds by its entry points: ``dataset.surfels``, ``plotter.surfels``, ``.pcd`` files."""

import os

import pyvista as pv

from ..backend import VTK_PACKAGE, vtk

if not issubclass(pv.PolyData, vtk("vtkCommonDataModel").vtkPolyData):
    setting = os.environ.get("PYVISTA_VTK_BACKEND")
    raise ImportError(
        f"PyVista {pv.__version__} does not use {VTK_PACKAGE}, the VTK that surfelsplatting is made "
        "for; " + (f"unset PYVISTA_VTK_BACKEND, which is {setting!r}" if setting else
                   "install PyVista 0.49 or later, which does"))

# The notebooks' interactive backend, trame-vtk, does not know which VTK PyVista uses.
os.environ.setdefault("VTK_MODULE_NAME", VTK_PACKAGE)
