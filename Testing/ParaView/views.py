# SPDX-License-Identifier: BSD-3-Clause
"""Views that are drawn alike wherever ParaView runs, and splats in them."""

from paraview import simple

SIZE = 300


def plain_view(kind, background, position):
    """Square; looks at the origin, with y up."""
    view = simple.CreateView(kind)
    view.ViewSize = [SIZE, SIZE]
    view.UseColorPaletteForBackground = 0
    view.Background = background
    view.OrientationAxesVisibility = 0
    view.UseFXAA = 0
    view.CameraPosition = position
    view.CameraFocalPoint = [0, 0, 0]
    view.CameraViewUp = [0, 1, 0]
    return view


def show_splats(source, view, color=(1.0, 1.0, 1.0)):
    """-> the display; in one colour"""
    display = simple.Show(source, view)
    display.Representation = "Surfel Splats"
    display.ColorArrayName = ["POINTS", ""]
    display.AmbientColor = display.DiffuseColor = color
    return display
