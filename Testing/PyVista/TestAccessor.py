# SPDX-License-Identifier: BSD-3-Clause
"""dataset.surfels, and files that PyVista reads with this package."""

import importlib.util
import os
import tempfile
import unittest
from unittest import mock
import warnings

import numpy as np
import pyvista as pv

from plottercase import PlotterCase, detail

HEADER = """VERSION .7
FIELDS x y z rgb
SIZE 4 4 4 4
TYPE F F F U
COUNT 1 1 1 1
WIDTH {width}
HEIGHT {height}
VIEWPOINT 0 0 0 1 0 0 0
POINTS {points}
DATA ascii
"""


def depth_image(columns=80, rows=60):
    """A wall seen from the origin along +z, with y down, as sensors have it."""
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, columns), np.linspace(-0.45, 0.45, rows))
    wall = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3) * 2
    return wall.astype(np.float32)


def write_pcd(path):
    """The wall, red at the left and blue at the right."""
    columns, rows = 80, 60
    points = depth_image(columns, rows)
    colors = np.where(points[:, 0] < 0, 0xFF0000, 0x0000FF)
    with open(path, "w", encoding="ascii") as file:
        file.write(HEADER.format(width=columns, height=rows, points=len(points)))
        file.writelines(f"{x} {y} {z} {c}\n" for (x, y, z), c in zip(points, colors))


def write_las(path, points):
    import laspy

    las = laspy.create()
    las.header.scales = [1e-4] * 3
    las.header.offsets = points.min(axis=0)
    las.x, las.y, las.z = points.T
    las.write(path)


def write_e57(path, points):
    import pye57

    with pye57.E57(path, mode="w") as file:
        file.write_scan_raw({f"cartesian{axis}": np.ascontiguousarray(column)
                             for axis, column in zip("XYZ", points.T)})


