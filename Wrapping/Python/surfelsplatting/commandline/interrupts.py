# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C stops Python code at once and a VTK filter at its next progress event.

A Python exception inside a VTK filter would end the process with VTK's own message.
"""

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
        """An interrupt stops the algorithm; KeyboardInterrupt is raised after it has returned."""
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
