# SPDX-License-Identifier: BSD-3-Clause
"""Meshes whose vertices do not tell the surface become points on their faces, others stay."""

import json
import struct
import unittest
from unittest import mock

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkBitArray, vtkStringArray
from vtkmodules.vtkCommonDataModel import VTK_QUAD, VTK_VOXEL, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkStripper
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from surfelsplatting.clouds.cloud import cloud_of
from surfelsplatting.clouds.faces import MOST_VERTICES, on_faces
from surfelsplatting.clouds.polydata import cells_of, polydata_of
from surfelsplatting.formats.reading import OF_MESHES, read_cloud
from surfelsplatting.notes import is_model
from toolcase import ToolCase, arrays_of, write, write_data

BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TRIANGLES = [side[i:j] + side[k:l] for side in SIDES for i, j, k, l in ((0, 3, 0, 0), (0, 1, 2, 4))]
SAMPLES, FEW_VERTICES, MODEL_VERTICES = 200_000, 50_000, 20_000
WHY = "points on the faces of its meshes, since its {} vertices are too {} to tell the surface"


def write_obj(path, rows, faces):
    lines = [" ".join(["v", *(f"{value:.17g}" for value in row)]) for row in rows]
    return write(path, "\n".join(lines + ["f " + " ".join(str(i + 1) for i in face)
                                          for face in faces]) + "\n")


def write_stl(path, places, triangles):
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *places[t].ravel(), 0) for t in triangles)
    return write(path, bytes(80) + struct.pack("<I", len(triangles)) + rows)


def read(path):
    progress = mock.Mock()
    progress.update = lambda algorithm, _label: algorithm.Update()
    return read_cloud(path, mock.Mock(), progress)


def places_of(cloud):
    return vtk_to_numpy(cloud.data.GetPoints().GetData())


def ball(steps):
    """-> [n, 3] vertices of an even mesh of a sphere, its triangles"""
    source = vtkSphereSource()
    source.SetThetaResolution(2 * steps)
    source.SetPhiResolution(steps)
    source.Update()
    mesh = source.GetOutput()
    return (vtk_to_numpy(mesh.GetPoints().GetData()).astype(float),
            vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3))


