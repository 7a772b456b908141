# SPDX-License-Identifier: BSD-3-Clause
"""The tool reads every format, and the same cloud makes the same picture in each of them."""

import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData

from surfelsplatting.formats.npy import read_npy_cloud
from surfelsplatting.problems import UserProblem
from surfelsplatting.vtkarrays import named_array
from TestReader import write_pcd
from toolcase import (CAMERA, SMALL, ToolCase, arrays_of, content_of, places_of, sphere, write,
                      write_data, write_ply)


def pcd_columns(points, colors, kind="f4"):
    packed = (colors[:, :3].astype(np.uint32) << [16, 8, 0]).sum(axis=1).astype(np.uint32)
    if colors.shape[1] == 4:
        packed |= colors[:, 3].astype(np.uint32) << 24
    name = "rgba" if colors.shape[1] == 4 else "rgb"
    return [(axis, points[:, i], kind) for i, axis in enumerate("xyz")] + [(name, packed, "u4")]


def write_vtp(path, points, colors):
    cloud = vtkPolyData()
    vertices = vtkPoints()
    vertices.SetData(named_array("Points", points))
    cloud.SetPoints(vertices)
    cloud.GetPointData().SetScalars(named_array("paint", colors))
    write_data(path, cloud)


class TestFormats(ToolCase):
    def picture(self, cloud):
        self.render(cloud, *CAMERA, *SMALL, "-o", "out.exr")
        return self.read_rgba("out.exr")

    def test_same_picture_from_every_format(self):
        points, colors = sphere()
        points = points.astype(np.float32).astype(np.float64)
        write_ply("ref.ply", points, colors)
        reference = self.picture("ref.ply")
        self.assertGreater(reference[24, 32, 3], 0.9)

        write_ply("ascii.ply", points, colors, form="ascii")
        write_ply("big.ply", points, colors, form="binary_big_endian")
        write_ply("double.ply", points, colors, kind="double")
        write_ply("UPPER.PLY", points, colors)
        for form in ("ascii", "binary", "binary_compressed"):
            write_pcd(f"{form}.pcd", pcd_columns(points, colors), form)
        write_vtp("cloud.vtp", points.astype(np.float32), colors)
        rows = np.column_stack([points, colors])
        np.savetxt("cloud.xyz", rows, fmt="%.17g")
        np.savetxt("cloud.txt", rows, fmt="%.17g", delimiter=",", header="x,y,z,r,g,b")
        np.savetxt("cloud.tsv", rows, fmt="%.17g", delimiter="\t", header="x\ty\tz\tr\tg\tb", comments="")
        np.savetxt("cloud.xyzrgb", rows, fmt="%.17g")
        np.save("cloud.npy", rows)
        for name in ("cloud.npy", "cloud.tsv", "cloud.xyzrgb", "ascii.ply", "big.ply", "double.ply", "UPPER.PLY",
                     "ascii.pcd", "binary.pcd", "binary_compressed.pcd", "cloud.vtp", "cloud.xyz", "cloud.txt"):
            np.testing.assert_allclose(self.picture(name), reference, atol=2e-3, err_msg=name)

    def test_content_counts_not_the_name(self):
        """Downloads and copies have other names, and so have files that somebody has renamed in hope."""
        points, colors = sphere(600)
        write_ply("ball.ply", points, colors)
        write_pcd("ball.pcd", pcd_columns(points, colors), "binary")
        np.save("ball.npy", points)
        for name in ("ball.ply", "ball.pcd", "ball.npy"):
            expected = self.report(name)
            for other in ("ball", "ball (1)", "ball.xyz", "ball.las", "ball.bak", "ball.gz"):
                write(other, content_of(name))
                report = self.report(other)
                self.assertEqual({**report, "file": name}, expected)

    def test_arrays_of_numpy(self):
        """Of rows, of pictures of points, and of records with names; what is no table of points is refused."""
        points, colors = sphere(600)
        records = np.rec.fromarrays([*points.T, *colors.T, np.arange(600)], names="X,Y,Z,R,G,B,ring")
        nested = np.empty(600, [("position", "f8", 3), ("rgb", "u1", 3), ("ring", "i4")])
        nested["position"], nested["rgb"], nested["ring"] = points, colors, records.ring
        for array, fields in ((points.astype(np.float32), []), (points.reshape(20, 30, 3), []),
                              (np.column_stack([points, colors]), ["RGB"]), (nested, ["RGB", "ring"]),
                              (nested.reshape(20, 30), ["RGB", "ring"]), (records, ["RGB", "ring"])):
            np.save("cloud.npy", array)
            cloud = read_npy_cloud("cloud.npy")[0]
            np.testing.assert_allclose(places_of(cloud), points, atol=1e-7)
            self.assertEqual(list(arrays_of(cloud)), fields)
        for array, says in ((points.T, "save its transpose"), (points[:, 0], "shape is"), (points[:, :2], "shape is"),
                            (points + 0j, "complex128"), (records[["X", "Y"]], "fields X, Y; a point has at least"),
                            (np.array([{}]), "no real numbers|pickle")):
            np.save("bad.npy", array)
            with self.assertRaisesRegex(UserProblem, f"bad.npy is not a .npy file of points: .*{says}"):
                read_npy_cloud("bad.npy")
        content = content_of("cloud.npy")
        for damaged in (b"", b"hello", content[:40], content[:-100], content[:20] + b"\xff" * 9 + content[29:],
                        content.replace(b"}", b" ", 1), content.replace(b"(600,)", b"(6e9,)", 1),
                        content.replace(b"(600,)", b"(9**9)", 1)):
            write("bad.npy", damaged)
            with self.assertRaisesRegex(UserProblem, "bad.npy"):
                read_npy_cloud("bad.npy")

    def test_alpha_makes_a_cloud_translucent(self):
        points, colors = sphere()
        half = np.column_stack([colors, np.full(len(colors), 128, np.uint8)])
        write_ply("half.ply", points, half)
        write_pcd("half.pcd", pcd_columns(points, half), "binary_compressed")
        for name in ("half.ply", "half.pcd"):
            self.assertAlmostEqual(self.picture(name)[24, 32, 3], 128 / 255, delta=0.05)

    def test_given_normals_decide_what_is_outside(self):
        points, colors = sphere()
        write_ply("out.ply", points, colors, normals=points)
        write_ply("in.ply", points, colors, normals=-points)
        # Seen from +z: the near half, or, inside out, the far half through the culled near one.
        surfels = {}
        for name in ("out.ply", "in.ply"):
            self.render(name, *CAMERA, *SMALL, "--sides", "given", "-o", "out.exr")
            surfels[name] = self.read_exr("out.exr")["Z"][24, 32]
        self.assertAlmostEqual(surfels["out.ply"], 5, delta=0.05)
        self.assertAlmostEqual(surfels["in.ply"], 7, delta=0.05)

    def test_utm_coordinates_keep_their_detail(self):
        points, colors = sphere(2000, radius=0.05)
        utm = points + [691000.123, 5334000.456, 512.789]
        write_ply("utm.ply", utm, colors, kind="double")
        np.savetxt("utm.xyz", np.column_stack([utm, colors]), fmt="%.9f")
        write_pcd("utm.pcd", pcd_columns(utm, colors, "f8"), "binary_compressed")
        for name in ("utm.ply", "utm.xyz", "utm.pcd"):
            self.render(name, *SMALL, "-o", "out.exr", "--surfels", "surfels.vtp")
            surfels = self.read_vtp("surfels.vtp")
            origin = vtk_to_numpy(surfels.GetFieldData().GetArray("SurfelOrigin")).reshape(3)
            world = places_of(surfels).astype(np.float64) + origin
            # A kernel sits in the middle of its point's cell; cells are 0.004 wide. Single
            # precision alone would be off by 0.03 in x and 0.25 in y.
            np.testing.assert_allclose(world, utm, rtol=0, atol=0.001, err_msg=name)
            self.assertGreater((self.read_rgba("out.exr")[..., 3] > 0.9).mean(), 0.2, name)

    def test_damaged_surfels_are_drawn_as_far_as_they_go(self):
        write_ply("ok.ply", *sphere(500))
        self.render("ok.ply", *SMALL, "-o", "ok.exr", "--surfels", "surfels.vtp")
        surfels = self.read_vtp("surfels.vtp")
        empty = vtkDoubleArray()
        empty.SetName("SurfelOrigin")
        empty.SetNumberOfComponents(3)
        surfels.GetFieldData().AddArray(empty)
        points = places_of(surfels)
        points.view(np.uint32)[0] = 0x7fa00000  # a signalling NaN
        write_data("damaged.vtp", surfels)
        self.render("damaged.vtp", *SMALL, "-o", "damaged.exr")  # without a word
        self.assertGreater((self.read_rgba("damaged.exr")[..., 3] > 0.9).mean(), 0.2)

    def test_depth_image_faces_its_sensor(self):
        # A wall seen by a sensor at the origin, as PCL stores it: y down, z forward, holes as NaN.
        columns, rows = 80, 60
        u, v = np.meshgrid(np.arange(columns) - 39.5, np.arange(rows) - 29.5)
        z = 2 + 0.2 * np.sin(u / 9)
        points = np.stack([u * z / 70, v * z / 70, z], axis=-1).reshape(-1, 3)
        points[::37] = np.nan
        colors = np.zeros((len(points), 3), np.uint8)
        colors[:, 0] = np.where(v.ravel() < 0, 255, 0)  # red above
        colors[:, 2] = np.where(u.ravel() > 0, 255, 0)  # blue on the right
        write_pcd("depth.pcd", pcd_columns(points, colors), "binary", columns, rows)
        frame = ("--unlit", "--size", "80x60")
        self.render("depth.pcd", *frame, "-o", "out.exr", "--surfels", "surfels.vtp", "--hierarchy",
                    "depth.surfels", "--save-camera", "view.json")
        # Pixel by pixel what the sensor saw, apart from the borders between colours and of the image.
        seen = np.full((rows, columns), True)
        for border in (0, 29, 30, 59):
            seen[border] = False
        for border in (0, 39, 40, 79):
            seen[:, border] = False
        picture = self.read_rgba("out.exr")
        np.testing.assert_array_equal(np.round(picture[seen][:, :3]),
                                      colors.reshape(rows, columns, 3)[seen] / 255)
        for cloud in ("surfels.vtp", "depth.surfels"):
            self.render(cloud, *frame, "-o", "again.exr", "--save-camera", "again.json")
            self.assertEqual(content_of("view.json"), content_of("again.json"), cloud)
        said = self.tool("render", "depth.surfels", *frame, "-v", "-o", "again.exr")
        self.assertIn("the camera is at the sensor of the depth image\n", said)
        self.assertIn("camera at 0 0 0 looking at 0 0 1.9", said)
        surfels = self.read_vtp("surfels.vtp")
        arrays = arrays_of(surfels)
        points = places_of(surfels)
        self.assertEqual(len(points), (np.arange(columns * rows) % 37 != 0).sum())
        self.assertTrue(((arrays["SurfelAreaVector"] * points).sum(axis=1) < 0).all())

    def test_cloud_without_colors_is_grey(self):
        write_ply("plain.ply", sphere()[0])
        self.render("plain.ply", *CAMERA, *SMALL, "--unlit", "-o", "out.exr")
        color = self.read_rgba("out.exr")[24, 32]
        np.testing.assert_allclose(color[:3] / color[3], 0.8, atol=1e-3)


if __name__ == "__main__":
    unittest.main()
