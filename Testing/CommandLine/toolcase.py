# SPDX-License-Identifier: BSD-3-Clause
"""What the tests share: a folder of their own, the tool, clouds to feed it, and its pictures."""

import contextlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

from surfelsplatting.clouds import faces
from surfelsplatting.lighting import BACKDROP

TOOL = os.environ["SURFELSPLAT"]
PATIENCE = 60  # s, of tests that wait for another process
# What the tool says of its time on a busy machine
BUSY = re.compile(r"surfelsplat: .*( \d+ % after \d+:\d\d|: the surfels took .*)\n")
# and of the focus where no option says it
IN_MIDDLE = re.compile(r"surfelsplat: in focus.* the middle of the picture .*\n")
CAMERA = ["--position", "0", "0", "6", "--focal-point", "0", "0", "0", "--view-up", "0", "1", "0",
          "--view-angle", "30"]
SMALL = ["--size", "64", "48"]


@contextlib.contextmanager
def small_files(size=2000):
    """As on a full disk: no file grows beyond so many bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def sphere(count=3000, radius=1.0):
    """[n, 3] points on the unit sphere, evenly spread, and their colours: +x red, +y green."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    ring = np.sqrt(1 - z * z)
    points = np.column_stack([ring * np.cos(k * 2.39996), ring * np.sin(k * 2.39996), z])
    colors = np.column_stack([np.where(points[:, 0] > 0, 230, 40),
                              np.where(points[:, 1] > 0, 200, 20), np.full(count, 90)])
    colors = colors.astype(np.uint8)
    return points * radius, colors


def write_ply(path, points, colors=None, normals=None, kind="float", form="binary_little_endian"):
    """x y z [nx ny nz] [red green blue [alpha]], as plain as a file can be."""
    columns = [(name, points[:, i], kind) for i, name in enumerate("xyz")]
    if normals is not None:
        columns += [("n" + name, normals[:, i], "float") for i, name in enumerate("xyz")]
    if colors is not None:
        names = ("red", "green", "blue", "alpha")[:colors.shape[1]]
        columns += [(name, colors[:, i], "uchar") for i, name in enumerate(names)]
    header = ["ply", f"format {form} 1.0", f"element vertex {len(points)}"]
    header += [f"property {kind} {name}" for name, _, kind in columns] + ["end_header", ""]
    order = ">" if "big" in form else "<"
    types = {"float": order + "f4", "double": order + "f8", "uchar": "u1"}
    record = np.empty(len(points), [(name, types[kind]) for name, _, kind in columns])
    for name, values, _ in columns:
        record[name] = values
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        if form == "ascii":
            for row in record.tolist():
                file.write((" ".join(repr(value) for value in row) + "\n").encode())
        else:
            file.write(record.tobytes())


def write_data(path, data):
    """Writes a vtkPolyData to a .vtp file."""
    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(data)
    writer.SetFileName(path)
    writer.Write()


def arrays_of(polydata):
    data = polydata.GetPointData()
    return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i))
            for i in range(data.GetNumberOfArrays())}


def places_of(data):
    """-> [n, 3]"""
    return vtk_to_numpy(data.GetPoints().GetData())


def write(path, content):
    """Text or bytes. -> path"""
    with open(path, "wb") as file:
        file.write(content if isinstance(content, (bytes, bytearray)) else content.encode())
    return path


def content_of(path):
    """-> bytes"""
    with open(path, "rb") as file:
        return file.read()


def read_json(path):
    return json.loads(content_of(path))


@contextlib.contextmanager
def caught(descriptor):
    """-> a list, which gets the text that is written to 1 or 2 meanwhile, by libraries, too"""
    texts, kept = [], os.dup(descriptor)
    with tempfile.TemporaryFile() as file:
        sys.stdout.flush()
        sys.stderr.flush()
        os.dup2(file.fileno(), descriptor)
        try:
            yield texts
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(kept, descriptor)
            os.close(kept)
            file.seek(0)
            texts.append(file.read().decode(errors="replace"))


def wait_for(condition, what):
    """AssertionError if it does not become true in PATIENCE."""
    ends = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > ends:
            raise AssertionError(f"{what} did not happen in {PATIENCE} s")
        time.sleep(0.05)


def fewer_on_faces(count):
    """-> a patch by which meshes get so many points on their faces, for less time"""
    class Fewer(faces.vtkPointsOnFaces):
        def __init__(self):
            self.SetNumberOfPoints(count)

    return mock.patch.object(faces, "vtkPointsOnFaces", Fewer)


