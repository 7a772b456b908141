# SPDX-License-Identifier: BSD-3-Clause
"""Where the camera of a capture is at home: among those that it was trained with, or inside of the
scene."""

import math
import os
from typing import NamedTuple, Tuple

import numpy as np

from ..problems import UserProblem
from ..shapes.directions import unit
from ..shapes.up import Up
from .cameras import are_parallel
from .surroundings import scene_view
from .trained import cameras_file, cameras_in, is_trained, load_json, pivot_of
from .turning import front_of

UPRIGHT = 0.5  # length of the mean of unit vectors up, below which they do not agree
SEEN = 0.02  # part of the Gaussians that a camera sees, of a file that belongs to the capture
TRIED = 200  # cameras
FEW = 5000  # samples
OCTANTS, AROUND = 8, 6  # of the directions around, and how many of them a whole turn needs
SWING = 40.0  # degrees, as around depth images


class Home(NamedTuple):
    """A view, and the point about which it turns."""

    position: np.ndarray
    focal_point: np.ndarray
    up: Up
    spread: Tuple[float, float]  # tangents of the largest angles to the sides, and up and down
    distance: float  # from the focal point, of views from other sides
    turn: float  # degrees of a turntable
    what: str  # for --verbose

    def angle(self, size):
        """The vertical angle, degrees, of the largest picture within the spread."""
        across, along = self.spread
        return math.degrees(2 * math.atan(min(along, across * size[1] / size[0])))

    def reach(self, side):
        """The distance of the camera; side: one of cameras.SIDES, or None"""
        return self.distance if side else float(np.linalg.norm(self.position - self.focal_point))

    @property
    def direction(self):
        return unit(self.position - self.focal_point)


def _up_of(cameras):
    """The mean of what is up for the cameras, or None if they do not agree"""
    mean = np.mean([camera.up for camera in cameras], axis=0)
    return unit(mean) if np.linalg.norm(mean) >= UPRIGHT else None


def _central(cameras, pivot):
    """The number of the camera that looks most straight at the pivot, from the usual distance; without
    a pivot of the one in the middle."""
    places = np.array([camera.position for camera in cameras])
    if pivot is None:
        return int(np.argmin(np.linalg.norm(places - np.median(places, axis=0), axis=1)))
    rays = pivot - places
    distance = np.maximum(np.linalg.norm(rays, axis=1), 1e-300)
    cosines = np.einsum("ij,ij->i", rays, [camera.forward for camera in cameras]) / distance
    off = np.arccos(np.clip(cosines, -1, 1)) + np.abs(np.log(distance / np.median(distance)))
    return int(np.argmin(off))


def _depths_seen(camera, points):
    """Depths of the points that are within the camera's image"""
    local = (points - camera.position) @ camera.rotation
    depth = local[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = (np.abs(local[:, :2]) <= np.multiply.outer(depth, camera.spread)).all(axis=1)
    return depth[(depth > 0) & inside]


def _goes_around(cameras, pivot, up):
    """Whether the cameras are all around the pivot"""
    front = front_of(up)
    side = np.cross(up, front)
    arms = np.array([camera.position - pivot for camera in cameras])
    angles = np.arctan2(arms @ side, arms @ front)
    return len(np.unique(np.floor(angles / (2 * math.pi) * OCTANTS) % OCTANTS)) >= AROUND


def _trained_home(cameras, file, samples):
    """-> Home, or UserProblem if the cameras see nothing of the capture"""
    points = samples.points[::max(1, len(samples.points) // FEW)]
    some = cameras[::max(1, len(cameras) // TRIED)]
    if np.median([len(_depths_seen(camera, points)) for camera in some]) < SEEN * len(points):
        raise UserProblem(f"{file}: its cameras see hardly anything of the capture; they are of "
                          "another one, or in other coordinates")
    pivot, up = pivot_of(cameras), _up_of(cameras)
    number = _central(cameras, pivot)
    camera = cameras[number]
    up = camera.up if up is None else up
    if pivot is None:
        seen = _depths_seen(camera, points)
        depth = np.median(seen) if len(seen) else np.median(
            np.linalg.norm(points - camera.position, axis=1))
        pivot, turn = camera.position + depth * camera.forward, 360.0
    else:
        turn = 360.0 if _goes_around(cameras, pivot, up) else SWING
    if are_parallel(up, camera.position - pivot, 0.1):
        up = camera.up
    distance = float(np.median([np.linalg.norm(c.position - pivot) for c in cameras]))
    return Home(camera.position, pivot, Up(up, True), camera.spread, distance, turn,
                f"as camera {number}, {camera.name}, of {len(cameras)} in {file}")


def _scene_home(samples):
    """-> Home inside of a scene, or None"""
    found = scene_view(samples)
    if not found:
        return None
    position, center, up, spread, is_free = found
    distance = float(np.linalg.norm(position - center))
    return Home(position, center, up, spread, distance, 360.0 if is_free else SWING,
                "from inside: what is around the subject hides it from outside")


def _find_home(path, samples):
    """-> Home or None, and why a file of cameras is not used, or None"""
    problem = None
    file = cameras_file(path) if path else None
    if file:
        file = os.path.relpath(file)
        try:
            content = load_json(file)
            if is_trained(content):
                return _trained_home(cameras_in(file, content), file, samples), None
        except UserProblem as error:
            problem = f"{error}; the view is found without it"
    return _scene_home(samples), problem


def home_of(cloud, samples, note=None):
    """-> Home of a capture, or None where it is to be shown from outside. Found once for each cloud.

    note: is called with a line about a file of cameras that is not used
    """
    if not samples.is_capture:
        return None
    if cloud.home is None:
        cloud.home = _find_home(cloud.path, samples)
    home, problem = cloud.home
    if note and problem:
        note(problem)
    return home
