# SPDX-License-Identifier: BSD-3-Clause
"""Points on the faces of meshes whose vertices do not tell the surface."""

from typing import NamedTuple, Optional

import numpy as np

from ..backend import vtk
from .colors import is_colors
from .parts import parts_of
from .polydata import cells_of, named_array, polydata_of

SAMPLES = 200_000  # points: about 2 px apart in the 800 x 600 px that pictures have by default
# Fewer are 4 px apart there or more, or 6 px where half of them are inside: fins, fingers and clothes
# are ragged, and neighbours across a gap are one.
FEW_VERTICES = SAMPLES // 4
MODEL_VERTICES = 20_000  # modelling programs make fewer, whose axes are known; scans have more
# Square root of the area of a face over the spacing that the vertices would have if they were
# spread evenly: 0.7 in an even mesh. If half of the area lies in faces above, it has hardly any
# points. Scans, sculptures and characters are at 1.6 at most; cars, rooms and CAD at 1.8 to 12.
COARSE = 1.7
MOST_VERTICES = SAMPLES  # of more, faces are not read: it would take seconds, and much memory
MIXED = 0.05  # part of the edges that two faces pass in the same direction, of a mesh without sides
TWINS = 0.25  # part of the faces that are where others are: a third to a half in foliage
AROUND = 12.0  # points around a wire: it is as round as its surfels can show
DENSER = 16.0, 8.0, 4.0, 2.0  # times as many points in the same area, at most
CREASE = 30.0  # degrees between faces, from which on the edge between them is sharp
# Multiples of these, modulo 1, fill the unit square evenly (Roberts' R2 sequence).
STEPS = 0.7548776662466927, 0.5698402909980532


class Sampled(NamedTuple):
    data: object  # vtkPolyData with points on the faces of one
    why: str
    parts: Optional[np.ndarray]  # [n] of the points, as parts_of; None if nothing tells their sides
    is_model: bool  # whether the mesh is one as modelling programs make


def _corners(cells):
    """-> numbers of points of all cells in a row, [n + 1] where cells begin and end; damaged cells
    are none."""
    to_numpy, kind = vtk("util.numpy_support").vtk_to_numpy, vtk("vtkCommonCore").vtkIdTypeArray
    corners, ends = kind(), kind()
    corners.DeepCopy(cells.GetConnectivityArray())  # VTK 9.7 has arrays that are formulas
    ends.DeepCopy(cells.GetOffsetsArray())
    corners, ends = to_numpy(corners), to_numpy(ends)
    if len(ends) < 2 or ends[0] < 0 or ends[-1] > len(corners) or (np.diff(ends) < 0).any():
        return np.zeros(0, np.int64), np.zeros(1, np.int64)
    return corners, ends


def _split(data, corners, ends):
    """-> [n, 3] triangles of polygons, which may be concave"""
    sizes = np.diff(ends)
    triangles = [corners[ends[:-1][sizes == 3, None] + np.arange(3)]]
    is_larger = sizes > 3
    if is_larger.any():
        polygons = vtk("vtkCommonDataModel").vtkPolyData()
        polygons.SetPoints(data.GetPoints())
        kept = corners[ends[0]:ends[-1]][np.repeat(is_larger, sizes)]
        polygons.SetPolys(cells_of(kept, np.append(0, np.cumsum(sizes[is_larger]))))
        split = vtk("vtkFiltersCore").vtkTriangleFilter()
        split.SetInputData(polygons)
        split.Update()
        triangles.append(_corners(split.GetOutput().GetPolys())[0].reshape(-1, 3))
    return np.concatenate(triangles)


def _unrolled(corners, ends):
    """-> [n, 3] triangles of strips"""
    place = np.arange(len(corners))
    strip = np.searchsorted(ends, place, side="right") - 1
    inside = (strip >= 0) & (strip < len(ends) - 1)
    place, strip = place[inside], strip[inside]
    place, strip = (a[place + 2 < ends[strip + 1]] for a in (place, strip))
    is_odd = (place - ends[strip]) % 2
    return corners[np.column_stack([place + is_odd, place + 1 - is_odd, place + 2])]


