# SPDX-License-Identifier: BSD-3-Clause
"""Between a View and what VTK draws it with: a vtkCamera and a vtkSurfelSplatter."""

import math

from ..backend import vtk
from ..vtkSurfelRendering import vtkSurfelSplatter
from .cameras import View


def set_camera(camera, view):
    """Sets a vtkCamera to a whole view."""
    camera.SetPosition(view.position)
    camera.SetFocalPoint(view.focal_point)
    camera.SetViewUp(view.view_up)
    camera.SetViewAngle(view.view_angle)
    camera.SetFocalDisk(view.focal_disk)
    camera.SetFocalDistance(view.focal_distance)


def make_camera(view):
    """-> vtkCamera"""
    camera = vtk("vtkRenderingCore").vtkCamera()
    set_camera(camera, view)
    return camera


def set_lens(splatter, view):
    """Sets how much the lens of a view blurs, and the point in focus."""
    if view.circle_of_confusion:
        splatter.SetLensModeToCircleOfConfusion()
        splatter.SetCircleOfConfusion(view.circle_of_confusion)
    elif view.focal_disk:
        splatter.SetLensModeToCamera()
    else:
        splatter.SetLensModeToPinhole()
    if view.focus_point:
        splatter.SetFocusModeToPoint()
        splatter.SetFocusPoint(view.focus_point)
    else:
        splatter.SetFocusModeToCamera()


def _settled(direction):
    """The direction as vtkCamera::SetViewUp keeps it: it makes it a unit vector, which changes the
    last bits of most unit vectors once more."""
    for _ in range(10):
        length = math.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
        unit = tuple(x / length for x in direction)
        if unit == direction:
            break
        direction = unit
    return direction


def view_of(camera, splatter, size):
    """-> View, which make_camera and set_lens turn into the same picture.

    size: width and height of the picture, px.
    """
    mode = splatter.GetLensMode()
    by_pixels = mode == vtkSurfelSplatter.LENS_CIRCLE_OF_CONFUSION
    by_point = splatter.GetFocusMode() == vtkSurfelSplatter.FOCUS_POINT
    return View(
        position=tuple(camera.GetPosition()),
        focal_point=tuple(camera.GetFocalPoint()),
        view_up=_settled(tuple(camera.GetViewUp())),
        view_angle=camera.GetViewAngle(),
        size=tuple(size),
        focal_disk=camera.GetFocalDisk() if mode == vtkSurfelSplatter.LENS_CAMERA else 0.0,
        focal_distance=camera.GetFocalDistance(),
        circle_of_confusion=splatter.GetCircleOfConfusion() if by_pixels else None,
        focus_point=tuple(splatter.GetFocusPoint()) if by_point else None)
