# SPDX-License-Identifier: BSD-3-Clause
"""A cloud, and what its file tells of it beside the points."""

from dataclasses import dataclass, field
from typing import List, Optional, Tuple

from ..notes import is_model, note_model, note_scan
from ..surfels import SURFEL_ARRAYS, holds_gaussians
from ..vtkarrays import to_numpy
from .depthimages import image_axes
from .faces import on_faces
from .polydata import as_polydata
from .stations import TO_SCANNER


def is_hierarchy(surfels):
    return bool(surfels.GetFieldData().HasArray("SurfelLeaves"))


@dataclass
class Cloud:
    data: object  # vtkPolyData, or vtkImageData of a volume
    viewpoint: Optional[Tuple[float, float, float]] = None  # of the sensor, if the file has it
    columns: int = 0  # of a depth image, stored row by row; 0 for other clouds
    image: object = None  # (forward, up) of a sensor whose depth image is not in rows: [3] each
    how: str = ""  # what was read, and how, where the file does not say it
    is_unsure: bool = False  # whether that was a guess which may be wrong
    path: str = ""  # of the file, beside which the cameras of a capture may be
    is_antialiased: bool = False  # whether the file says that a capture was trained so
    parts: object = None  # of a mesh: [n] numbers of the parts whose normals are consistent, or None
    home: object = None  # of a capture: what views.homes has found, which takes seconds of a scene
    is_volume: bool = field(init=False)
    is_surfels: bool = field(init=False)
    is_gaussians: bool = field(init=False)
    normals: List[str] = field(init=False)  # names of arrays

    def __post_init__(self):
        points = self.data.GetPointData()
        active = points.GetNormals()
        names = {"Normals", active.GetName() if active is not None else "Normals"}
        self.normals = [name for name in names if name and points.HasArray(name)]
        self.is_volume = bool(self.data.IsA("vtkImageData"))
        self.is_surfels = not self.is_volume and all(
            points.HasArray(name) for name in SURFEL_ARRAYS)
        self.is_gaussians = not self.is_volume and holds_gaussians(self.data)

    @property
    def is_drawable(self):
        """Whether it can be drawn without surfels being made of it."""
        return self.is_surfels or self.is_gaussians


def with_image(cloud):
    """The Cloud, with its sensor if it is a depth image that was saved without rows"""
    data = cloud.data
    is_known = (cloud.viewpoint or data.GetFieldData().HasArray("ScanViewpoint")
                or data.GetPointData().HasArray(TO_SCANNER))
    if cloud.is_drawable or is_known or data.GetNumberOfPoints() == 0:
        return cloud
    cloud.image = image_axes(to_numpy(data.GetPoints().GetData()))
    if cloud.image:
        cloud.viewpoint = (0.0, 0.0, 0.0)
        cloud.data = data.NewInstance()  # who gave it may need it
        cloud.data.ShallowCopy(data)
        note_scan(cloud.data, cloud.viewpoint)
        cloud.how = "; ".join(filter(None, (cloud.how, "a depth image that is not in rows")))
    return cloud


def _with_fitting_arrays(data):
    """-> the vtkDataSet without point arrays that do not have a value for each point; what to say of it"""
    arrays, count = data.GetPointData(), data.GetNumberOfPoints()
    numbers = [number for number in range(arrays.GetNumberOfArrays())
               if arrays.GetAbstractArray(number).GetNumberOfTuples() != count]
    if not numbers:
        return data, ""
    fitting = data.NewInstance()  # who gave it may need it
    fitting.ShallowCopy(data)
    for number in reversed(numbers):
        fitting.GetPointData().RemoveArray(number)
    names = ", ".join(str(arrays.GetArrayName(number)) for number in numbers)
    return fitting, f"left out, as they do not have a value for each point: {names}"


def cloud_of(data, how=""):
    """-> Cloud of the points of a vtkDataSet, or of points on its faces where they tell more"""
    cloud = Cloud(data, how=how)
    if cloud.is_drawable or not (data.IsA("vtkPolyData") or data.IsA("vtkUnstructuredGrid")):
        return cloud
    data, left_out = _with_fitting_arrays(data)
    cloud = with_image(Cloud(data, how="; ".join(filter(None, (how, left_out))),
                              is_unsure=bool(left_out)))
    if cloud.image:
        return cloud
    sampled = on_faces(as_polydata(data))
    if sampled is None:
        return cloud
    note_model(sampled.data, sampled.is_model or is_model(data))
    return Cloud(sampled.data, how="; ".join(filter(None, (sampled.why, left_out))),
                 is_unsure=bool(left_out), parts=sampled.parts)
