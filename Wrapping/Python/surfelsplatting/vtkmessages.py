# SPDX-License-Identifier: BSD-3-Clause
"""VTK's errors and warnings as Python data, without windows and without output on stderr."""

from contextlib import contextmanager
import logging
import re
import sys
import weakref

from .backend import vtk
from .problems import UserProblem, warn_user

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


@contextmanager
def errors_of(*objects, event="ErrorEvent"):
    """-> a list that gets the errors, or warnings, of VTK objects, which nobody else sees meanwhile."""
    texts = []

    def note(_caller, _event, text):
        texts.append(plain_text(text))

    note.CallDataType = vtk("vtkCommonCore").VTK_STRING
    tags = [(observed, observed.AddObserver(event, note)) for observed in objects]
    try:
        yield texts
    finally:
        for observed, tag in tags:
            observed.RemoveObserver(tag)


def update(algorithm, what, run=None, warns=lambda: True):
    """Updates an algorithm, or runs it. Raises its first error as a RuntimeError, and repeats its
    warnings, in the log if warns() is not true."""
    observed = algorithm, algorithm.GetExecutive()
    with errors_of(*observed) as errors, errors_of(*observed, event="WarningEvent") as texts:
        (run or algorithm.Update)()
    if errors:
        raise RuntimeError(f"{what}: {errors[0]}")
    tell = warn_user if texts and warns() else logging.getLogger("surfelsplatting").info
    for text in texts:
        tell(f"{what}: {' '.join(text.split())}")


_collectors = weakref.WeakSet()
_windows = []  # those that are observed. Python must not collect them: VTK would go on calling
               # what is left of the observers' functions.


def _observe(window):
    def observe(event, method):
        def call(_caller, _event, text):
            for collector in list(_collectors):
                method(collector, plain_text(text))

        call.CallDataType = vtk("vtkCommonCore").VTK_STRING
        window.AddObserver(event, call)

    observe("ErrorEvent", VtkMessages.add_error)
    observe("WarningEvent", VtkMessages.add_warning)
    _windows.append(window)


class VtkMessages:
    """Collects VTK's messages as long as it lives.

    check() raises the first error as a UserProblem. Warnings are printed if verbose.
    """

    def __init__(self, verbose=False):
        self.errors = []
        self.verbose = verbose
        core = vtk("vtkCommonCore")
        core.vtkLogger.SetStderrVerbosity(core.vtkLogger.VERBOSITY_OFF)
        window = core.vtkOutputWindow.GetInstance()
        window.SetDisplayModeToNever()
        if window not in _windows:
            _observe(window)
        _collectors.add(self)

    def add_error(self, text):
        self.errors.append(text)

    def add_warning(self, text):
        if text.startswith("Error"):  # so vtkDataReader says that a file is cut short
            self.add_error(text)
        elif self.verbose:
            print("surfelsplat: warning: " + " ".join(text.split()), file=sys.stderr)

    def forget(self):
        self.errors.clear()

    def check(self, prefix=""):
        if self.errors:
            raise UserProblem(prefix + self.errors[0])
