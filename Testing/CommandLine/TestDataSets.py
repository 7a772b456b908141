# SPDX-License-Identifier: BSD-3-Clause
"""Points of VTK's files and vertices of meshes, written by hand as other programs write them."""

import base64
import json
import struct
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from surfelsplatting.formats.datasets import read_dataset
from surfelsplatting.formats.gltf import read_gltf_cloud
from surfelsplatting.formats.meshes import read_obj_cloud, read_stl_cloud
from surfelsplatting.formats.off import read_off_cloud
from surfelsplatting.formats.reading import read_cloud
from surfelsplatting.problems import UserProblem
from surfelsplatting.vtkmessages import VtkMessages
from toolcase import CAMERA, SMALL, ToolCase, arrays_of, places_of, sphere, write

UTM = np.array([691000.123, 5334000.456, 512.789])
POINTS = np.array([[0, 0, 0], [0.001, 0, 0], [0, 0.002, 0], [0, 0, 0.5]]) + UTM
COLORS = np.array([[255, 128, 0], [0, 0, 1], [9, 8, 7], [255, 255, 255]])


class Silent:
    def update(self, algorithm, _label):
        algorithm.Update()


def text_of(rows):
    return "\n".join(" ".join(map(repr, row)) for row in np.asarray(rows).tolist())


def vtu(colors=COLORS, kind="UInt8"):
    return f"""<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="0">
<PointData><DataArray type="{kind}" Name="rgb" NumberOfComponents="3" format="ascii">
{text_of(colors)}</DataArray>
<DataArray type="Int32" Name="intensity" format="ascii">7 8 9 10</DataArray></PointData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
{text_of(POINTS)}</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="ascii"/>
<DataArray type="Int32" Name="offsets" format="ascii"/>
<DataArray type="UInt8" Name="types" format="ascii"/></Cells>
</Piece></UnstructuredGrid></VTKFile>"""


def legacy(geometry):
    return (f"# vtk DataFile Version 3.0\nby hand\nASCII\n{geometry}POINT_DATA 4\n"
            f"COLOR_SCALARS rgb 3\n{text_of(COLORS / 255)}\nSCALARS intensity int\n"
            "LOOKUP_TABLE default\n7 8 9 10\n")


