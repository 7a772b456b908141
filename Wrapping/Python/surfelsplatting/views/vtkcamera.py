# SPDX-License-Identifier: BSD-3-Clause
"""Sets what VTK draws a View with: a vtkCamera and a vtkSurfelSplatter."""

from ..backend import vtk


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