class ToolCase(unittest.TestCase):
    """Runs in a temporary folder."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def run_tool(self, *words, **options):
        """In a process of its own. Without a display, as on a server."""
        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "PYTHONPATH")}
        return subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True,
                              env=environment, timeout=200, check=False, **options)

    def tool(self, *words):
        """-> what it says on stderr, but for BUSY. In this process, which has loaded VTK; self.code
        becomes its exit code, self.printed what it prints on stdout."""
        from surfelsplatting.commandline.main import main
        with caught(1) as printed, caught(2) as said, mock.patch.dict(os.environ):
            os.environ.pop("DISPLAY", None)  # as on a server
            self.code = main([*map(str, words)])
        self.printed = printed[0]
        return BUSY.sub("", said[0])

    def render(self, *words):
        """A run that must succeed, and in silence, but for IN_MIDDLE."""
        said = IN_MIDDLE.sub("", self.tool("render", *words))
        self.assertEqual((self.code, said, self.printed), (0, "", ""), words)

    def info(self, *words):
        """-> what surfelsplat info prints"""
        self.assertEqual((self.tool("info", *words), self.code), ("", 0))
        return self.printed

    def report(self, *paths):
        return json.loads(self.info(*paths, "--json"))

    def refuse(self, *words, says):
        """One line says these texts, in any order; nothing is written."""
        before = sorted(os.listdir("."))
        said = self.tool(*words)
        self.assertEqual((self.code, self.printed), (2, ""), (words, said))
        self.assertRegex(said, r"\Asurfelsplat: [^\n]+\n\Z")
        for text in [says] if isinstance(says, str) else says:
            self.assertIn(text, said)
        self.assertEqual(sorted(os.listdir(".")), before)

    def note_errors(self, algorithm):
        """Its errors go into self.errors, those of its executive nowhere."""
        self.errors = []

        def note(_caller, _event, text):
            self.errors.append(text)

        note.CallDataType = "string0"
        algorithm.AddObserver("ErrorEvent", note)
        algorithm.GetExecutive().AddObserver("ErrorEvent", lambda *_: None)

    def exr_writer(self, kind, image, path="out.exr"):
        """A writer whose errors go into self.errors."""
        writer = kind()
        self.note_errors(writer)
        writer.SetInputData(image)
        writer.SetFileName(path)
        return writer

    def exr_reader(self, path):
        """A reader whose errors go into self.errors, not yet updated."""
        from surfelsplatting import vtkSurfelEXRReader
        reader = vtkSurfelEXRReader()
        self.note_errors(reader)
        reader.SetFileName(path)
        return reader

    def refuse_to_write(self, writer, says):
        """One error, and no file."""
        writer.Write()
        self.assertNotEqual(writer.GetErrorCode(), 0)
        self.assertEqual(len(self.errors), 1, self.errors)
        self.assertIn(says, self.errors[0])
        self.assertEqual(os.listdir("."), [])
        self.errors.clear()

    def read_exr(self, path):
        """{channel: [height, width]}, top row first."""
        dump = subprocess.run([os.environ["DUMP_EXR"], path], capture_output=True, check=True)
        line, values = dump.stdout.split(b"\n", 1)
        width, height, _compression, *channels = line.decode().split()
        planes = np.frombuffer(values, np.float32).reshape(len(channels), int(height), int(width))
        return {channel.split(":")[0]: plane for channel, plane in zip(channels, planes)}

    def read_rgba(self, path):
        planes = self.read_exr(path)
        return np.stack([planes[channel] for channel in "RGBA"], axis=-1)

    def read_png(self, path, reader=None):
        """[height, width, components], top row first."""
        reader = reader or vtkPNGReader()
        reader.SetFileName(path)
        reader.Update()
        picture = reader.GetOutput()
        width, height, _ = picture.GetDimensions()
        values = vtk_to_numpy(picture.GetPointData().GetScalars())
        return values.reshape(height, width, -1)[::-1]

    def covered(self, path):
        """Part of a lit picture that differs from its background."""
        return (np.abs(self.read_png(path) - 255 * np.array(BACKDROP)).max(axis=2) > 8).mean()

    def read_vtp(self, path):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(path)
        reader.Update()
        return reader.GetOutput()
