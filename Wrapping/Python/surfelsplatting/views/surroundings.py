# SPDX-License-Identifier: BSD-3-Clause
"""Captures that surround their subject, such as a table in a garden or a room: what is around hides
it from outside, so that it is seen from among it."""

import copy
import math
from typing import NamedTuple

import numpy as np

from ..shapes.directions import rotated, unit
from ..shapes.samples import ENOUGH
from ..shapes.up import EVEN, FLOOR, find_up
from .turning import front_of

OPAQUE = 0.1  # opacity of Gaussians that count for where the subject is
CELLS = 400  # of all directions
HIDDEN = 0.5  # part of the light in a direction, above which it counts as hidden
SHARES = range(15, 75, 5)  # percent of the Gaussians that may be the inside
GAP = 0.7  # radius of the inside over that from which on Gaussians are around
# Percent of the Gaussians that are inside, and the part of all directions that must then be hidden:
# things are closed as well, but have little inside.
AROUND = (15, 50), (0.72, 0.55)
SUBJECT = 25  # percent of the Gaussians, at most, that are the subject
TRIED = 300  # normals that may be those of the ground
GROUND = 6.0  # radii of the subject, within which the ground tells what is up
DISTANCES = (4.0, 3.2, 2.6, 2.0)  # of the camera, in radii of the subject
ELEVATIONS = (20, 35, 10)  # degrees
AZIMUTHS = range(30, 390, 45)  # degrees
MARGIN = 1.8  # half-height of the picture over the radius of the subject
WIDEST = math.tan(math.radians(37))
GRID = 8  # cells along a side of a picture that tells what is in the way
AS_GOOD = 0.8  # of the most light that any camera gets
FREE = 0.5  # the same, of each camera around
NEAR = 0.1  # of the distance, nearer than which a Gaussian covers the picture


class Scene(NamedTuple):
    center: np.ndarray  # of the subject
    radius: float