class TestAccessor(PlotterCase):
    def wall_file(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = os.path.join(folder.name, "wall.pcd")
        write_pcd(path)
        return path

    def test_pcd_files(self):
        cloud = pv.read(self.wall_file())
        self.assertIsInstance(cloud, pv.PolyData)
        np.testing.assert_allclose(cloud.points, depth_image(), atol=1e-6)
        np.testing.assert_array_equal(np.unique(cloud["RGB"], axis=0), [[0, 0, 255], [255, 0, 0]])

    def test_damaged_pcd_file(self):
        path = self.wall_file()
        with open(path, "w", encoding="ascii") as file:
            file.write("VERSION .7\nFIELDS x y\n")
        with self.assertRaisesRegex(Exception, "wall.pcd"):
            pv.read(path)

    def test_las_and_e57_files(self):
        points = depth_image().astype(float) + [4.5e5, 5.4e6, 0]
        with tempfile.TemporaryDirectory() as folder:
            for extension, package, write, begin in ((".las", "laspy", write_las, b"LASF"),
                                                     (".laz", "laspy", write_las, b"LASF"),
                                                     (".e57", "pye57", write_e57, b"ASTM-E57")):
                path = os.path.join(folder, "wall" + extension)
                with self.subTest(extension):
                    if importlib.util.find_spec(package):
                        write(path, points)
                        cloud = pv.read(path)
                        np.testing.assert_allclose(cloud.points, points, atol=1e-3)
                    else:
                        with open(path, "wb") as file:
                            file.write(begin)
                        with self.assertRaisesRegex(ValueError, "pip install"):
                            pv.read(path)

    def test_tables(self):
        """In files of all names that PyVista has no reader for; a guess is a warning."""
        with tempfile.TemporaryDirectory() as folder:
            for name in ("a.asc", "a.csv", "a.tsv", "a.txt", "a.xyz", "a.xyzn", "a.xyzrgb"):
                path = os.path.join(folder, name)
                with open(path, "w", encoding="ascii") as file:
                    file.write("1;2,5;3;255;0;0\n4;5,5;6;0;255;0\n")
                cloud = pv.read(path)
                np.testing.assert_array_equal(cloud.points, [[1, 2.5, 3], [4, 5.5, 6]], name)
                self.assertEqual(cloud["RGB"].dtype, np.uint8)
            with open(path, "w", encoding="ascii") as file:
                file.write("1 2 3 10 20 30 7\n" * 12)
            with self.assertWarnsRegex(UserWarning, "write their names into the first line"):
                pv.read(path)
            with open(path, "w", encoding="ascii") as file:
                file.write("no points")
            with self.assertRaisesRegex(ValueError, "it begins with 'no points'"):
                pv.read(path)

    def test_ptx_files(self):
        header = "1\n5\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n"
        rows = "".join(f"{x} 0 -5 0.5 255 0 0\n" for x in range(4)) + "0 0 0 0 0 0 0\n"
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "scan.ptx")
            with open(path, "w", encoding="ascii") as file:
                file.write(header + rows)
            cloud = pv.read(path)
            with open(path, "w", encoding="ascii") as file:
                file.write(header + "1 2\n")
            with self.assertRaisesRegex(ValueError, "its points have 2 numbers"):
                pv.read(path)
        np.testing.assert_array_equal(cloud.points, [[1 + x, 2, -2] for x in range(4)])
        np.testing.assert_array_equal(cloud["RGB"], [[255, 0, 0]] * 4)
        np.testing.assert_array_equal(cloud.field_data["ScanViewpoint"].ravel(), [1, 2, 3])

    def test_depth_image_without_rows(self):
        """Told by its pixels, and seen from its sensor, which also tells its sides."""
        u, v = np.meshgrid(np.arange(80) - 39.5, np.arange(60) - 29.5)
        z = 2 + 0.3 * np.sin(u / 9) * np.cos(v / 7)
        cloud = pv.PolyData(np.stack([u * z / 90, v * z / 90, z], axis=-1).reshape(-1, 3))
        self.assertEqual(cloud.surfels.estimate()["SurfelTwoSided"].max(), 0)
        position, middle, up = cloud.surfels.plot(return_cpos=True, off_screen=True)
        np.testing.assert_array_equal(position, [0, 0, 0])
        self.assertGreater(middle[2], 1)
        np.testing.assert_allclose(up, [0, -1, 0], atol=1e-3)
        self.assertFalse(cloud.field_data.keys())

    def test_one_call_from_file_to_picture(self):
        """The wall as its sensor saw it, with red to the left."""
        cloud = pv.read(self.wall_file())
        picture = cloud.surfels.plot(screenshot=True, return_img=True, window_size=(240, 180))
        self.assertEqual(picture.shape, (180, 240, 3))
        np.testing.assert_array_equal(picture[90, 60] > 100, [True, False, False])
        np.testing.assert_array_equal(picture[90, 180] > 100, [False, False, True])
        np.testing.assert_array_equal(picture[2, 2] > 100, [True, False, False])
        place = cloud.surfels.plot(return_cpos=True, off_screen=True)[0]
        np.testing.assert_array_equal(place, [0, 0, 0])

    def test_estimate(self):
        surfels = self.cloud.surfels.estimate()
        self.assertIsInstance(surfels, pv.PolyData)
        self.assertTrue(surfels.surfels.are_estimated)
        self.assertFalse(self.cloud.surfels.are_estimated)
        self.assertEqual(surfels.n_points, self.cloud.n_points)
        self.assertIn("height", surfels.point_data)
        areas = np.linalg.norm(surfels["SurfelAreaVector"], axis=1)
        self.assertAlmostEqual(areas.sum(), 4 * np.pi, delta=0.3)

    def test_options(self):
        estimate = self.cloud.surfels.estimate
        self.assertEqual(estimate()["SurfelTwoSided"].max(), 0)
        self.assertEqual(estimate(sides="two")["SurfelTwoSided"].min(), 1)
        self.assertIn("SurfelNodes", estimate().field_data)
        self.assertNotIn("SurfelNodes", estimate(hierarchy=False).field_data)
        facing = estimate(viewpoint=(0, 0, 9), cleaning="off")
        self.assertTrue((facing["SurfelAreaVector"][facing.points[:, 2] < -0.5, 2] > 0).all())

    def test_sensor_of_the_scan(self):
        """Known from the file, and no longer true of points that were moved."""
        cloud = pv.PolyData(depth_image())
        cloud.field_data["ScanViewpoint"] = [[0.0, 0.0, 0.0]]
        cloud.field_data["ScanDimensions"] = [[80, 60]]
        cloud.field_data["ScanBounds"] = [cloud.bounds]

        def surfels(scan):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return scan.surfels.estimate()

        seen = surfels(cloud)
        self.assertEqual(seen["SurfelTwoSided"].max(), 0)
        self.assertTrue((seen["SurfelAreaVector"][:, 2] < 0).all())
        moved = cloud.rotate_x(180)
        self.assertEqual(surfels(moved)["SurfelTwoSided"].min(), 1)
        part = cloud.extract_points(cloud.points[:, 0] > 0)
        self.assertEqual(surfels(part)["SurfelTwoSided"].min(), 1)

    def test_other_data_sets(self):
        sphere = pv.Icosphere(nsub=7)  # of 163842 vertices; with few ones: TestMeshes.py
        for data in (sphere, sphere.cast_to_unstructured_grid(), pv.PointSet(sphere.points)):
            with self.subTest(type(data).__name__):
                self.assertEqual(data.surfels.estimate().n_points, sphere.n_points)

    def test_errors_say_what_to_do(self):
        cases = [
            (ValueError, r"the dataset has no points \(0\)", pv.PolyData().surfels.estimate),
            (TypeError, "^ImageData is a grid without points", pv.ImageData().surfels.estimate),
            (ValueError, "sides is 'left'; it must be one of 'auto', 'two', 'given'",
             lambda: self.cloud.surfels.estimate(sides="left")),
            (ValueError, "none of the 5 points gives a surfel",
             pv.PolyData(np.full((5, 3), np.inf)).surfels.estimate),
            (ValueError, r"cpos is \[\(nan, 0, 6\), .*; it must be finite",
             lambda: self.surfels.surfels.plot(cpos=[(np.nan, 0, 6), (0, 0, 0), (0, 1, 0)])),
            (ValueError, "there is no point array 'heat'; there are 'height', 'RGB', 'stripes'",
             lambda: self.cloud.surfels.plot(scalars="heat")),
            (TypeError, "surfels.plot has no argument 'point_size'; surfels have no point_size",
             lambda: self.cloud.surfels.plot(point_size=5)),
            (TypeError, "surfels.estimate has no argument 'side'; did you mean 'sides'",
             lambda: self.cloud.surfels.estimate(side="two")),
            (TypeError, "surfels.plot has no argument 'ssao'; a pyvista.Plotter",
             lambda: self.cloud.surfels.plot(ssao=True)),
            (TypeError, "surfels.plot has no argument 'blur'; coc is the blur",
             lambda: self.cloud.surfels.plot(blur=10)),
        ]
        for kind, text, call in cases:
            with self.subTest(text), self.assertRaisesRegex(kind, text), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                call()

    def test_progress_bar(self):
        """PyVista's, and an end that is asked for while the filter runs."""
        seen = []

        class Monitor:
            def __init__(self, algorithm, message):
                algorithm.AddObserver("ProgressEvent", lambda filters, _: self.note(filters))

            def note(self, filters):
                seen.append(filters.GetProgress())

            __enter__ = __exit__ = lambda *_: None

        class Stopping(Monitor):
            def note(self, filters):
                filters.AbortExecuteOn()

        name = "surfelsplatting.pyvista.accessor.ProgressMonitor"
        with mock.patch(name, Monitor):
            self.cloud.surfels.estimate()
            self.assertEqual(seen, [])
            self.cloud.surfels.estimate(progress_bar=True)
        self.assertEqual(seen, sorted(seen))
        self.assertEqual(seen[-1], 1.0)
        with mock.patch(name, Stopping), self.assertRaises(KeyboardInterrupt):
            self.cloud.surfels.estimate(progress_bar=True)

    def test_plot(self):
        options = {"return_img": True, "screenshot": True, "window_size": (240, 180),
                   "cpos": [(0, 0, 6), (0, 0, 0), (0, 1, 0)], "show_scalar_bar": False}
        sharp, blurred = (self.surfels.surfels.plot(
            scalars="stripes", cmap="gray", coc=coc, background="navy", **options)
            for coc in (None, 60))
        np.testing.assert_array_equal(sharp[0, 0], [0, 0, 128])
        # In focus: the surface in the middle, not the sphere's centre.
        middle, edge = (slice(85, 95), slice(110, 130)), (slice(85, 95), slice(40, 90))
        self.assertGreater(detail(blurred[middle]), 0.7 * detail(sharp[middle]))
        self.assertLess(detail(blurred[edge]), 0.7 * detail(sharp[edge]))

    def test_arguments_of_pyvistas_plot(self):
        """Each of them changes the picture."""
        options = {"return_img": True, "screenshot": True, "window_size": (240, 180)}
        plain = self.surfels.surfels.plot(show_axes=False, **options)
        for more in ({"show_axes": True}, {"show_bounds": True}, {"text": "scan"}, {"zoom": 1.5}):
            picture = self.surfels.surfels.plot(**{"show_axes": False, **more}, **options)
            self.assertGreater(np.abs(picture.astype(int) - plain).max(), 50, more)
        size = [(self.surfels.surfels.plot(zoom=zoom, **options) > 0).any(axis=2).mean()
                for zoom in (1.0, 1.5)]
        self.assertGreater(size[1], 1.5 * size[0])
        for nothing in ({"show_bounds": False}, {"text": ""}, {"zoom": None}):
            np.testing.assert_array_equal(
                self.surfels.surfels.plot(**nothing, show_axes=False, **options), plain)

    def test_cells(self):
        """Still pictures are drawn through seven cells of the lens, unless others are wanted."""
        pl = self.plotter()
        pl.surfels.add(self.surfels, "stripes", show_scalar_bar=False)
        pl.add_mesh(pv.Cube(center=(0.3, 0, 2), x_length=0.4, y_length=0.4), color="red")
        pl.surfels.lens(coc=60, focus=(0, 0, 1))
        self.assertEqual(pl.surfels.splatter.GetLensCells(), 7)
        still = self.picture(pl)
        pl.surfels.lens(cells=1)
        one = self.picture(pl)
        self.assertGreater(np.abs(still.astype(int) - one).max(), 3)
        pl.surfels.lens(coc=60)
        self.assertEqual(pl.surfels.splatter.GetLensCells(), 1)  # what is not given stays
        pl.surfels.lens(cells=7)
        pl.render_window.SetDesiredUpdateRate(30)  # the mouse turns the plot
        np.testing.assert_array_equal(self.picture(pl), one)


