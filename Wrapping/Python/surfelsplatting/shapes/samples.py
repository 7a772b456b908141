# SPDX-License-Identifier: BSD-3-Clause
"""Some surfels of a cloud without stray ones, of which a view is found."""

import math
from functools import cached_property

import numpy as np

from ..notes import is_model
from ..problems import UserProblem
from ..vtkarrays import to_numpy
from .directions import lengths
from .rooms import facing_of, profile_of
from .surfaces import Surface

FAR = 4.0  # x and y over the diagonal of a cloud that is far from the origin
LARGEST_CLOUD = 1e15  # the camera is farther away, and squares must stay in float's range
SAMPLES = 100_000
ENOUGH = 50_000  # for shares within one percent; what is up is told of them within 50 ms
KEYS = 9 << 29  # of points, and an eighth more, so that enough are among the smallest
STEP = 0.1  # of the width of a box that grows
SPARSE = 4.0  # times the usual distance between points
ALONE = 2e-5  # part of the points, of strays that are left


class Samples(Surface):
    """Some surfels, about `most`, without stray ones: centres in the world and area vectors; of
    volumes also the integrals over space of the extinction for which each stands, of captures the
    opacities."""

    def __init__(self, surfels, most=SAMPLES):
        points, areas, two_sided, covariances = (_stored_samples(surfels)
                                                 or _every_so_many(surfels, most))
        origin = surfels.GetFieldData().GetArray("SurfelOrigin")
        if origin and origin.GetNumberOfValues() == 3:  # others are ignored, as by the filters
            points += _doubles(origin).ravel()
        keep = _in_all(np.isfinite(points) & np.isfinite(areas))
        self.beyond = np.zeros((0, 3)), np.zeros(0)  # points and areas that are left out
        self.is_volume = bool(surfels.GetPointData().HasArray("GaussianExtinction"))
        self.is_capture = not self.is_volume and covariances is not None and bool(
            surfels.GetPointData().HasArray("GaussianOpacity"))
        if self.is_volume:
            keep &= _all_finite(keep)
            self.masses = _masses(surfels, covariances, most)[keep]
        elif self.is_capture:
            opacities = surfels.GetPointData().GetArray("GaussianOpacity")
            opacities = _doubles(opacities, _some_of(surfels, most))
            self.unfenced = points[keep], opacities[keep], covariances[keep]
            self.count = surfels.GetNumberOfPoints()
            keep &= _within_fences(points, keep)
            self.opacities = opacities[keep]
        else:
            finite, keep = keep, _near_the_bulk(points, areas, keep)
            beyond = finite & ~keep
            self.beyond = points[beyond], lengths(areas[beyond])
        self.up = _stored_up(surfels)
        self.is_model = is_model(surfels)
        super().__init__(np.compress(keep, points, axis=0), np.compress(keep, areas, axis=0),
                         two_sided[keep])
        self.covariances = (None if covariances is None else
                            np.compress(keep, covariances, axis=0))
        self.radius = 0.0 if covariances is None else _typical_radius(self.covariances)
        self.low, self.high = (np.array([end(x) for x in self.points.T]) for end in (np.min, np.max))
        # As in coordinates of a country. A model may be far off along one axis.
        farthest = np.maximum(np.abs(self.low), np.abs(self.high))
        self.is_far = bool(farthest[:2].min() > FAR * np.linalg.norm(self.extent))
        if farthest.max() > LARGEST_CLOUD:
            raise UserProblem(f"the cloud reaches to coordinates of {farthest.max():g}, and a view of it "
                              f"can be found up to {LARGEST_CLOUD:g} only; scale it down")

    @property
    def center(self):
        return (self.low + self.high) / 2

    @property
    def extent(self):
        return self.high - self.low

    @cached_property
    def some(self):
        """-> Surface of them, enough for shares and directions; of the same extent"""
        step = max(1, len(self.points) // ENOUGH)
        some = Surface(*(np.ascontiguousarray(rows[::step])  # three times as fast to read
                         for rows in (self.points, self.areas, self.two_sided)))
        some.extent = self.extent
        return some

    @cached_property
    def profiles(self):
        """-> Profile along each axis"""
        return [profile_of(self.some, axis) for axis in range(3)]

    @cached_property
    def facing(self):
        """-> 1 if a closed surface faces outward, -1 inward, 0 if it is not closed"""
        return facing_of(self.some)

    @property
    def spacing(self):
        """Of the points on the surface: each has its area."""
        return math.sqrt(np.median(self.sizes))


def _stored_up(surfels):
    """-> what the file says is up, or None"""
    array = surfels.GetFieldData().GetArray("ScanUp")
    up = _doubles(array).ravel() if array else np.zeros(3)
    is_known = up.shape == (3,) and abs(up @ up - 1) < 1e-6  # not finite is not known
    return up if is_known else None


def _some_of(surfels, most):
    count = surfels.GetNumberOfPoints()
    return slice(0, count, max(1, count // most))


def _masses(surfels, covariances, most):
    """[n] of the Gaussians of a volume"""
    some = _some_of(surfels, most)
    xx, yy, zz, xy, yz, xz = covariances.T
    squares = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    extinctions = _doubles(surfels.GetPointData().GetArray("GaussianExtinction"), some)
    masses = extinctions * np.sqrt((2 * math.pi) ** 3 * np.maximum(squares, 0))
    return some.step * np.nan_to_num(masses, nan=0.0, posinf=0.0)


def _scattered(points, most):
    """Which points are samples, one of so many, as Core/Surfels/SurfelSamples.h chooses them for files: those
    with the smallest keys of their coordinates, of equal ones the first. So a hierarchy, which has them in
    another order than the points it was made of, has the same."""
    count = len(points)
    step = max(1, count // most)
    if step == 1:
        return slice(None)
    with np.errstate(all="ignore"):  # doubles of damaged files
        x, y, z = np.asarray(points, np.float32).view(np.uint32).T
    key = x * np.uint32(0x9E3779B1) ^ y * np.uint32(0x85EBCA77) ^ z * np.uint32(0xC2B2AE3D)
    key ^= key >> np.uint32(15)
    key *= np.uint32(0x2C1B3C6D)
    some = np.flatnonzero(key < np.uint32(KEYS // step))
    wanted = -(-count // step)
    if len(some) < wanted:  # as of points that are all at one place
        return slice(0, count, step)
    keys = key[some].astype(np.uint64) << np.uint64(32) | some.astype(np.uint64)
    return some[keys <= np.partition(keys, wanted - 1)[wanted - 1]]


def _every_so_many(surfels, most):
    """-> points, area vectors, whether they are two-sided, covariances or None"""
    data = surfels.GetPointData()
    places = to_numpy(surfels.GetPoints().GetData())
    if data.HasArray("GaussianCovariance"):  # no surface, so that no direction is outside
        some = _some_of(surfels, most)
        points = _doubles_of(places[some])
        return (points, np.zeros_like(points), np.ones(len(points), bool),
                _doubles(data.GetArray("GaussianCovariance"), some))
    some = _scattered(places, most)
    points = _doubles_of(places[some])
    two_sided = data.GetArray("SurfelTwoSided")
    two_sided = (to_numpy(two_sided)[some].astype(bool) if two_sided
                 else np.zeros(len(points), bool))
    covariances = data.GetArray("SurfelCovariance")
    return (points, _doubles(data.GetArray("SurfelAreaVector"), some), two_sided,
            _doubles(covariances, some) if covariances else None)


def _stored_samples(surfels):
    """The same of a mapped file, which is not to be read as a whole; None for others."""
    array = surfels.GetFieldData().GetArray("SurfelSamples")
    if not array or array.GetNumberOfComponents() != 13 or array.GetNumberOfTuples() == 0:
        return None
    if surfels.GetPoints().GetData().GetMTime() > array.GetMTime():  # they were moved
        return None
    values = _doubles(array)
    return values[:, :3], values[:, 3:6], values[:, 6] != 0, values[:, 7:]


def _doubles_of(values):
    """Values of a damaged file may be signalling NaNs, which casts warn of."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def _doubles(array, some=slice(None)):
    return _doubles_of(to_numpy(array)[some])


def _in_all(of_axes):
    """[n, 3] -> [n] whether it is so on all axes; all(axis=1) takes four times as long."""
    return of_axes[:, 0] & of_axes[:, 1] & of_axes[:, 2]


def _within(points, low, high):
    with np.errstate(invalid="ignore"):
        x, y, z = ((values >= low[axis]) & (values <= high[axis])
                   for axis, values in enumerate(points.T))  # three times as fast as rows
    return x & y & z


def _near_the_bulk(points, areas, finite):
    """Which points lie in the box that holds the middle 90 % on every axis, or where the cloud goes on
    beyond it, about as densely: a thin trunk does, far returns of a scanner in a street do not."""
    if not finite.any():
        raise UserProblem("none of the surfels has finite values; nothing can be drawn")
    last = finite.sum() - 1
    ends = [math.floor(0.05 * last), math.ceil(0.95 * last)]  # so that few points are all inside
    low, high = np.stack([np.partition(values, ends)[ends]  # all axes at once take half as long again
                          for values in np.compress(finite, points, axis=0).T], axis=1)
    outside = finite & ~_within(points, low, high)
    sizes = lengths(areas)
    dense = sizes[outside] <= SPARSE**2 * np.median(sizes[finite])
    low, high = _grown(low, high, points[outside], dense, ALONE * finite.sum())
    return finite & _within(points, low, high)


def _grown(low, high, points, dense, least):
    """-> the box that grows in steps at each side with more than `least` points before it, of which
    half are dense; and by one step more, so that no edge and no noise is cut off."""
    box = np.stack([low, high])
    outward = (-1, 1)
    sides = [(end, axis) for axis in range(3) for end in (0, 1)]
    while sides:
        step = STEP * max(np.ptp(box, axis=0).max(), 1e-30)
        growing = []
        for end, axis in sides:
            near = _within(points, box[0] - step, box[1] + step)
            near &= outward[end] * (points[:, axis] - box[end, axis]) > 0
            count = near.sum()
            if count > least and 2 * dense[near].sum() >= count:
                box[end, axis] += outward[end] * step
                growing.append((end, axis))
        sides = growing
    return box[0] - step, box[1] + step


def _all_finite(finite):
    """Volumes have no stray Gaussians."""
    if not finite.any():
        raise UserProblem("none of the Gaussians has finite values; nothing can be drawn")
    return finite


def _within_fences(points, finite):
    """Which Gaussians of a capture lie within Tukey's fences, one and a half interquartile ranges
    beyond the quartiles, on every axis. Captures have many stray ones, and a sky far away. Where
    nearly nothing is beyond two ranges, these are the fences: a guitar has a long neck."""
    _all_finite(finite)
    low, high = np.percentile(points[finite], (25, 75), axis=0)
    # The largest range for all axes, as above.
    slack = max((high - low).max(), 1e-30)
    with np.errstate(invalid="ignore"):
        beyond = np.maximum(low - points, points - high).max(axis=1) / slack
        return beyond <= (2.0 if np.mean(beyond[finite] > 2) < 0.001 else 1.5)


def _typical_radius(covariances):
    """Two standard deviations of a kernel; gives a cloud of one point an extent."""
    xx, yy, zz = covariances[:, :3].T
    trace = xx + yy + zz
    trace = trace[np.isfinite(trace) & (trace > 0)]
    return 2 * math.sqrt(np.median(trace)) if len(trace) else 0.0