class _Gaussians:
    """Some of a capture, with those far away. areas: of their discs, times the opacity."""

    def __init__(self, samples):
        points, opacities, covariances = samples.unfenced
        some = slice(None, None, max(1, len(points) // ENOUGH))
        self.share = min(1.0, len(points[some]) / max(1, samples.count))
        self.points, self.opacities = points[some], np.clip(opacities[some], 0, 1)
        matrices = covariances[some][:, (0, 3, 5, 3, 1, 4, 5, 4, 2)].reshape(-1, 3, 3)
        finite = np.isfinite(matrices).all(axis=(1, 2))
        values, vectors = np.linalg.eigh(np.where(finite[:, None, None], matrices, 0.0))
        values = np.sqrt(np.maximum(values, 0))
        self.areas = 2 * math.pi * values[:, 1] * values[:, 2] * self.opacities / self.share
        self.normals = vectors[:, :, 0]


def _directions(count):
    """[count, 3] evenly over the sphere, along a spiral"""
    heights = 1 - (2 * np.arange(count) + 1) / count
    turns = math.pi * (3 - math.sqrt(5)) * np.arange(count)
    across = np.sqrt(1 - heights ** 2)
    return np.stack([across * np.cos(turns), across * np.sin(turns), heights], axis=1)


def _dense_middle(points):
    """Of the half of the points that are nearest to the middle, again and again"""
    center = np.median(points, axis=0)
    for _ in range(10):
        distances = np.linalg.norm(points - center, axis=1)
        center = np.median(points[distances <= np.median(distances)], axis=0)
    return center


def _hidden_beyond(radii, distances, cells, gaussians):
    """-> for each radius the part of all directions from the middle that is hidden beyond it"""
    solid = 4 * math.pi / CELLS
    depth = np.minimum(gaussians.areas / np.maximum(distances ** 2, 1e-300), 4 * math.pi) / solid
    hidden = []
    for radius in radii:
        far = distances > radius
        depths = np.bincount(cells[far], depth[far], CELLS)
        hidden.append(float(np.mean(-np.expm1(-depths) > HIDDEN)))
    return hidden


def _find_scene(gaussians):
    """-> Scene, or None if the subject can be seen from outside"""
    points = gaussians.points[gaussians.opacities > OPAQUE]
    if len(points) < 100:
        return None
    center = _dense_middle(points)
    inside = np.percentile(np.linalg.norm(points - center, axis=1), SHARES)
    rays = gaussians.points - center
    distances = np.linalg.norm(rays, axis=1)
    rays /= np.maximum(distances, 1e-300)[:, None]
    cells = np.concatenate([np.argmax(part @ _directions(CELLS).T, axis=1)
                            for part in np.array_split(rays, 10)])
    hidden = _hidden_beyond(inside / GAP, distances, cells, gaussians)
    fits = np.flatnonzero(np.array(hidden) >= np.interp(SHARES, *AROUND))
    if not len(fits):
        return None
    return Scene(center, float(inside[min(fits[-1], SHARES.index(SUBJECT))]))


def _in_the_way(gaussians, scene, direction, up, distance):
    """The part of the light from the subject that is lost on the way to a camera"""
    forward = -direction
    right = unit(np.cross(forward, up))
    local = gaussians.points - (scene.center + distance * direction)
    depth = local @ forward
    before = (depth > 0) & (depth < distance - scene.radius)
    depth = np.maximum(depth[before], NEAR * distance)
    places = local[before] @ np.stack([right, np.cross(right, forward)], axis=1) / depth[:, None]
    width = 2 * MARGIN * scene.radius / distance / GRID
    columns = np.floor(places / width + GRID / 2).astype(int)
    seen = ((columns >= 0) & (columns < GRID)).all(axis=1)
    thick = gaussians.areas[before][seen] / (width * depth[seen]) ** 2
    depths = np.bincount(columns[seen] @ (1, GRID), np.minimum(thick, GRID ** 2), GRID ** 2)
    return float(np.mean(-np.expm1(-depths)))


def _places(up):
    """Directions to the camera and distances in radii, the usual ones first"""
    front = front_of(up)
    for distance in DISTANCES:
        for elevation in map(math.radians, ELEVATIONS):
            for azimuth in map(math.radians, AZIMUTHS):
                level = rotated(front, up, azimuth)
                yield math.cos(elevation) * level + math.sin(elevation) * up, distance


def _common_normal(gaussians, near, most):
    """The normal that most of the area of flat Gaussians has, such as of a floor, or None

    most: area of one, so that a wide one does not decide alone
    """
    normals, areas = gaussians.normals[near], np.minimum(gaussians.areas[near], most)
    tried = normals[::max(1, len(normals) // TRIED)]
    votes = areas @ (np.abs(normals @ tried.T) > EVEN)
    normal = tried[int(np.argmax(votes))]
    for _ in range(2):
        along = normals @ normal
        same = np.abs(along) > EVEN
        normal = unit((areas * np.sign(along))[same] @ normals[same])
    return normal if areas[same].sum() > FLOOR * areas.sum() else None


def _levelling(normal):
    """[3, 3] rotation that turns the normal to the nearest axis"""
    if normal is None:
        return np.eye(3)
    nearest = int(np.argmax(np.abs(normal)))
    axis = np.eye(3)[nearest] * np.sign(normal[nearest])
    pivot = np.cross(normal, axis)
    angle = math.atan2(np.linalg.norm(pivot), normal @ axis)
    return np.stack([rotated(e, unit(pivot), angle) for e in np.eye(3)], axis=1)


def _upright(samples, gaussians, scene):
    """-> Up: of what is near the subject, since a sky and trees far away say nothing of the ground, in
    axes along the ground, since those of most captures are those of a camera."""
    near = np.linalg.norm(gaussians.points - scene.center, axis=1) < GROUND * scene.radius
    level = _levelling(_common_normal(gaussians, near, scene.radius ** 2))
    around = copy.copy(samples)
    for found in ("profiles", "facing", "sizes"):  # of all of the capture
        vars(around).pop(found, None)
    around.points = gaussians.points[near] @ level.T
    around.opacities = gaussians.opacities[near]
    around.areas, around.two_sided = np.zeros_like(around.points), np.ones(near.sum(), bool)
    around.low, around.high = around.points.min(axis=0), around.points.max(axis=0)
    up = find_up(around)
    return up._replace(axis=up.axis @ level)


def scene_view(samples):
    """-> position, focal point, Up, tangents of the angles to the sides and up, and whether the camera
    sees the subject all the way around; or None"""
    gaussians = _Gaussians(samples)
    scene = _find_scene(gaussians)
    if scene is None:
        return None
    up = _upright(samples, gaussians, scene)
    places = list(_places(up.axis))
    lost = np.array([_in_the_way(gaussians, scene, direction, up.axis, distance * scene.radius)
                     for direction, distance in places])
    chosen = int(np.argmax(1 - lost >= AS_GOOD * (1 - lost.min())))
    direction, distance = places[chosen]
    first = chosen - chosen % len(AZIMUTHS)
    is_free = bool((1 - lost[first:first + len(AZIMUTHS)] >= FREE * (1 - lost.min())).all())
    tangent = min(MARGIN / distance, WIDEST)
    return (scene.center + distance * scene.radius * direction, scene.center, up,
            (4 / 3 * tangent, tangent), is_free)