class TestLargeCoordinates(PlotterCase):
    """Surfels in coordinates of a country, such as UTM, are where the points are."""

    OFFSET = np.array([691608.0, 5334780.0, 512.0])
    TOLERANCE = 0.005  # of picks, in diagonals of the window, 300 px; a pixel is 0.018 wide

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.far = pv.PolyData(cls.cloud.points + cls.OFFSET)
        cls.far["height"] = cls.cloud["height"]
        cls.far_surfels = cls.far.surfels.estimate()

    def picture_at(self, surfels, offset):
        pl = self.plotter()
        pl.surfels.add(surfels, "height", show_scalar_bar=False)
        pl.camera_position = [offset + (0, 0, 6), offset, (0, 1, 0)]
        pl.surfels.lens(coc=30, focus=offset + (0, 0, 1))
        return self.picture(pl).astype(int)

    def test_points_are_in_the_world(self):
        self.assertEqual(self.far_surfels.points.dtype, np.float64)
        np.testing.assert_allclose(self.far_surfels.bounds, self.far.bounds, atol=0.05)
        self.assertEqual(self.surfels.points.dtype, np.float32)  # where that is enough

    def test_pictures(self):
        """The same as near the origin, with and without level of detail."""
        near = self.picture_at(self.surfels, np.zeros(3))
        rough = self.far.surfels.estimate(hierarchy=False)
        for surfels in (self.far_surfels, rough):
            self.assertLess(np.abs(self.picture_at(surfels, self.OFFSET) - near).mean(), 0.5)

    def test_clip(self):
        half = self.far_surfels.clip("x", origin=self.OFFSET)
        self.assertAlmostEqual(half.n_points / self.far.n_points, 0.5, delta=0.05)
        np.testing.assert_allclose(half.surfels.estimate().center, half.center, atol=0.05)

    def picked(self, surfels, offset):
        pl = self.plotter()
        pl.surfels.add(surfels)
        pl.camera_position = [offset + (0, 0, 6), offset, (0, 1, 0)]
        pl.show(auto_close=False)
        seen = pv._vtk.vtkPropPicker()  # reads the dots' depth
        self.assertTrue(seen.Pick(140, 100, 0, pl.renderer))
        self.assertAlmostEqual(np.linalg.norm(seen.GetPickPosition() - offset), 1, delta=0.05)
        picker = pv._vtk.vtkPointPicker()
        picker.SetTolerance(self.TOLERANCE)
        self.assertTrue(picker.Pick(140, 100, 0, pl.renderer))
        return np.array(picker.GetPickPosition())

    def test_picking(self):
        near = self.picked(self.surfels, np.zeros(3))
        self.assertAlmostEqual(np.linalg.norm(near), 1, delta=0.05)
        far = self.picked(self.far_surfels, self.OFFSET)
        # VTK picks the nearest of all points within the tolerance, about 1.5 px: two points that are
        # as near, which of them depends on last bits, are up to 3 px from one another.
        np.testing.assert_allclose(far - self.OFFSET, near, atol=3 * 0.018)

    def test_files_with_an_origin(self):
        """As the tool writes them."""
        local = self.far_surfels.copy()
        local.points = (local.points - self.OFFSET).astype(np.float32)
        local.field_data["SurfelOrigin"] = [self.OFFSET]
        del local.field_data["SurfelPlaces"]
        pl = self.plotter()
        actor = pl.surfels.add(local)
        np.testing.assert_allclose(actor.mapper.dataset.center, self.OFFSET, atol=0.01)


