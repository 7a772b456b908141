# SPDX-License-Identifier: BSD-3-Clause
"""Directions from which a cloud is seen, and turns of the camera."""

import math

import numpy as np

from ..shapes.directions import rotated, unit

QUARTER = math.pi / 2
AZIMUTHS = {"front": 0.0, "right": QUARTER, "back": 2 * QUARTER, "left": 3 * QUARTER,
            "iso": math.pi / 4}
ISOMETRIC = math.atan(math.sqrt(0.5))  # elevation at which all three axes look equally long


def front_of(up):
    """The direction to a camera in front: -y if z is up, as in maps and CAD; -z if -y is, since the
    cameras of COLMAP, whose y is down, look along z; else z, as in models."""
    front = np.array([0.0, 0.0, -1.0 if up[1] < -0.7 else 1.0])
    if abs(up[2]) > 0.7:
        front = np.array([0.0, -1.0, 0.0])
    return unit(front - (front @ up) * up)


def seen_from(side, front, up):
    """-> for one of cameras.SIDES: the direction to the camera, and what is up in the picture."""
    if side == "top":
        return up, -front
    if side == "bottom":
        return -up, front
    direction = rotated(front, up, AZIMUTHS[side])
    if side == "iso":
        direction = math.cos(ISOMETRIC) * direction + math.sin(ISOMETRIC) * up
    return direction, up


def turned(direction, picture_up, axis, wishes):
    """-> direction to the camera and up in the picture, after the wishes' azimuth about the axis,
    elevation and roll. As vtkCamera's Azimuth, Elevation and Roll, but up stays up in the picture
    over the poles."""
    if wishes.azimuth:
        angle, axis = math.radians(wishes.azimuth), unit(axis)
        direction, picture_up = (rotated(v, axis, angle) for v in (direction, picture_up))
    if wishes.elevation:
        right = unit(np.cross(picture_up, direction))
        picture_up = np.cross(direction, right)
        angle = -math.radians(wishes.elevation)
        direction, picture_up = (rotated(v, right, angle) for v in (direction, picture_up))
    if wishes.roll:
        picture_up = rotated(picture_up, -direction, math.radians(wishes.roll))
    return direction, picture_up
