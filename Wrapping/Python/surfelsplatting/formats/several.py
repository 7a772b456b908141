# SPDX-License-Identifier: BSD-3-Clause
"""Several files as one cloud: tiles of a survey, or the scans of a project."""

import numpy as np

from ..clouds.cloud import Cloud
from ..clouds.colors import is_colors
from ..clouds.degrees import beside_first
from ..clouds.polydata import polydata_of
from ..clouds.stations import TO_SCANNER, trusted_places, ways_of
from ..problems import UserProblem
from ..vtkarrays import named_array, to_numpy
from .agreement import doubts
from .reading import read_cloud

GREY = 204  # of points without colours beside others that have them; such clouds alone are as grey
COMMON_FIELDS = ("ScanUp", "ModelUp", "ModelHasFaces")  # hold for the whole if they are the same in all files


def _places(cloud):
    return to_numpy(cloud.data.GetPoints().GetData()).astype(float)


def _check_points(cloud):
    holds = ("a volume" if cloud.is_volume else "a capture of 3D Gaussian splatting"
             if cloud.is_gaussians else "surfels" if cloud.is_surfels else None)
    if holds:
        raise UserProblem(f"{cloud.path} holds {holds}; only files of points become one cloud, so give "
                          "it alone")


def _names(data):
    points = data.GetPointData()
    return [points.GetArrayName(number) for number in range(points.GetNumberOfArrays())]


def _joined(arrays):
    """-> an array of VTK with the rows of all, or None where they do not fit together"""
    if any(array is None for array in arrays):  # of texts
        return None
    kinds = {(array.GetNumberOfComponents(), is_colors(array)) for array in arrays}
    if len(kinds) > 1:
        return None
    return named_array(arrays[0].GetName(), np.concatenate([to_numpy(array) for array in arrays]))


def _with_grey(clouds):
    """-> clouds of which all have colours, if one has: some scanners have no camera"""
    colors = [cloud.data.GetPointData().GetScalars() for cloud in clouds]
    named = next((array for array in colors if is_colors(array)), None)
    if named is None:
        return clouds
    for cloud in clouds:
        points = cloud.data.GetPointData()
        if not points.HasArray(named.GetName()) and not is_colors(points.GetScalars()):
            grey = np.full((cloud.data.GetNumberOfPoints(), named.GetNumberOfComponents()), GREY,
                           np.uint8)
            grey[:, 3:] = 255
            points.SetScalars(named_array(named.GetName(), grey))
    return clouds


def _join_arrays(clouds, whole):
    """-> names of the arrays that not all of the clouds have, or not alike"""
    datas = [cloud.data.GetPointData() for cloud in clouds]
    names = dict.fromkeys(name for cloud in clouds for name in _names(cloud.data))
    left_out, points = [], whole.GetPointData()
    for name in names:
        is_in_all = all(data.HasArray(name) for data in datas)
        array = _joined([data.GetArray(name) for data in datas]) if is_in_all else None
        if array is None:
            left_out.append(name)
        else:
            points.AddArray(array)
    for active, activate in ((datas[0].GetScalars(), points.SetActiveScalars),
                             (datas[0].GetNormals(), points.SetActiveNormals)):
        if active is not None and points.HasArray(active.GetName()):
            activate(active.GetName())
    return left_out


def _join_ways(clouds, whole):
    """Each point knows its scanner: that of its file, or the one that it knew before."""
    places = trusted_places([cloud.viewpoint for cloud in clouds])
    arrays = [cloud.data.GetPointData().GetArray(TO_SCANNER) for cloud in clouds]
    ways = ways_of([_places(cloud) for cloud in clouds], places).get(TO_SCANNER)
    if ways is None and not any(arrays):
        return
    ways = np.zeros((whole.GetNumberOfPoints(), 3), np.float32) if ways is None else ways
    begin = 0
    for cloud, array in zip(clouds, arrays):
        end = begin + cloud.data.GetNumberOfPoints()
        if array and array.GetNumberOfComponents() == 3:
            ways[begin:end] = to_numpy(array)
        begin = end
    whole.GetPointData().SetVectors(named_array(TO_SCANNER, ways))


def _join_fields(clouds, whole):
    for name in COMMON_FIELDS:
        arrays = [cloud.data.GetFieldData().GetArray(name) for cloud in clouds]
        is_in_all = all(array and array.GetNumberOfTuples() == 1 for array in arrays)
        if is_in_all and len({array.GetTuple(0) for array in arrays}) == 1:
            whole.GetFieldData().AddArray(arrays[0])


def _join_parts(clouds):
    """-> [n] numbers of the parts of meshes, or None if the points of a file belong to none"""
    if any(cloud.parts is None for cloud in clouds):
        return None
    joined, next_one = [], 0
    for cloud in clouds:
        joined.append(cloud.parts + next_one)
        next_one += cloud.parts.max() + 1
    return np.concatenate(joined)


def _joined_cloud(clouds):
    for cloud in clouds:
        _check_points(cloud)
    places = beside_first(clouds, [_places(cloud) for cloud in clouds])
    whole = polydata_of(np.concatenate(places), {})
    left_out = [name for name in _join_arrays(_with_grey(clouds), whole) if name != TO_SCANNER]
    _join_ways(clouds, whole)
    _join_fields(clouds, whole)
    how = doubts([cloud.path for cloud in clouds], places)
    how += [f"{cloud.path}: {cloud.how}" for cloud in clouds if cloud.is_unsure]
    if left_out:
        how.append(f"left out, as not all of the files have them: {', '.join(left_out)}")
    return Cloud(whole, how="; ".join(how) or f"{len(clouds)} files as one cloud",
                 is_unsure=bool(how), path=clouds[0].path, parts=_join_parts(clouds))


def read_clouds(paths, messages, progress):
    """-> Cloud with the points of all files, or UserProblem."""
    clouds = [read_cloud(path, messages, progress) for path in paths]
    return clouds[0] if len(clouds) == 1 else _joined_cloud(clouds)
