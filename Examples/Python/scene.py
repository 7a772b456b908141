#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Surfels, a mesh, axes and text in one window, with depth of field on the surfels.

    scene.py [CLOUD.ply] [OUT.png]

Needs the package surfelsplatting (PYTHONPATH=build/lib/python3/dist-packages) and an X display;
without one: xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" scene.py
"""

import os
import sys

import vtkmodules.vtkInteractionStyle  # noqa: F401
import vtkmodules.vtkRenderingFreeType  # noqa: F401  (the text's font)
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersSources import vtkConeSource, vtkPointSource
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingAnnotation import vtkAxesActor
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkTextActor,
    vtkWindowToImageFilter)

from surfelsplatting import (
    vtkPointCloudReader, vtkPointsToSurfels, vtkSurfelMapper, vtkSurfelSplattingPass)


def point_source(path):
    """A cloud from a file, or points on a sphere."""
    if path:
        reader = vtkPointCloudReader()
        reader.SetFileName(path)
        return reader
    source = vtkPointSource()
    source.SetDistributionToShell()
    source.SetRadius(0.5)
    source.SetNumberOfPoints(20000)
    return source


def surfel_actor(points):
    surfels = vtkPointsToSurfels()
    surfels.SetInputConnection(points.GetOutputPort())
    mapper = vtkSurfelMapper()
    mapper.SetInputConnection(surfels.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def cone_actor(size, center):
    cone = vtkConeSource()
    cone.SetHeight(size)
    cone.SetRadius(0.4 * size)
    cone.SetCenter(center)
    cone.SetResolution(48)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(cone.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.9, 0.5, 0.2)
    return actor


def main(cloud=None, picture="scene.png"):
    surfels = surfel_actor(point_source(cloud))
    bounds = surfels.GetBounds()
    size = max(bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4])

    center = vtkTransform()
    center.Translate(*surfels.GetCenter())
    axes = vtkAxesActor()
    axes.SetUserTransform(center)
    axes.SetTotalLength(0.8 * size, 0.8 * size, 0.8 * size)
    text = vtkTextActor()
    text.SetInput("surfels, a mesh, axes and text")
    text.SetPosition(10, 10)
    text.GetTextProperty().SetFontSize(24)

    renderer = vtkRenderer()
    renderer.SetBackground(0.16, 0.17, 0.19)
    for prop in (surfels, axes, text):
        renderer.AddViewProp(prop)
    renderer.AddActor(cone_actor(0.6 * size, (bounds[0], bounds[2], bounds[5] - 0.3 * size)))

    # Depth of field needs only this line and a lens.
    renderer.SetPass(vtkSurfelSplattingPass())
    renderer.ResetCamera(bounds)
    renderer.GetActiveCamera().Zoom(0.7)  # for cone and axes
    camera = renderer.GetActiveCamera()
    camera.Azimuth(30)
    camera.Elevation(20)
    camera.SetFocalDisk(0.25 * size)  # diameter of the lens, world units

    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetSize(800, 600)
    window.AddRenderer(renderer)
    window.Render()

    grabber = vtkWindowToImageFilter()
    grabber.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetInputConnection(grabber.GetOutputPort())
    writer.SetFileName(picture)
    writer.Write()


if __name__ == "__main__":
    if not os.environ.get("DISPLAY"):
        sys.exit("scene.py needs an X display; without one, see its first lines")
    clouds = [word for word in sys.argv[1:] if not word.endswith(".png")]
    pictures = [word for word in sys.argv[1:] if word.endswith(".png")]
    main(clouds[0] if clouds else None, pictures[0] if pictures else "scene.png")
