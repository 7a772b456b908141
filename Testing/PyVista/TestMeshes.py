# SPDX-License-Identifier: BSD-3-Clause
"""Meshes whose vertices do not tell the surface are surfels on their faces; clouds and dense meshes
keep their points."""

import os
import tempfile
import unittest
import warnings

import numpy as np
import pyvista as pv
from surfelsplatting.clouds import faces
from surfelsplatting.pyvista.points import points_of
from surfelsplatting.surfels import make_surfels

from plottercase import PlotterCase

SAMPLES = 20_000  # a tenth, for a tenth of the time
SPACING = (6 / SAMPLES) ** 0.5  # of the points on a cube; surfels at its edges move by half of it
CORNER = [(4, 3, 5), (0, 0, 0), (0, 1, 0)]  # camera that sees three sides of a cube


class Fewer(faces.vtkPointsOnFaces):
    def __init__(self):
        self.SetNumberOfPoints(SAMPLES)


faces.vtkPointsOnFaces = Fewer


def heated_cube():
    """pv.Cube() with what goes up with x from 0 to 1, and numbers of its vertices."""
    cube = pv.Cube()
    cube["heat"] = cube.points[:, 0] + 0.5
    cube["vertex"] = np.arange(cube.n_points)
    cube["name"] = [f"vertex {number}" for number in range(cube.n_points)]
    cube["is_right"] = cube.points[:, 0] > 0
    cube["RGB"] = np.round(255 * (cube.points + 0.5)).astype(np.uint8)
    cube.set_active_scalars("heat")
    return cube


def arrays_of(data):
    return {"points": np.asarray(data.points),
            **{name: np.asarray(data.point_data[name]) for name in data.point_data}}


class MeshCase(PlotterCase):
    @classmethod
    def setUpClass(cls):
        cls.cube = heated_cube()
        cls.surfels = cls.cube.surfels.estimate()

    def plotter(self, **options):
        pl = super().plotter(**options)
        pl.camera_position = CORNER
        return pl


