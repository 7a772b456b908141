#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Hills through a lens: writes hills.png, without a display. With --window also in a window."""

import sys

from vtkmodules.vtkCommonComputationalGeometry import vtkParametricRandomHills
from vtkmodules.vtkFiltersSources import vtkParametricFunctionSource
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkCamera, vtkRenderer, vtkRenderWindow, vtkRenderWindowInteractor)

from surfelsplatting import (
    vtkPointsToSurfels, vtkSurfelImageRenderer, vtkSurfelMapper, vtkSurfelSplattingPass, write_png)

points = vtkParametricFunctionSource()
points.SetParametricFunction(vtkParametricRandomHills())
points.SetUResolution(300)
points.SetVResolution(300)
points.SetScalarModeToZ()

surfels = vtkPointsToSurfels()
surfels.SetInputConnection(points.GetOutputPort())
mapper = vtkSurfelMapper()
mapper.SetInputConnection(surfels.GetOutputPort())
mapper.SetScalarRange(0, 7)
mapper.GetLookupTable().SetHueRange(0.6, 0.0)  # high is red
actor = vtkActor()
actor.SetMapper(mapper)

camera = vtkCamera()
camera.SetPosition(9, -34, 23)
camera.SetFocalPoint(0, 1, 5)
camera.SetViewUp(0, 0, 1)
camera.SetFocalDisk(2)  # diameter of the lens
camera.SetFocalDistance(34)  # what is in focus

picture = vtkSurfelImageRenderer()
picture.AddActor(actor)
picture.SetCamera(camera)
write_png(picture, "hills.png")

if "--window" not in sys.argv:
    sys.exit()
import vtkmodules.vtkInteractionStyle  # noqa: E402, F401  (the mouse)

renderer = vtkRenderer()
renderer.AddActor(actor)
renderer.SetActiveCamera(camera)
renderer.SetPass(vtkSurfelSplattingPass())
window = vtkRenderWindow()
window.SetSize(512, 512)
window.AddRenderer(renderer)
interactor = vtkRenderWindowInteractor()
interactor.SetRenderWindow(window)
window.Render()
interactor.Start()
