# SPDX-License-Identifier: BSD-3-Clause
"""Volumes for tests, and their files."""

import numpy as np
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOLegacy import vtkDataSetWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from surfelsplatting.vtkarrays import named_array


def add(data, name, values):
    array = named_array(name, values)
    data.AddArray(array)
    return array


def make_image(values, spacing=1.0):
    """values: [z, y, x] active scalars at the points"""
    image = vtkImageData()
    image.SetDimensions(values.shape[::-1])
    image.SetSpacing([spacing] * 3)
    image.GetPointData().SetScalars(add(image.GetPointData(), "density", values.ravel()))
    return image


def write_image(path, image):
    writer = vtkXMLImageDataWriter() if path.endswith("vti") else vtkDataSetWriter()
    if path.endswith("vtk"):
        writer.SetFileTypeToBinary()
    writer.SetInputData(image)
    writer.SetFileName(path)
    writer.Write()
    return path


META = """ObjectType = Image
NDims = 3
BinaryData = True
BinaryDataByteOrderMSB = False
DimSize = 13 13 13
ElementType = MET_FLOAT
ElementDataFile = LOCAL
"""
NRRD = """NRRD0004
type: float
dimension: 3
sizes: 13 13 13
endian: little
encoding: raw

"""


def write_raw(path, header, values):
    with open(path, "wb") as file:
        file.write(header.encode() + values.astype("<f4").tobytes())


def ball(count=13):
    """[z, y, x] floats that fall from 1 in the middle to 0 at half of the way to the sides"""
    axis = np.linspace(-2, 2, count)
    return np.maximum(0, 1 - np.linalg.norm(np.meshgrid(axis, axis, axis), axis=0)).astype("f4")