class TestDataSets(ToolCase):
    def setUp(self):
        super().setUp()
        self.messages = VtkMessages()

    def read(self, path, content):
        return read_dataset(write(path, content), self.messages, Silent())

    def check(self, cloud):
        np.testing.assert_array_equal(places_of(cloud), POINTS)
        np.testing.assert_array_equal(vtk_to_numpy(cloud.GetPointData().GetScalars()), COLORS)
        np.testing.assert_array_equal(arrays_of(cloud)["intensity"], [7, 8, 9, 10])

    def test_vtu(self):
        self.check(self.read("a.vtu", vtu()))
        self.check(self.read("a.vtu", vtu(COLORS * 257, "UInt16")))
        self.check(self.read("a.vtu", vtu(COLORS / 255, "Float64")))

    def test_colors_and_normals_in_arrays_of_their_own(self):
        """As of tables that ParaView has read"""
        columns = {"Red": COLORS[:, 0], "Green": COLORS[:, 1], "Blue": COLORS[:, 2], "nx": [0] * 4, "ny": [0] * 4,
                   "nz": [1] * 4}
        arrays = "".join(f'<DataArray type="Float64" Name="{name}" format="ascii">{" ".join(map(str, values))}</DataArray>'
                         for name, values in columns.items())
        cloud = self.read("a.vtu", vtu().replace("<PointData>", "<PointData>" + arrays).replace('"rgb"', '"other"'))
        self.check(cloud)
        np.testing.assert_array_equal(vtk_to_numpy(cloud.GetPointData().GetNormals()), [[0, 0, 1]] * 4)
        self.assertEqual(set(arrays_of(cloud)), {"RGB", "Normals", "intensity", "other"})

    def test_legacy(self):
        points = f"POINTS 4 double\n{text_of(POINTS)}\n"
        for kind, rest in (("POLYDATA", ""), ("UNSTRUCTURED_GRID", "CELLS 0 0\nCELL_TYPES 0\n")):
            self.check(self.read("a.vtk", legacy(f"DATASET {kind}\n{points}{rest}")))
        grid = f"DATASET STRUCTURED_GRID\nDIMENSIONS 2 2 1\n{points}"
        self.check(self.read("a.vtk", legacy(grid)))
        cloud = self.read("a.vtk", legacy("DATASET RECTILINEAR_GRID\nDIMENSIONS 2 2 1\n"
                                          "X_COORDINATES 2 double\n691000.123 691001.5\n"
                                          "Y_COORDINATES 2 double\n5334000.456 5334001\n"
                                          "Z_COORDINATES 1 double\n512.789\n"))
        np.testing.assert_array_equal(places_of(cloud)[3], [691001.5, 5334001, 512.789])

    def test_arrays_of_another_length(self):
        """They are left out, which is said: nobody can tell whose values they are."""
        fields = [("Normals", 3, 2), ("ToScanner", 3, 9), ("rgb", 4, 1), ("short", 1, 3), ("good", 1, 4)]
        text = "".join(f"{name} {width} {rows} float\n{'1 ' * (width * rows)}\n"
                       for name, width, rows in fields)
        for geometry in ("POLYDATA\n", "UNSTRUCTURED_GRID\n", "STRUCTURED_GRID\nDIMENSIONS 2 2 1\n"):
            path = write("a.vtk", "# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET " + geometry
                         + f"POINTS 4 double\n{text_of(POINTS)}\n"
                         + f"POINT_DATA 4\nFIELD more {len(fields)}\n{text}")
            cloud = read_cloud(path, self.messages, Silent())
            self.assertEqual(list(arrays_of(cloud.data)), ["good"])
            self.assertEqual(cloud.how, "left out, as they do not have a value for each point: Normals, "
                             "ToScanner, rgb, short")
            self.assertTrue(cloud.is_unsure)
        self.assertIn(cloud.how, self.info("a.vtk"))

    def test_vti(self):
        cloud = self.read("a.vti", """<VTKFile type="ImageData" version="0.1"><ImageData
 WholeExtent="0 1 0 1 0 0" Origin="691000.125 5334000.5 512" Spacing="0.25 0.5 1">
<Piece Extent="0 1 0 1 0 0"/></ImageData></VTKFile>""")
        np.testing.assert_array_equal(places_of(cloud)[3], [691000.375, 5334001, 512])

    def test_volume(self):
        """With scalars along three axes: not points, but what is between them."""
        write("a.vti", """<VTKFile type="ImageData" version="0.1"><ImageData WholeExtent="0 2 0 2 0 2">
<Piece Extent="0 2 0 2 0 2"><PointData Scalars="heat"><DataArray type="Float32" Name="heat"
format="ascii">""" + "0 0 0 0 9 0 0 0 0 " * 3 + "</DataArray></PointData></Piece></ImageData></VTKFile>")
        self.render("a.vti", *SMALL, "-o", "out.exr")
        self.assertGreater(self.read_rgba("out.exr")[24, 32, 3], 0.5)

    def test_extent_that_is_empty(self):
        content = """<VTKFile type="ImageData" version="0.1"><ImageData WholeExtent="0 3 9 4 0 5">
<Piece Extent="0 3 9 4 0 5"/></ImageData></VTKFile>"""
        self.assertEqual(self.read("a.vti", content).GetNumberOfPoints(), 0)

    def test_files_that_end_the_reader(self):
        # An unknown type of an array: a segmentation fault in VTK 9.1. Sizes: an exception.
        for content in (vtu().replace("Int32", "Int3x"), vtu().replace('Points="4', 'Points="-4'),
                        vtu().replace('Points="4', 'Points="400000000000')):
            with self.assertRaisesRegex(UserProblem, "damaged|not a readable"):
                self.read("a.vtu", content)
            self.messages.errors.clear()
        with self.assertRaisesRegex(UserProblem, "damaged|not a readable"):
            self.read("a.vtk", legacy("DATASET POLYDATA\nPOINTS 4000000000000 double\n1 2 3\n"))

    def test_legacy_that_is_cut_short(self):
        """VTK only warns, and leaves zeros for what is missing."""
        for kind, points in (("ASCII", text_of(POINTS).encode()), ("BINARY", POINTS.astype(">f8").tobytes())):
            head = f"# vtk DataFile Version 3.0\nby hand\n{kind}\nDATASET POLYDATA\nPOINTS 4 double\n".encode()
            with self.assertRaisesRegex(UserProblem, "a.vtk is not a readable .vtk file: Error reading"):
                self.read("a.vtk", head + points[:-30])
            self.messages.errors.clear()

    def test_message_that_is_no_text(self):
        words = legacy(f"DATASET POLYDATA\nPOINTS 4 double\n{text_of(POINTS)}\n").encode()
        write("a.vtk", words.replace(b"SCALARS intensity", b"\xff\xfe\xfa intensity"))
        said = self.tool("render", "a.vtk", "-o", "out.png")
        self.assertNotIn("Traceback", said)