def _whole(corners, ends, is_good):
    """The cells all of whose points are good."""
    inside = (corners >= 0) & (corners < len(is_good))
    good = np.zeros(len(corners), bool)
    good[inside] = is_good[corners[inside]]
    before = np.append(0, np.cumsum(good))
    sizes = np.diff(ends)
    kept = before[ends[1:]] - before[ends[:-1]] == sizes
    rows = corners[ends[0]:ends[-1]][np.repeat(kept, sizes)]
    return rows, np.append(0, np.cumsum(sizes[kept]))


def _triangles(data, places):
    """-> [n, 3] numbers of points, [n, 3] twice the areas as vectors; of triangles that have one"""
    is_good = np.isfinite(places).all(axis=1)
    triangles = np.concatenate([
        _split(data, *_whole(*_corners(data.GetPolys()), is_good)),
        _unrolled(*_whole(*_corners(data.GetStrips()), is_good))])
    first, second, third = (places[triangles[:, i]] for i in range(3))
    vectors = np.cross(second - first, third - first)
    sizes = np.linalg.norm(vectors, axis=1)
    kept = np.isfinite(sizes) & (sizes > 0)
    return triangles[kept], vectors[kept]


def _coarseness(areas, count):
    """Of the face in the middle of the area, and with count vertices: see COARSE."""
    areas = np.sort(areas)
    sums = np.cumsum(areas)
    half = areas[np.searchsorted(sums, sums[-1] / 2)]
    return np.sqrt(half / sums[-1] * count)


def _what_lacks(places, triangles, areas):
    """-> what the vertices are too much or too little of to tell the surface, None if they do; whether
    the mesh is a model"""
    is_used = np.zeros(len(places), bool)
    is_used[triangles] = True
    count = np.count_nonzero(is_used)
    if count < len(places) / 2:
        return None, False  # a cloud with a few faces
    if count >= MODEL_VERTICES:  # faces that meet may have vertices of their own
        count = len(np.unique(places[is_used], axis=0))
    is_coarse = _coarseness(areas, count) > COARSE
    lacks = "few" if count < FEW_VERTICES else "uneven" if is_coarse else None
    return lacks, count < MODEL_VERTICES or is_coarse


def _weighed(areas, corners, parts, count):
    """-> areas, larger in parts around which fewer than AROUND points would fit of so many on all: wires
    and rods would be dashes otherwise. Others lose a third of their points at most.

    corners: [n, 3, 3]. parts: [n] numbers. Within a part all points are as far apart.
    """
    order = np.argsort(parts, kind="stable")
    begins = np.flatnonzero(np.diff(parts[order], prepend=-1))
    low, high = corners.min(axis=1)[order], corners.max(axis=1)[order]
    extents = np.maximum.reduceat(high, begins) - np.minimum.reduceat(low, begins)
    lengths = np.maximum(np.linalg.norm(extents, axis=1), 1e-300)
    girths = np.add.reduceat(areas[order], begins) / lengths
    around = girths / np.sqrt(areas.sum() / count)
    denser = np.empty(len(areas))
    denser[order] = np.repeat((AROUND / np.maximum(around, 1e-300)) ** 2,
                              np.diff(begins, append=len(areas)))
    for most in DENSER:
        weighed = areas * np.clip(denser, 1.0, most)
        if weighed.sum() <= 1.5 * areas.sum():
            return weighed
    return areas


def _spread(areas, count):
    """-> [n] triangles, [n, 3] weights of their corners, of about count points, evenly by area"""
    number = np.arange(2 * count)
    sums = np.cumsum(areas)
    triangles = np.searchsorted(sums, (number + 0.5) / len(number) * sums[-1], side="right")
    # Of points that fill parallelograms evenly the halves that fill the triangles.
    second, third = (number * step % 1 for step in STEPS)
    weights = np.column_stack([1 - second - third, second, third])
    inside = weights[:, 0] >= 0
    return np.minimum(triangles[inside], len(areas) - 1), weights[inside]


def _nearest(corners, weights):
    """-> [n] numbers of the vertices that the points have most of"""
    return corners[np.arange(len(corners)), weights.argmax(axis=1)]


