# SPDX-License-Identifier: BSD-3-Clause
"""Hierarchies in .surfels files: the same pictures as from memory, from pieces too; an error for
every damage."""

import gc
import os
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkBitArray, vtkFloatArray, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkAppendPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera

from surfelsplatting import (vtkSurfelHierarchy, vtkSurfelHierarchyReader, vtkSurfelHierarchyWriter,
                             vtkSurfelImageRenderer, vtkSurfelMapper)
from surfelsplatting.commandline.outputs import write_polydata
from surfelsplatting.shapes.samples import SAMPLES, Samples
from surfelsplatting.vtkarrays import named_array
from surfelsplatting.vtkmessages import errors_of
from toolcase import (SMALL, ToolCase, arrays_of, content_of, places_of, read_json, sphere, write,
                      small_files, write_ply)

LARGE = 700_000  # surfels: a file too large to be checked at once
PAGE = 4096
CANNOT_OPEN, NO_NAME, DISK_FULL, UNKNOWN = 20002, 20006, 20007, 20008  # vtkErrorCode


def ball(count, seed=1, origin=None, offset=0.0):
    """Surfels of the unit sphere, as vtkPolyData; with an origin, their points are relative to it."""
    rnd = np.random.default_rng(seed)
    normals = rnd.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    area = 4 * np.pi / count
    x, y, z = normals.T
    covariances = area / 4 * np.column_stack(
        [1 - x * x, 1 - y * y, 1 - z * z, -x * y, -y * z, -x * z])
    surfels = vtkPolyData()
    points = vtkPoints()
    points.SetData(named_array("Points", (normals + offset - (origin or 0)).astype(np.float32)))
    surfels.SetPoints(points)
    data = surfels.GetPointData()
    data.AddArray(named_array("SurfelCovariance", covariances.astype(np.float32)))
    data.AddArray(named_array("SurfelAreaVector", (area * normals).astype(np.float32)))
    data.AddArray(named_array("SurfelTwoSided", (x > 0).astype(np.uint8)))
    data.AddArray(named_array("SurfelOverlap", rnd.integers(0, 256, count).astype(np.uint8)))
    data.AddArray(named_array("height", z))
    data.SetScalars(named_array("RGB", (127 + 100 * np.sin(9 * normals)).astype(np.uint8)))
    if origin is not None:
        surfels.GetFieldData().AddArray(named_array("SurfelOrigin", np.full((1, 3), float(origin))))
    return surfels


def hierarchy_of(surfels):
    hierarchy = vtkSurfelHierarchy()
    hierarchy.SetInputData(surfels)
    hierarchy.Update()
    return hierarchy.GetOutput()


def save(surfels, path="ball.surfels"):
    writer = vtkSurfelHierarchyWriter()
    writer.SetFileName(path)
    writer.SetInputData(surfels)
    assert writer.Write() == 1


def load(path="ball.surfels"):
    reader = vtkSurfelHierarchyReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


class Picture:
    """Of surfels through a lens; keeps its mapper."""

    def __init__(self, surfels):
        self.mapper = vtkSurfelMapper()
        self.mapper.SetInputData(surfels)
        actor = vtkActor()
        actor.SetMapper(self.mapper)
        camera = vtkCamera()
        camera.SetPosition(0.3, 0.2, 5)
        camera.SetFocalDisk(0.3)
        camera.SetFocalDistance(4.2)
        self.renderer = vtkSurfelImageRenderer()
        self.renderer.AddActor(actor)
        self.renderer.SetCamera(camera)
        self.renderer.SetSize(120, 90)

    def pixels(self):
        self.renderer.Modified()
        self.renderer.Update()
        return np.array(vtk_to_numpy(self.renderer.GetOutput().GetPointData().GetScalars()))

    @property
    def prepared(self):
        return self.renderer.GetSplatter().GetNumberOfPreparedSurfels()


