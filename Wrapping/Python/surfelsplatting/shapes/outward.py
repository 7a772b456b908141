# SPDX-License-Identifier: BSD-3-Clause
"""Turns parts of meshes and clouds whose normals point inward, as a look from all around shows.

A part of which hardly more than the back is seen from outside is inside out, whatever it meets or
is inside of. So are rooms, which stay.
"""

import math
from itertools import product

import numpy as np

from ..backend import vtk
from ..clouds.parts import parts_of_points
from ..clouds.polydata import polydata_of
from ..notes import note_sheet
from ..vtkarrays import named_array, to_numpy
from .rooms import FLAT, HEIGHTS, LEAST, UPRIGHT, profile_of
from .surfaces import Surface

# Axes, diagonals of faces and of the cube: a look along each, from both ends.
LINES = np.array([line for line in product((-1, 0, 1), repeat=3) if line > (0, 0, 0)], float)
PER_PIXEL = 5.0  # points of a surface in a pixel, if it faces the viewer: few look through it
MOST_PIXELS = 1024  # along the longest side
VOXELS = 0.125  # along the longest side, over the root of the number of points: a voxel has many
VOXELS_PER_AREA = 1.5  # that a surface of the area of a voxel's side meets
LEAST_SEEN = 0.1  # cosines per point; less is what is seen between other points, and 0.9 all around
# Part of what is seen of a part that is its back. A bowl has 0.35 or 0.65. A box without its lid
# that faces inward has 0.67 to 0.84: what looks like a room must be closed.
MOSTLY, NEARLY = 0.75, 0.86
OPEN = 0.3  # net area over area, from which on a part is open; a box without its lid has 0.2
CHANCE = 0.5  # over the root of what is seen: of two faces in one place either may be nearest
HALF_UPRIGHT = 0.5  # least part of the area of a room with much in it that is level or upright
CONTENT = 0.02  # part of the area, of what is in a room
# Part of what is seen of the content from which on it faces outward, or inward. A bowl has 0.65. The
# walls between solids that touch are seen from both sides alike.
CLEARLY = 0.6
MOST_SAMPLES = 100_000  # of a mesh of many parts, that are looked at
MOST_POINTS = 20_000  # of a cloud, which take 40 ms; a part of it may have a hundredth of them
FEWEST_POINTS = 100
FEW_BACKS = 0.02  # of what is seen of a cloud; parts are looked for if there is more
SHEET = 0.9  # net area over area of a mesh, from which on it is a sheet; a hemisphere has 0.5
REACH = 4.0  # spacings, from which on there is a gap between parts, about


def _area(places):
    """Of the surface, about."""
    low, high = places.min(axis=0), places.max(axis=0)
    count = int(np.ceil(VOXELS * np.sqrt(len(places))))
    size = max((high - low).max(), 1e-300) / count
    voxels = ((places - low) / size).astype(np.int64) @ ((count + 1) ** 2, count + 1, 1)
    return len(np.unique(voxels)) * size * size / VOXELS_PER_AREA


def _frame(line):
    """-> [3, 3] columns: two axes across the line, and it"""
    line = line / np.linalg.norm(line)
    across = np.cross(line, np.eye(3)[np.argmin(np.abs(line))])
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(line, across), line])


def _both_ends(seen, pixel):
    """-> [m], [m] numbers of the points that are nearest in their pixels, from either end of the z
    axis. seen: [n, 3]"""
    seen = seen - seen.min(axis=0)
    columns = (seen[:, :2] / pixel).astype(np.int64)
    cells = columns[:, 0] * (columns[:, 1].max() + 1) + columns[:, 1]
    depths = seen[:, 2] / max(seen[:, 2].max(), 1e-300) * np.iinfo(np.uint16).max
    order = np.argsort(depths.astype(np.uint16), kind="stable")  # 16 bits are sorted in two passes
    nearest = np.full((2, cells.max() + 1), -1)
    nearest[0, cells[order]] = order  # the last one stays
    nearest[1, cells[order[::-1]]] = order[::-1]
    return (row[row >= 0] for row in nearest)