def _mixed(values, corners, weights, is_smooth):
    """[n, ...] of an array of the vertices at the points; kinds and classes stay whole numbers"""
    if not is_smooth:
        return values[_nearest(corners, weights)]
    mixed = sum((values[corners[:, i]].T.astype(float) * weights[:, i]).T for i in range(3))
    return mixed if values.dtype.kind == "f" else np.round(mixed)


def _rows_of(array, numbers):
    """-> an array of VTK with rows of one that is not for numpy, of bits or texts"""
    wanted = vtk("vtkCommonCore").vtkIdList()
    wanted.SetNumberOfIds(len(numbers))
    for row, number in enumerate(numbers.tolist()):
        wanted.SetId(row, number)
    rows = array.NewInstance()
    rows.SetName(array.GetName())
    rows.SetNumberOfComponents(array.GetNumberOfComponents())
    rows.SetNumberOfTuples(len(numbers))
    array.GetTuples(wanted, rows)
    return rows


def _mixed_array(array, corners, weights):
    """The same of an array of VTK"""
    if array.GetDataTypeAsString() in ("bit", "string", "variant"):
        return _rows_of(array, _nearest(corners, weights))
    values = vtk("util.numpy_support").vtk_to_numpy(array)
    is_smooth = values.dtype.kind == "f" or is_colors(array)
    return named_array(array.GetName(), _mixed(values, corners, weights, is_smooth), values.dtype)


def _unit(vectors):
    """Unit vectors, and zeros for vectors without a direction."""
    lengths = np.linalg.norm(vectors, axis=1)[:, None]
    return np.where(np.isfinite(lengths) & (lengths > 0), vectors / np.maximum(lengths, 1e-300), 0)


def _are_turned(given, faces):
    """-> [n] whether the given normals at the three corners tell the other side of the faces"""
    return (sum(given) * faces).sum(axis=1) < 0


def _mixed_normals(values, corners, weights, faces):
    """Unit vectors. At corners where there are none, or where they lean on their face by more than
    CREASE, as means of faces at both sides of an edge do, they are that of the face; given ones tell
    which side it is."""
    given = [_unit(values[corners[:, i]].astype(float)) for i in range(3)]
    faces = np.where(_are_turned(given, faces)[:, None], -faces, faces)
    mixed = 0
    for i, normals in enumerate(given):
        is_near = (normals * faces).sum(axis=1) > np.cos(np.radians(CREASE))
        mixed = mixed + weights[:, i, None] * np.where(is_near[:, None], normals, faces)
    return _unit(mixed)


def normals_of(data):
    return data.GetPointData().GetNormals() or data.GetPointData().GetArray("Normals")


def are_vectors(values):
    return values.shape[1:] == (3,) and values.dtype.kind == "f"


def _sampled(data, triangles, vectors, parts):
    """-> vtkPolyData with points on the triangles, [n] triangles on which they are. parts: numbers of
    those of the triangles, or None"""
    to_numpy = vtk("util.numpy_support").vtk_to_numpy
    places = to_numpy(data.GetPoints().GetData())
    areas, count = np.linalg.norm(vectors, axis=1) / 2, max(SAMPLES, data.GetNumberOfPoints())
    if parts is not None:
        areas = _weighed(areas, places[triangles], parts, count)
    chosen, weights = _spread(areas, count)
    corners, normals = triangles[chosen], _unit(vectors)[chosen]
    sampled = polydata_of(_mixed(places, corners, weights, True), {})
    old, new = data.GetPointData(), sampled.GetPointData()
    given = normals_of(data)
    for array in map(old.GetAbstractArray, range(old.GetNumberOfArrays())):
        if array is not given and array.GetNumberOfTuples() == len(places):
            new.AddArray(_mixed_array(array, corners, weights))
    if given:
        values = to_numpy(given)
        if are_vectors(values):
            normals = _mixed_normals(values, corners, weights, normals)
        new.SetNormals(named_array(given.GetName(), normals, np.float32))
    if old.GetScalars():
        new.SetActiveScalars(old.GetScalars().GetName())
    sampled.GetFieldData().ShallowCopy(data.GetFieldData())
    return sampled, chosen


