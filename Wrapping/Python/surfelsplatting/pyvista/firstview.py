# SPDX-License-Identifier: BSD-3-Clause
"""The view of a subplot until somebody chooses another: the cloud upright, and a depth image from its sensor."""

import numpy as np
import pyvista as pv

from ..clouds.cloud import Cloud
from ..notes import scan
from ..views.cameras import View
from ..views.framing import complete_view


class FirstView:
    """Places the camera of a renderer, which PyVista then takes for one that was set.

    points: those that the surfels of an actor were made of, which know the sensor; or the surfels
    """

    def __init__(self, renderer, actor, points):
        view = complete_view(View(size=tuple(renderer.GetSize())), Cloud(points, *scan(points)),
                             actor.mapper.dataset)
        renderer.camera_position = [view.position, view.focal_point, view.view_up]
        renderer.camera.view_angle = view.view_angle
        self._actor = actor
        self._placed = _place_of(renderer.camera)

    def show_others(self, renderer):
        """Moves back, in the same direction, if other props are outside of the picture, and clips none.
        What was added after the camera was set would not be seen."""
        if _place_of(renderer.camera) != self._placed:
            return
        back = max((_way_back(renderer, actor.GetBounds()) for actor in renderer.actors.values()
                    if actor is not self._actor and actor.GetVisibility() and actor.GetUseBounds()), default=0)
        if back > 0:
            _move_back(renderer, back)
        renderer.ResetCameraClippingRange()


def _place_of(camera):
    return camera.position, camera.focal_point, camera.up, camera.view_angle, camera.parallel_projection


def _way_back(renderer, bounds):
    """How far the camera has to go back to see all of a box; below 0 if it may go forward, as for what has
    no bounds, such as text."""
    if bounds is None or bounds[0] > bounds[1]:
        return -np.inf
    camera = renderer.camera
    corners = np.array(np.meshgrid(bounds[:2], bounds[2:4], bounds[4:])).reshape(3, -1).T
    forward = np.array(camera.direction)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    x, y, depth = ((corners - camera.position) @ np.stack([right, np.cross(right, forward), forward], 1)).T
    high = np.tan(np.radians(camera.view_angle) / 2)
    wide = high * renderer.GetTiledAspectRatio()
    return max(np.max(np.maximum(np.abs(x) / wide, np.abs(y) / high) - depth), -depth.min())


def _move_back(renderer, way):
    """By this way, or to where PyVista sees the whole scene in the middle, if things are larger there."""
    camera = renderer.camera
    back = pv.Camera()
    back.DeepCopy(camera)
    back.position = np.subtract(camera.position, way * np.array(camera.direction))
    height = _height_at(back, camera.focal_point)
    focal_point = camera.focal_point
    renderer.reset_camera(render=False)
    if height < _height_at(camera, focal_point):
        camera.DeepCopy(back)


def _height_at(camera, point):
    """Of what a camera sees at the distance of a point, world units."""
    depth = np.subtract(point, camera.position) @ np.array(camera.direction)
    return depth * np.tan(np.radians(camera.view_angle) / 2)
