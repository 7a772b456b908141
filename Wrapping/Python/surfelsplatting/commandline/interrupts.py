# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C: at once in Python; in VTK's filters, where a Python exception would end the process with
VTK's own message, at their next progress event."""

import signal
from contextlib import contextmanager


class Interrupts:
    def __init__(self):
        self._asked = False
        self._in_vtk = False
        signal.signal(signal.SIGINT, self._on_signal)

    def _on_signal(self, _number, _frame):
        self._asked = True
        if not self._in_vtk:
            raise KeyboardInterrupt

    @contextmanager
    def stopping(self, algorithm):
        """While the algorithm runs, an interrupt stops it; raised when it is back."""
        observer = algorithm.AddObserver("ProgressEvent", self._on_progress)
        self._in_vtk = True
        try:
            yield
        finally:
            self._in_vtk = False
            algorithm.RemoveObserver(observer)
        if self._asked:
            raise KeyboardInterrupt

    def _on_progress(self, caller, _event):
        if self._asked:
            caller.SetAbortExecute(True)