def _same_places(places, triangles):
    """-> [n, 3] numbers of the places of the corners, which faces that meet may number apart"""
    return np.unique(places, axis=0, return_inverse=True)[1].ravel()[triangles]


def _are_twins(corners):
    """Whether many triangles are there twice, as leaves with two sides are. corners: of _same_places"""
    count = len(np.unique(np.sort(corners, axis=1), axis=0))
    return len(corners) - count > TWINS * len(corners)


def _has_sides(corners):
    """Whether the order of their corners tells from where the triangles are seen: two that meet pass
    their edge in opposite directions, and of solids that touch as many pass it in one as in the other.
    corners: of _same_places"""
    begin, end = corners.ravel().astype(np.int64), np.roll(corners, -1, axis=1).ravel()
    edges = begin * (corners.max() + 1) + end
    most = MIXED * edges.size
    if edges.size - len(np.unique(edges)) <= most:
        return True
    either = np.minimum(begin, end) * (corners.max() + 1) + np.maximum(begin, end)
    numbers = np.unique(either, return_inverse=True)[1]
    surplus = np.abs(np.bincount(numbers, np.where(begin < end, 1, -1)))
    return np.maximum(surplus - 1, 0).sum() <= most and not _are_twins(corners)


def _with_normals(data, triangles):
    """-> vtkPolyData of the triangles with normals that are smooth but for creases, whose vertices it
    repeats"""
    mesh = vtk("vtkCommonDataModel").vtkPolyData()
    mesh.SetPoints(data.GetPoints())
    mesh.GetPointData().ShallowCopy(data.GetPointData())
    mesh.GetFieldData().ShallowCopy(data.GetFieldData())
    mesh.SetPolys(cells_of(triangles.ravel(), np.arange(0, triangles.size + 1, 3)))
    smooth = vtk("vtkFiltersCore").vtkPolyDataNormals()
    smooth.SetInputData(mesh)
    smooth.SetFeatureAngle(CREASE)
    smooth.ConsistencyOff()
    smooth.Update()
    return smooth.GetOutput()


def _parts(data, triangles, vectors, corners):
    """-> [n] numbers of the connected parts whose faces, and normals, agree on their sides.
    corners: of _same_places"""
    values = vtk("util.numpy_support").vtk_to_numpy(normals_of(data))
    if are_vectors(values):
        given = [_unit(values[triangles[:, i]].astype(float)) for i in range(3)]
        is_turned = _are_turned(given, vectors)
        corners = np.where(is_turned[:, None], corners[:, ::-1], corners)
    return parts_of(corners)


def _lacking(data):
    """-> what _what_lacks says; triangles and vectors; places"""
    places = vtk("util.numpy_support").vtk_to_numpy(data.GetPoints().GetData()).astype(float)
    triangles, vectors = _triangles(data, places)
    areas = np.linalg.norm(vectors, axis=1) / 2
    is_surface = len(areas) and np.isfinite(areas.sum())
    said = _what_lacks(places, triangles, areas) if is_surface else (None, False)
    return said, triangles, vectors, places


@np.errstate(all="ignore")  # places that are not finite warn
def on_faces(data):
    """-> Sampled, or None if the vertices of a vtkPolyData tell the surface, or there are no faces"""
    count = data.GetNumberOfPoints()
    if not 0 < count <= MOST_VERTICES or not data.GetNumberOfPolys() + data.GetNumberOfStrips():
        return None
    (lacks, is_model), triangles, vectors, places = _lacking(data)
    if lacks is None:
        return None
    corners = _same_places(places, triangles)
    if not normals_of(data) and _has_sides(corners):
        data = _with_normals(data, triangles)
        triangles = _corners(data.GetPolys())[0].reshape(-1, 3)
    parts = _parts(data, triangles, vectors, corners) if normals_of(data) else None
    sampled, chosen = _sampled(data, triangles, vectors, parts)
    return Sampled(
        sampled, f"points on the faces of its meshes, since its {count} vertices are too {lacks} to "
        "tell the surface", None if parts is None else parts[chosen], is_model)
