# SPDX-License-Identifier: BSD-3-Clause
"""From where the sensor of a depth image has seen the points."""

import math
from dataclasses import astuple, dataclass, replace
from typing import Optional

import numpy as np

from ..vtkarrays import named_array, to_numpy
from .directions import unit

# Field arrays, one for each value of Sensor; see DataContract.md.
ARRAYS = ("ScanSensorPlace", "ScanSensorDirection", "ScanSensorUp", "ScanSensorSpread")
SAMPLES = 100_000
OFF = 0.02  # largest rms angle between the rays and those of a camera, radians
ROUNDING = 1e-6  # of directions to points whose coordinates are floats
UNKNOWN = 1e-7  # share of the variance below which the rays fit several cameras
LARGEST_SPREAD = math.tan(math.radians(60))  # what is wider looks stretched in a picture


@dataclass
class Sensor:
    place: np.ndarray
    direction: np.ndarray  # from what it has seen to the sensor
    up: np.ndarray  # in the image, perpendicular to that
    spread: Optional[np.ndarray] = None  # tangents of the angles to the sides of its image, and to
    # top and bottom; None if no picture can show all of it

    def angle(self, size):
        """The vertical angle, degrees, of a picture that shows the whole image."""
        across, along = self.spread
        return math.degrees(2 * math.atan(max(along, across * size[1] / size[0])))

    def placed(self, view):
        """The view from the place of the sensor, as wide as its image; what is given stays."""
        point = self.place - self.direction
        return replace(view, position=tuple(map(float, self.place)),
                       focal_point=view.focal_point or tuple(map(float, point)),
                       view_up=view.view_up or tuple(map(float, self.up)),
                       view_angle=view.view_angle or self.angle(view.size))