class TestEstimate(MeshCase):
    def check_cube(self, surfels):
        self.assertAlmostEqual(surfels.n_points / SAMPLES, 1, delta=0.01)
        self.assertLess(np.abs(np.abs(surfels.points).max(axis=1) - 0.5).max(), SPACING / 2)
        areas = np.asarray(surfels["SurfelAreaVector"])
        self.assertAlmostEqual(np.linalg.norm(areas, axis=1).sum(), 6, delta=0.2)
        outward = (areas * surfels.points).sum(axis=1) > 0
        self.assertGreater(outward.mean(), 0.999)

    def test_points_on_faces(self):
        self.check_cube(self.surfels)
        self.assertTrue(self.surfels.surfels.are_estimated)
        self.assertEqual(self.cube.n_points, 8)  # the mesh itself stays
        self.assertEqual(self.cube.n_cells, 6)

    def test_point_data(self):
        """Real numbers and colours mix; others are those of a corner, which they tell."""
        x = self.surfels.points[:, 0] + 0.5
        np.testing.assert_allclose(self.surfels["heat"], x, atol=SPACING)
        self.assertEqual(self.surfels["RGB"].dtype, np.uint8)
        colors = 255 * (self.surfels.points + 0.5)
        self.assertLess(np.abs(self.surfels["RGB"] - colors).mean(), 1)
        self.assertEqual(self.surfels["vertex"].dtype, self.cube["vertex"].dtype)
        corners = self.cube.points[self.surfels["vertex"]]
        self.assertLess(np.linalg.norm(self.surfels.points - corners, axis=1).max(), 1)
        np.testing.assert_array_equal(self.surfels["is_right"], corners[:, 0] > 0)
        np.testing.assert_array_equal(self.surfels["name"], self.cube["name"][self.surfels["vertex"]])
        self.assertEqual(self.surfels.point_data.active_scalars_name, "heat")

    def test_normals_need_not_be_given(self):
        bare = pv.Cube()
        bare.point_data.clear()
        self.check_cube(bare.surfels.estimate(sides="given"))

    def test_other_kinds_of_meshes(self):
        strips = pv.Cube().triangulate().strip()
        self.assertGreater(strips.n_strips, 0)
        grid = pv.Cube().cast_to_unstructured_grid()
        blocks = pv.MultiBlock([pv.Cube().clip("x"), pv.Cube().clip("-x")]).combine()
        for mesh in (strips, grid, grid.extract_cells(range(6)), blocks):
            with self.subTest(type(mesh).__name__):
                self.check_cube(mesh.surfels.estimate())

    def test_sides_are_told_once(self):
        """Points on the faces of a room in centimetres, of which no parts are known any more, stay."""
        shell = pv.Box((0, 500, 0, 400, 0, 250))
        shell = pv.PolyData.from_regular_faces(shell.points, shell.regular_faces[:, ::-1])
        legs = [pv.Box((x, x + 10, y, y + 10, 0, 140)) for x in (100, 290) for y in (100, 210)]
        furnished = shell.append_polydata(pv.Box((100, 300, 100, 220, 140, 150)), *legs)
        points = points_of(furnished)
        np.testing.assert_array_equal(points_of(points)["Normals"], points["Normals"])

    def test_sheets_are_seen_from_both_sides(self):
        """Whichever way their faces are oriented: a plane and a terrain have no outside."""
        grid = pv.StructuredGrid(*np.meshgrid(np.arange(20.0), np.arange(20.0), [0.0]))
        terrain = pv.PolyData(pv.Plane(i_size=19, j_size=19, i_resolution=19, j_resolution=19))
        terrain.points[:, 2] = np.sin(terrain.points[:, 0] / 3)
        for mesh in (grid, terrain, terrain.flip_faces()):
            surfels = mesh.surfels.estimate()
            self.assertGreater(surfels.n_points, 0.75 * SAMPLES)
            self.assertTrue(surfels["SurfelTwoSided"].all())
            self.assertFalse(mesh.surfels.estimate(sides="given")["SurfelTwoSided"].any())
            picture = mesh.surfels.plot(return_img=True, window_size=(120, 90), color="white")
            self.assertGreater(picture.max(), 60)
        self.assertFalse(pv.Sphere(end_phi=90).surfels.estimate()["SurfelTwoSided"].any())

    def test_vertices_alone(self):
        """A way to keep them."""
        sphere = pv.Sphere(theta_resolution=40, phi_resolution=40)
        sphere["height"] = sphere.points[:, 2]
        surfels = sphere.cast_to_pointset().surfels.estimate()
        self.assertEqual(surfels.n_points, sphere.n_points)
        np.testing.assert_allclose(surfels["height"], surfels.points[:, 2], atol=1e-3)

    def test_surfaces_of_grids(self):
        """Of solid cells only the surface is drawn, with its scalars; and of structured grids."""
        block = pv.ImageData(dimensions=(9, 9, 9)).cast_to_structured_grid()
        sheet = pv.ImageData(dimensions=(9, 9, 1)).cast_to_structured_grid()
        for grid in (block, block.cast_to_unstructured_grid(), sheet):
            with self.subTest(type(grid).__name__, dimensions=grid.dimensionality):
                grid["height"] = grid.points[:, 1]
                surfels = grid.surfels.estimate()
                self.assertGreater(surfels.n_points, 0.95 * SAMPLES)
                np.testing.assert_allclose(surfels["height"], surfels.points[:, 1], atol=8 * SPACING)
                if grid is not sheet:
                    depth = np.minimum(surfels.points, 8 - surfels.points).min(axis=1)
                    self.assertLess(depth.max(), 8 * SPACING)
                self.assertEqual(sorted(surfels.array_names), sorted(
                    grid.extract_surface(algorithm="dataset_surface", pass_pointid=False,
                                         pass_cellid=False).surfels.estimate().array_names))

    def test_clouds_stay(self):
        """Bit by bit: points without cells, points with cells of their own, dense meshes."""
        dense = pv.Sphere(theta_resolution=230, phi_resolution=230)
        self.assertGreater(dense.n_points, 50_000)
        bare = pv.PolyData()
        bare.points = self.cloud_points()
        lines = pv.lines_from_points(self.cloud_points())
        for cloud in (pv.PolyData(self.cloud_points()), bare, lines, dense,
                      pv.PointSet(self.cloud_points())):
            with self.subTest(type(cloud).__name__), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                surfels, expected = cloud.surfels.estimate(), pv.wrap(make_surfels(cloud))
            found, expected = arrays_of(surfels), arrays_of(expected)
            self.assertEqual(list(found), list(expected))
            for name, values in expected.items():
                np.testing.assert_array_equal(found[name], values)

    @staticmethod
    def cloud_points():
        points = np.random.default_rng(1).normal(size=(3000, 3))
        return points / np.linalg.norm(points, axis=1)[:, None]

    def test_damaged_meshes(self):
        """Places that are not finite leave holes, and warn of nothing that numpy did."""
        places = np.array([[np.nan, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0], [np.inf, 1, 0]])
        mesh = pv.PolyData(places, faces=[3, 0, 1, 2, 3, 1, 2, 3, 3, 2, 3, 4])
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            surfels = mesh.surfels.estimate()
        self.assertGreater(surfels.n_points, 0.9 * SAMPLES)
        self.assertLess(surfels.points.sum(axis=1).max(), 1 + SPACING)

    def test_surfels_are_no_meshes(self):
        """Filters and files hand back surfels, of which nothing is made anew."""
        with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
            warnings.simplefilter("error")
            half = self.surfels.clip("x", origin=(0.1, 0, 0)).surfels.estimate()
            path = os.path.join(folder, "cube.vtp")
            self.surfels.save(path)
            self.assertTrue(pv.read(path).surfels.are_estimated)
        self.assertAlmostEqual(half.n_points / self.surfels.n_points, 0.6 * 2 / 3 + 1 / 6, delta=0.02)
        self.assertLess(half["heat"].max(), 0.61)
        linked = self.surfels.copy()
        linked.faces = [3, 0, 1, 2]
        self.assertEqual(linked.surfels.estimate(cleaning="off").n_points, self.surfels.n_points)


