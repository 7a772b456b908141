# SPDX-License-Identifier: BSD-3-Clause
"""The plugin in pvpython: its filters, and points and surfels as Surfel Splats in a render view."""

import numpy as np
from paraview import simple
from paraview.numpy_support import vtk_to_numpy
from paraview.vtk.vtkCommonCore import vtkOutputWindow

from plugincase import FOCAL_LENGTH, SIZE, PluginCase, screenshot, write_sphere


class Filters(PluginCase):
    def test_filters(self):
        estimation = simple.SurfelEstimation(Input=self.points)
        normalization = simple.SurfelNormalization(Input=estimation)
        hierarchy = simple.SurfelHierarchy(Input=normalization)
        hierarchy.UpdatePipeline()
        names = set(hierarchy.PointData.keys())
        self.assertLessEqual({"SurfelCovariance", "SurfelAreaVector", "height"}, names)
        self.assertIn("SurfelNodes", hierarchy.FieldData.keys())
        parts = simple.PartitionedSurfelEstimation(Input=self.points, PointsPerPart=5000)
        parts.UpdatePipeline()
        self.assertEqual(parts.GetDataInformation().GetNumberOfPoints(), 20000)
        self.assertEqual(estimation.NumberOfNeighbors, 16)
        together = simple.PointsToSurfels(Input=self.points)
        for surfels in (estimation, normalization, hierarchy, parts, together):
            self.assertEqual(simple.Show(surfels, self.view).Representation, "Surfel Splats")


