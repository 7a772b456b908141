# SPDX-License-Identifier: BSD-3-Clause
"""Surfels of a file, estimated by another process while this one draws.

Python's lock is held while a VTK filter runs, so that a thread would stop the window. The other
process (estimationprocess.py) writes its progress to its standard output, and the surfels to a
file in memory that has no name: nothing is left when either process is killed. It ends at its next
line if nobody reads on.
"""

import json
import os
import subprocess
import sys
import time

from ..backend import vtk
from ..problems import UserProblem


MODULE = __package__ + ".estimationprocess"
FLAGS = ["-s"] if sys.flags.no_user_site else []


def file_of(descriptor):
    return f"/proc/self/fd/{descriptor}"


class AwaitedSurfels:
    """The other process, as seen by the window."""

    def __init__(self, arguments, ends):
        """ends: is called with the seconds that the surfels took."""
        self._ends, self._began = ends, time.monotonic()
        self._stage, self._fraction = "reading", 0.0
        self._memory = os.memfd_create("surfels")
        self._rest = b""
        values = {name: value for name, value in vars(arguments).items() if not callable(value)}
        package = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
        paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
        self._process = subprocess.Popen(
            [sys.executable, *FLAGS, "-m", MODULE, str(self._memory)], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, pass_fds=[self._memory],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)})
        self._process.stdin.write(json.dumps(values).encode())
        self._process.stdin.close()
        os.set_blocking(self._process.stdout.fileno(), False)

    def poll(self):
        """-> vtkPolyData once it is there, else None. UserProblem: what the estimation said."""
        ended = self._process.poll() is not None
        self._read_lines()
        if not ended:
            return None
        if self._process.returncode != 0:
            raise UserProblem("the estimation of surfels ended with "
                              f"{self._process.returncode}; is there enough memory?")
        surfels = _read(file_of(self._memory))
        self.close()
        self._ends(time.monotonic() - self._began)
        return surfels

    def _read_lines(self):
        while chunk := self._process.stdout.read(65536):
            self._rest += chunk
        *lines, self._rest = self._rest.split(b"\n")
        for line in map(json.loads, lines):
            if "problem" in line:
                raise UserProblem(line["problem"])
            self._stage, self._fraction = line["stage"], line["fraction"]

    def describe(self):
        """What is being done."""
        return f"{self._stage} {100 * self._fraction:.0f} %"

    def close(self):
        """Ends the process and frees its memory."""
        if self._memory is not None:
            os.close(self._memory)
            self._memory = None
            self._process.kill()
            self._process.wait()
            self._process.stdout.close()


def _read(path):
    reader = vtk("vtkIOXML").vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()