class TestDrawn(MeshCase):
    def drawn(self, *args, **options):
        pl = self.plotter()
        pl.surfels.add(*args, **{"show_scalar_bar": False, **options})
        return self.picture(pl)

    def test_covers_what_the_mesh_covers(self):
        pl = self.plotter()
        pl.add_mesh(self.cube, color="tan", lighting=False)
        expected = self.picture(pl).any(axis=2)
        covered = self.drawn(self.cube, color="tan", lighting=False).max(axis=2) > 100
        self.assertLess((covered != expected).sum(), 0.02 * expected.sum())

    def test_colors_are_those_of_the_mesh(self):
        for name, options in (("heat", {"cmap": "bwr"}), ("RGB", {"rgb": True})):
            pl = self.plotter()
            pl.add_mesh(self.cube, scalars=name, lighting=False, show_scalar_bar=False, **options)
            expected = self.picture(pl).astype(int)
            picture = self.drawn(self.cube, name, lighting=False, **options)
            self.assertLess(np.abs(picture - expected)[60:120, 90:150].mean(), 3)

    def test_scalars_of_vertices(self):
        """An array with a row for each vertex is as good as a name."""
        named = self.drawn(self.cube, "heat", cmap="bwr")
        np.testing.assert_array_equal(self.drawn(self.cube, self.cube["heat"], cmap="bwr"), named)
        with self.assertRaisesRegex(ValueError, r"the shape \(6,\), but there are 8 points"):
            self.drawn(self.cube, np.zeros(6))

    def test_scalars_of_cells(self):
        cube = self.cube.copy()
        cube.cell_data["side"] = np.arange(6.0)
        with self.assertRaisesRegex(ValueError, "'side' is one of cells.*cell_data_to_point_data"):
            cube.surfels.plot(scalars="side")
        self.drawn(cube.cell_data_to_point_data(), "side")

    def test_scalar_bar(self):
        pl = self.plotter()
        actor = pl.surfels.add(self.cube, "heat")
        self.assertEqual(list(pl.scalar_bars.keys()), ["heat"])
        np.testing.assert_allclose(actor.mapper.scalar_range, (0, 1), atol=1e-6)
        self.assertEqual(actor.mapper.array_name, "heat")

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            for extension in (".stl", ".ply", ".obj", ".vtp"):
                path = os.path.join(folder, "cube" + extension)
                pv.Cube().triangulate().save(path)
                actor = self.plotter().surfels.add(path)
                self.assertAlmostEqual(actor.mapper.dataset.n_points / SAMPLES, 1, delta=0.01)

    def test_picking(self):
        """Picks find places on faces, and by their numbers the vertices. (Of a cube that of VTK may find the
        back: it takes the point closest to the ray, unless a nearer one came before.)"""
        pl, square = self.plotter(), pv.Plane(i_resolution=1, j_resolution=1)
        square["vertex"] = np.arange(square.n_points)
        actor = pl.surfels.add(square)
        pl.camera_position = [(0.2, 0.3, 6), (0.2, 0.3, 0), (0, 1, 0)]
        pl.show(auto_close=False)
        picker = pv._vtk.vtkPointPicker()
        picker.SetTolerance(0.005)
        self.assertTrue(picker.Pick(120, 90, 0, pl.renderer))
        np.testing.assert_allclose(picker.GetPickPosition(), (0.2, 0.3, 0), atol=0.05)
        vertex = actor.mapper.dataset["vertex"][picker.GetPointId()]
        np.testing.assert_allclose(square.points[vertex], (0.5, 0.5, 0))

    def test_changes_in_place(self):
        """Surfels keep what the mesh was like until they are added anew; they can be changed, too."""
        mesh, pl = self.cube.copy(), self.plotter()
        options = {"scalars": "heat", "clim": (0, 1), "name": "cube", "show_scalar_bar": False}
        pl.surfels.add(mesh, **options)
        before = self.picture(pl).astype(int)
        mesh["heat"][:] = 0
        np.testing.assert_array_equal(self.picture(pl), before)
        actor = pl.surfels.add(mesh, **options)
        after = self.picture(pl)
        self.assertGreater(np.abs(after - before).max(), 50)
        self.assertEqual(len(pl.actors), 1)
        actor.mapper.dataset["heat"] = actor.mapper.dataset.points[:, 0] + 0.5
        self.assertLess(np.abs(self.picture(pl) - before).max(), 10)

    def test_plot_shows_all(self):
        """From above, as the command line shows it, and in one call."""
        options = {"screenshot": True, "return_img": True, "window_size": (240, 180)}
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            picture = self.cube.surfels.plot(coc=10, scalars=self.cube["heat"], show_scalar_bar=False,
                                             **options)
        covered = picture.max(axis=2) > 0
        self.assertTrue(covered[90, 120])
        self.assertFalse(covered[0].any() or covered[:, 0].any() or covered[-1].any())
        self.assertGreater(covered.mean(), 0.25)
        place = self.cube.surfels.plot(return_cpos=True)[0]
        sampled = pv.wrap(faces.on_faces(self.cube).data)
        np.testing.assert_array_equal(place, sampled.surfels.plot(return_cpos=True)[0])


if __name__ == "__main__":
    unittest.main()
