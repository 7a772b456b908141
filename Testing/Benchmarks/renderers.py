# SPDX-License-Identifier: BSD-3-Clause
"""Hierarchy, camera and renderer of surfels. Nothing here needs more of the package than all of its
versions have: versions.py draws with older ones."""

from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera

from surfelsplatting.vtkSurfelFilters import vtkSurfelHierarchy
from surfelsplatting.vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper


def hierarchy_of(surfels):
    hierarchy = vtkSurfelHierarchy()
    hierarchy.SetInputData(surfels)
    hierarchy.Update()
    return hierarchy.GetOutput()


def view_camera(view):
    camera = vtkCamera()
    camera.SetPosition(view["position"])
    camera.SetFocalPoint(view["focalPoint"])
    camera.SetViewUp(view["viewUp"])
    camera.SetViewAngle(view["viewAngle"])
    camera.SetFocalDistance(view["focalDistance"])
    return camera


def camera_view(camera):
    """What view_camera() reads."""
    return {"position": camera.GetPosition(), "focalPoint": camera.GetFocalPoint(),
            "viewUp": camera.GetViewUp(), "viewAngle": camera.GetViewAngle(),
            "focalDistance": camera.GetFocalDistance()}


def image_renderer(surfels, camera, lit):
    """Draws each frame anew, without a window."""
    mapper, actor, renderer = vtkSurfelMapper(), vtkActor(), vtkSurfelImageRenderer()
    mapper.SetInputData(surfels)
    mapper.SetScalarVisibility(surfels.GetPointData().GetScalars() is not None)
    actor.SetMapper(mapper)
    actor.GetProperty().SetLighting(lit)
    renderer.AddActor(actor)
    renderer.SetCamera(camera)
    splatter = renderer.GetSplatter()
    if hasattr(splatter, "FrameReuseOff"):  # older versions never reuse a frame
        splatter.FrameReuseOff()
    return renderer


def set_blur(splatter, confusion):
    """confusion: radius of the blur of a point at infinity in px, 0 = pinhole."""
    if confusion:
        splatter.SetLensModeToCircleOfConfusion()
        splatter.SetCircleOfConfusion(confusion)
    else:
        splatter.SetLensModeToPinhole()