def _rays(cloud):
    """-> unit vectors from the sensor to some points, and these points' columns and rows"""
    count = cloud.data.GetNumberOfPoints()
    # A step that shares no divisor with the columns samples all of them.
    step = max(1, count // SAMPLES)
    while math.gcd(step, cloud.columns) > 1:
        step += 1
    ids = np.arange(0, count, step)
    points = to_numpy(cloud.data.GetPoints().GetData())[ids].astype(np.float64)
    rays = points - np.asarray(cloud.viewpoint)
    length = np.linalg.norm(rays, axis=1)
    keep = np.isfinite(length) & (length > 0)
    ids = ids[keep]
    return rays[keep] / length[keep, None], ids % cloud.columns, ids // cloud.columns


def _are_in_a_plane(rays):
    return bool(np.linalg.eigvalsh(rays.T @ rays)[0] < ROUNDING ** 2 * len(rays))


def _camera_of(rays, columns, rows):
    """-> [3, 3] C, so that the ray of a pixel is C (x, y, 1), where x and y go from -1 to 1 over the
    image; None if they are the rays of no camera with a plane image.

    The least squares of what is perpendicular to the rays, |(I - r r^T) C (x, y, 1)|^2.
    """
    pixels = np.stack([columns, rows, np.ones(len(rays))], axis=1)
    products = np.einsum("ni,nj->nij", rays, pixels).reshape(-1, 9)
    normal = np.kron(np.eye(3), pixels.T @ pixels) - products.T @ products
    values, vectors = np.linalg.eigh(normal)
    camera = vectors[:, 0].reshape(3, 3)
    modelled = pixels @ camera.T
    modelled /= np.maximum(np.linalg.norm(modelled, axis=1), 1e-300)[:, None]
    cosines = np.einsum("ni,ni->n", rays, modelled)
    camera *= np.sign(cosines.sum())
    off = np.sqrt(np.mean(1 - np.minimum(cosines ** 2, 1)))
    return camera if values[1] > UNKNOWN * values.sum() and off < OFF else None


def _rounded(vector):
    """The unit vector without what is less than a float's rounding error."""
    vector = unit(vector)
    return unit(np.where(np.abs(vector) < ROUNDING, 0.0, vector))


def _spread(camera, forward, up):
    """-> tangents of the angles to the sides of the image and to top and bottom, or None"""
    corners = np.array([(x, y, 1) for x in (-1, 1) for y in (-1, 1)]) @ camera.T
    depth = corners @ forward
    if depth.min() <= 0:
        return None
    spread = np.array([np.abs(corners @ axis / depth).max()
                       for axis in (np.cross(forward, up), up)])
    return spread if spread.max() < LARGEST_SPREAD else None


def _sensor_of_rows(cloud):
    """-> Sensor of a depth image, or None if too few of its pixels saw anything, or if it would see a
    plane from its edge: then the place of the sensor was not written."""
    rays, columns, rows = _rays(cloud)
    if len(rows) and np.ptp(rows) > 0 and _are_in_a_plane(rays):
        return None
    heights = cloud.data.GetNumberOfPoints() // cloud.columns
    columns, rows = (2 * (columns + 0.5) / cloud.columns - 1, 2 * (rows + 0.5) / heights - 1)
    camera = _camera_of(rays, columns, rows)
    if camera is None:  # as of a scanner that turns
        direction, up = -rays.mean(axis=0), (rows.mean() - rows) @ rays
    else:
        direction, up = -camera[:, 2], -camera[:, 1]
    direction = _rounded(direction)
    up = up - (up @ direction) * direction
    if np.linalg.norm(up) < ROUNDING * len(rays):  # all of it is in one row
        up = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    up = _rounded(up)
    if not np.allclose(np.linalg.norm([direction, up], axis=1), 1):
        return None
    spread = None if camera is None else _spread(camera, -direction, up)
    return Sensor(np.asarray(cloud.viewpoint, np.float64), direction, up, spread)


def _sensor_of_image(cloud):
    """-> Sensor of a depth image that is not in rows, at the origin. It looks at the middle of what
    it has seen, which is a part of its image if somebody has cut it out."""
    forward, up = cloud.image
    right = np.cross(forward, up)
    points = to_numpy(cloud.data.GetPoints().GetData()).astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        slopes = points @ np.stack([right, up], axis=1) / (points @ forward)[:, None]
    slopes = slopes[np.isfinite(slopes).all(axis=1)]
    middle = (slopes.min(axis=0) + slopes.max(axis=0)) / 2
    looks = unit(forward + middle @ [right, up])
    above = unit(up - (up @ looks) * looks)
    rays = slopes @ [right, up] + forward
    spread = np.array([np.abs(rays @ axis / (rays @ looks)).max()
                       for axis in (np.cross(looks, above), above)])
    return Sensor(np.zeros(3), _rounded(-looks), _rounded(above), spread)


def _sensor_of(cloud):
    """-> Sensor that a file tells, or None"""
    if cloud.image:
        return _sensor_of_image(cloud)
    return _sensor_of_rows(cloud) if cloud.viewpoint and cloud.columns else None


def _values_of(surfels, name, count):
    """-> [count] of a field array, or None if it is missing or damaged"""
    array = surfels.GetFieldData().GetArray(name)
    if not array or array.GetNumberOfValues() != count or array.GetDataTypeAsString() != "double":
        return None
    values = to_numpy(array).ravel().astype(np.float64)
    return values if np.isfinite(values).all() else None


def _kept_sensor(surfels):
    """-> Sensor that keep_sensor wrote, or None"""
    place, direction, up, spread = (_values_of(surfels, name, count)
                                    for name, count in zip(ARRAYS, (3, 3, 3, 2)))
    if direction is None or up is None:
        return None
    axes = np.array([direction, up])
    if not np.allclose(axes @ axes.T, np.eye(2), atol=1e-6):
        return None
    if place is None:  # as of hierarchies that were written before it was kept
        return Sensor(np.zeros(3), direction, up)
    if spread is not None and not 0 < spread.min() <= spread.max() < LARGEST_SPREAD:
        spread = None
    return Sensor(place, direction, up, spread)


def sensor_of(cloud, surfels):
    """-> Sensor of a depth image, or None for other clouds.

    The surfels of a depth image are not in rows; keep_sensor has written for them what is known.
    """
    if cloud.image or (cloud.viewpoint and cloud.columns):
        return _sensor_of(cloud)
    return _kept_sensor(surfels)


def keep_sensor(cloud, surfels):
    """Writes into the surfels of a depth image from where its sensor has seen it."""
    sensor = _sensor_of(cloud)
    for name, values in zip(ARRAYS, astuple(sensor) if sensor else ()):
        if values is not None:
            surfels.GetFieldData().AddArray(named_array(name, values.reshape(1, -1)))
