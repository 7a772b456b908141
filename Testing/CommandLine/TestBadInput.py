# SPDX-License-Identifier: BSD-3-Clause
"""Bad input: one line that says what is wrong, exit code 2, nothing written."""

import gzip
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile
from unittest import mock

import numpy as np

from surfelsplatting.problems import how_to_install
from toolcase import SMALL, TOOL, ToolCase, content_of, small_files, sphere, write, write_ply


class TestBadInput(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(500)
        write_ply("ok.ply", points, colors)

    def refuse_cloud(self, name, *says):
        self.refuse("render", name, "-o", "out.png", says=(name, *says))

    def refuse_options(self, *options, says):
        self.refuse("render", "ok.ply", *SMALL, *options,
                    *([] if "-o" in options else ["-o", "out.exr"]), says=says)

    def refuse_view(self, view, *says):
        write("camera.json", view if isinstance(view, str) else json.dumps(view))
        self.refuse_options("--camera", "camera.json", says=says)

    def test_no_words(self):
        """One screen that names the commands."""
        result = self.run_tool()
        self.assertEqual((result.returncode, result.stdout), (2, ""))
        self.assertTrue(result.stderr.startswith("usage: surfelsplat "), result.stderr)
        for text in ("view ", "web ", "render ", "film ", "info ", "surfelsplat view scan.ply"):
            self.assertIn(text, result.stderr)
        self.assertLess(result.stderr.count("\n"), 24)

    # --- clouds ---------------------------------------------------------------------------------
    def test_files_that_are_no_clouds(self):
        self.refuse_cloud("missing.ply", "does not exist")
        self.refuse_cloud("okay.ply", "does not exist; did you mean ok.ply?")
        os.makedirs("in/a folder")
        write("in/a folder/scan.ply", "")
        self.refuse_cloud("in/a folder/scn.ply", "did you mean in/a folder/scan.ply?")
        self.refuse_cloud(r"in\a folder\scan.ply", "does not exist; did you mean 'in/a folder/scan.ply'?")
        self.refuse_cloud("in/*/scan.*", "does not exist; without quotes the shell finds the files")
        self.refuse_cloud("https://example.org/a.ply", "does not exist; download it first")
        with mock.patch.dict(os.environ, HOME=os.path.abspath("in")):
            self.refuse_cloud("~/a folder/scan.ply", f"did you mean '{os.path.abspath('in/a folder/scan.ply')}'?")
        self.refuse("render", ".", says="surfelsplat: . is a folder; give a point cloud file, or several, for "
                    "example ./*.ply")
        os.mkdir("folder.ply")
        self.refuse_cloud("folder.ply", "is a folder")
        self.refuse_cloud(write("empty.ply", ""), "empty")
        self.refuse_cloud(write("empty.xyz", ""), "empty")
        self.refuse_cloud(write("junk.ply", b"\0\1\2\3" * 500), "neither a .ply nor a .pcd", r'"\x00\x01')
        self.refuse_cloud(write("junk.pcd", "hello"), 'neither a .ply nor a .pcd file: it begins with "hello"')
        self.refuse_cloud(write("page.ply", "<!DOCTYPE html>\n<html>"), '"<!DOCTYPE html>"')
        self.refuse_cloud(write("cloud.docx", "v 1 2 3"), "unknown extension", "CloudCompare", "render --help")
        self.refuse_cloud(write("cloud", "one two three"), "it has no extension")
        for packed, how in (("cloud.zip", "unzip cloud.zip"), ("a cloud.xyz.gz", "gunzip -k 'a cloud.xyz.gz'"),
                            ("cloud.tar.xz", "tar xf cloud.tar.xz")):
            self.refuse_cloud(write(packed, "PK"), "is packed; unpack it first: " + how)
        packed = write("packed.ply", gzip.compress(content_of("ok.ply")))
        self.refuse_cloud(packed, "is packed; unpack it first: gunzip < packed.ply > unpacked-packed.ply")
        expected = "no readable zip" if importlib.util.find_spec("PIL") else "pip install Pillow"
        self.refuse_cloud(write("cloud.sog", "PK"), expected)
        self.refuse_cloud(write("cloud.spz", "NGSP"), "its header is cut short")
        self.refuse_cloud(write("broken.vtp", "<VTKFile><oops"), "not a readable .vtp")
        self.refuse_cloud(write("image.vtp", "<VTKFile type='ImageData'/>"), "not a readable .vtp")

    def test_surfels_of_other_shapes(self):
        def surfels(covariances):
            return f"""<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="2"><Points>
<DataArray type="Float32" NumberOfComponents="3">0 0 0 1 1 1</DataArray></Points><PointData>
<DataArray type="Float32" Name="SurfelCovariance" {covariances}</DataArray>
<DataArray type="Float32" Name="SurfelAreaVector" NumberOfComponents="3">0 0 1 0 0 1</DataArray>
</PointData></Piece></PolyData></VTKFile>"""

        for covariances in ('NumberOfComponents="1">1 1', 'NumberOfComponents="3">1 1 0 1 1 0'):
            self.refuse_cloud(write("surfels.vtp", surfels(covariances)),
                              "SurfelCovariance does not have 6 numbers")

    def test_las_says_how_to_convert(self):
        expected = "not a readable" if importlib.util.find_spec("laspy") else "pdal translate"
        self.refuse_cloud(write("scan.las", b"LASF" + b"\0" * 400), expected)
        for name in ("scan.laz", "scan.e57"):  # as where a server answers that there is no such file
            self.refuse_cloud(write(name, "<!DOCTYPE html>"), f"{name} is not a readable {name[4:]} file: it "
                              "begins with b'<!DO")
            self.refuse_cloud(write(name, b""), f"{name} is empty")

    def test_files_that_are_cut_short(self):
        content = content_of("ok.ply")
        self.refuse_cloud(write("cut.ply", content[:-100]), "cut short")
        self.refuse_cloud(write("header.ply", content[:60]), "cut short")
        self.refuse_cloud(write("many.ply", content.replace(b"vertex 500", b"vertex 99999999999")),
                          "99999999999 points")
        write("lots.pcd", "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4000000\n"
              "HEIGHT 1\nPOINTS 4000000\nDATA binary\n")
        self.refuse_cloud("lots.pcd", "4000000 points")

    def test_bytes_that_are_no_text(self):
        """They are quoted so that the message stays readable."""
        content = (b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
                   b"DATA ascii\n0 \xff\xfe1 0\n")
        self.refuse_cloud(write("bytes.pcd", content),
                          'line 9, field y: "\\xff\\xfe1" is not a number')

    def test_names_that_are_no_text(self):
        content = content_of("ok.ply")
        write("names.ply", content.replace(b"uchar red", b"uchar \xff\xfe"))
        self.render("names.ply", *SMALL, "-o", "names.png")
        self.assertIn("\\xff\\xfe: scalars, unsigned char", self.info("names.ply"))

    def test_file_names_that_are_no_text(self):
        """As of disks that were written with another encoding."""
        for name in (b"caf\xe9.ply", b"caf\xe9.vtp"):
            cloud = os.fsdecode(name)
            if name.endswith(b".ply"):
                shutil.copy("ok.ply", cloud)
            else:
                self.render("ok.ply", *SMALL, "-o", "ok.png", "--surfels", cloud)
            self.render(cloud, *SMALL, "-o", cloud + ".png", "--hierarchy", cloud + ".surfels")
            self.render(cloud + ".surfels", *SMALL, "-o", cloud + ".exr")
            self.assertTrue(os.path.exists(name + b".png") and os.path.exists(name + b".exr"))
            self.assertIn(r"caf\udce9", self.run_tool("info", cloud).stdout)

    def test_pipes(self):
        with subprocess.Popen(["cat", "ok.ply"], stdout=subprocess.PIPE) as cat:
            result = self.run_tool("render", "/dev/stdin", *SMALL, "-o", "x.png", stdin=cat.stdout)
        self.assertEqual(result.returncode, 2)
        self.assertIn("/dev/stdin is no file but a pipe", result.stderr)

    def test_closed_output(self):
        """As of services."""
        result = self.run_tool("info", "ok.ply", preexec_fn=lambda: os.close(1))
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_clouds_without_points(self):
        write_ply("none.ply", np.zeros((0, 3)))
        self.refuse_cloud("none.ply", "no points")
        write_ply("nan.ply", np.full((50, 3), np.nan))
        self.refuse_cloud("nan.ply", "none of its points", "finite")
        far = sphere(200)[0] * 1e16
        np.savetxt("far.xyz", far)
        self.refuse("render", "far.xyz", "-o", "out.png",
                    says=("coordinates of 9.99", "up to 1e+15 only"))
        np.savetxt("farther.xyz", far * 1e20)
        self.refuse_cloud("farther.xyz", "none of its points", "up to 1e15")
        self.refuse_cloud(write("comment.xyz", "# nothing\n"), "no points")
        write("fields.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float u\n"
              "property float v\nend_header\n1 2\n")
        self.refuse_cloud("fields.ply", "x, y and z")

    def test_coordinates_of_too_few_digits(self):
        """Far from the origin float32 has steps; a lone far point does not count."""
        points, colors = sphere(3000)
        map_points = points + (691000, 5334000, 500)
        far_one = np.vstack([points, [[1e9, 0, 0]]])
        for places, kind, says in ((map_points, "float", "the coordinates have steps of 0.5"),
                                   (map_points, "double", ""), (points, "float", ""),
                                   (far_one, "float", "")):
            write_ply("steps.ply", places, np.resize(colors, (len(places), 3)), kind=kind)
            said = self.tool("render", "steps.ply", *SMALL, "-o", "out.png")
            self.assertEqual(self.code, 0)
            (self.assertIn if says else self.assertNotIn)(says or "steps of", said)

    def check_mended(self, path, content, *says):
        """The message names a command, after which the file has the points of ok.ply."""
        write(path, content)
        said = self.tool("info", path)
        for text in says:
            self.assertIn(text, said)
        subprocess.run(said.partition("mend it by ")[2], shell=True, check=True)
        self.assertEqual(self.report("mended-" + path)["bounds"], self.report("ok.ply")["bounds"])
        os.remove("mended-" + path)

    def test_headers_that_editors_have_changed(self):
        points, colors = sphere(500)
        write_ply("text.ply", points, colors, form="ascii")
        for name in ("ok.ply", "text.ply"):
            content = content_of(name)
            head, end, numbers = content.partition(b"end_header\n")
            for mixed in (head.replace(b"\n", b"\r\n", 2), head.replace(b"\n", b"\r\r\n")):
                self.check_mended("a b.ply", mixed + end + numbers, "of its header ends in LF, and line 1 in CR LF")
            self.check_mended("a.ply", b"\xef\xbb\xbf" + content, "a.ply begins with a mark of Unicode")
            for line_end in (b"\n", b"\r\n", b"\r\r\n"):
                write("a.ply", (head + end).replace(b"\n", line_end) + numbers)
                self.assertEqual(self.report("a.ply")["bounds"], self.report("ok.ply")["bounds"])
        self.check_mended("a.ply", content.replace(b"\n", b"\r"), "end in CR alone, as on old Macs")
        self.check_mended("a.ply", content.decode().encode("utf-16"), "a mark of Unicode")
        self.check_mended("a.pcd", b"\xef\xbb\xbf" + content, "a mark of Unicode")
        write("a.ply", content_of("ok.ply").replace(b"\n", b"\r"))
        self.refuse_cloud("a.ply", "end in CR alone", "save it again, with LF")

    def test_numbers_that_were_written_as_text(self):
        """As by programs for Windows that forget to open a file as binary"""
        content = content_of("ok.ply").replace(b"\n", b"\r\n")
        self.refuse_cloud(write("a.ply", content), "became CR LF; write or copy it in binary mode")
        head = ("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 500\nHEIGHT 1\nPOINTS 500\n"
                "DATA binary\n").encode()
        numbers = sphere(500)[0].astype("<f4").tobytes()
        self.assertGreater(numbers.count(b"\n"), 8)
        self.refuse_cloud(write("a.pcd", (head + numbers).replace(b"\n", b"\r\n")), "in binary mode")
        self.render(write("b.pcd", head.replace(b"\n", b"\r\n") + numbers), *SMALL, "-o", "b.png")

    def test_properties_that_ply_has_not(self):
        for old, new, says in ((b"float x", b"int64 x", "says 'property int64 x', but .ply has no type 'int64'"),
                               (b"float x", b"list uchar long x", "no type 'long'"),
                               (b"uchar red", b"uchar x", "two properties of an element are called 'x'")):
            self.refuse_cloud(write("a.ply", content_of("ok.ply").replace(old, new)), says)
        self.render(write("a.ply", content_of("ok.ply").replace(b"uchar red", b"uchar a red")), *SMALL, "-o", "a.png")

    def test_nan_that_signals(self):
        """As in damaged files: numpy's warning about it says nothing to anyone."""
        points = sphere(500)[0].astype("<f4")
        points.view("<u4")[7] = 0x7FA00001
        head = "ply\nformat binary_little_endian 1.0\nelement vertex 500\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
        self.render(write("nan.ply", head.encode() + points.tobytes()), *SMALL, "-o", "out.png")

    def test_misspelled_options(self):
        for words, hint in ((("render", "x.ply", "-o", "x.png", "--veiw", "left"), "--view"),
                            (("film", "x.ply", "-o", "x", "--frams=3"), "--frames"),
                            (("film", "x.ply", "-o", "x", "--fps", "25"), "--rate"),
                            (("film", "x.ply", "-o", "x", "--seconds", "8"), "--frames"),
                            (("render", "x.ply", "--cmap", "magma"), "--colormap")):
            self.refuse(*words, says=f"did you mean {hint}? (surfelsplat {words[0]} --help")

    def test_text_that_is_no_table(self):
        self.refuse_cloud(write("words.txt", "one two three\n"), "not a table of numbers")
        self.refuse_cloud(write("ragged.xyz", "1 2 3\n4 5\n"), "columns changed from 3 to 2")
        self.refuse_cloud(write("two.xyz", "1 2\n3 4\n"), "2 columns")
        self.refuse_cloud(write("binary.xyz", bytes(range(128, 256)) * 9), "not a table of numbers")

    # --- cameras --------------------------------------------------------------------------------
    def test_camera_files(self):
        self.refuse_options("--camera", "missing.json", says=["missing.json", "No such file"])
        self.refuse_view("{", "camera.json", "JSON")
        self.refuse_view([], "no views")
        self.refuse_view({"views": 3}, "no views")
        self.refuse_view({"colour": 3}, "describes no camera")
        self.refuse_view({"position": [0, 0]}, "position is [0, 0]", "three finite numbers")
        self.refuse_view({"position": [0, 0, "5"]}, "three finite numbers")
        self.refuse_view('{"position": [0, 0, NaN]}', "three finite numbers")
        self.refuse_view({"viewAngle": 0}, "viewAngle is 0")
        self.refuse_view({"viewAngle": 180}, "viewAngle is 180")
        self.refuse_view({"viewAngle": "wide"}, "viewAngle")
        self.refuse_view({"viewAngle": 10**400}, "viewAngle is 1000")
        self.refuse_view({"viewAngle": 30, "circleOfConfusion": -1}, "circleOfConfusion is -1")
        self.refuse_view({"viewAngle": 30, "focusPoint": [1, 2]}, "focusPoint is [1, 2]")
        self.refuse_view({"viewAngle": 30, "size": [0, 10]}, "size is [0, 10]")
        self.refuse_view({"viewAngle": 30, "focalDisk": -1}, "focalDisk is -1")
        self.refuse_view({"viewAngle": 30, "focalDistance": -1}, "focalDistance is -1")
        self.refuse_view({"position": [1, 2, 3], "focalPoint": [1, 2, 3]}, "same point")
        self.refuse_view({"position": [0, 0, 5], "focalPoint": [0, 0, 0], "viewUp": [0, 0, -2]},
                         "parallel")
        self.refuse_view({"viewUp": [0, 0, 0]}, "view-up vector is 0 0 0")

    def test_unknown_view_names_the_known_ones(self):
        write("views.json", json.dumps({"views": [{"name": n, "viewAngle": 20} for n in "ab"]}))
        self.refuse_options("--camera", "views.json:c", says=["'c'", "a, b"])
        write("unnamed.json", json.dumps({"views": [{"viewAngle": 20}]}))
        self.refuse_options("--camera", "unnamed.json:c", says=["'c'", "have no names"])

    def test_camera_options(self):
        self.refuse_options("--position", "1", "2", "x", says=["--position", "'x'"])
        self.refuse_options("--position", "1", "2", says=["--position", "3 arguments"])
        self.refuse_options("--position", "1", "2", "nan", says="not a finite number")
        self.refuse_options("--focal-point", "1", "2", "-inf", says="not a finite number")
        self.refuse_options("--position", "1", "2", "3", "--focal-point", "1", "2", "3",
                            says="same point")
        self.refuse_options("--position", "0", "0", "-1e-3", "--focal-point", "0", "0", "0",
                            "--view-up", "0", "0", "1", says="parallel")
        for angle in ("0", "180", "-20", "wide"):
            self.refuse_options("--view-angle", angle, says=["--view-angle", angle])
        for size in (("0", "10"), ("10", "-1"), ("10", "2.5"), ("10", "big")):
            self.refuse_options("--size", *size, says=["--size", "whole number"])
        self.refuse_options("--size", "70000", "10", says="too large")

    def test_unusable_cameras(self):
        for options, says in (
                (["--position", "1e300", "0", "0"], ["position", "1e+300", "1e+17"]),
                (["--focal-point", "0", "-1e300", "0"], ["focal point", "-1e+300"]),
                (["--view-angle", "1e-300"], ["view angle", "1e-300", "0.0001"]),
                (["--view-angle", "179.99999"], ["view angle", "179.9999"]),
                (["--focal-disk", "1e200"], ["focal disk", "1e+200"]),
                (["--focal-distance", "1e300"], ["focal distance", "1e+300"])):
            self.refuse_options(*options, says=says)
        self.refuse_view({"position": [0, 0, 1e300]}, "position", "1e+300")
        for angle in ("0.001", "179"):
            self.tool("render", "ok.ply", *SMALL, "--view-angle", angle, "-o", "out.exr")
            self.assertEqual(self.code, 0)
        os.remove("out.exr")

    def test_picture_size_of_a_camera_file(self):
        write("camera.json", json.dumps({"viewAngle": 30, "size": [1000000, 1000000]}))
        self.refuse("render", "ok.ply", "--camera", "camera.json", "-o", "out.png",
                    says="too large")

    def test_other_options(self):
        self.refuse_options("--focal-disk", "-1", says=["--focal-disk", "negative"])
        self.refuse_options("--focal-disk", "1", "--blur", "0", says="--focal-disk and --blur cannot be combined")
        self.refuse_options("--background", "0", "0", "2", says="between 0 and 1")
        self.refuse_options("--threads", "0", says="--threads")
        self.refuse_options("--threads", "none", says="--threads")
        self.refuse_options("--nonsense", says="--nonsense (surfelsplat render")
        for option, meant in (("--linear", "--linear-light"), ("--aperture", "--f-number"),
                              ("--dof=10", "--blur"), ("--fov", "--view-angle")):
            self.refuse_options(option, says=f"did you mean {meant}?")
        self.refuse_options("--blur", "2,5", says="'2,5' is not a finite number; the decimal point is a point")
        self.refuse("paint", says="'paint' is no command; give one of view, web, render")
        self.refuse("rendr", "ok.ply", says="did you mean render?")
        self.refuse("ok.ply", says="first, for example surfelsplat view ok.ply")
        self.refuse_options("--background", "whit", says="'whit' is no colour; did you mean white?")
        self.refuse_options("--background=#12345", says="'#12345' is no colour")
        self.refuse_options("--background", "0.5", says="expected 3 arguments: R G B")
        self.refuse("render", says="CLOUD")

    # --- outputs --------------------------------------------------------------------------------
    def test_outputs_that_cannot_be(self):
        self.refuse_options("-o", "out.gif", says=["out.gif", ".jpeg or .exr"])
        self.refuse_options("-o", "out", says=".jpeg or .exr")
        self.refuse_options("-o", "nowhere/out.png", says=["nowhere", "does not exist"])
        os.mkdir("out.png")
        self.refuse_options("-o", "out.png", says="is a folder")
        self.refuse_options("--surfels", "surfels.ply", says=["surfels.ply", ".vtp"])
        self.refuse_options("--surfels", "nowhere/surfels.vtp", says="does not exist")
        self.refuse_options("--stats", "nowhere/stats.json", says="does not exist")

    def test_statistics_are_json(self):
        self.refuse_options("--stats", "stats.txt", says=("stats.txt", ".json"))

    def test_folder_that_takes_no_files(self):
        # Where not even root can create a file.
        for name in ("/proc/out.png", "/proc/out.exr"):
            self.refuse_options("-o", name, says=[name])

    def test_full_disk(self):
        for options in (["-o", "out.exr"], ["-o", "out.exr", "--deep"], ["-o", "out.png"]):
            with small_files():
                self.refuse("render", "ok.ply", "--size", "200", "200", *options,
                            says=["annot write", "out."])

    def test_full_disk_for_surfels(self):
        with small_files(8000):
            said = self.tool("render", "ok.ply", "--size", "8", "8", "-o", "out.png", "--surfels",
                             "surfels.vtp")
        self.assertEqual(self.code, 2, said)
        self.assertRegex(said, r"\Asurfelsplat: cannot write surfels.vtp[^\n]+\n\Z")
        self.assertEqual(sorted(os.listdir(".")), ["ok.ply", "out.png"])

    def test_old_output_survives_a_failure(self):
        write("out.exr", "old")
        self.refuse("render", "ok.ply", "-o", "out.exr", "--position", "0", "0", "x", says="'x'")
        with small_files():
            self.refuse("render", "ok.ply", "-o", "out.exr", says="out.exr")
        self.assertEqual(content_of("out.exr"), b"old")


class TestMissingPackages(ToolCase):
    def test_where_pip_may_not_install(self):
        """Debian lets pip install into folders of its own only."""
        for is_managed, prefix, says in ((True, sys.base_prefix, "-m pip install --prefix ~/.local/share/surfelsplat"
                                          " 'pye57', and then the same again"),
                                         (True, "/an/environment", ": pip install 'pye57'"),
                                         (False, sys.base_prefix, ": pip install 'pye57'")):
            with tempfile.TemporaryDirectory() as folder:
                if is_managed:
                    write(os.path.join(folder, "EXTERNALLY-MANAGED"), "")
                with mock.patch("sysconfig.get_path", return_value=folder), \
                        mock.patch.object(sys, "prefix", prefix):
                    self.assertIn(says, "It needs pye57: " + how_to_install("'pye57'"))

    @unittest.skipIf(sys.prefix != sys.base_prefix or not importlib.util.find_spec("pip"),
                     "runs in an environment, or without pip")
    def test_command_and_then_the_same_again(self):
        """What the command installs is found, although the system's Python takes no packages."""
        with mock.patch("os.path.exists", return_value=True):
            command = how_to_install("pye57").partition(", and")[0]
        files = {"pye57.py": "raise SystemExit('of pip')", "pye57-1.dist-info/WHEEL":
                 "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
                 "pye57-1.dist-info/METADATA": "Metadata-Version: 2.1\nName: pye57\nVersion: 1\n"}
        with zipfile.ZipFile("pye57-1-py3-none-any.whl", "w") as wheel:
            wheel.writestr("pye57-1.dist-info/RECORD", "".join(f"{name},,\n" for name in files))
            for name, text in files.items():
                wheel.writestr(name, text)
        write("scan.e57", b"ASTM-E57")
        home = dict(os.environ, HOME=os.getcwd(), PIP_NO_INDEX="1", PIP_FIND_LINKS=".", PIP_NO_COMPILE="1")
        subprocess.run(command, shell=True, check=True, capture_output=True, env=home)
        result = subprocess.run([TOOL, "info", "scan.e57"], capture_output=True, text=True, env=home,
                                check=False)
        self.assertEqual(result.stderr, "of pip\n")


if __name__ == "__main__":
    unittest.main()
