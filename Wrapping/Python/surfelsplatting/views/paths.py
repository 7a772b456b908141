# SPDX-License-Identifier: BSD-3-Clause
"""Paths of a camera: a list of views, one for each frame of a film."""

import math
from dataclasses import replace

import numpy as np

from ..backend import vtk
from ..problems import UserProblem
from ..shapes.directions import rotated, unit
from .cameras import check_view
from .focus import distance_in_focus


def turntable(view, pivot, axis, frames, degrees=360.0):
    """The camera goes around the axis through the pivot.

    A whole turn ends one step before its first frame, so that it can be repeated. Less than a whole
    turn swings to both sides, as far as half of it.
    """
    axis, pivot = unit(np.asarray(axis)), np.asarray(pivot)

    def around(point, angle, center):
        return tuple(map(float, center + rotated(np.asarray(point) - center, axis, angle)))

    views = []
    for number in range(frames):
        angle = 2 * math.pi * number / frames
        if abs(degrees) < 360:
            angle = math.radians(degrees) / 2 * math.sin(angle)
        else:
            angle *= degrees / 360
        views.append(replace(view, position=around(view.position, angle, pivot),
                             focal_point=around(view.focal_point, angle, pivot),
                             view_up=around(view.view_up, angle, np.zeros(3))) if angle else view)
    return views


def _eased(fraction):
    """Starts and ends without speed."""
    return fraction * fraction * (3 - 2 * fraction)


def focus_pull(view, near, far, frames):
    """The focus goes from one distance to another. Blur is linear in the reciprocal of the
    distance, and so is its motion."""
    views = []
    for number in range(frames):
        part = _eased(number / max(1, frames - 1))
        views.append(replace(view, focus_point=None,
                             focal_distance=1 / ((1 - part) / near + part / far)))
    return views


def _frame_of(up):
    """Three axes, the last of them up."""
    other = np.eye(3)[int(np.argmin(np.abs(up)))]
    first = unit(np.cross(other, up))
    return np.array([first, np.cross(up, first), up])


def _directions(azimuth, elevation):
    """-> to the camera, and up and right in a level picture from there; in the axes of the path."""
    around = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    top = np.array([0.0, 0.0, 1.0])
    to_camera = math.cos(elevation) * around + math.sin(elevation) * top
    up = math.cos(elevation) * top - math.sin(elevation) * around
    return to_camera, up, np.cross(up, to_camera)


def _nearest_turn(angle, last):
    """The angle, with whole turns added so that it is as near as possible to the last one."""
    return angle if last is None else angle + 2 * math.pi * round((last - angle) / (2 * math.pi))


def _parameters(view, origin, axes, last):
    """A view as numbers that may be interpolated one by one: the camera stays level between level
    views, and what is positive stays so.

    last: the parameters of the view before; None for the first one.
    """
    to_camera = axes @ (np.asarray(view.position) - np.asarray(view.focal_point))
    view_up = axes @ np.asarray(view.view_up)
    distance = np.linalg.norm(to_camera)
    elevation = math.asin(max(-1.0, min(1.0, to_camera[2] / distance)))
    if math.hypot(to_camera[0], to_camera[1]) > 1e-6 * distance:
        azimuth = math.atan2(to_camera[1], to_camera[0])
    else:  # from above or below, where it is the view-up vector that tells directions apart
        azimuth = math.atan2(*(-math.copysign(1.0, elevation) * view_up[[1, 0]]))
    azimuth = _nearest_turn(azimuth, last and last[0])
    _, up, right = _directions(azimuth, elevation)
    roll = _nearest_turn(math.atan2(view_up @ right, view_up @ up), last and last[2])
    return (azimuth, elevation, roll, math.log(distance), *(np.asarray(view.focal_point) - origin),
            math.log(math.tan(math.radians(view.view_angle) / 2)),
            1 / distance_in_focus(view), view.focal_disk, view.circle_of_confusion or 0.0)


def _spline(values):
    """A function of the number of the key: smooth, and without speed at the first and the last."""
    spline = vtk("vtkCommonComputationalGeometry").vtkKochanekSpline()
    spline.SetLeftConstraint(1)
    spline.SetRightConstraint(1)
    spline.SetLeftValue(0.0)
    spline.SetRightValue(0.0)
    for number, value in enumerate(values):
        spline.AddPoint(number, value)
    return spline.Evaluate


def _view_of(parameters, origin, axes, view):
    """The view with these parameters, and the rest of another one."""
    azimuth, elevation, roll, distance, *shift, angle, focus, disk, pixels = parameters
    to_camera, up, right = _directions(azimuth, elevation)
    view_up = math.cos(roll) * up + math.sin(roll) * right
    focal_point = origin + shift
    return replace(
        view, focal_point=tuple(map(float, focal_point)),
        position=tuple(map(float, focal_point + math.exp(distance) * (to_camera @ axes))),
        view_up=tuple(map(float, view_up @ axes)),
        view_angle=math.degrees(2 * math.atan(math.exp(angle))),
        focal_distance=0.0 if view.focus_point is not None else 1 / max(focus, 1e-17),
        focal_disk=max(0.0, disk),
        circle_of_confusion=None if view.circle_of_confusion is None else max(0.0, pixels))


def through(keys, frames):
    """From the first view to the last, through the others.

    Two views make a dolly. What is in focus in all of them stays in focus; otherwise the distance
    in focus moves as in focus_pull.
    """
    if len({key.circle_of_confusion is None for key in keys}) == 2:
        raise UserProblem("some of the views have a lens in world units and some one in pixels; "
                          "give one size of the lens for all, such as --circle-of-confusion 12")
    if len({key.focus_point for key in keys}) > 1:
        keys = [replace(key, focus_point=None, focal_distance=distance_in_focus(key))
                for key in keys]
    first = keys[0]
    origin, axes = np.asarray(first.focal_point), _frame_of(unit(np.asarray(first.view_up)))
    rows = []
    for key in keys:
        rows.append(_parameters(key, origin, axes, rows[-1] if rows else None))
    splines = [_spline(values) for values in zip(*rows)]
    times = [(len(keys) - 1) * number / max(1, frames - 1) for number in range(frames)]
    return [keys[int(time)] if time == int(time) else
            _view_of([spline(time) for spline in splines], origin, axes, first) for time in times]


def check_views(views):
    """Raises UserProblem if a frame cannot be drawn."""
    for number, view in enumerate(views):
        try:
            check_view(view)
        except UserProblem as problem:
            raise UserProblem(f"frame {number + 1} of {len(views)}: {problem}") from problem
