# SPDX-License-Identifier: BSD-3-Clause
"""Files of each format with random damage: a picture or an error that says what is wrong."""

import os
import random
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_FLOAT
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkAppendFilter
from vtkmodules.vtkIOImage import vtkMetaImageWriter
from vtkmodules.vtkIOLegacy import vtkDataSetWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLUnstructuredGridWriter

import captures
from surfelsplatting import vtkPointsToSurfels, vtkSurfelHierarchyWriter
from surfelsplatting.commandline.main import main
from TestDataSets import gltf
from TestFormats import pcd_columns, write_vtp
from TestReader import write_pcd
from toolcase import SMALL, ToolCase, content_of, sphere, write, write_ply

ROUNDS = 8  # of damage to each file
NO_PICTURE, NO_PROBLEM = 2, 0


def write_by(writer, path, data, binary):
    writer.SetInputData(data)
    writer.SetFileName(path)
    if hasattr(writer, "SetDataModeToAscii"):
        writer.SetDataModeToAppended() if binary else writer.SetDataModeToAscii()
        writer.SetEncodeAppendedData(False)
    else:
        writer.SetFileType(2 if binary else 1)
    writer.Write()


def damage(content, rnd):
    content = bytearray(content)
    place = rnd.randrange(len(content))
    kind = rnd.randrange(5)
    if kind == 0:
        for _ in range(rnd.randint(1, 8)):
            content[rnd.randrange(len(content))] = rnd.randrange(256)
    elif kind == 1:
        del content[place:]
    elif kind == 2:
        content[place:place] = bytes(rnd.randrange(256) for _ in range(rnd.randint(1, 40)))
    elif kind == 3:
        digits = [i for i, byte in enumerate(content[:1500]) if 48 <= byte <= 57]
        for place in rnd.sample(digits, min(3, len(digits))):
            content[place] = rnd.choice(b"0123456789-e.")
    else:
        del content[place:rnd.randrange(place, len(content))]
    return bytes(content)


class TestDamagedFiles(ToolCase):
    def write_files(self):
        points, colors = sphere(300)
        write_ply("a.ply", points, colors)
        write_pcd("a.pcd", pcd_columns(points, colors), "binary_compressed")
        write_vtp("a.vtp", points, colors)
        cloud = self.read_vtp("a.vtp")
        grid = vtkAppendFilter()
        grid.AddInputData(cloud)
        grid.Update()
        surfels = vtkPointsToSurfels()
        surfels.SetInputData(cloud)
        hierarchy = vtkSurfelHierarchyWriter()
        hierarchy.SetFileName("a.surfels")
        hierarchy.SetInputConnection(surfels.GetOutputPort())
        hierarchy.Write()
        image = vtkImageData()
        image.SetDimensions(5, 6, 7)
        image.AllocateScalars(VTK_FLOAT, 1)
        vtk_to_numpy(image.GetPointData().GetScalars())[:] = np.arange(210)
        for name, writer, data in (("vtu", vtkXMLUnstructuredGridWriter, grid.GetOutput()),
                                   ("vti", vtkXMLImageDataWriter, image),
                                   ("vtk", vtkDataSetWriter, grid.GetOutput())):
            for number, binary in enumerate((False, True)):
                write_by(writer(), f"{number}.{name}", data, binary)
        volume = vtkMetaImageWriter()
        volume.SetInputData(image)
        volume.SetFileName("a.mha")
        volume.Write()
        for name, mark in (("xyz", " "), ("csv", ","), ("pts", " "), ("asc", ";")):
            np.savetxt("a." + name, np.column_stack([points, colors]), fmt="%.6g", delimiter=mark)
        np.save("a.npy", np.column_stack([points, colors]))
        np.savetxt("a.obj", points, fmt="v %.6g %.6g %.6g")
        triangles = b"".join(row.tobytes() + bytes(2) for row in points[:288].reshape(-1, 12)
                             .astype("<f4"))
        write("a.stl", bytes(80) + (72).to_bytes(4, "little") + triangles)
        content, buffer = gltf()
        write("buffer.bin", buffer)
        content["buffers"][0]["uri"] = "buffer.bin"
        write("a.gltf", str(content).replace("'", '"').replace("True", "true"))

    def run_in_child(self, *words):
        """-> exit code or minus the signal, what it said. Loading VTK once makes this quick."""
        child = os.fork()
        if child == 0:
            code = 77
            try:
                os.dup2(os.open("said", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                code = main([*words, "--threads", "1"])
            finally:
                os._exit(code)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        with open("said", errors="replace") as file:
            return status, file.read()

    def check(self, code, said, case):
        self.assertIn(code, (NO_PROBLEM, NO_PICTURE), (case, said))
        self.assertNotIn("Traceback", said, case)
        if code == NO_PICTURE:
            self.assertRegex(said, "(?m)^surfelsplat: ", case)  # the library of .mha says more

    def test_no_file_ends_the_tool(self):
        self.write_files()
        names = [name for name in sorted(os.listdir(".")) if not name.endswith(".bin")]
        for name in names:
            whole = content_of(name)
            words = (*SMALL, "-o", "out.png")
            self.assertIn(self.run_in_child("render", name, *words)[0], (NO_PROBLEM,), name)
            rnd = random.Random(name)
            for number in range(ROUNDS):
                path = write("damaged" + os.path.splitext(name)[1], damage(whole, rnd))
                if os.path.exists("out.png"):
                    os.remove("out.png")
                code, said = self.run_in_child("render", path, *words)
                self.check(code, said, (name, number))
                self.assertEqual(os.path.exists("out.png"), code == NO_PROBLEM, (name, number))

    def test_no_capture_ends_the_tool(self):
        captures.write_ply("a.ply", captures.torus(40))
        captures.write_ply("b.ply", captures.torus(40), "ascii")
        captures.write_splat("a.splat", captures.torus(40))
        captures.write_packed("c.ply", captures.torus(400))
        captures.write_spz("a.spz", captures.torus(40))
        for name in ("a.ply", "b.ply", "c.ply", "a.splat", "a.spz"):
            whole = content_of(name)
            rnd = random.Random(name)
            for number in range(ROUNDS):
                path = write("damaged" + os.path.splitext(name)[1], damage(whole, rnd))
                code, said = self.run_in_child("render", path, *SMALL, "-o", "out.png")
                self.check(code, said, (name, number))
                self.assertEqual(os.path.exists("out.png"), code == NO_PROBLEM, (name, number))
                if code == NO_PROBLEM:
                    os.remove("out.png")


if __name__ == "__main__":
    unittest.main()
