# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of TestScans.py by plain VTK: the same scan through pcl_io, filters, camera and lens.

    python3 plainvtk.py SCANS PICTURE.png...    exit status 1: less than 40 dB
"""

import json
import os
import sys

import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, the implementation of rendering
from measures import psnr
from surfelsplatting import (vtkPointCloudReader, vtkPointsToSurfels, vtkSurfelMapper,
                             vtkSurfelSplattingPass)
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader, vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkActor, vtkLightKit, vtkRenderer, vtkRenderWindow,
                                         vtkWindowToImageFilter)

LEAST_PSNR = 40.0


def make_actor(scan):
    reader = vtkPointCloudReader()
    reader.SetFileName(scan)
    reader.Update()
    filters, mapper = vtkPointsToSurfels(), vtkSurfelMapper()
    filters.SetInputConnection(reader.GetOutputPort())
    if reader.GetHasViewpoint():  # a depth image, of which the plugin knows the sensor
        filters.GetCleaning().SetColumns(reader.GetDimensions()[0])
        filters.GetCleaning().SetViewpoint(reader.GetViewpoint())
        filters.GetEstimation().SetNumberOfNeighbors(30)
        filters.GetEstimation().SetOrientationModeToViewpoint()
        filters.GetEstimation().SetViewpoint(reader.GetViewpoint())
    mapper.SetInputConnection(filters.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def draw(actor, seen):
    renderer, window = vtkRenderer(), vtkRenderWindow()
    renderer.SetBackground(seen["background"])
    renderer.AddActor(actor)
    kit = vtkLightKit()  # ParaView's lights
    kit.AddLightsToRenderer(renderer)
    kit.Update()
    camera = renderer.GetActiveCamera()
    camera.SetPosition(seen["position"])
    camera.SetFocalPoint(seen["focal_point"])
    camera.SetViewUp(seen["up"])
    camera.SetViewAngle(seen["angle"])
    renderer.ResetCameraClippingRange()
    splatting = vtkSurfelSplattingPass()
    splatter = splatting.GetSplatter()
    splatter.SetLensModeToCircleOfConfusion()
    splatter.SetCircleOfConfusion(seen["radius"])
    splatter.SetFocusModeToPoint()
    splatter.SetFocusPoint(seen["focus"])
    renderer.SetPass(splatting)
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(seen["size"])
    window.AddRenderer(renderer)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    return grab.GetOutput()


def pixels(image):
    return vtk_to_numpy(image.GetPointData().GetScalars())[:, :3].astype(float)


def compare(scans, picture):
    """-> PSNR, dB"""
    with open(picture + ".json") as file:
        seen = json.load(file)
    plain = draw(make_actor(os.path.join(scans, seen["scan"])), seen)
    writer = vtkPNGWriter()
    writer.SetInputData(plain)
    writer.SetFileName(picture.replace(".png", "-plain.png"))
    writer.Write()
    reader = vtkPNGReader()
    reader.SetFileName(picture)
    reader.Update()
    return psnr(pixels(reader.GetOutput()), pixels(plain), 255)


def main():
    scans, *pictures = sys.argv[1:]
    worst = min(compare_and_tell(scans, picture) for picture in pictures)
    sys.exit(0 if worst >= LEAST_PSNR else 1)


def compare_and_tell(scans, picture):
    value = compare(scans, picture)
    print(f"{os.path.basename(picture)} against plain VTK: {value:.1f} dB", flush=True)
    return value


if __name__ == "__main__":
    main()
