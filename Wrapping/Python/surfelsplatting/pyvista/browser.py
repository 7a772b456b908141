# SPDX-License-Identifier: BSD-3-Clause
"""What pages show that draw in the browser, which has neither surfels nor a lens: the points."""

import importlib.util


def show_points_in_browsers():
    """Has trame-vtk, if it is installed, take surfels for what else they are, points of a mapper. It
    would leave out what it does not know, and say nothing."""
    if importlib.util.find_spec("trame_vtk"):
        from trame_vtk.modules.vtk.serializers.registry import register_js_class

        register_js_class("vtkSurfelMapper", "vtkMapper")