def _turn(a, b):
    """Twice the area of triangles with the origin."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def hull_area(points):
    """Of the convex hull of points in the plane."""
    points = points - points.mean(axis=0)
    area = 0.0
    for a in points:
        for b in points:
            if (a != b).any() and (_turn(b - a, points - a) > -1e-9).all():  # an edge of the hull
                area += _turn(a, b) / 2
    return area


class TestMeshFaces(ToolCase):
    def check_box(self, path, why="few", count=8):
        cloud = read(path)
        self.assertEqual(cloud.how, WHY.format(count, why))
        places, normals = places_of(cloud), arrays_of(cloud.data)["Normals"]
        self.assertAlmostEqual(len(places) / SAMPLES, 1, delta=0.001)
        on_side = np.minimum(np.abs(places), np.abs(places - 1)).min(axis=1)
        self.assertLess(on_side.max(), 1e-12)
        np.testing.assert_allclose(places.mean(axis=0), 0.5, atol=1e-3)
        outward = ((places + 0.001 * normals - 0.5).__abs__() > 0.5).any(axis=1)
        self.assertTrue(outward.all())
        self.assertEqual(cloud.data.GetNumberOfPolys(), 0)
        return cloud

    def test_silhouette_of_a_cube(self):
        """Of 12 triangles, as a CAD program writes it."""
        write_stl("cube.stl", BOX, TRIANGLES)
        self.check_box("cube.stl")
        eye, size, angle = np.array([3.5, 2.5, 4.0]), (320, 240), 30
        self.render("cube.stl", "--position", *eye, "--focal-point", 0.5, 0.5, 0.5, "--view-up",
                    0, 1, 0, "--view-angle", angle, "--size", *size, "-o", "out.exr")
        forward = (0.5 - eye) / np.linalg.norm(0.5 - eye)
        right = np.cross(forward, [0, 1, 0])
        right /= np.linalg.norm(right)
        seen = (BOX - eye) @ np.column_stack([right, np.cross(right, forward), forward])
        pixels = seen[:, :2] / seen[:, 2:] * size[1] / 2 / np.tan(np.radians(angle / 2))
        covered = self.read_rgba("out.exr")[:, :, 3].sum()
        self.assertAlmostEqual(covered / hull_area(pixels), 1, delta=0.01)

    def test_says_so(self):
        write_stl("cube.stl", BOX, TRIANGLES)
        self.assertIn(WHY.format(8, "few"), self.tool("render", "cube.stl", "-o", "a.png", "-v"))
        self.assertIn(WHY.format(8, "few"), self.info("cube.stl"))

    def test_scanned_mesh(self):
        """Its fins are thinner than its vertices are apart, and its axes are not known."""
        vertices, triangles = ball(120)
        vertices[:, 2] *= 0.002
        self.assertGreater(len(vertices), MODEL_VERTICES)
        cloud = read(write_obj("fin.obj", vertices, triangles))
        self.assertEqual(cloud.how, WHY.format(len(vertices), "few"))
        places, normals = places_of(cloud), arrays_of(cloud.data)["Normals"]
        inside = np.hypot(*places[:, :2].T) < 0.4
        self.assertGreater(inside.sum(), 1000)
        self.assertTrue((normals[inside, 2] * places[inside, 2] > 0).all())
        self.assertTrue(is_model(cloud.data))  # as all .obj files
        cells = cells_of(triangles.ravel(), np.arange(0, triangles.size + 1, 3))
        self.assertFalse(is_model(cloud_of(polydata_of(vertices, {}, cells)).data))
        vertices, triangles = ball(20)
        cells = cells_of(triangles.ravel(), np.arange(0, triangles.size + 1, 3))
        self.assertTrue(is_model(cloud_of(polydata_of(vertices, {}, cells)).data))

    def test_wire_beside_a_plate(self):
        """It has a hundredth of the area, and is a tenth as thick as points on all are apart."""
        plate, sides = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]], float), [[0, 1, 2, 3]]
        spacing = (100 / SAMPLES) ** 0.5
        angle, along = np.meshgrid(2 * np.pi * np.arange(6) / 6, np.linspace(0, 10, 41))
        radius = spacing / 2
        wire = np.column_stack([along.ravel(), radius * np.cos(angle.ravel()) + 5,
                                radius * np.sin(angle.ravel()) + 1])
        rings = [[4 + 6 * k + i, 4 + 6 * k + (i + 1) % 6, 10 + 6 * k + (i + 1) % 6, 10 + 6 * k + i]
                 for k in range(40) for i in range(6)]
        places = places_of(read(write_obj("a.obj", np.vstack([plate, wire]), sides + rings)))
        is_wire = places[:, 2] > 0.5
        self.assertGreater(np.diff(np.sort(places[is_wire, 0])).size, 10 / spacing * 10)
        self.assertLess(np.diff(np.sort(places[is_wire, 0])).max(), spacing)
        self.assertGreater((~is_wire).sum(), 0.6 * SAMPLES)

    def test_dense_mesh_stays(self):
        vertices, triangles = ball(165)
        self.assertGreater(len(vertices), FEW_VERTICES)
        cloud = read(write_obj("ball.obj", vertices, triangles))
        np.testing.assert_array_equal(places_of(cloud), vertices)
        self.assertEqual((cloud.how, arrays_of(cloud.data), cloud.data.GetNumberOfPolys()),
                         (OF_MESHES, {}, 0))
        cloud = read(write_stl("ball.stl", vertices, triangles))
        np.testing.assert_array_equal(places_of(cloud), np.unique(vertices, axis=0))
        few = ball(20)
        self.assertEqual(read(write_obj("few.obj", *few)).how, WHY.format(len(few[0]), "few"))

    def test_uneven_mesh(self):
        """A ball on a plate: most of the area has four vertices."""
        vertices, triangles = ball(165)
        plate = np.array([[-2, -2, -0.6], [2, -2, -0.6], [2, 2, -0.6], [-2, 2, -0.6]])
        rows = np.concatenate([vertices, plate])
        first = len(vertices)
        cloud = read(write_obj("a.obj", rows, [*triangles, first + np.arange(4)]))
        self.assertEqual(cloud.how, WHY.format(len(rows), "uneven"))
        low = np.abs(places_of(cloud)[:, 2] + 0.6) < 1e-9
        self.assertAlmostEqual(low.mean(), 16 / (16 + np.pi), delta=0.002)

    def test_points_are_even(self):
        points = places_of(read(write_obj("a.obj", [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
                                          [[0, 1, 2], [0, 2, 3]])))[:, :2]
        counts = np.histogram2d(*points.T, 100, [[0, 1], [0, 1]])[0]
        self.assertLess(counts.std(), 0.5 * np.sqrt(counts.mean()))  # 1.0 of points at random
        again = places_of(read("a.obj"))[:, :2]
        np.testing.assert_array_equal(points, again)

    def test_normals_are_smooth_but_for_creases(self):
        places, triangles = ball(20)  # of faces that meet at up to 9 degrees
        cloud = read(write_obj("ball.obj", places, triangles))
        found = places_of(cloud)
        normals = arrays_of(cloud.data)["Normals"]
        radial = found / np.linalg.norm(found, axis=1)[:, None]
        cosines = (normals * radial).sum(axis=1)
        self.assertGreater(cosines.min(), np.cos(np.radians(2.5)))
        cloud = read(write_obj("box.obj", BOX, SIDES))
        self.assertGreater(np.abs(arrays_of(cloud.data)["Normals"]).max(axis=1).min(), 0.999)

    def test_given_normals_are_sharp_at_creases(self):
        """A box with one normal for each corner, the mean of three sides, and of another order of
        corners: the normals tell what is outside. A ball's normals stay what they are."""
        triangles = np.array(TRIANGLES)
        for order in (triangles, triangles[:, ::-1]):
            write_data("box.vtp", polydata_of(BOX, {"Normals": BOX - 0.5},
                                              cells_of(order.ravel(), np.arange(0, 37, 3))))
            normals = arrays_of(self.check_box("box.vtp").data)["Normals"]
            self.assertGreater(np.abs(normals).max(axis=1).min(), 0.999)
        places, triangles = ball(20)
        write_data("ball.vtp", polydata_of(places, {"Normals": places}, cells_of(
            triangles.ravel(), np.arange(0, triangles.size + 1, 3))))
        cloud = read("ball.vtp")
        found = places_of(cloud) / np.linalg.norm(places_of(cloud), axis=1)[:, None]
        cosines = (arrays_of(cloud.data)["Normals"] * found).sum(axis=1)
        self.assertGreater(cosines.min(), np.cos(np.radians(1)))

    def test_faces_that_do_not_agree_have_no_sides(self):
        places, triangles = ball(20)
        mixed = triangles.copy()
        mixed[::4] = mixed[::4, ::-1]
        cloud = read(write_obj("mixed.obj", places, mixed))
        self.assertEqual(cloud.how, WHY.format(len(places), "few"))
        self.assertNotIn("Normals", arrays_of(cloud.data))
        apart = places[triangles].reshape(-1, 3)  # as in .stl files: they meet by their places
        cloud = read(write_obj("apart.obj", apart, np.arange(len(apart)).reshape(-1, 3)))
        self.assertIn("Normals", arrays_of(cloud.data))

    def test_colors(self):
        """Colours mix over a face, and so does what a .vtp has; classes stay what they are."""
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float) + [5e5, 5e6, 100]
        shades = np.array([[0, 0, 0.2], [1, 0, 0.2], [1, 1, 0.2], [0, 1, 0.2]])
        cloud = read(write_obj("a.obj", np.hstack([corners, shades]), [[0, 1, 2, 3]]))
        expected = np.column_stack([255 * (places_of(cloud) - corners[0])[:, :2],
                                    np.full(cloud.data.GetNumberOfPoints(), 51)])
        self.assertLess(np.abs(arrays_of(cloud.data)["RGB"] - expected).max(), 1)
        self.assertEqual(cloud.data.GetPointData().GetScalars().GetName(), "RGB")
        data = polydata_of(corners, {
            "RGB": np.round(255 * shades), "heat": shades[:, 0], "class": np.array([3, 9, 9, 3]),
            "Normals": np.array([[1, 0, 0], [1, 0, 0], [0, 0, 0], [0, 1, 0]])},
            cells_of([0, 1, 2, 3], [0, 4]))
        write_data("a.vtp", data)
        cloud = read("a.vtp")
        arrays, x = arrays_of(cloud.data), (places_of(cloud) - corners[0])[:, 0]
        self.assertLess(np.abs(arrays["heat"] - x).max(), 1e-6)
        self.assertEqual(set(arrays["class"]), {3, 9})
        np.testing.assert_allclose(np.linalg.norm(arrays["Normals"], axis=1), 1, rtol=1e-6)
        self.assertEqual(cloud.normals, ["Normals"])

    def write_ply(self, path, form, sides):
        header = (f"ply\nformat {form} 1.0\ncomment by hand\nelement vertex 8\n"
                  "property float x\nproperty float y\nproperty uchar red\nproperty uchar green\n"
                  f"property uchar blue\nproperty float z\nelement face {len(sides)}\n"
                  "property uchar flags\nproperty list uchar int vertex_indices\nend_header\n")
        rows = [(x, y, 250, 99, 0, z) for x, y, z in BOX]
        if form == "ascii":
            lines = [*rows, *((0, len(side), *side) for side in sides)]
            return write(path, header + "\n".join(" ".join(map(str, line)) for line in lines))
        order = ">" if "big" in form else "<"
        content = b"".join(struct.pack(order + "ffBBBf", *row) for row in rows)
        return write(path, header.encode() + content + b"".join(
            struct.pack(f"{order}BB{len(side)}i", 0, len(side), *side) for side in sides))

    def test_ply(self):
        """Of equal faces and of several kinds, as text and in both byte orders."""
        for sides in (SIDES, TRIANGLES, SIDES[:3] + TRIANGLES[6:]):
            for form in ("ascii", "binary_little_endian", "binary_big_endian"):
                cloud = self.check_box(self.write_ply("a.ply", form, sides))
                self.assertTrue((arrays_of(cloud.data)["RGB"] == [250, 99, 0]).all())

    def test_gltf(self):
        """Triangles by numbers, mirrored ones, strips and fans."""
        numbers = np.array(TRIANGLES, np.uint16)
        fan, strip = np.array([0, 1, 3, 2], np.uint16), np.array([4, 6, 5, 7], np.uint16)
        for matrix in (np.eye(4), np.diag([-1, 1, 1, 1])):
            parts = [(numbers[4:], 4), (fan, 6), (strip, 5)]
            blobs = [BOX.astype("<f4").tobytes(), *(part.tobytes() for part, _ in parts)]
            starts = np.cumsum([0, *map(len, blobs)])
            matrix = matrix.astype(float)
            matrix[0, 3] = matrix[0, 0] < 0  # x becomes 1 - x
            content = {
                "asset": {"version": "2.0"},
                "nodes": [{"mesh": 0, "matrix": matrix.T.ravel().tolist()}],
                "meshes": [{"primitives": [
                    {"attributes": {"POSITION": 0}, "indices": i + 1, "mode": mode}
                    for i, (_, mode) in enumerate(parts)]}],
                "accessors": [
                    {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
                    *({"bufferView": i + 1, "componentType": 5123, "count": part.size,
                       "type": "SCALAR"} for i, (part, _) in enumerate(parts))],
                "bufferViews": [{"buffer": 0, "byteOffset": int(start), "byteLength": len(blob)}
                                for start, blob in zip(starts, blobs)],
                "buffers": [{"uri": "a.bin", "byteLength": int(starts[-1])}]}
            write("a.bin", b"".join(blobs))
            cloud = read(write("a.gltf", json.dumps(content)))
            self.assertEqual(cloud.data.GetFieldData().GetArray("ScanUp").GetTuple(0), (0, 1, 0))
            self.check_box("a.gltf", count=24)

    def test_grids_of_faces(self):
        """Cells of an unstructured grid are faces, unless there are others."""
        for sides, count in ((SIDES, 6), ([*SIDES, range(8)], 7)):
            kinds = [VTK_QUAD] * 6 + [VTK_VOXEL]
            grid = vtkUnstructuredGrid()
            grid.SetPoints(polydata_of(BOX, {}).GetPoints())
            grid.SetCells(kinds[:count], cells_of(np.concatenate([*sides]),
                                                  np.cumsum([0, *map(len, sides)])))
            writer = vtkXMLUnstructuredGridWriter()
            writer.SetFileName("a.vtu")
            writer.SetInputData(grid)
            writer.Write()
            if count == 6:
                self.check_box("a.vtu")
            else:
                self.assertEqual(read("a.vtu").data.GetNumberOfPoints(), 8)

    def test_strips(self):
        data = polydata_of(BOX, {}, cells_of(np.ravel(TRIANGLES), np.arange(0, 37, 3)))
        stripper = vtkStripper()
        stripper.SetInputData(data)
        stripper.Update()
        self.assertGreater(stripper.GetOutput().GetNumberOfStrips(), 0)
        write_data("a.vtp", stripper.GetOutput())
        self.check_box("a.vtp")

    def test_concave_faces(self):
        """An L of one face, and quads that are numbered from the end."""
        corners = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
        rows = np.column_stack([corners, np.zeros(6)])
        places = places_of(read(write_obj("a.obj", rows, [[2, 3, 4, 5, 0, 1]])))
        self.assertFalse((places[:, :2] > 1).all(axis=1).any())
        self.assertAlmostEqual((places[:, :2] < 1).all(axis=1).mean(), 1 / 3, delta=0.002)
        lines = "".join("v {:g} {:g} {:g}\n".format(*row) for row in BOX)
        faces = "".join("f " + " ".join(f"{i - 8}/1/1" for i in side) + "\n" for side in SIDES)
        self.check_box(write("b.obj", lines + faces))

    def test_faces_that_are_none(self):
        """Without area or finite places, of vertices that are not there, lines, and words."""
        good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 2 0 0\nv 0 0 1e200\n"
        for lines in ("l 1 2 3\n", "f 1 2 4\n", "f 1 2 5\n", "f 1 1 2\n", "f 1 2 99\n", "f 1 2\n",
                      "f 1 2 0\n", "f 1 2 -9\n", "f 1 2 x/y\n", "f 1 2 \u00b3\n", "f\n", "",
                      "f 1 2 4 3\n", f"f 1 2 {'9' * 40}\n", "p 1\nf 1 5 2 1\n"):
            cloud = read(write("a.obj", good + lines))
            self.assertEqual((cloud.data.GetNumberOfPoints(), cloud.how), (6, OF_MESHES), lines)
        cloud = read(write("a.obj", "v nan 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 2 3 4\n"))
        self.assertEqual(cloud.how, WHY.format(4, "few"))
        self.assertTrue(np.isfinite(places_of(cloud)).all())
        np.testing.assert_array_equal(arrays_of(cloud.data)["Normals"][0], [0, 0, 1])

    def test_damaged_cells(self):
        for corners, ends in (([0, 1, 2], [0, 3, 2]), ([0, 1, 2], [0, 9]), ([0, 1, 99], [0, 3]),
                              ([0, -5, 2], [0, 3]), ([0, 1, 2], [-3, 0])):
            self.assertIsNone(on_faces(polydata_of(BOX, {}, cells_of(corners, ends))))

    def test_normals_that_are_none(self):
        data = polydata_of(BOX, {"Normals": np.zeros((8, 2))},
                           cells_of(np.ravel(TRIANGLES), np.arange(0, 37, 3)))
        write_data("a.vtp", data)
        self.check_box("a.vtp")

    def test_bits_and_texts(self):
        """Are those of one corner."""
        data = polydata_of(BOX, {"corner": np.arange(8)},
                           cells_of(np.ravel(TRIANGLES), np.arange(0, 37, 3)))
        bits, texts = vtkBitArray(), vtkStringArray()
        for array, name in ((bits, "bits"), (texts, "texts")):
            array.SetName(name)
            data.GetPointData().AddArray(array)
        for corner in range(8):
            bits.InsertNextValue(corner % 2)
            texts.InsertNextValue(f"corner {corner}")
        found = on_faces(data).data.GetPointData()
        corners = vtk_to_numpy(found.GetArray("corner"))
        for row in range(0, len(corners), 1000):
            self.assertEqual(found.GetAbstractArray("bits").GetValue(row), corners[row] % 2)
            self.assertEqual(found.GetAbstractArray("texts").GetValue(row), f"corner {corners[row]}")
        write_data("a.vtp", data)
        self.assertIn(WHY.format(8, "few"), self.tool("render", "a.vtp", "-o", "a.png", "-v"))

    def test_clouds_stay(self):
        """Points of which a few are corners of faces, and so many that faces do not count."""
        points = np.concatenate([BOX, np.random.default_rng(1).random((100, 3))])
        cells = cells_of(np.ravel(TRIANGLES), np.arange(0, 37, 3))
        self.assertIsNone(on_faces(polydata_of(points, {}, cells)))
        for count, is_mesh in ((MOST_VERTICES - 2, True), (MOST_VERTICES + 1, False)):
            points = np.random.default_rng(1).random((count, 3))
            cells = cells_of(np.arange(count), np.arange(0, count + 1, 3))
            self.assertEqual(on_faces(polydata_of(points, {}, cells)) is not None, is_mesh)
        self.assertIsNone(on_faces(vtkPolyData()))


if __name__ == "__main__":
    unittest.main()