def _looks(places, normals):
    """-> [2, n] sums of the cosines under which each point is seen from its front, and its back"""
    looks = np.zeros((2, len(places)))
    pixel = max(np.sqrt(PER_PIXEL * _area(places) / len(places)),
                np.ptp(places, axis=0).max() / MOST_PIXELS, 1e-300)
    for line in LINES:
        frame = _frame(line)
        slopes = normals @ frame[:, 2]
        for nearest, slope in zip(_both_ends(places @ frame, pixel), (slopes, -slopes)):
            looks[0, nearest] += np.maximum(slope[nearest], 0)
            looks[1, nearest] += np.maximum(-slope[nearest], 0)
    return looks


def _shares(looks, parts):
    """-> [m] part of what is seen of each part that is its back, less what may be chance; 0 of what is
    hidden; [m] whether it is"""
    counts = np.bincount(parts)
    front, back = (np.bincount(parts, row) for row in looks)
    seen = front + back
    is_hidden = seen <= LEAST_SEEN * counts
    shares = back / np.maximum(seen, 1e-300) - CHANCE / np.sqrt(np.maximum(seen, 1e-300))
    return np.where(is_hidden, 0, shares), is_hidden


def _are_closed(normals, parts):
    """-> [m] whether the areas of each part cancel"""
    sums = np.column_stack([np.bincount(parts, column) for column in normals.T])
    return np.linalg.norm(sums, axis=1) <= OPEN * np.bincount(parts)


def _profiles(places, normals):
    """-> Profile of a shell along each axis"""
    shell = Surface(places, normals, np.zeros(len(places), bool))
    return [profile_of(shell, axis) for axis in range(3)]


def _may_be_open_room(places, normals):
    """Whether nearly all is level or a wall, and some of it a floor, or a ceiling."""
    return any(profile.upright >= UPRIGHT and max(profile.floor, profile.ceiling) >= LEAST
               for profile in _profiles(places, normals)[1:])


def _is_room(places, normals, in_shell, in_content):
    """Whether a shell that faces inward has floor, ceiling and walls, and things inside that face
    outward, or, if they do not tell, the height of a room in metres or feet, and a longer side."""
    ends = [axis for axis, profile in enumerate(_profiles(places[in_shell], normals[in_shell]))
            if min(profile.floor, profile.ceiling) >= LEAST and profile.upright >= HALF_UPRIGHT]
    if {1, 2}.isdisjoint(ends):
        return False
    if np.mean(in_content) >= CONTENT:
        front, back = _looks(places[in_content], normals[in_content]).sum(axis=1)
        if max(front, back) >= CLEARLY * (front + back):
            return front > back
    extent = np.ptp(places[in_shell], axis=0)
    return len(ends) > 1 and any(
        HEIGHTS[0] <= extent[axis] <= min(HEIGHTS[1], FLAT * extent.max()) for axis in ends if axis)


def inward_parts(places, normals, parts, looks, is_mesh):
    """-> [m] whether each part is inside out

    places, normals: [n, 3] evenly spread points of a surface, and unit vectors
    parts: [n] whole numbers from 0, of connected parts whose normals are consistent
    looks: [2, n] as _looks
    is_mesh: parts of others are turned only if they are closed
    """
    shares, is_hidden = _shares(looks, parts)
    found = shares > MOSTLY
    in_shell = found[parts]
    if not is_mesh or (found.any() and _may_be_open_room(places[in_shell], normals[in_shell])):
        found = shares > NEARLY
        in_shell = found[parts]
        is_one_shell = is_mesh and _are_closed(normals[in_shell], 0 * parts[in_shell]).all()
        if not is_one_shell:  # lone walls, and what is behind windows, may face inward
            found &= _are_closed(normals, parts)
    if found.any() and _is_room(places, normals, found[parts], is_hidden[parts]):
        return np.zeros(len(found), bool)
    return found