class TestChangedSurfels(PlotterCase):
    """Surfels that other filters moved or selected: what was estimated holds for some of them only."""

    def test_coordinates_of_too_few_digits(self):
        far = pv.PolyData((self.cloud.points + [691000, 5334000, 500]).astype(np.float32))
        with self.assertWarnsRegex(UserWarning, "the coordinates have steps of 0.5"):
            far.surfels.estimate()

    def picture_of(self, surfels):
        return surfels.surfels.plot(window_size=(160, 120), screenshot=True, return_img=True)

    def test_selected(self):
        """Each point has a cell, which filters of cells need. Surfels that are selected stay as they
        are, with a hierarchy of their own."""
        self.surfels["number"] = np.arange(self.surfels.n_points)
        half = self.surfels.threshold(self.surfels.n_points // 2, scalars="number")
        self.assertAlmostEqual(half.n_points, self.surfels.n_points / 2, delta=2)
        for part in (half, self.surfels.clip("x")):
            self.assertFalse(part.surfels.are_estimated)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                surfels = part.surfels.estimate()
            self.assertTrue(surfels.surfels.are_estimated)
            self.assertEqual(surfels.field_data["SurfelLeaves"].sum(), part.n_points)
            before, after = (np.sort(cloud["SurfelAreaVector"], axis=0) for cloud in (part, surfels))
            np.testing.assert_array_equal(before, after)
        again = surfels.clip("y").surfels.estimate()
        self.assertAlmostEqual(again.n_points / surfels.n_points, 0.5, delta=0.1)

    def test_points_replaced(self):
        """Arrays of the points that were there before do not fit and tell nothing."""
        surfels = self.surfels.copy()
        points = pv.vtk_points(self.cloud.points[:3000])
        surfels.SetPoints(points)
        with self.assertWarnsRegex(UserWarning, "which are made anew"):
            self.assertEqual(surfels.surfels.estimate().n_points, 3000)

    def test_selected_and_turned(self):
        """What was selected, or is little, does not tell whether it was turned."""
        for change in (lambda data: data.rotate_z(30), lambda data: data.rotate_z(90)):
            with self.assertWarnsRegex(UserWarning, "made anew") as caught:
                turned = change(self.surfels.clip("y")).surfels.estimate()
            self.assertEqual(caught.filename, __file__)
            areas = turned["SurfelAreaVector"]
            normals = areas / np.linalg.norm(areas, axis=1)[:, None]
            cosines = np.einsum("ij,ij->i", normals, turned.points)
            self.assertGreater(np.abs(cosines).mean(), 0.98)
        few = self.surfels.extract_points(np.arange(20) * 400)
        with self.assertWarnsRegex(UserWarning, "made anew"):
            few.surfels.estimate()

    def test_moved(self):
        before = self.picture_of(self.surfels)
        with self.assertWarnsRegex(UserWarning, "made anew"):
            after = self.picture_of(self.surfels.translate((50, 0, 0)))
        self.assertLess(np.abs(after.astype(int) - before).mean(), 1)

    def test_saved(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "surfels.vtp")
            self.surfels.save(path)
            self.assertTrue(pv.read(path).surfels.are_estimated)


if __name__ == "__main__":
    unittest.main()