def gltf(matrix=None):
    """The points in the middle of a tetrahedron, with 16-bit colours of linear light and normals."""
    local = (POINTS - UTM).astype("<f4")
    codes = COLORS / 255
    light = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    colors = np.column_stack([np.round(light * 65535), np.full(4, 65535)]).astype("<u2")
    normals = np.tile(np.array([0, 0, 1], "<f4"), (4, 1))
    buffer = local.tobytes() + colors.tobytes() + normals.tobytes()
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": 48},
             {"buffer": 0, "byteOffset": 48, "byteLength": 32, "byteStride": 8},
             {"buffer": 0, "byteOffset": 80, "byteLength": 48}]
    accessors = [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                 {"bufferView": 1, "componentType": 5123, "count": 4, "type": "VEC4",
                  "normalized": True},
                 {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"}]
    attributes = {"POSITION": 0, "COLOR_0": 1, "NORMAL": 2}
    place = {"matrix": matrix} if matrix else {"translation": UTM.tolist()}
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"children": [1]}, {"mesh": 0, **place}],
            "meshes": [{"primitives": [{"attributes": attributes, "mode": 0}]}],
            "accessors": accessors, "bufferViews": views,
            "buffers": [{"byteLength": len(buffer)}]}, buffer


class TestMeshes(ToolCase):
    def test_obj(self):
        rows = np.column_stack([POINTS, COLORS / 255])
        lines = "\n".join("v " + line for line in text_of(rows).splitlines())
        write("a.obj", f"# by hand\nmtllib a.mtl\n{lines}\nvn 0 0 1\nvt 0 0\nf 1//1 2//1 3//1\n")
        cloud = read_obj_cloud("a.obj")
        np.testing.assert_array_equal(places_of(cloud), POINTS)
        np.testing.assert_array_equal(arrays_of(cloud)["RGB"], COLORS)
        write("a.obj", lines.replace("v ", "v\t").replace("\n", "\r\n"))
        np.testing.assert_array_equal(places_of(read_obj_cloud("a.obj")), POINTS)
        for content, says in (("f 1 2 3\n", "no vertices"), ("v 1 2\n", "2 values"),
                              ("v 1 2 x\n", "not numbers"), ("v 1 2 3\nv 1 2\n", "not numbers: .* from 3 to 2")):
            with self.assertRaisesRegex(UserProblem, says):
                read_obj_cloud(write("bad.obj", content))

    def test_obj_of_several_meshes(self):
        """Of which some have colours: these are not those of all."""
        write("a.obj", "o a\nv 1 2 3\nv 4 5 6\no b\nv 7 8 9 1 0 0\n")
        cloud = read_obj_cloud("a.obj")
        np.testing.assert_array_equal(places_of(cloud), [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
        self.assertEqual(arrays_of(cloud), {})

    def test_marks_of_utf8(self):
        """Before the first line; it is a vertex, or the word that names the format."""
        lines = "v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 3\n"
        cells = "facet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 4 5 6\nvertex 7 8 10\nendloop\nendfacet\n"
        for path, read, text in (("a.obj", read_obj_cloud, lines),
                                 ("a.off", read_off_cloud, "OFF\n3 1 0\n1 2 3\n4 5 6\n7 8 10\n3 0 1 2\n"),
                                 ("a.stl", read_stl_cloud, f"solid a\n{cells}endsolid a\n"),
                                 ("b.stl", read_stl_cloud, f"solid a\n{cells}endsolid a\n".upper())):
            cloud = read(write(path, "\ufeff" + text))
            np.testing.assert_array_equal(places_of(cloud), [[1, 2, 3], [4, 5, 6], [7, 8, 10]], path)
            self.assertEqual(vtk_to_numpy(cloud.GetPolys().GetConnectivityArray()).tolist(), [0, 1, 2], path)

    def test_stl_text(self):
        facets = "".join("facet normal 0 0 1\nouter loop\n"
                         + "".join(f"vertex {text_of([POINTS[i]])}\n" for i in triangle)
                         + "endloop\nendfacet\n" for triangle in ((0, 1, 2), (1, 2, 3)))
        cloud = read_stl_cloud(write("a.stl", f"solid a\n{facets}endsolid a\n"))
        np.testing.assert_array_equal(places_of(cloud), np.unique(POINTS, axis=0))
        with self.assertRaisesRegex(UserProblem, "no vertices"):
            read_stl_cloud(write("a.stl", "solid a\nendsolid a\n"))
        with self.assertRaisesRegex(UserProblem, "not a whole .stl file: its last triangle has 2 of 3 vertices"):
            read_stl_cloud(write("a.stl", "solid a\n" + facets[:facets.rindex("vertex")]))

    def test_stl_binary(self):
        corners = (POINTS - UTM)[[[0, 1, 2], [1, 2, 3]]]
        content = b"solid, but binary".ljust(80) + struct.pack("<I", 2) + b"".join(
            struct.pack("<12fH", 0, 0, 1, *triangle.ravel(), 0) for triangle in corners)
        cloud = read_stl_cloud(write("a.stl", content))
        np.testing.assert_array_equal(places_of(cloud),
                                      np.unique((POINTS - UTM).astype(np.float32), axis=0))
        with self.assertRaisesRegex(UserProblem, "says 2 triangles, and it holds 1"):
            read_stl_cloud(write("a.stl", content[:-1]))

    def test_off(self):
        """With and without colours and normals; of many programs, some of which forget a line end."""
        ups = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
        bytes_, fractions = text_of(np.column_stack([POINTS, COLORS])), COLORS / 255
        alpha = np.column_stack([POINTS, fractions, np.ones(len(POINTS))])
        for head, rows in (("OFF\n4 2 0\n", bytes_), ("COFF 4 2 0\n", text_of(alpha)),
                           ("# by hand\n\nOFF4 2 0\n", bytes_.replace("\n", " # a\n\n"))):
            path = write("a.off", f"{head}{rows}\n3 0 1 2\n3 1 2 3 255 0 0\n")
            cloud = read_off_cloud(path)
            np.testing.assert_array_equal(places_of(cloud), POINTS)
            np.testing.assert_array_equal(arrays_of(cloud)["RGB"], COLORS)
            self.assertEqual(cloud.GetNumberOfPolys(), 2)
            np.testing.assert_array_equal(
                vtk_to_numpy(cloud.GetPolys().GetConnectivityArray()), [0, 1, 2, 1, 2, 3])
        rows = text_of(np.column_stack([POINTS, ups, COLORS]))
        cloud = read_off_cloud(write("a.off", f"CNOFF\n4 0 0\n{rows}\n"))
        np.testing.assert_array_equal(arrays_of(cloud)["Normals"], ups)
        np.testing.assert_array_equal(arrays_of(cloud)["RGB"], COLORS)
        self.assertEqual(cloud.GetNumberOfPolys(), 0)

    def test_damaged_off(self):
        for content, says in (("ply\n", "begins with 'ply'"), ("OFF BINARY\n4 2 0\n", "save it as text"),
                              ("OFF\n", "missing"), ("OFF\n0 0 0\n", "no points"),
                              ("OFF\n2 0 0\n1 2 3\n", "2 vertices, and holds 1"),
                              ("OFF\n1 0 0\n1 2 x\n", "not numbers"),
                              ("NOFF\n1 0 0\n1 2 3\n", "too few for NOFF"),
                              ("4OFF\n1 0 0\n1 2 3 4\n", "kind 4OFF")):
            with self.assertRaisesRegex(UserProblem, says):
                read_off_cloud(write("bad.off", content))
        rows = "1 0 0\n0 1 0\n0 0 1\n"
        faces = f"3 0 1 x\n3 0 1 {10 ** 30}\n3 0\n3 0 1 2"
        cloud = read_off_cloud(write("a.off", f"OFF\n3 4 0\n{rows}{faces}"))
        self.assertEqual(cloud.GetNumberOfPolys(), 3)
        self.render("a.off", "--up", "z", "-o", "a.png")

    def check_gltf(self, path):
        cloud = read_gltf_cloud(path)
        expected = (POINTS - UTM).astype(np.float32) + UTM
        np.testing.assert_array_equal(places_of(cloud), expected)
        np.testing.assert_array_equal(arrays_of(cloud)["RGB"], COLORS)
        np.testing.assert_array_equal(arrays_of(cloud)["Normals"], [[0, 0, 1]] * 4)

    def test_gltf(self):
        content, buffer = gltf()
        content["buffers"][0]["uri"] = "a%20b.bin"
        write("a b.bin", buffer)
        self.check_gltf(write("a.gltf", json.dumps(content)))
        inside = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
        content["buffers"][0]["uri"] = inside
        self.check_gltf(write("a.gltf", json.dumps(content)))
        content, _ = gltf([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, *UTM, 1])
        content["buffers"][0]["uri"] = inside
        cloud = read_gltf_cloud(write("a.gltf", json.dumps(content)))
        np.testing.assert_allclose(places_of(cloud), 2 * (POINTS - UTM) + UTM, rtol=1e-15)
        np.testing.assert_array_equal(arrays_of(cloud)["Normals"], [[0, 0, 1]] * 4)

    def test_glb(self):
        content, buffer = gltf()
        text = json.dumps(content).encode()
        text += b" " * (-len(text) % 4)
        write("a.glb", b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(buffer))
              + struct.pack("<I4s", len(text), b"JSON") + text
              + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer)
        self.check_gltf("a.glb")
        up = read_cloud("a.glb", None, None).data.GetFieldData().GetArray("ScanUp")
        self.assertEqual(up.GetTuple(0), (0, 1, 0))  # as the format says

    def test_gltf_with_its_nodes_in_no_scene(self):
        content, buffer = gltf()
        del content["scenes"], content["scene"]
        content["buffers"][0]["uri"] = "a.bin"
        write("a.bin", buffer)
        self.check_gltf(write("a.gltf", json.dumps(content)))

    def test_gltf_that_cannot_be_read(self):
        content, _ = gltf()
        shared = [{"children": [i + 1, i + 1]} for i in range(40)] + [{"mesh": 0}]
        for change, says in ((("buffers", [{"uri": "../../secret.bin"}]), "secret.bin"),
                             (("buffers", [{"uri": "/etc/passwd"}]), "not in a file beside it"),
                             (("nodes", [{"children": [1]}, {"children": [0]}]), "one another"),
                             (("nodes", shared), "many times"),
                             (("accessors", []), "not a readable"),
                             (("meshes", 3), "not a readable"),
                             (("bufferViews", [{"buffer": 0, "byteOffset": 1 << 60}]), "past")):
            damaged = {**content, change[0]: change[1]}
            with self.assertRaisesRegex(UserProblem, says):
                read_gltf_cloud(write("a.gltf", json.dumps(damaged)))
        for part, name in ((content["bufferViews"][0], "EXT_meshopt_compression"),
                           (content["meshes"][0]["primitives"][0], "KHR_draco_mesh_compression")):
            part["extensions"] = {name: {}}
            with self.assertRaisesRegex(UserProblem, f"{name}; store it without compression"):
                read_gltf_cloud(write("a.gltf", json.dumps(content)))
        with self.assertRaisesRegex(UserProblem, "begins with b'<!DOCTYPE html>' and is no JSON.* was all of it downl"):
            read_gltf_cloud(write("a.glb", "<!DOCTYPE html>"))

    def test_picture(self):
        points, colors = sphere()
        np.savetxt("rows", np.column_stack([points, colors / 255]), fmt="v %.9g %.9g %.9g %g %g %g")
        with open("rows") as file:
            write("ball.obj", file.read())
        self.render("ball.obj", *CAMERA, *SMALL, "-o", "out.exr")
        self.assertGreater(self.read_rgba("out.exr")[24, 32, 3], 0.9)


if __name__ == "__main__":
    unittest.main()
