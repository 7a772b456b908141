# SPDX-License-Identifier: BSD-3-Clause
"""Views that a mouse moves: each function takes a View and gives the moved one.

Distances of the mouse are in pixels, to the right and upwards.
"""

import math
from dataclasses import replace

import numpy as np

from ..shapes.directions import rotated, unit

TURN = math.pi  # radians that the height of the picture turns
STEEPEST = math.radians(1)  # the nearest that the camera comes to the vertical
NEAREST, FARTHEST = 1e-3, 1e3  # distance to the focal point, in sizes of the cloud


def _moved(view, position, focal_point=None):
    focal_point = view.focal_point if focal_point is None else tuple(map(float, focal_point))
    return replace(view, position=tuple(map(float, position)), focal_point=focal_point)


def _arm(view):
    """From the focal point to the camera."""
    return np.subtract(view.position, view.focal_point)


def orbit(view, right, up):
    """Turns the camera about the focal point. What is up stays up."""
    arm, axis = _arm(view), unit(np.array(view.view_up))
    per_pixel = TURN / view.size[1]
    arm = rotated(arm, axis, -right * per_pixel)
    tilt = math.acos(np.clip(unit(arm) @ axis, -1, 1))  # from the vertical
    wanted = np.clip(tilt + up * per_pixel, STEEPEST, math.pi - STEEPEST)
    side = unit(np.cross(axis, arm))
    return _moved(view, np.array(view.focal_point) + rotated(arm, side, wanted - tilt))


def pan(view, right, up):
    """Moves the camera so that what is at the focal point follows the mouse."""
    arm = _arm(view)
    across = unit(np.cross(view.view_up, arm))
    above = unit(np.cross(arm, across))
    height = 2 * math.tan(math.radians(view.view_angle) / 2) * np.linalg.norm(arm)
    shift = -(right * across + up * above) * height / view.size[1]
    return _moved(view, view.position + shift, view.focal_point + shift)


def zoom(view, factor, cloud_size):
    """Moves the camera towards the focal point: to 1 / factor of the distance."""
    arm = _arm(view)
    distance = np.linalg.norm(arm)
    wanted = np.clip(distance / factor, NEAREST * cloud_size, FARTHEST * cloud_size)
    return _moved(view, view.focal_point + arm * (wanted / distance))