class EitherView:
    """What depends on whether the representation or the view has the pass."""

    def set_lens(self, display, **settings):
        owner, prefix = (self.view, "") if self.view_type == "SurfelRenderView" else (display, "Surfel")
        for name, value in settings.items():
            setattr(owner, prefix + name, value)

    def test_lens_of_the_view_and_of_the_representation(self):
        display = self.show(self.points)
        sharp = screenshot(self.view)
        self.view.CameraFocalDisk = 0.6
        self.view.CameraFocalDistance = 9.0
        # ParaView's focal disk is 1 where nobody has set it.
        self.assertLess(np.abs(screenshot(self.view) - sharp).max(), 2)
        self.set_lens(display, LensMode="Camera")
        through_camera = screenshot(self.view)
        self.assertGreater(np.abs(through_camera - sharp).max(), 60)
        self.set_lens(display, LensMode="Pinhole")
        self.assertLess(np.abs(screenshot(self.view) - sharp).max(), 2)
        # The same lens: f R / z_f.
        self.set_lens(display, LensMode="Circle of confusion", CircleOfConfusion=FOCAL_LENGTH * 0.3 / 9.0)
        self.assertLess(np.abs(screenshot(self.view) - through_camera).max(), 2)

    def test_selection_gives_the_points_of_the_source(self):
        display = self.show(self.points)
        screenshot(self.view)
        left, low, right, high = rectangle = [130, 140, 170, 175]
        simple.SelectSurfacePoints(Rectangle=rectangle, View=self.view)
        ids = np.asarray(self.points.GetSelectionInput(0).Input[0].IDs)[1::2]
        points = vtk_to_numpy(simple.servermanager.Fetch(self.points).GetPoints().GetData())[ids]
        self.assertGreater(len(ids), 80)
        self.assertGreater(points[:, 2].min(), 0.2)  # the near side
        x, y = (SIZE / 2 + FOCAL_LENGTH * points[:, c] / (5 - points[:, 2]) for c in (0, 1))
        # A dot is 4 px wide.
        self.assertTrue(np.all((x > left - 4) & (x < right + 4) & (y > low - 4) & (y < high + 4)))
        simple.ClearSelection(self.points)
        self.assertEqual(self.view.SMProxy.Pick(SIZE // 2, SIZE // 2), display.SMProxy)
        self.assertIsNone(self.view.SMProxy.Pick(2, 2))

    def test_blocks(self):
        write_sphere("left.vtk", 5000, (-0.6, 0, 0))
        write_sphere("right.vtk", 5000, (0.6, 0, 0))
        group = simple.GroupDatasets(Input=[
            simple.LegacyVTKReader(FileNames=[name]) for name in ("left.vtk", "right.vtk")])
        self.view.CameraPosition = [0, 0, 8]
        display = self.show(group)
        half = SIZE // 2

        def colors():
            seen = screenshot(self.view)
            return seen[half, half - 60], seen[half, half + 60]

        def is_white(color):
            return color.min() > 100 and color.max() - color.min() < 15  # lit by a warm light

        self.assertTrue(all(map(is_white, colors())))
        tree = group.GetDataInformation().DataInformation.GetHierarchy()
        root, first, second = (tree.GetNodeName(i) for i in range(3))
        display.BlockSelectors = [f"/{root}/{second}"]
        left, right = colors()
        self.assertEqual(left.max(), 0)
        self.assertTrue(is_white(right))
        display.BlockSelectors = ["/"]
        display.BlockColors = [f"/{root}/{first}", "1", "0", "0"]
        left, right = colors()
        self.assertTrue(left[0] > 100 and left[1] == 0 and is_white(right))
        display.BlockColors = []
        self.assertTrue(all(map(is_white, colors())))
        simple.SelectSurfacePoints(Rectangle=[200, 140, 220, 160], View=self.view)
        ids = np.asarray(group.GetSelectionInput(0).Input[0].IDs).reshape(-1, 3)
        self.assertEqual(set(ids[:, 0]), {2})  # flat index of the second block

    def test_focus_on_a_point(self):
        display = self.show(self.points)
        self.set_lens(display, LensMode="Circle of confusion", CircleOfConfusion=20)
        self.view.CameraFocalDistance = 9.0
        camera = screenshot(self.view)
        self.set_lens(display, FocusMode="Point", FocusPoint=[0.3, 0.2, -4.0])
        self.assertLess(np.abs(screenshot(self.view) - camera).max(), 2)
        self.set_lens(display, FocusPoint=[0.3, 0.2, 0.0])
        near = screenshot(self.view)
        self.assertGreater(np.abs(near - camera).max(), 60)
        self.set_lens(display, FocusMode="Center of rotation")
        self.view.CenterOfRotation = [0.0, 0.0, -4.0]
        self.assertLess(np.abs(screenshot(self.view) - camera).max(), 2)
        self.view.CenterOfRotation = [0.0, 0.0, 0.0]
        self.assertLess(np.abs(screenshot(self.view) - near).max(), 2)

    def test_first_focus_is_on_what_is_seen(self):
        """Not on the focal point, the centre of the data: on the surface in the middle."""
        display = self.show(self.points)
        self.set_lens(display, LensMode="Circle of confusion", CircleOfConfusion=20)
        for position in ([0, 0, 5], [4, 0, 0]):
            self.view.CameraPosition = position
            first = screenshot(self.view)
            self.view.CameraFocalDistance = np.linalg.norm(position) - 0.99  # its front
            self.assertLess(np.abs(screenshot(self.view) - first).max(), 4)
            self.view.CameraFocalDistance = 0
            self.set_lens(display, FocusMode="Focal point")
            self.assertGreater(np.abs(screenshot(self.view) - first).max(), 30)
            self.set_lens(display, FocusMode="Surface in the middle")
            self.assertLess(np.abs(screenshot(self.view) - first).max(), 1)

    def test_hidden_by_and_hiding_a_mesh(self):
        self.show(self.points)
        box = simple.Box(XLength=0.5, YLength=0.5, ZLength=0.5, Center=[0, 0, 1.5])
        simple.Show(box, self.view).DiffuseColor = [0.0, 1.0, 0.0]
        middle = SIZE // 2
        self.assertLess(screenshot(self.view)[middle, middle, 0], 5)
        box.Center = [0, 0, -1.5]
        self.assertGreater(screenshot(self.view)[middle, middle, 0], 180)


class SurfelSplats(EitherView, PluginCase):
    """Which surfels are drawn, and in which colours, which no view changes."""

    def test_raw_points_are_a_closed_sphere(self):
        self.show(self.points)
        seen = screenshot(self.view)
        # The sphere of radius 1 seen from 5: sin = 1/5.
        radius = SIZE / 2 / np.tan(np.radians(15)) * np.tan(np.arcsin(0.2))
        y, x = np.mgrid[0:SIZE, 0:SIZE] + 0.5 - SIZE / 2
        inside = np.hypot(x, y) < radius - 4
        self.assertGreater(seen[inside].min(), 40)  # lit from the camera; no holes
        self.assertEqual(seen[np.hypot(x, y) > radius + 4].max(), 0)

    def test_backs(self):
        display = self.show(self.points)
        self.view.CameraPosition, self.view.CameraFocalPoint = (0, 0, 0), (0, 0, -1)
        self.assertEqual(screenshot(self.view).max(), 0)
        display.SurfelShowBacks = 1
        self.assertGreater(screenshot(self.view).min(), 40)
        display.SurfelShowBacks = 0
        self.assertEqual(screenshot(self.view).max(), 0)

    def test_surfels_are_drawn_as_they_are(self):
        self.show(self.points)
        raw = screenshot(self.view)
        simple.Hide(self.points, self.view)
        estimation = simple.SurfelEstimation(Input=self.points)
        normalization = simple.SurfelNormalization(Input=estimation)
        self.show(simple.SurfelHierarchy(Input=normalization))
        self.assertLess(np.abs(screenshot(self.view) - raw).max(), 2)

    def test_colors_by_an_array(self):
        display = self.show(self.points)
        simple.ColorBy(display, ("POINTS", "height"))
        simple.GetColorTransferFunction("height").RGBPoints = [-1, 0, 0, 1, 1, 1, 0, 0]
        self.view.CameraPosition = [5, 0, 0]
        self.view.CameraViewUp = [0, 0, 1]
        seen = screenshot(self.view)
        column = seen[:, SIZE // 2]
        self.assertGreater(column[SIZE // 2 + 40, 0], column[SIZE // 2 - 40, 0] + 60)
        self.assertGreater(column[SIZE // 2 - 40, 2], column[SIZE // 2 + 40, 2] + 20)
        self.assertEqual(self.view.SMProxy.Pick(SIZE // 2, SIZE // 2), display.SMProxy)

    def test_colors_of_the_data(self):
        """Are shown as they are; a component of them by a colour map."""
        write_sphere("colored.vtk", colors=True)
        display = self.show(simple.LegacyVTKReader(FileNames=["colored.vtk"]))
        simple.ColorBy(display, ("POINTS", "RGB"))
        middle = SIZE // 2

        def left_and_right():
            seen = screenshot(self.view)
            return seen[middle, middle - 50], seen[middle, middle + 50]

        red, blue = left_and_right()
        self.assertTrue(red[0] > 100 and red[1:].max() < 20, red)
        self.assertTrue(blue[2] > 100 and blue[:2].max() < 20, blue)
        simple.ColorBy(display, ("POINTS", "RGB", "X"))
        simple.GetColorTransferFunction("RGB").RGBPoints = [0, 1, 1, 0, 255, 0, 1, 0]
        green, yellow = left_and_right()
        self.assertTrue(green[1] > 100 and green[0] < 20, green)
        self.assertTrue(yellow[:2].min() > 100 and yellow[2] < 20, yellow)

    def test_faces_of_meshes(self):
        """Of meshes of few vertices the faces are drawn, as by ParaView itself, with what is between
        their corners. Each surfel is a point of the source to a selection."""
        self.view.CameraPosition = [1.5, 2, 2.5]
        for mesh in (simple.Sphere(), simple.Plane()):
            source = simple.Elevation(Input=mesh, LowPoint=[0, -0.5, 0], HighPoint=[0, 0.5, 0])
            display = simple.Show(source, self.view)
            simple.ColorBy(display, ("POINTS", "Elevation"))
            display.Ambient, display.Diffuse = 1, 0
            pictures = []
            for display.Representation in ("Surface", "Surfel Splats"):
                pictures.append(screenshot(self.view))
            # Half covered: the colours' brightest channel is 180 to 220.
            covered, expected = (picture.max(2) > 100 for picture in reversed(pictures))
            self.assertLess((covered ^ expected).sum(), 0.02 * expected.sum(), mesh)
            inside = covered & expected
            error = np.abs(pictures[0] - pictures[1])[inside]
            self.assertLess(error.mean(), 3, mesh)
            simple.SelectSurfacePoints(Rectangle=[140, 140, 160, 160], View=self.view)
            ids = np.asarray(source.GetSelectionInput(0).Input[0].IDs)[1::2]
            self.assertGreater(len(ids), 0)
            self.assertLess(ids.max(), source.GetDataInformation().GetNumberOfPoints())
            simple.Hide(source, self.view)

    def test_dense_meshes_and_clouds_are_their_points(self):
        for source in (simple.Sphere(ThetaResolution=300, PhiResolution=200), self.points):
            surfels = simple.PointsToSurfels(Input=source)
            surfels.UpdatePipeline()
            count = source.GetDataInformation().GetNumberOfPoints()
            self.assertAlmostEqual(
                surfels.GetDataInformation().GetNumberOfPoints(), count, delta=5)

    def test_exports(self):
        """Go through all actors of a view, also those that only have the surfels drawn."""
        self.show(self.points)
        screenshot(self.view)
        errors = []
        window = vtkOutputWindow.GetInstance()
        tag = window.AddObserver("ErrorEvent", lambda *_: errors.append(1))
        for name in ("scene.x3d", "scene.gltf"):
            simple.ExportView(name, self.view)
        window.RemoveObserver(tag)
        self.assertEqual(errors, [])

    def test_other_kinds_of_data(self):
        for source in (simple.MergeBlocks(Input=simple.SurfelEstimation(Input=self.points)),
                       simple.Wavelet()):
            self.show(source)
            self.view.ResetCamera()
            self.assertGreater(screenshot(self.view).max(), 100)
            simple.Hide(source, self.view)


class SurfelRenderView(EitherView, PluginCase):
    """Meshes go through the lens, too."""

    view_type = "SurfelRenderView"

    def width_of_edges(self):
        row = screenshot(self.view)[SIZE // 2, :, 0]
        self.assertGreater(row.max(), 100)
        return ((row > 0.1 * row.max()) & (row < 0.9 * row.max())).sum()

    def test_meshes_are_blurred(self):
        plane = simple.Plane(Origin=[-1, -1, -3], Point1=[0, -1, -3], Point2=[-1, 1, -3])
        display = simple.Show(plane, self.view)
        display.AmbientColor = display.DiffuseColor = [1.0, 1.0, 1.0]
        self.view.LensMode = "Camera"
        self.view.CameraFocalDisk = 0.6
        self.view.CameraFocalDistance = 4.0
        for cells in (1, 7):
            self.view.LensCells = cells
            self.assertGreater(self.width_of_edges(), 15, cells)
        self.view.OtherPropsThroughLens = 0
        self.assertLess(self.width_of_edges(), 3)