class TestMappedFiles(ToolCase):
    def assert_same_picture(self, one, other):
        pixels = Picture(one).pixels()
        self.assertGreater(pixels[:, 3].mean(), 0.2)
        np.testing.assert_array_equal(pixels, Picture(other).pixels())

    def test_the_tool_draws_the_same(self):
        points, colors = sphere(4000)
        write_ply("ball.ply", points, colors)
        options = [*SMALL, "--blur", "8", "--stats", "stats.json"]
        self.render("ball.ply", *options, "--hierarchy", "ball.vtp", "-o", "a.exr")
        self.render("ball.vtp", *options, "--hierarchy", "ball.surfels", "-o", "b.exr")
        for look in ([], ["--linear-light"], ["--scalars", "z"], ["--view", "left"]):
            self.render("ball.vtp", *options, *look, "-o", "a.exr")
            self.render("ball.surfels", *options, *look, "-o", "b.exr")
            np.testing.assert_array_equal(self.read_rgba("a.exr"), self.read_rgba("b.exr"), str(look))
            statistics = read_json("stats.json")
            self.assertNotIn("hierarchy", statistics["milliseconds"])
            if look in ([], ["--view", "left"]):
                self.assertEqual(statistics["detail"]["prepared"], 0)
        self.assertIn("4000 surfels with a hierarchy", self.info("ball.surfels"))

    def warnings_of(self, surfels, in_pieces=False):
        """-> what the writer warns of."""
        writer = vtkSurfelHierarchyWriter()
        with errors_of(writer, event="WarningEvent") as warnings:
            writer.SetFileName("ball.surfels")
            if in_pieces:
                self.assertTrue(writer.AddPiece(surfels) and writer.AddPiece(surfels))
            writer.SetInputData(surfels)
            self.assertEqual(writer.Write(), 1)
        return warnings

    def test_arrays_that_are_left_out_are_named(self):
        self.assertEqual(self.warnings_of(ball(300)), [])
        surfels = ball(300)
        for name, array, count in (("labels", vtkStringArray(), 300), ("flags", vtkBitArray(), 300),
                                   ("x" * 96, vtkFloatArray(), 300), ("short", vtkFloatArray(), 299)):
            array.SetName(name)
            array.SetNumberOfValues(count)
            surfels.GetPointData().AddArray(array)
        for in_pieces in (False, True):
            warnings = self.warnings_of(surfels, in_pieces)
            self.assertEqual(len(warnings), 1, warnings)
            for name in ("labels", "flags", "x" * 96, "short"):
                self.assertIn(name, warnings[0])
            self.assertNotIn("height", warnings[0])
            self.assertEqual(load().GetPointData().GetNumberOfArrays(), 6)

    def test_the_tool_names_arrays_that_are_left_out(self):
        surfels = ball(300)
        labels = vtkStringArray()
        labels.SetName("labels")
        labels.SetNumberOfValues(300)
        surfels.GetPointData().AddArray(labels)
        self.assertTrue(write_polydata(surfels, "labels.vtp"))
        said = self.tool("render", "labels.vtp", *SMALL, "--hierarchy", "out.surfels", "-o", "out.png")
        self.assertIn("surfelsplat: warning: Arrays that are not in the file: labels.", said)

    def test_surfels_that_are_not_finite_are_left_out(self):
        surfels = ball(3000)
        places_of(surfels)[100:150] = np.nan
        warnings = []
        writer = vtkSurfelHierarchyWriter()
        writer.AddObserver("WarningEvent", lambda *_: warnings.append(1))
        writer.SetFileName("ball.surfels")
        writer.SetInputData(surfels)
        self.assertEqual((writer.Write(), len(warnings)), (1, 1))
        self.assertEqual(load().GetNumberOfPoints(), 2950)
        filtered = vtkSurfelHierarchy()
        filtered.AddObserver("WarningEvent", lambda *_: None)
        filtered.SetInputData(surfels)
        filtered.Update()
        self.assert_same_picture(filtered.GetOutput(), load())

    def test_the_papers_level_of_detail(self):
        """Needs values of all surfels."""
        surfels = hierarchy_of(ball(3000))
        save(surfels)
        pictures = [Picture(surfels), Picture(surfels), Picture(load())]
        for picture in pictures:
            picture.renderer.GetCamera().SetFocalDisk(3)
        for picture in pictures[1:]:
            picture.renderer.GetSplatter().SetLODModeToPaper()
        moments, one, other = (picture.pixels() for picture in pictures)
        self.assertGreater(np.abs(moments - one).max(), 1e-3)
        np.testing.assert_array_equal(one, other)

    def test_arrays(self):
        surfels = hierarchy_of(ball(3000))
        save(surfels)
        mapped = load()
        before, after = arrays_of(surfels), arrays_of(mapped)
        self.assertEqual(list(before), list(after))
        for name in set(before) - {"RGB"}:
            np.testing.assert_array_equal(before[name], after[name])
            self.assertEqual(before[name].dtype, after[name].dtype)
        np.testing.assert_array_equal(before["RGB"], after["RGB"][:, :3])
        self.assertEqual(mapped.GetPointData().GetScalars().GetName(), "RGB")
        self.assertEqual(mapped.GetFieldData().GetArray("SurfelLeaves").GetNumberOfValues(), 2)
        bounds = [Picture(cloud).mapper.GetBounds() for cloud in (surfels, mapped)]
        self.assertEqual(*bounds)
        save(mapped, "again.surfels")
        self.assertEqual(content_of("ball.surfels"), content_of("again.surfels"))

    def test_arrays_keep_the_file(self):
        save(ball(500))
        height = load().GetPointData().GetArray("height")
        os.remove("ball.surfels")
        gc.collect()
        self.assertLess(np.abs(vtk_to_numpy(height)).max(), 1.001)
        height.InsertNextValue(7)  # moves to memory of its own
        self.assertEqual(height.GetNumberOfTuples(), 501)

    def test_changed_arrays_count(self):
        surfels = hierarchy_of(ball(3000))
        save(surfels)
        mapped = load()
        picture = Picture(mapped)
        first = picture.pixels()
        self.assertEqual(picture.prepared, 0)
        for cloud in (surfels, mapped):
            colors = cloud.GetPointData().GetScalars()
            vtk_to_numpy(colors)[:, :2] = 9
            colors.Modified()
        changed = picture.pixels()
        self.assertEqual(picture.prepared, 3000)
        self.assertGreater(np.abs(changed - first).max(), 0.1)
        np.testing.assert_array_equal(changed, Picture(surfels).pixels())
        np.testing.assert_array_equal(first, Picture(load()).pixels())  # the file is as before

    def test_pieces_are_one_hierarchy(self):
        pieces = [ball(1000, 1), ball(2000, 2, origin=64.0, offset=0.0), ball(500, 3)]
        writer = vtkSurfelHierarchyWriter()
        writer.SetFileName("pieces.surfels")
        for piece in pieces:
            self.assertTrue(writer.AddPiece(piece))
        self.assertEqual(writer.Write(), 1)
        self.assertEqual(os.listdir("."), ["pieces.surfels"])
        append = vtkAppendPolyData()
        for piece in pieces:
            if piece.GetFieldData().GetArray("SurfelOrigin"):
                points = piece.GetPoints().GetData()
                vtk_to_numpy(points)[:] += 64
                piece.GetFieldData().RemoveArray("SurfelOrigin")
            append.AddInputData(piece)
        append.Update()
        whole = hierarchy_of(append.GetOutput())
        self.assert_same_picture(whole, load("pieces.surfels"))
        save(append.GetOutput(), "whole.surfels")
        self.assert_same_picture(whole, load("whole.surfels"))

    def test_the_view_needs_samples_only(self):
        surfels = hierarchy_of(ball(LARGE))
        save(surfels)
        mapped = load()
        samples = mapped.GetFieldData().GetArray("SurfelSamples")
        self.assertLess(samples.GetNumberOfTuples(), 2 * SAMPLES)
        one, other = Samples(surfels), Samples(mapped)
        for name in ("points", "areas", "two_sided", "radius", "low", "high", "spacing"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
        self.change_colors_of_a_large_file()
        self.damage_where_it_is_drawn()
        self.refuse_damaged_arrays()

    def test_samples_of_copies(self):
        """Each place has seven surfels, which tie; samples end among those of one."""
        surfels = ball(7 * 30001)
        places = places_of(surfels)
        places[:] = np.repeat(places[::7], 7, axis=0)
        surfels = hierarchy_of(surfels)
        save(surfels)
        one, other = Samples(surfels), Samples(load())
        np.testing.assert_array_equal(one.points, other.points)
        np.testing.assert_array_equal(one.areas, other.areas)

    def change_colors_of_a_large_file(self):
        """That is no damage."""
        mapped = load()
        colors = mapped.GetPointData().GetScalars()
        vtk_to_numpy(colors)[:, :3] = 51
        colors.Modified()
        pixels = Picture(mapped).pixels()
        np.testing.assert_array_equal(pixels[:, 0], pixels[:, 2])
        self.assertGreater(pixels[:, 0].max(), 0.1)

    def damage_where_it_is_drawn(self):
        """One byte in each page of the nodes."""
        nodes = vtk_to_numpy(load().GetFieldData().GetArray("SurfelNodes")).tobytes()
        with open("ball.surfels", "rb") as file:
            content = bytearray(file.read())
        begin = content.index(nodes[:PAGE])
        for place in range(begin, begin + len(nodes), PAGE):
            content[place] ^= 1
        write("damaged.surfels", content)

    def refuse_damaged_arrays(self):
        """A large file opens; what is drawn of it is checked."""
        picture = Picture(load("damaged.surfels"))
        with errors_of(picture.renderer.GetSplatter()) as errors, errors_of(
                picture.renderer, picture.renderer.GetExecutive()):
            picture.renderer.Update()
        self.assertEqual(len(errors), 1)
        self.assertIn("its array SurfelNodes is not what was written", errors[0])
        self.refuse("render", "damaged.surfels", "-o", "out.png", says="SurfelNodes")
        for options in ([], ["--blur", "5"], ["--focus-pull"]):  # what is in focus is drawn first
            self.refuse("film", "damaged.surfels", *SMALL, "--frames", "2", *options, "-o", "frames",
                        says="SurfelNodes")
        reader = vtkSurfelHierarchyReader()
        self.note_errors(reader)
        reader.SetFileName("damaged.surfels")
        self.assertFalse(reader.CheckFile())
        self.assertIn("SurfelNodes", self.errors[0])
        reader.SetFileName("ball.surfels")
        self.assertTrue(reader.CheckFile())

    def refused(self, path):
        """-> what the reader says."""
        reader = vtkSurfelHierarchyReader()
        self.note_errors(reader)
        if path:
            reader.SetFileName(path)
        reader.Update()
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 0)
        self.assertNotEqual(reader.GetErrorCode(), 0)
        self.assertEqual(len(self.errors), 1, self.errors)
        return self.errors[0]

    def test_files_that_are_none(self):
        self.assertIn("SetFileName", self.refused(None))
        self.assertIn("No such file", self.refused("none.surfels"))
        self.assertIn("no regular file", self.refused("."))
        write("text.surfels", "no surfels at all " * 10)
        self.assertIn("does not begin", self.refused("text.surfels"))
        save(ball(300))
        content = content_of("ball.surfels")
        write("half.surfels", content[:len(content) // 2])
        self.assertIn("not whole", self.refused("half.surfels"))
        self.refuse("render", "half.surfels", "-o", "out.png", says=("half.surfels", "not whole"))

    def refused_to_write(self, surfels, path, code=UNKNOWN):
        """-> what the writer says; it leaves nothing."""
        writer = vtkSurfelHierarchyWriter()
        self.note_errors(writer)
        if path:
            writer.SetFileName(path)
        if surfels:
            writer.SetInputData(surfels)
        self.assertEqual(writer.Write(), 0)
        self.assertEqual(writer.GetErrorCode(), code)
        self.assertEqual(len(self.errors), 1, self.errors)
        self.assertEqual(os.listdir("."), [])
        return self.errors[0]

    def test_what_cannot_be_written(self):
        self.assertIn("set the input", self.refused_to_write(None, "a.surfels"))
        self.assertIn("SetFileName", self.refused_to_write(ball(9), None, NO_NAME))
        self.assertIn("No such file", self.refused_to_write(
            ball(9), "no/such/a.surfels", CANNOT_OPEN))
        with small_files():
            self.assertIn("File too large", self.refused_to_write(
                ball(9), "a.surfels", DISK_FULL))
        self.assertIn("no surfels", self.refused_to_write(vtkPolyData(), "a.surfels"))
        plain = ball(9)
        plain.GetPointData().RemoveArray("SurfelCovariance")
        self.assertIn("SurfelCovariance", self.refused_to_write(plain, "a.surfels"))
        broken = hierarchy_of(ball(9))
        broken.GetFieldData().RemoveArray("SurfelNodes")
        self.assertIn("SurfelNodes", self.refused_to_write(broken, "a.surfels"))
        writer = vtkSurfelHierarchyWriter()
        self.note_errors(writer)
        writer.SetFileName("a.surfels")
        self.assertTrue(writer.AddPiece(ball(9)))
        self.assertFalse(writer.AddPiece(plain))
        self.assertIn("SurfelCovariance", self.errors[0])
        self.assertEqual(writer.GetErrorCode(), UNKNOWN)
        writer.SetFileName("no/such/a.surfels")
        self.assertFalse(writer.AddPiece(ball(9)))
        self.assertEqual(writer.GetErrorCode(), CANNOT_OPEN)
        writer.SetFileName("a.surfels")
        with small_files():
            self.assertFalse(writer.AddPiece(ball(900)))
        self.assertEqual(writer.GetErrorCode(), DISK_FULL)
        self.assertEqual(os.listdir("."), [])

    def test_input_that_cannot_be_made(self):
        """Nothing is written then, which the writer has to say."""
        reader, writer = vtkSurfelHierarchyReader(), vtkSurfelHierarchyWriter()
        self.note_errors(reader)
        writer.GetExecutive().AddObserver("ErrorEvent", lambda *_: None)
        reader.SetFileName("missing.surfels")
        writer.SetInputConnection(reader.GetOutputPort())
        writer.SetFileName("a.surfels")
        self.assertEqual(writer.Write(), 0)
        self.assertEqual(writer.GetErrorCode(), UNKNOWN)
        self.assertEqual((len(self.errors), os.listdir(".")), (1, []))


if __name__ == "__main__":
    unittest.main()
