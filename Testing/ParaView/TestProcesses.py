# SPDX-License-Identifier: BSD-3-Clause
"""Two ranks, and servers of one and two, draw the picture of one process, and nothing hangs: raw
points that are spread in space, that are mixed, and that one rank alone has."""

import os
import shutil
import socket
import subprocess
import time
import unittest

import numpy as np
from paraview.vtk.vtkCommonDataModel import vtkPolyData
from paraview.vtk.vtkIOImage import vtkPNGReader
from paraview.vtk.vtkIOXML import vtkXMLPolyDataWriter
from paraview.numpy_support import numpy_to_vtk, vtk_to_numpy
from paraview.vtk.vtkCommonCore import vtkPoints

from measures import psnr
from plugincase import sphere

HERE = os.path.dirname(os.path.abspath(__file__))
FOLDER = os.path.join(os.environ["FOLDER"], "processes")
TIMEOUT = 240  # s; a run takes 30
MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
       "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
       "OMPI_MCA_mpi_yield_when_idle": "1"}
# pvpython is a rank of its own already, which its children must not take themselves for.
ENVIRONMENT = {**{name: value for name, value in os.environ.items()
                  if not name.startswith(("OMPI_", "PMIX_"))}, **MPI}
LEAST_PSNR = 45.0  # dB; each rank has a hierarchy of its own


def write_pieces(name, pieces):
    for i, piece in enumerate(pieces):
        data, points = vtkPolyData(), vtkPoints()
        points.SetData(numpy_to_vtk(np.ascontiguousarray(piece, np.float32), deep=1))
        data.SetPoints(points)
        writer = vtkXMLPolyDataWriter()
        writer.SetDataModeToAscii()  # Debian's libexpat cannot read what is appended
        writer.SetInputData(data)
        writer.SetFileName(f"{FOLDER}/{name}_{i}.vtp")
        writer.Write()
    with open(f"{FOLDER}/{name}.pvtp", "w") as file:
        file.write('<VTKFile type="PPolyData" version="0.1" byte_order="LittleEndian">'
                   '<PPolyData GhostLevel="0"><PPoints><PDataArray type="Float32" Name="Points" '
                   'NumberOfComponents="3"/></PPoints>')
        file.write("".join(f'<Piece Source="{name}_{i}.vtp"/>' for i in range(len(pieces))))
        file.write("</PPolyData></VTKFile>")


def read(path):
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())[:, :3].astype(float)


def draw(run, command, *scenes, **variables):
    """Runs scene.py; -> its exit status"""
    folder = f"{FOLDER}/{run}"
    os.makedirs(folder)
    done = subprocess.run(
        [*command, f"{HERE}/scene.py", folder, *scenes], timeout=TIMEOUT, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, env={**ENVIRONMENT, "DATA": FOLDER, **variables})
    with open(f"{folder}/log.txt", "w") as log:
        log.write(done.stdout)
    return done.returncode if "drawn" in done.stdout else done.returncode or 1


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Processes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(FOLDER, ignore_errors=True)
        os.makedirs(FOLDER)
        near = sphere(10000, [0, 0, 0], 1.0)
        write_pieces("near", [near[0::2], near[1::2]])
        wall = np.random.default_rng(1).uniform(-4, 4, (20000, 3))
        wall[:, 2] = -3.0
        write_pieces("wall", [wall[wall[:, 0] < 0.1], wall[wall[:, 0] >= 0.1]])
        write_pieces("far", [np.empty((0, 3)), sphere(5000, [0.3, 0.2, 1.6], 0.4)])
        assert draw("serial", ["pvbatch"], "all", "camera") == 0

    def compare(self, run, *scenes):
        for scene in scenes:
            serial = f"{FOLDER}/serial/{'all' if scene == 'all' else 'camera'}"
            names = sorted(os.listdir(serial))
            self.assertGreater(len(names), 1)
            for name in names:
                expected, found = read(f"{serial}/{name}"), read(f"{FOLDER}/{run}/{scene}/{name}")
                self.assertGreater(expected.std(), 20, name)
                value = psnr(found, expected, 255)
                print(f"{run}, {scene}, {name}: {value:.1f} dB, "
                      f"{np.abs(found - expected).max():.0f} at most", flush=True)
                self.assertGreater(value, LEAST_PSNR, (scene, name))

    def test_two_ranks(self):
        """Each draws its pieces; or all are collected on the root."""
        scenes = "all", "collected"
        self.assertEqual(draw("ranks", ["mpirun", "-np", "2", "pvbatch"], *scenes), 0)
        self.compare("ranks", *scenes)

    def test_a_rank_that_dies(self):
        start = time.time()
        # On both ranks the script itself runs.
        status = draw("dying", ["mpirun", "-np", "2", "pvbatch", "--symmetric"], "camera", DYING="1")
        self.assertNotEqual(status, 0)
        self.assertLess(time.time() - start, TIMEOUT / 2)

    def serve(self, run, command, *scenes):
        port = str(free_port())
        server = subprocess.Popen(
            [*command, "pvserver", "--force-offscreen-rendering", f"--server-port={port}",
             "--multi-clients=0"], env=ENVIRONMENT, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        try:
            self.assertEqual(draw(run, ["pvpython"], *scenes, PORT=port), 0)
            server.wait(TIMEOUT)
        finally:
            server.kill()
        self.compare(run, *scenes)

    def test_server_that_renders(self):
        self.serve("server", [], "camera")

    def test_two_servers(self):
        """They render; or the client does."""
        self.serve("servers", ["mpirun", "-np", "2"], "camera", "collected")
