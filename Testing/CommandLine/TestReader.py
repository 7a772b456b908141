# SPDX-License-Identifier: BSD-3-Clause
"""vtkPointCloudReader: fields, types and containers of .ply and .pcd."""

import struct
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_DOUBLE, VTK_FLOAT

from surfelsplatting import vtkPointCloudReader
from toolcase import ToolCase, arrays_of, content_of, places_of, sphere, write, write_ply


def compress_lzf(data):
    """LZF without any back reference: literal runs of up to 32 bytes."""
    return b"".join(bytes([len(data[i:i + 32]) - 1]) + data[i:i + 32]
                    for i in range(0, len(data), 32))


def write_pcd(path, columns, form, width=None, height=1, viewpoint="0 0 0 1 0 0 0"):
    """columns: [(name, values, numpy type)], stored as ascii, binary or binary_compressed."""
    count = len(columns[0][1])
    types = [np.dtype(kind) for _, _, kind in columns]
    letters = {"f": "F", "u": "U", "i": "I"}
    header = ["# .PCD v0.7", "VERSION 0.7", "FIELDS " + " ".join(name for name, _, _ in columns),
              "SIZE " + " ".join(str(t.itemsize) for t in types),
              "TYPE " + " ".join(letters[t.kind] for t in types),
              "COUNT " + " ".join("1" for _ in columns), f"WIDTH {width or count}",
              f"HEIGHT {height}", f"VIEWPOINT {viewpoint}", f"POINTS {count}", f"DATA {form}", ""]
    values = [np.asarray(v).astype(t) for (_, v, _), t in zip(columns, types)]
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        if form == "ascii":
            for row in zip(*(v.tolist() for v in values)):
                file.write((" ".join(map(repr, row)) + "\n").encode())
        elif form == "binary":
            record = np.empty(count, [(f"c{i}", t) for i, t in enumerate(types)])
            for i, v in enumerate(values):
                record[f"c{i}"] = v
            file.write(record.tobytes())
        else:
            raw = b"".join(v.tobytes() for v in values)
            packed = compress_lzf(raw)
            file.write(struct.pack("<II", len(packed), len(raw)) + packed)


def write_mesh(path, form, lists, faces, name="vertex_indices", points=4):
    """Faces of four points, then of others at 0, with a list of other numbers before each; lists: the
    types of a length and of a corner."""
    kinds = {"uchar": "B", "ushort": "H", "uint": "I", "char": "b", "short": "h", "int": "i"}
    header = (f"ply\nformat {form} 1.0\nelement vertex {points}\nproperty float x\nproperty float y\n"
              f"property float z\nelement face {len(faces)}\nproperty list uchar float weights\n"
              f"property list {' '.join(lists)} {name}\nend_header\n").encode()
    places = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)] + [(0, 0, 0)] * (points - 4)
    if form == "ascii":
        rows = [*places, *((2, 0.5, 0.25, len(face), *face) for face in faces)]
        return write(path, header + "\n".join(" ".join(map(str, row)) for row in rows).encode())
    order, (length, corner) = "<" if "little" in form else ">", (kinds[kind] for kind in lists)
    return write(path, header + b"".join(struct.pack(order + "3f", *place) for place in places)
                 + b"".join(struct.pack(f"{order}Bff", 2, 0.5, 0.25)
                            + struct.pack(f"{order}{length}{len(face)}{corner}", len(face), *face)
                            for face in faces))


