# SPDX-License-Identifier: BSD-3-Clause
"""Which VTK this package works with: PyVista's, cvista, or the one named vtkmodules.

The compiled modules are made for one of them, and objects of the two do not mix.
"""

import importlib
import importlib.util
import os

from .version import VTK_PACKAGE


def _wanted_package():
    """By PyVista's rule: the environment variable, or cvista if it is installed, or vtkmodules."""
    name = os.environ.get("PYVISTA_VTK_BACKEND")
    if name:
        return "vtkmodules" if name == "vtk" else name
    return "cvista" if importlib.util.find_spec("cvista") else "vtkmodules"


def vtk(name):
    """A module of VTK, such as vtk("vtkRenderingCore")."""
    return importlib.import_module(f"{VTK_PACKAGE}.{name}")
