# SPDX-License-Identifier: BSD-3-Clause
"""What a subplot shows at a pixel or in its middle, so that the lens can focus on it."""

import numpy as np

from ..backend import vtk
from ..lens import focus_on_point
from ..problems import UserProblem
from ..views.cameras import View
from ..views.focus import fronts_of
from ..vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelSplattingPass
from .mapper import SurfelMapper


def has_no_focus(splatter, camera):
    return splatter.GetFocusMode() == splatter.FOCUS_CAMERA and not camera.GetFocalDistance()


def focus_on_middle(splatter, renderer):
    """Focuses on the surface in the middle, unless the lens has a focus or there are no surfels."""
    if not has_no_focus(splatter, renderer.camera):
        return
    actors = [actor for actor in renderer.actors.values()
              if actor.GetVisibility() and getattr(actor, "mapper", None)]
    surfels = [actor for actor in actors if isinstance(actor.mapper, SurfelMapper)]
    if not surfels:
        return
    meshes = [actor for actor in actors if actor not in surfels]
    fronts = [_front_of_surfels(renderer, surfels), _front_of_meshes(renderer, meshes)]
    front = min((front for front in fronts if front > 0), default=None)
    if front:
        camera = renderer.camera
        focus_on_point(splatter, None, np.add(camera.position, front * np.array(camera.direction)))


def _front_of_surfels(renderer, actors):
    """Distance at which a photographer would focus; 0 where there are none."""
    camera, image = renderer.camera, vtkSurfelImageRenderer()
    for actor in actors:
        image.AddActor(actor)
    size = tuple(renderer.GetSize())
    image.SetSize(*size)
    view = View(camera.position, camera.focal_point, camera.up, camera.view_angle, size)
    try:
        return fronts_of([view], image)[0]
    except UserProblem:
        return 0  # the frame will say it


def _front_of_meshes(renderer, actors):
    """Distance of the first face on the line of sight; 0 where there is none."""
    position, direction = np.array(renderer.camera.position), np.array(renderer.camera.direction)
    bounds = np.reshape(renderer.ComputeVisiblePropBounds(), (3, 2))
    end = np.linalg.norm(bounds - position[:, None], axis=0).sum()  # beyond all of them
    picker = vtk("vtkRenderingCore").vtkCellPicker()
    picker.PickFromListOn()
    for actor in actors:
        picker.AddPickList(actor)
    if not picker.Pick3DPoint(position, position + end * direction, renderer):
        return 0
    return float((np.array(picker.GetPickPosition()) - position) @ direction)


def point_at(plotter, splatter, pixel):
    """The point that a pixel of the active subplot sees."""
    renderer, camera = plotter.renderer, plotter.camera
    width, height = plotter.window_size
    if not renderer.IsInViewport(*pixel):
        raise ValueError(f"the lens's focus {pixel} is no pixel of the active subplot in a window "
                         f"of {width} x {height}")
    distance = _distance_at(plotter, splatter, pixel)
    if distance is None:
        if camera.parallel_projection:
            raise ValueError("the camera has a parallel projection, with which all is sharp, so the "
                             f"lens cannot focus on the pixel {pixel}; disable_parallel_projection()")
        raise ValueError(f"the pixel {pixel} sees nothing, so the lens cannot focus on it; choose a "
                         "pixel that shows a surface, or give a point (x, y, z)")
    renderer.SetDisplayPoint(*pixel, 0)
    renderer.DisplayToWorld()
    near = np.array(renderer.GetWorldPoint())
    position = np.array(camera.position)
    ray = near[:3] / near[3] - position
    return tuple(position + ray * (distance / (ray @ camera.GetDirectionOfProjection())))


def _distance_at(plotter, splatter, pixel):
    """Distance along the view direction to what a pixel sees without the lens, or None."""
    camera = plotter.camera
    distance, mode = camera.GetFocalDistance(), splatter.GetLensMode()
    splatter.SetLensModeToPinhole()
    try:
        plotter.screenshot(return_img=True)  # for what was never rendered
        plotter.render()
        found = vtkSurfelSplattingPass.FocusAt(plotter.renderer, *pixel)
        return camera.GetFocalDistance() if found else None
    finally:
        splatter.SetLensMode(mode)
        camera.SetFocalDistance(distance)