def _inward_of_mesh(places, normals, cloud):
    """-> [n] whether the normals of a mesh are to be turned, and what to say of it"""
    step = math.ceil(len(places) / MOST_SAMPLES)
    some, facing, parts = places[::step], normals[::step], cloud.parts[::step]
    is_inward = np.zeros(cloud.parts.max() + 1, bool)
    is_inward[:parts.max() + 1] = inward_parts(some, facing, parts, _looks(some, facing), True)
    return is_inward[cloud.parts], ("parts that were inside out, and are turned: "
                                    f"{np.count_nonzero(is_inward)} of {len(is_inward)}")


def _nearest_of(places, values, wanted):
    """-> [m] values of the nearest of the places. values: [n]; wanted: [m, 3]"""
    nearest = vtk("vtkFiltersPoints").vtkPointInterpolator()
    nearest.SetKernel(vtk("vtkFiltersPoints").vtkVoronoiKernel())
    nearest.SetSourceData(polydata_of(places, {"value": values}))
    nearest.SetInputData(polydata_of(wanted, {}))
    nearest.Update()
    found = nearest.GetOutput().GetPointData().GetArray("value")
    return to_numpy(found)


def _inward_of_points(places, normals, _cloud):
    """-> [n] whether the normals of other points are to be turned, and what to say of it"""
    lengths = np.linalg.norm(normals, axis=1)
    usable = np.flatnonzero(np.isfinite(places).all(axis=1) & np.isfinite(lengths) & (lengths > 0))
    chosen = usable
    if len(usable) > MOST_POINTS:  # at random: every so many of a grid are rows of it
        chosen = np.random.default_rng(1).choice(usable, MOST_POINTS, replace=False)
    is_inward = np.zeros(len(places), bool)
    if len(chosen) < FEWEST_POINTS:
        return is_inward, ""
    some, facing = places[chosen].astype(float), normals[chosen] / lengths[chosen, None]
    looks = _looks(some, facing)
    front, back = looks.sum(axis=1)
    if back > FEW_BACKS * front:
        parts = parts_of_points(some, REACH / 2 * np.sqrt(_area(some) / len(some)))
        found = inward_parts(some, facing, parts, looks, False)
        if found.any():
            is_inward[usable] = _nearest_of(some, found[parts].astype(float), places[usable]) > 0
    return is_inward, (f"the normals of {100 * np.mean(is_inward):.0f} % of the points point inward, and "
                       "are turned; --sides given keeps them")


@np.errstate(all="ignore")  # values that are not finite warn
def turn_outward(cloud):
    """Turns the normals of a Cloud where they are those of a mesh or of a closed surface, and point
    inward, and says so in `how`. Where the place of the sensor is known, they stay. A mesh that is a
    sheet, such as a plane or a terrain, has no outside, and is seen from both sides."""
    arrays = cloud.data.GetPointData()
    array = arrays.GetNormals() or arrays.GetArray("Normals")
    if cloud.is_drawable or cloud.is_volume or cloud.viewpoint or cloud.columns or array is None:
        return
    normals = to_numpy(array)
    if normals.shape[1:] != (3,) or normals.dtype.kind != "f":
        return
    if cloud.parts is not None and np.linalg.norm(normals.mean(axis=0)) >= SHEET:
        points = cloud.data.NewInstance()  # who gave them may need them
        points.ShallowCopy(cloud.data)
        note_sheet(points)
        cloud.data = points
        return
    inward_of = _inward_of_points if cloud.parts is None else _inward_of_mesh
    is_inward, what = inward_of(to_numpy(cloud.data.GetPoints().GetData()), normals, cloud)
    if not is_inward.any():
        return
    turned = np.where(is_inward[:, None], -normals, normals)
    points = cloud.data.NewInstance()  # who gave them may need them
    points.ShallowCopy(cloud.data)
    points.GetPointData().SetNormals(named_array(array.GetName(), turned, normals.dtype))
    cloud.data = points
    cloud.how = "; ".join(filter(None, [cloud.how, what]))
    cloud.is_unsure = cloud.is_unsure or cloud.parts is None
