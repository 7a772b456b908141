# SPDX-License-Identifier: BSD-3-Clause
"""Which points of a data set surfels are made of, and by which of their arrays they are coloured."""

import os
from pathlib import Path

import numpy as np
import pyvista as pv

from ..arraypoints import point_rows
from ..backend import vtk
from ..clouds.cloud import Cloud, cloud_of
from ..clouds.stations import TO_SCANNER
from ..notes import MODEL, scan
from ..shapes.outward import turn_outward
from ..shapes.precision import warn_of_steps
from ..shapes.sensor import keep_sensor
from ..surfels import in_the_world, is_surfels, make_surfels
from ..vtkSurfelReaders import vtkGaussianSplatReader
from .readers import read_capture

OPACITY = "opacity of points"


def as_dataset(cloud):
    """What pl.surfels.add is given, as one data set."""
    if isinstance(cloud, (pv.DataSet, pv.MultiBlock)):
        return as_one(cloud)
    if isinstance(cloud, np.ndarray):
        return pv.PolyData(point_rows(cloud))
    if isinstance(cloud, (str, Path)):
        is_capture = vtkGaussianSplatReader.CanReadFile(os.fsencode(cloud))  # PyVista reads .ply as a mesh
        return read_capture(cloud) if is_capture else as_dataset(pv.read(cloud))
    if isinstance(cloud, (pv._vtk.vtkDataSet, pv._vtk.vtkMultiBlockDataSet)):
        return as_one(pv.wrap(cloud))
    if isinstance(cloud, vtk("vtkCommonCore").vtkObject):
        raise TypeError(f"cloud is of the type {type(cloud).__name__}, which has no points for surfels; give "
                        "a data set, such as a pyvista.PolyData, or an array of shape (n, 3)")
    if hasattr(cloud, "GetClassName"):
        package = type(cloud).__module__.partition(".")[0]
        raise TypeError(f"cloud is a {cloud.GetClassName()} of {package}, which PyVista does not use "
                        f"here; objects of two VTKs do not mix. Make a pyvista.PolyData of its points")
    return pv.PolyData(point_rows(cloud))


def as_one(dataset):
    """The data set; of a MultiBlock, all of its blocks."""
    return dataset.combine() if isinstance(dataset, pv.MultiBlock) else dataset


def points_of(dataset, sides="auto"):
    """Points on the faces of a mesh whose vertices do not tell the surface; others as they are. Those of
    a depth image know its sensor.

    sides: that of `SurfelAccessor.estimate`; parts that are inside out are turned if it is "auto"
    """
    if not isinstance(dataset, vtk("vtkCommonDataModel").vtkPointSet):
        raise TypeError(f"{type(dataset).__name__} is a grid without points of its own; surfels need the "
                        "points of a surface, for example those of dataset.contour()")
    cloud = cloud_of(_surface_of(dataset))
    # Of points that were made of a mesh, the parts are no longer known.
    if sides == "auto" and not dataset.GetFieldData().HasArray(MODEL):
        turn_outward(cloud)
    if cloud.image:
        keep_sensor(cloud, cloud.data)
    return pv.wrap(cloud.data)


def _surface_of(dataset):
    """Of solid cells, inside of which nothing is seen, and of structured grids, the faces, as PyVista
    itself draws them; others as they are."""
    model = vtk("vtkCommonDataModel")
    if not isinstance(dataset, (model.vtkUnstructuredGrid, model.vtkStructuredGrid)):
        return dataset
    least = 3 if isinstance(dataset, model.vtkUnstructuredGrid) else 2
    if Cloud(dataset).is_drawable or pv.wrap(dataset).max_cell_dimensionality < least:
        return dataset
    surface = vtk("vtkFiltersGeometry").vtkDataSetSurfaceFilter()
    surface.SetInputData(dataset)
    surface.Update()
    return surface.GetOutput()


def surfels_of(points, **options):
    """A PolyData. points: of `points_of`; options: of `SurfelAccessor.estimate`"""
    surfels = pv.wrap(in_the_world(make_surfels(points, **options)))
    if surfels is not points:  # which is so for Gaussians with their level of detail
        cloud = Cloud(points, *scan(points))
        keep_sensor(cloud, surfels)
        if not cloud.is_gaussians:
            warn_of_steps(points, surfels)
    if surfels.n_cells == 1:  # of all points; filters select cells, so that each gets its own
        surfels.verts = np.insert(np.arange(surfels.n_points), range(surfels.n_points), 1)
    return surfels


def points_and_surfels(cloud):
    """-> the points that surfels are made of, or the surfels if they are there already; the surfels"""
    if is_surfels(cloud):
        return cloud, pv.wrap(in_the_world(cloud))  # picking finds files of surfels in place, too
    points = points_of(cloud)
    return points, surfels_of(points)


def with_scalars(dataset, scalars):
    """-> the data set with the scalars of pl.surfels.add, the name of their point array or None"""
    if scalars is None:
        name = dataset.point_data.active_scalars_name
        is_color = not (name and name.startswith(("Surfel", "Gaussian", TO_SCANNER)))
        return dataset, name if is_color else None
    if isinstance(scalars, str):
        if scalars not in dataset.point_data:
            raise ValueError(_no_array(dataset, scalars))
        return dataset, scalars
    name, values = pv.DEFAULT_SCALARS_NAME, np.asarray(scalars)
    if values.ndim not in (1, 2) or len(values) != dataset.n_points:
        raise ValueError(f"scalars have the shape {values.shape}, but there are {dataset.n_points} "
                         "points; give one row for each point")
    dataset = dataset.copy(deep=False)
    dataset.point_data[name] = values
    return dataset, name


def with_opacity(dataset, opacity):
    """-> the data set with the opacity of pl.surfels.add, what add_mesh is to know of it: an array of
    points becomes one that surfels, which are in another order, have as well"""
    values = np.asarray(opacity)
    if values.shape != (dataset.n_points,) or values.dtype.kind not in "biuf":
        return dataset, opacity
    dataset = dataset.copy(deep=False)
    dataset.point_data.set_array(values, OPACITY)
    return dataset, OPACITY


def are_colors(surfels, name):
    if name is None:
        return False
    values = surfels.point_data[name]
    return values.dtype == np.uint8 and values.ndim == 2 and values.shape[1] in (3, 4)


def _no_array(dataset, name):
    if name in dataset.cell_data:
        return (f"the array {name!r} is one of cells, but surfels are coloured by those of points; "
                "dataset.cell_data_to_point_data() makes it one")
    return (f"there is no point array {name!r}; there are "
            f"{', '.join(map(repr, dataset.point_data)) or 'none'}")
