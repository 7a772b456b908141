# SPDX-License-Identifier: BSD-3-Clause
"""Points To Surfels and Surfel Splats clean scans, and use what the file says of the sensor."""

import numpy as np
from paraview import simple
from paraview.numpy_support import numpy_to_vtk, vtk_to_numpy
from paraview.vtk.vtkCommonCore import vtkPoints
from paraview.vtk.vtkCommonDataModel import vtkPolyData
from paraview.vtk.vtkIOLegacy import vtkPolyDataWriter

from plugincase import PluginCase, screenshot, sphere

COLUMNS, ROWS, FOCAL = 320, 240, 262.5
STEP = 0.0029  # of 1/z, 1/m, about that of the first Kinect
ROUNDING = STEP / np.sqrt(12)  # RMS
SENSOR = np.array([0.5, -1.0, 2.0])


def depth_image():
    """-> [rows * columns, 3] a tilted floor in steps of 1/z, and its true 1/z"""
    y, x = np.mgrid[0:ROWS, 0:COLUMNS]
    true = 0.26 + 0.26 * y / ROWS + 0.03 * x / COLUMNS
    z = 1 / (np.round(true / STEP) * STEP)
    points = np.stack([(x - COLUMNS / 2) * z / FOCAL, (y - ROWS / 2) * z / FOCAL, z], -1) + SENSOR
    return points.reshape(-1, 3), true.ravel()


def write_pcd(path, points):
    with open(path, "w") as file:
        file.write("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
                   f"WIDTH {COLUMNS}\nHEIGHT {ROWS}\n"
                   f"VIEWPOINT {' '.join(map(str, SENSOR))} 1 0 0 0\nPOINTS {len(points)}\n"
                   "DATA ascii\n")
        np.savetxt(file, points, "%.9g")


def write_noisy_sphere(path):
    random = np.random.default_rng(2)
    points = sphere(20000, (0, 0, 0)) * (1 + random.normal(0, 0.02, (20000, 1)))
    points = np.concatenate([points, random.uniform(-2, 2, (200, 3))])
    data = vtkPolyData()
    data.SetPoints(vtkPoints())
    data.GetPoints().SetData(numpy_to_vtk(points, deep=1))
    writer = vtkPolyDataWriter()
    writer.SetInputData(data)
    writer.SetFileName(path)
    writer.Write()


def fetch(source):
    """-> positions, {array: values}"""
    data = simple.servermanager.Fetch(source)
    arrays = data.GetPointData()
    origin = vtk_to_numpy(data.GetFieldData().GetArray("SurfelOrigin")).ravel()
    return vtk_to_numpy(data.GetPoints().GetData()) + origin, {
        arrays.GetArrayName(i): vtk_to_numpy(arrays.GetArray(i))
        for i in range(arrays.GetNumberOfArrays())}


class Sensor(PluginCase):
    def setUp(self):
        super().setUp()
        self.image, self.true = depth_image()
        write_pcd("floor.pcd", self.image)
        self.scan = simple.PCDReader(FileName="floor.pcd")

    def error(self, source):
        """RMS of 1/z, away from the borders."""
        points, arrays = fetch(source)
        z, x = points[:, 2] - SENSOR[2], points[:, 0] - SENSOR[0]
        y = points[:, 1] - SENSOR[1]
        # Surfels have another order: which pixel it is follows from the ray.
        column = np.round(x / z * FOCAL + COLUMNS / 2).astype(int)
        row = np.round(y / z * FOCAL + ROWS / 2).astype(int)
        inside = (column > 12) & (column < COLUMNS - 12) & (row > 12) & (row < ROWS - 12)
        true = self.true.reshape(ROWS, COLUMNS)[row[inside], column[inside]]
        return np.sqrt(np.mean((1 / z[inside] - true) ** 2)), points, arrays

    def test_depth_steps_become_smooth(self):
        surfels = simple.PointsToSurfels(Input=self.scan)
        error, points, arrays = self.error(surfels)
        self.assertLess(error, 0.05 * ROUNDING)  # 0.01 measured
        away = np.sum(arrays["SurfelAreaVector"] * (points - SENSOR), 1) > 0
        self.assertEqual(away.sum(), 0)
        surfels.Cleaning = "Off"
        # 0.19: surfels lie on the surface of their normals, a mean of pixels.
        self.assertGreater(self.error(surfels)[0], 0.1 * ROUNDING)
        surfels.Cleaning = "Full"
        surfels.Sides = "Two-sided"
        self.assertEqual(fetch(surfels)[1]["SurfelTwoSided"].min(), 1)

    def test_the_cleaning_filter_takes_columns(self):
        cleaning = simple.PointCloudCleaning(Input=self.scan, Columns=COLUMNS, Viewpoint=SENSOR)
        points = vtk_to_numpy(simple.servermanager.Fetch(cleaning).GetPoints().GetData())
        self.assertGreater(np.abs(points - self.image).max(), STEP)

    def test_the_representation_does_the_same(self):
        self.view.CameraPosition = [0.5, -1, 1.5]
        self.view.CameraFocalPoint = [0.5, -0.5, 4.5]
        self.show(self.scan)
        simple.Render(self.view)
        raw = screenshot(self.view)
        self.assertGreater(raw.max(2).mean(), 40)
        simple.Hide(self.scan, self.view)
        self.show(simple.PointsToSurfels(Input=self.scan))
        self.assertLess(np.abs(screenshot(self.view) - raw).max(), 2)

    def test_depth_images_are_seen_from_behind(self):
        """As ParaView's first view may be; their normals point to the sensor all the same."""
        surfels = simple.PointsToSurfels(Input=self.scan)
        points, arrays = fetch(surfels)
        self.assertEqual(arrays["SurfelTwoSided"].min(), 1)
        self.assertTrue((np.sum(arrays["SurfelAreaVector"] * (SENSOR - points), 1) > 0).all())
        self.view.CameraPosition = [0.5, 3, 8]
        self.view.CameraFocalPoint = [0.5, -0.5, 4.5]
        self.show(self.scan)
        self.assertGreater((screenshot(self.view).max(2) > 40).mean(), 0.1)

    def test_points_that_were_moved_have_no_sensor(self):
        moved = simple.Transform(Input=self.scan)
        moved.Transform.Translate = [0, 0, -20]  # the sensor would be behind the floor
        for source, two_sided in ((self.scan, 0), (moved, 1)):
            arrays = fetch(simple.PartitionedSurfelEstimation(Input=source))[1]
            self.assertAlmostEqual(arrays["SurfelTwoSided"].mean(), two_sided, 3)

    def test_noise_and_stray_points(self):
        write_noisy_sphere("noisy.vtk")
        noisy = simple.LegacyVTKReader(FileNames=["noisy.vtk"])
        surfels = simple.PointsToSurfels(Input=noisy)
        distance = np.linalg.norm(fetch(surfels)[0], axis=1)
        surface = np.abs(distance - 1) < 0.1
        self.assertLess(np.sum(~surface), 40)  # 200 strays, some of them near the sphere
        self.assertLess(distance[surface].std(), 0.01)  # 0.02 before
        surfels.Cleaning = "Outliers"
        distance = np.linalg.norm(fetch(surfels)[0], axis=1)
        # Surfels lie on the surface of their normals: 0.0147.
        self.assertGreater(distance[np.abs(distance - 1) < 0.1].std(), 0.013)
