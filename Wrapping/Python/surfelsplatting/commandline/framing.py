# SPDX-License-Identifier: BSD-3-Clause
"""A view that fits a cloud: bounds without stray points, the up direction, the position."""

import math
from dataclasses import replace

import numpy as np

from ..backend import vtk
from .cameras import are_parallel, check_view
from .problems import UserProblem

vtk_to_numpy = vtk("util.numpy_support").vtk_to_numpy

SAMPLES = 200_000
MARGIN = 0.92  # the fraction of the picture that the cloud fills
AZIMUTH, ELEVATION = math.radians(30), math.radians(22)
MIDDLE = 0.25  # half-height of the picture's middle over the half-height of the picture
FLAT = 0.35  # thickness over width below which a cloud is a terrain
OPEN = 0.05  # net area over area above which a surface has an open side


class Samples:
    """Up to SAMPLES surfels without stray ones: centres in the world and area vectors."""

    def __init__(self, surfels):
        data = surfels.GetPointData()
        count = surfels.GetNumberOfPoints()
        some = slice(0, count, max(1, count // SAMPLES))
        points = _doubles(surfels.GetPoints().GetData())[some]
        areas = _doubles(data.GetArray("SurfelAreaVector"))[some]
        origin = surfels.GetFieldData().GetArray("SurfelOrigin")
        if origin and origin.GetNumberOfValues() == 3:  # others are ignored, as by the filters
            points += _doubles(origin).ravel()
        two_sided = data.GetArray("SurfelTwoSided")
        self.two_sided = (vtk_to_numpy(two_sided)[some].astype(bool) if two_sided
                          else np.zeros(len(points), bool))
        keep = np.isfinite(points).all(axis=1) & np.isfinite(areas).all(axis=1)
        keep &= _near_the_bulk(points, keep)
        self.points, self.areas = points[keep], areas[keep]
        self.radius = _typical_radius(data.GetArray("SurfelCovariance"), some, keep)
        self.two_sided = self.two_sided[keep]
        self.low, self.high = self.points.min(axis=0), self.points.max(axis=0)

    @property
    def center(self):
        return (self.low + self.high) / 2

    @property
    def extent(self):
        return self.high - self.low


def _doubles(array):
    """Values of a damaged file may be signalling NaNs, which casts warn of."""
    with np.errstate(invalid="ignore"):
        return vtk_to_numpy(array).astype(np.float64)


def _near_the_bulk(points, finite):
    """Which points lie within half a width of the box that holds the middle 96 % on every axis."""
    if not finite.any():
        raise UserProblem("none of the surfels has finite values; nothing can be drawn")
    low, high = np.percentile(points[finite], (2, 98), axis=0)
    # The largest width for all axes, so that the noise of a flat thing is not cut off.
    slack = 0.5 * max((high - low).max(), 1e-30)
    with np.errstate(invalid="ignore"):
        return ((points >= low - slack) & (points <= high + slack)).all(axis=1)


def _typical_radius(covariances, some, keep):
    """Two standard deviations of a kernel; gives a cloud of one point an extent."""
    if not covariances:
        return 0.0
    trace = _doubles(covariances)[some, :3][keep].sum(axis=1)
    trace = trace[np.isfinite(trace) & (trace > 0)]
    return 2 * math.sqrt(np.median(trace)) if len(trace) else 0.0


def _unit(vector):
    return vector / max(np.linalg.norm(vector), 1e-300)


def _up_of_openings(samples):
    """Objects are rarely scanned from below, so the sum of the area vectors points up."""
    one_sided = samples.areas[~samples.two_sided]
    total = np.linalg.norm(one_sided, axis=1).sum()
    net = one_sided.sum(axis=0)
    axis = int(np.argmax(np.abs(net)))
    if total == 0 or net[axis] < OPEN * total or axis == 0:
        return None
    return np.eye(3)[axis]


def up_axis(samples):
    """A terrain's normal; away from an open bottom; otherwise y, as is usual for models."""
    thin = int(np.argmin(samples.extent))
    if thin != 0 and samples.extent[thin] < FLAT * np.delete(samples.extent, thin).min():
        return np.eye(3)[thin]
    up = _up_of_openings(samples)
    return np.array([0.0, 1.0, 0.0]) if up is None else up


def _directions(up):
    """Directions to the camera: the usual side first, then in steps of 45 degrees around."""
    front = np.array([0.0, -1.0, 0.0]) if abs(up[2]) > 0.7 else np.array([0.0, 0.0, 1.0])
    front = _unit(front - (front @ up) * up)
    right = np.cross(up, front)
    for turn in range(8):
        angle = AZIMUTH + turn * math.pi / 4
        level = math.cos(angle) * front + math.sin(angle) * right
        yield math.cos(ELEVATION) * level + math.sin(ELEVATION) * up


def _three_quarter_direction(samples, up):
    """From the object to the lens: the usual side, unless another one shows much more."""
    def facing(direction):
        projected = samples.areas @ direction
        return np.where(samples.two_sided, np.abs(projected), np.maximum(projected, 0)).sum()

    directions = list(_directions(up))
    shown = [facing(direction) for direction in directions]
    best = int(np.argmax(shown))
    return directions[best] if shown[best] > 1.5 * shown[0] else directions[0]


def _fit(samples, direction, up, view):
    """-> position, focal point: as near as possible with all samples inside the picture."""
    right = np.cross(up, direction)
    right /= np.linalg.norm(right)
    above = np.cross(direction, right)
    tan_y = MARGIN * math.tan(math.radians(view.view_angle) / 2)
    tan_x = tan_y * view.size[0] / view.size[1]
    local = samples.points - samples.center
    x, y, z = local @ right, local @ above, local @ direction
    shift = np.zeros(2)
    distance = 0.0
    for _ in range(3):
        reach = np.maximum((np.abs(x - shift[0]) + samples.radius) / tan_x,
                           (np.abs(y - shift[1]) + samples.radius) / tan_y) + z
        nearest = 1e-3 * max(np.ptp(z), np.ptp(x), 1e-9 * np.abs(samples.center).max(), 1e-12)
        distance = max(reach.max(), z.max() + nearest)
        # The middle of the visible part moves with the distance.
        depth = distance - z
        for i, along in enumerate((x, y)):
            slope = (along - shift[i]) / depth
            shift[i] += 0.5 * (slope.min() + slope.max()) * distance
    focal_point = samples.center + shift[0] * right + shift[1] * above
    return focal_point + distance * direction, focal_point


def _sensor_directions(cloud):
    """-> for a depth image: the direction to the sensor, and up in the image."""
    points = vtk_to_numpy(cloud.data.GetPoints().GetData()).astype(np.float64)
    rays = points - np.asarray(cloud.viewpoint)
    rows = np.arange(len(rays)) // cloud.columns
    keep = np.isfinite(rays).all(axis=1) & (np.linalg.norm(rays, axis=1) > 0)
    rays, rows = rays[keep], rows[keep]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    forward = _unit(rays.mean(axis=0))
    down = (rows - rows.mean()) @ rays
    return -forward, _unit(-(down - (down @ forward) * forward))


def _other_than(up, direction):
    """Up, or another axis if up is nearly the view direction."""
    if not are_parallel(up, direction, sine=0.1):
        return up
    return np.eye(3)[int(np.argmin(np.abs(direction)))]


def surface_in_the_middle(samples, position, focal_point, view):
    """Distance along the view direction to the front of the surface in the middle of the picture,
    on which a photographer would focus."""
    forward = _unit(focal_point - position)
    local = samples.points - position
    depth = local @ forward
    off_axis = np.linalg.norm(local - np.outer(depth, forward), axis=1)
    window = MIDDLE * math.tan(math.radians(view.view_angle) / 2) * depth
    facing = samples.two_sided | (samples.areas @ forward < 0)
    in_the_middle = depth[(depth > 0) & (off_axis < window) & facing]
    return float(np.percentile(in_the_middle, 20)) if len(in_the_middle) else 0.0


def complete_view(view, cloud, surfels):
    """The view; everything that was not given is derived from the cloud."""
    if view.position and view.focal_point and view.view_up:
        return view
    samples = Samples(surfels)
    if cloud.viewpoint and cloud.columns and not view.view_up:
        direction, up = _sensor_directions(cloud)
    else:
        up = _unit(np.asarray(view.view_up)) if view.view_up else up_axis(samples)
        direction = _three_quarter_direction(samples, up)
    position, focal_point = _fit(samples, direction, up, view)
    if view.position:
        focal_point = np.asarray(view.focal_point or samples.center)
        position = np.asarray(view.position)
    elif view.focal_point:
        position = position - focal_point + np.asarray(view.focal_point)
        focal_point = np.asarray(view.focal_point)
    if not view.view_up:
        up = _other_than(up, focal_point - position)
    focal_distance = view.focal_distance
    if focal_distance == 0 and not view.position and not view.focal_point:
        focal_distance = surface_in_the_middle(samples, position, focal_point, view)
    completed = replace(view, position=tuple(map(float, position)),
                        focal_distance=focal_distance,
                        focal_point=tuple(map(float, focal_point)),
                        view_up=tuple(map(float, up)))
    check_view(completed)
    return completed
