# SPDX-License-Identifier: BSD-3-Clause
"""Analytic surfels and strict comparison for the tests in Python; without NumPy, which VTK does
not bring along."""
import math
import os
import sys

from vtkmodules.vtkCommonCore import vtkFloatArray, vtkPoints, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkImagingCore import vtkImageDifference
from vtkmodules.vtkIOImage import vtkPNGReader, vtkPNGWriter

BASELINES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "Data", "Baseline")


class Surfels:
    """A vtkPolyData with the arrays of the data contract: kernels of half the spacing."""

    def __init__(self):
        self.points = vtkPoints()
        self.covariance = self._array("SurfelCovariance", 6)
        self.area = self._array("SurfelAreaVector", 3)
        self.colors = vtkUnsignedCharArray()
        self.colors.SetName("Color")
        self.colors.SetNumberOfComponents(3)

    @staticmethod
    def _array(name, components):
        array = vtkFloatArray()
        array.SetName(name)
        array.SetNumberOfComponents(components)
        return array

    def add(self, p, n, area, color=(255, 255, 255)):
        v = area / 4.0
        self.points.InsertNextPoint(p)
        self.covariance.InsertNextTuple(
            (v * (1 - n[0] * n[0]), v * (1 - n[1] * n[1]), v * (1 - n[2] * n[2]),
             -v * n[0] * n[1], -v * n[1] * n[2], -v * n[0] * n[2]))
        self.area.InsertNextTuple([area * x for x in n])
        self.colors.InsertNextTuple(color)

    def sphere(self, count=4000, center=(0, 0, 0), radius=1.0, color=lambda p: (255, 255, 255)):
        """Fibonacci points."""
        for i in range(count):
            z = 1 - (2 * i + 1) / count
            r = math.sqrt(1 - z * z)
            t = i * math.pi * (3 - math.sqrt(5))
            n = (r * math.cos(t), r * math.sin(t), z)
            p = [c + radius * x for c, x in zip(center, n)]
            self.add(p, n, 4 * math.pi * radius * radius / count, color(p))
        return self

    def tube(self, radius, x0, x1, around, along, color=lambda p: (255, 255, 255)):
        """About the x axis, open at its ends."""
        area = 2 * math.pi * radius / around * (x1 - x0) / along
        for i in range(along):
            for j in range(around):
                t = 2 * math.pi * (j + 0.5 * (i % 2)) / around
                n = (0, math.cos(t), math.sin(t))
                p = (x0 + (i + 0.5) * (x1 - x0) / along, radius * n[1], radius * n[2])
                self.add(p, n, area, color(p))
        return self

    def data(self):
        surfels = vtkPolyData()
        surfels.SetPoints(self.points)
        surfels.GetPointData().AddArray(self.covariance)
        surfels.GetPointData().AddArray(self.area)
        surfels.GetPointData().SetScalars(self.colors)
        return surfels


def values(array):
    """All values of an array, tuple after tuple."""
    kinds = {"float": "f", "unsigned char": "B"}
    return memoryview(array).cast("B").cast(kinds[array.GetDataTypeAsString()]).tolist()


def difference(a, b):
    """Largest and mean difference of two pictures' scalars."""
    if a.GetDimensions() != b.GetDimensions():
        return math.inf, math.inf
    pairs = zip(values(a.GetPointData().GetScalars()), values(b.GetPointData().GetScalars()))
    differences = [abs(x - y) for x, y in pairs]
    return max(differences), sum(differences) / len(differences)


def strict_error(a, b):
    """VTK's own comparison without what makes it blind: no threshold, no shift, no averaging."""
    compare = vtkImageDifference()
    compare.SetInputData(a)
    compare.SetImageData(b)
    compare.SetThreshold(0)
    compare.AllowShiftOff()
    compare.AveragingOff()
    compare.Update()
    return compare.GetError()


def check_baseline(picture, name, largest, mean):
    """Compares with a picture that someone has looked at. SURFELSPLATTING_WRITE_BASELINES=1 writes
    it."""
    path = os.path.join(BASELINES, name + ".png")
    if os.environ.get("SURFELSPLATTING_WRITE_BASELINES", "0") not in ("", "0"):
        writer = vtkPNGWriter()
        writer.SetInputData(picture)
        writer.SetFileName(path)
        writer.Write()
        return
    assert os.path.exists(path), "there is no picture " + path
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    found = difference(picture, reader.GetOutput())
    if found[0] > largest or found[1] > mean:
        writer = vtkPNGWriter()
        writer.SetInputData(picture)
        writer.SetFileName(name + ".failed.png")
        writer.Write()
    assert found[0] <= largest and found[1] <= mean, (name, found)
    return reader.GetOutput()


def run(module):
    """Runs the functions test_* of a script, or those that its arguments name."""
    names = sys.argv[1:] or [name for name in vars(module) if name.startswith("test_")]
    tests = [(name, getattr(module, name)) for name in names]
    assert tests, "no tests"
    for name, function in tests:
        function()
        print("ok", name)
    sys.stdout.flush()