class TestReader(ToolCase):
    def read(self, path):
        reader = vtkPointCloudReader()
        reader.SetFileName(path)
        reader.Update()
        self.assertEqual(reader.GetErrorCode(), 0)
        return reader

    def failure(self, path):
        reader = vtkPointCloudReader()
        self.note_errors(reader)
        reader.SetFileName(path)
        reader.Update()
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 0)
        self.assertNotEqual(reader.GetErrorCode(), 0)
        self.assertEqual(len(self.errors), 1)
        return self.errors[0]

    def points(self, reader):
        return places_of(reader.GetOutput())

    def faces_of(self, *words, **options):
        output = self.read(write_mesh("mesh.ply", *words, **options)).GetOutput()
        cells = output.GetPolys()
        ends = vtk_to_numpy(cells.GetOffsetsArray()).tolist()
        corners = vtk_to_numpy(cells.GetConnectivityArray()).tolist()
        self.assertEqual(output.GetNumberOfVerts(), 0 if len(ends) > 1 else 1)
        return [corners[i:j] for i, j in zip(ends, ends[1:])]

    def test_ply_faces(self):
        faces = [[0, 1, 2], [3, 2, 1, 0], [], [0, 1, 2] * 100]
        for form in ("ascii", "binary_little_endian", "binary_big_endian"):
            for corner in ("char", "uchar", "short", "ushort", "int", "uint"):
                self.assertEqual(self.faces_of(form, ("uchar", corner), faces[:3]), faces[:3])
                self.assertEqual(self.faces_of(form, ("ushort", corner), faces), faces)
            self.assertEqual(self.faces_of(form, ("uint", "int"), faces, "vertex_index"), faces)
            self.assertEqual(self.faces_of(form, ("uint", "int"), faces, "edges"), [])
            # Corners that do not exist.
            self.assertEqual(self.faces_of(form, ("uchar", "int"), [[0, 1, 4], [2, 1, 0], [-1, 1, 2]]),
                             [[2, 1, 0]])
        content = content_of("mesh.ply")
        self.assertIn("cut short", self.failure(write("cut.ply", content[:-1])))

    def test_ply_faces_of_many_vertices_are_left_out(self):
        form = "binary_little_endian"
        for points, faces in ((200_000, [[0, 1, 2]]), (200_001, [])):
            self.assertEqual(self.faces_of(form, ("uchar", "int"), [[0, 1, 2]], points=points), faces)

    def test_ply_containers(self):
        points, colors = sphere(100)
        for form in ("ascii", "binary_little_endian", "binary_big_endian"):
            write_ply("cloud.ply", points, colors, -points, form=form)
            reader = self.read("cloud.ply")
            np.testing.assert_array_equal(self.points(reader), points.astype(np.float32))
            self.assertEqual(reader.GetOutput().GetPoints().GetDataType(), VTK_FLOAT)
            data = reader.GetOutput().GetPointData()
            np.testing.assert_array_equal(vtk_to_numpy(data.GetScalars()), colors)
            np.testing.assert_array_equal(vtk_to_numpy(data.GetNormals()),
                                          -points.astype(np.float32))
            self.assertEqual(set(arrays_of(reader.GetOutput())), {"RGB", "Normals"})

    def test_doubles_stay_doubles(self):
        utm = np.array([[691000.0, 5334000.0, 512.0]]) + np.arange(30).reshape(10, 3) * 1e-4
        columns = [(name, utm[:, i], "f8") for i, name in enumerate("xyz")]
        write_ply("utm.ply", utm, kind="double")
        write_ply("text.ply", utm, kind="double", form="ascii")
        write_pcd("utm.pcd", columns, "binary")
        write_pcd("packed.pcd", columns, "binary_compressed")
        write_pcd("text.pcd", columns, "ascii")
        for path in ("utm.ply", "text.ply", "utm.pcd", "packed.pcd", "text.pcd"):
            reader = self.read(path)
            self.assertEqual(reader.GetOutput().GetPoints().GetDataType(), VTK_DOUBLE, path)
            np.testing.assert_array_equal(self.points(reader), utm, path)

    def test_whole_numbers_of_four_bytes_stay_exact(self):
        centimetres = np.array([[69100012, 533400045, 4000000001], [69100013, 533400047, 5]])
        header = "\n".join(["ply", "format ascii 1.0", "element vertex 2", "property int x",
                            "property int y", "property uint z", "property uchar r",
                            "property uchar g", "property uchar b", "property short scalar_age",
                            "end_header", ""])
        rows = "\n".join(" ".join(map(str, [*row, 1, 2, 3, -7])) for row in centimetres)
        write("whole.ply", header + rows + "\n")
        reader = self.read("whole.ply")
        np.testing.assert_array_equal(self.points(reader), centimetres)
        arrays = arrays_of(reader.GetOutput())
        np.testing.assert_array_equal(arrays["RGB"], [[1, 2, 3]] * 2)
        np.testing.assert_array_equal(arrays["scalar_age"], [-7, -7])

    def test_pcd_containers(self):
        points, colors = sphere(100)
        packed = (colors.astype(np.uint32) << [16, 8, 0]).sum(axis=1).astype(np.uint32)
        columns = [(name, points[:, i], "f4") for i, name in enumerate("xyz")]
        columns += [("rgb", packed, "u4"), ("intensity", np.arange(100), "f4"),
                    ("label", np.arange(100) * 500, "u2")]
        for form in ("ascii", "binary", "binary_compressed"):
            write_pcd("cloud.pcd", columns, form)
            reader = self.read("cloud.pcd")
            np.testing.assert_array_equal(self.points(reader), points.astype(np.float32))
            arrays = arrays_of(reader.GetOutput())
            np.testing.assert_array_equal(arrays["RGB"], colors)
            np.testing.assert_array_equal(arrays["intensity"], np.arange(100))
            np.testing.assert_array_equal(arrays["label"], np.arange(100) * 500)
            self.assertEqual(arrays["label"].dtype, np.uint16)
            self.assertFalse(reader.GetHasViewpoint())
            self.assertEqual(reader.GetDimensions(), (100, 1))

    def test_colors_packed_into_floats(self):
        packed = np.array([0x00FF8001, 0x00102030], np.uint32).view(np.float32)
        columns = [(name, [0, 1], "f4") for name in "xyz"] + [("rgb", packed, "f4")]
        for form in ("binary", "binary_compressed"):
            write_pcd("cloud.pcd", columns, form)
            colors = arrays_of(self.read("cloud.pcd").GetOutput())["RGB"]
            np.testing.assert_array_equal(colors, [[255, 128, 1], [16, 32, 48]])

    def test_ply_with_a_camera_is_a_depth_image(self):
        """As PCL writes its organized clouds."""
        points = np.arange(36, dtype="<f4")
        nan = float("nan")
        for kind, size, expected in (
                ("int", (4, 3), (4, 3)), ("int", (40, 30), (12, 1)),  # the second is no cloud's
                ("float", (4.0, 3.0), (4, 3)), ("float", (1e30, 3.0), (12, 1)),
                ("float", (-4.0, -3.0), (12, 1)), ("float", (nan, nan), (12, 1))):
            header = ("ply\nformat binary_little_endian 1.0\nelement vertex 12\nproperty float x\n"
                      "property float y\nproperty float z\nelement camera 1\nproperty float view_px\n"
                      f"property {kind} viewportx\nproperty {kind} viewporty\nend_header\n")
            with open("camera.ply", "wb") as file:
                camera = struct.pack("<f" + 2 * kind[0], 0, *size)
                file.write(header.encode() + points.tobytes() + camera)
            reader = self.read("camera.ply")
            self.assertEqual(reader.GetDimensions(), expected)
            self.assertEqual(self.points(reader).ravel().tolist(), points.tolist())

    def test_ply_of_a_range_scanner(self):
        """A grid of three columns and two rows with three points; NaN where there is none."""
        values = [(i, i + 0.5, i + 0.25, 10 + i) for i in range(3)]
        cells = [[2], [], [0], [], [1], []]
        with open("range.ply", "w") as file:
            file.write("ply\nformat ascii 1.0\nobj_info num_cols 3\nobj_info num_rows 2\n"
                       "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                       "property short echo\nelement range_grid 6\n"
                       "property list uchar int vertex_indices\nend_header\n")
            for row in values + [[len(cell), *cell] for cell in cells]:
                file.write(" ".join(map(str, row)) + "\n")
        reader = self.read("range.ply")
        self.assertEqual(reader.GetDimensions(), (3, 2))
        expected = np.full((6, 3), np.nan)
        for cell, vertex in ((0, 2), (2, 0), (4, 1)):
            expected[cell] = values[vertex][:3]
        np.testing.assert_array_equal(self.points(reader), expected)
        self.assertEqual(arrays_of(reader.GetOutput())["echo"].tolist(), [12, 0, 10, 0, 11, 0])

    def test_ply_with_wrong_sizes_of_a_depth_image(self):
        """Sizes whose product overflows to the number of points, and a grid of hardly a point, whose
        cells would take any memory."""
        rows = 2 ** 31 + 1
        columns = 3 * pow(rows, -1, 2 ** 64) % 2 ** 64
        cells = [[0]] + [[]] * 3999
        for columns, rows, grid in ((columns, rows, []), (40, 100, cells)):
            with open("range.ply", "w") as file:
                file.write(f"ply\nformat ascii 1.0\nobj_info num_cols {columns}\nobj_info num_rows "
                           f"{rows}\nelement vertex 3\nproperty float x\nproperty float y\n"
                           f"property float z\nelement range_grid {len(grid)}\n"
                           "property list uchar int vertex_indices\nend_header\n")
                for row in [(i, i, i) for i in range(3)] + [[len(cell), *cell] for cell in grid]:
                    file.write(" ".join(map(str, row)) + "\n")
            reader = self.read("range.ply")
            self.assertEqual(reader.GetDimensions(), (3, 1))
            self.assertEqual(self.points(reader).tolist(), [[i, i, i] for i in range(3)])

    def test_separate_alpha(self):
        """Of any type; of no use where it is full."""
        for kind, full in (("uchar", 255), ("ushort", 65535), ("float", 1.0)):
            for alpha, expected in ((full, (255, 0, 0)), (0.2 * full, (255, 0, 0, 51))):
                alpha = alpha if kind == "float" else round(alpha)
                with open("alpha.ply", "w") as file:
                    file.write("ply\nformat ascii 1.0\nelement vertex 2\n" + "".join(
                        f"property {t} {name}\n" for t, name in [("float", c) for c in "xyz"] + [
                            (kind, c) for c in ("red", "green", "blue", "alpha")])
                        + f"end_header\n1 2 3 {full} 0 0 {alpha}\n4 5 6 {full} 0 0 {full}\n")
                [colors] = arrays_of(self.read("alpha.ply").GetOutput()).values()
                self.assertEqual(tuple(colors[0]), expected, kind)

    def test_alpha_that_says_nothing_is_dropped(self):
        columns = [(name, [0, 1], "f4") for name in "xyz"]
        for alphas, expected in (((0, 0), "RGB"), ((255, 255), "RGB"), ((255, 128), "RGBA"),
                                 ((7, 7), "RGBA")):
            packed = np.array([(alpha << 24) | 0x102030 for alpha in alphas], np.uint32)
            write_pcd("cloud.pcd", columns + [("rgba", packed, "u4")], "binary")
            arrays = arrays_of(self.read("cloud.pcd").GetOutput())
            self.assertEqual(list(arrays), [expected], alphas)
            np.testing.assert_array_equal(arrays[expected][:, :3], [[16, 32, 48]] * 2)
            if expected == "RGBA":
                np.testing.assert_array_equal(arrays["RGBA"][:, 3], alphas)

    def sensor(self, reader):
        """The field arrays."""
        fields = reader.GetOutput().GetFieldData()
        return {fields.GetArrayName(i): vtk_to_numpy(fields.GetArray(i)).ravel().tolist()
                for i in range(fields.GetNumberOfArrays())}

    def test_viewpoint(self):
        columns = [(name, np.arange(6), "f4") for name in "xyz"]
        write_pcd("grid.pcd", columns, "ascii", width=3, height=2)
        reader = self.read("grid.pcd")
        self.assertTrue(reader.GetHasViewpoint())
        self.assertEqual(reader.GetViewpoint(), (0, 0, 0))
        self.assertEqual(reader.GetDimensions(), (3, 2))
        self.assertEqual(self.sensor(reader), {"ScanViewpoint": [0, 0, 0], "ScanDimensions": [3, 2],
                                               "ScanBounds": [0, 5] * 3})
        write_pcd("seen.pcd", columns, "ascii", viewpoint="1 -2 3.5 1 0 0 0")
        reader.SetFileName("seen.pcd")
        reader.Update()
        self.assertTrue(reader.GetHasViewpoint())
        self.assertEqual(reader.GetViewpoint(), (1, -2, 3.5))
        self.assertEqual(self.sensor(reader), {"ScanViewpoint": [1, -2, 3.5],
                                               "ScanBounds": [0, 5] * 3})
        write_pcd("nan.pcd", [(name, [1, np.nan, 3], "f4") for name in "xyz"], "ascii", width=1,
                  height=3)
        reader = self.read("nan.pcd")
        self.assertEqual(self.sensor(reader)["ScanBounds"], [1, 3] * 3)
        self.assertEqual(self.sensor(reader)["ScanBounds"], list(reader.GetOutput().GetBounds()))
        write_pcd("anywhere.pcd", columns, "ascii")
        self.assertEqual(self.sensor(self.read("anywhere.pcd")), {})

    def test_nan_points_are_kept(self):
        write_pcd("nan.pcd", [(name, [1, np.nan, 3], "f4") for name in "xyz"], "binary")
        points = self.points(self.read("nan.pcd"))
        np.testing.assert_array_equal(np.isnan(points[:, 0]), [False, True, False])

    def test_ply_with_more_than_points(self):
        with open("mesh.ply", "w") as file:
            file.write("ply\r\nformat ascii 1.0\r\ncomment from elsewhere\r\nelement face 1\r\n"
                       "property list uchar int vertex_indices\r\nelement vertex 2\r\n"
                       "property float x\r\nproperty float y\r\nproperty float z\r\n"
                       "property float red\r\nproperty float green\r\nproperty float blue\r\n"
                       "property double time\r\nend_header\r\n3 0 1 0\r\n1 2 3 0 0.5 1 7.25\r\n"
                       "4 5 6 nan -1 0.25 8\r\n")
        reader = self.read("mesh.ply")
        np.testing.assert_array_equal(self.points(reader), [[1, 2, 3], [4, 5, 6]])
        arrays = arrays_of(reader.GetOutput())
        np.testing.assert_array_equal(arrays["RGB"], [[0, 128, 255], [0, 0, 64]])
        np.testing.assert_array_equal(arrays["time"], [7.25, 8])

    def test_real_colors_above_one_are_bytes(self):
        columns = [(name, [0, 1], "f4") for name in "xyz"]
        columns += [(name, [value, 300], "f4")
                    for name, value in (("red", 1), ("green", 2.4), ("blue", 99))]
        write_pcd("cloud.pcd", columns, "ascii")
        colors = arrays_of(self.read("cloud.pcd").GetOutput())["RGB"]
        np.testing.assert_array_equal(colors, [[1, 2, 99], [255, 255, 255]])

    def test_colors_whose_type_is_wider_than_they_are(self):
        for kind in ("u2", "u4", "i4", "f4"):
            for scale in (1, 257):
                columns = [(name, [0, 1], "f4") for name in "xyz"]
                columns += [(name, [value * scale, 255 * scale], kind)
                            for name, value in (("red", 1), ("green", 2), ("blue", 99))]
                write_pcd("cloud.pcd", columns, "binary")
                colors = arrays_of(self.read("cloud.pcd").GetOutput())["RGB"]
                np.testing.assert_array_equal(colors, [[1, 2, 99], [255, 255, 255]], (kind, scale))

    def test_text_of_other_types(self):
        """As numpy writes it, with faces behind, and empty lines"""
        head = ("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                "property uchar red\nproperty uchar green\nproperty uchar blue\n{}end_header\n")
        rows = "1 2 3 10.0 2e1 30.000000\n{}4 5 6 255 0 1\n7 8 9 {} 0 0\n"
        face = "element face 1\nproperty list uchar int vertex_indices\n"
        for more, blank, faces, line in (("", "\n", "", 14), (face, "", "3 0 1 2\n", 15)):
            write("cloud.ply", head.format(more) + rows.format(blank, "5.0") + faces)
            data = self.read("cloud.ply").GetOutput()
            np.testing.assert_array_equal(arrays_of(data)["RGB"], [[10, 20, 30], [255, 0, 1], [5, 0, 0]])
            self.assertEqual(data.GetNumberOfPolys(), len(faces) > 0)
            for word, says in (("red", f'line {line}, field red: "red" is not a number'),
                               ("5 6", f"line {line} has 7 values, but a point has 6"),
                               ("", f"line {line} has 5 values, but a point has 6")):
                write("cloud.ply", head.format(more) + rows.format(blank, word) + faces)
                self.assertIn(says, self.failure("cloud.ply"))

    def test_names_in_capitals(self):
        names = ("X", "Y", "Z", "Nx", "NY", "nZ", "R", "G", "B", "Alpha", "Intensity")
        write("cloud.ply", "ply\nformat ascii 1.0\nelement vertex 2\n" + "".join(
            f"property float {name}\n" for name in names)
            + "end_header\n1 2 3 0 0 1 1 0.2 0 0.4 7\n4 5 6 0 0 1 0 0 1 1 8\n")
        write_pcd("cloud.pcd", [(name, [row, row], "f4") for name, row in zip(names, range(11))], "ascii")
        arrays = arrays_of(self.read("cloud.ply").GetOutput())
        self.assertEqual(set(arrays), {"RGBA", "Normals", "Intensity"})
        np.testing.assert_array_equal(arrays["RGBA"], [[255, 51, 0, 102], [0, 0, 255, 255]])
        np.testing.assert_array_equal(self.points(self.read("cloud.pcd")), [[0, 1, 2]] * 2)

    def test_colors_that_nobody_has_set(self):
        points, _ = sphere(10)
        write_ply("cloud.ply", points, np.zeros((10, 3), np.uint8))
        write_pcd("cloud.pcd", [(name, [0, 1], "f4") for name in "xyz"] + [("rgb", [0, 0], "u4")],
                  "binary")
        for path in ("cloud.ply", "cloud.pcd"):
            self.assertEqual(arrays_of(self.read(path).GetOutput()), {})

    def test_can_read_goes_by_content(self):
        write_ply("cloud.dat", sphere(10)[0])
        write_pcd("cloud.bin", [(name, [1, 2], "f4") for name in "xyz"], "binary")
        write("fake.ply", "plywood\n")
        found = [vtkPointCloudReader.CanReadFile(name)
                 for name in ("cloud.dat", "cloud.bin", "fake.ply", "missing.ply")]
        self.assertEqual(found, [1, 1, 0, 0])
        self.assertEqual(self.read("cloud.dat").GetOutput().GetNumberOfPoints(), 10)

    def test_failures_name_the_file(self):
        self.assertIn("missing.ply", self.failure("missing.ply"))
        write_ply("cut.ply", sphere(100)[0])
        with open("cut.ply", "r+b") as file:
            file.truncate(700)
        self.assertIn("cut.ply", self.failure("cut.ply"))

    def test_damaged_files_do_not_crash(self):
        points, colors = sphere(40)
        write_ply("whole.ply", points, colors, form="ascii")
        write_pcd("whole.pcd", [(name, points[:, i], "f4") for i, name in enumerate("xyz")],
                  "binary_compressed")
        rng = np.random.default_rng(3)
        for name in ("whole.ply", "whole.pcd"):
            whole = content_of(name)
            for _ in range(150):
                damaged = bytearray(whole)
                for place in rng.integers(0, min(len(whole), 400), 3):
                    damaged[place] = rng.integers(0, 256)
                write("damaged" + name[-4:], damaged)
                reader = vtkPointCloudReader()
                self.note_errors(reader)
                reader.SetFileName("damaged" + name[-4:])
                reader.Update()
                if reader.GetErrorCode():
                    self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 0)


if __name__ == "__main__":
    unittest.main()
