# SPDX-License-Identifier: BSD-3-Clause
"""The view of a subplot until somebody chooses another: the cloud upright, and a depth image from its sensor."""

import numpy as np

from ..clouds.reading import Cloud
from ..surfels import scan
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
        if all(_is_in_picture(renderer, actor.GetBounds()) for actor in renderer.actors.values()
               if actor is not self._actor and actor.GetVisibility() and actor.GetUseBounds()):
            renderer.ResetCameraClippingRange()
        else:
            renderer.reset_camera(render=False)


def _place_of(camera):
    return camera.position, camera.focal_point, camera.up, camera.view_angle, camera.parallel_projection


def _is_in_picture(renderer, bounds):
    """Whether a box is; what has no bounds, such as text, is."""
    if bounds is None or bounds[0] > bounds[1]:
        return True
    corners = np.array(np.meshgrid(bounds[:2], bounds[2:4], bounds[4:], [1.0])).reshape(4, -1)
    matrix = renderer.camera.GetCompositeProjectionTransformMatrix(
        renderer.GetTiledAspectRatio(), -1, 1)
    x, y, _, w = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)]) @ corners
    return bool((w > 0).all() and (np.abs(x) <= w).all() and (np.abs(y) <= w).all())
