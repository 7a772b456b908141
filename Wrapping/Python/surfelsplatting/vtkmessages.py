# SPDX-License-Identifier: BSD-3-Clause
"""VTK's errors and warnings as Python data, without windows and without output on stderr."""

import re
import sys

from .backend import vtk
from .problems import UserProblem

# "ERROR: In file.cxx, line 12\nvtkClass (0x55d0): the message\n\n"
_PREFIX = re.compile(
    r"(?:ERROR|Warning|Generic Warning|Debug): In [^\n]*, line \d+\n(?:\S+ \(\w+\): )?")


def plain_text(message):
    """The message, and those it quotes, without the file, the line and the object's address.

    message: None where it quotes bytes of a file that are no text.
    """
    if message is None:
        return "the file is damaged (the message about it is not text)"
    return _PREFIX.sub("", message).strip()


class VtkMessages:
    """Collects VTK's messages from its construction on.

    check() raises the first error as a UserProblem. Warnings are printed if verbose.
    """

    def __init__(self, verbose=False):
        self.errors = []
        self.verbose = verbose
        core = vtk("vtkCommonCore")
        core.vtkLogger.SetStderrVerbosity(core.vtkLogger.VERBOSITY_OFF)
        self._window = core.vtkOutputWindow.GetInstance()
        self._window.SetDisplayModeToNever()
        self._observe("ErrorEvent", self._on_error)
        self._observe("WarningEvent", self._on_warning)

    def _observe(self, event, method):
        def call(_caller, _event, text):
            method(plain_text(text))

        call.CallDataType = vtk("vtkCommonCore").VTK_STRING
        self._window.AddObserver(event, call)

    def _on_error(self, text):
        self.errors.append(text)

    def _on_warning(self, text):
        if self.verbose:
            print("surfelsplat: warning: " + " ".join(text.split()), file=sys.stderr)

    def check(self, prefix=""):
        if self.errors:
            raise UserProblem(prefix + self.errors[0])
