# SPDX-License-Identifier: BSD-3-Clause
"""A progress bar on the terminal, driven by VTK's progress events."""

import sys
import time

WIDTH = 30
PATIENCE = 0.3  # s before the bar appears


class Progress:
    """Draws on stderr if that is a terminal."""

    def __init__(self, interrupts, stream=None):
        self._interrupts = interrupts
        self._stream = stream or sys.stderr
        self._active = self._stream.isatty()
        self._label = ""
        self._drawn = None  # the line on the terminal
        self._began = 0.0

    def update(self, algorithm, label):
        """Updates the algorithm; Ctrl-C stops it."""
        observer = algorithm.AddObserver(
            "ProgressEvent", lambda caller, _event: self.show(label, caller.GetProgress()))
        with self._interrupts.stopping(algorithm):
            algorithm.Update()
        algorithm.RemoveObserver(observer)

    def show(self, label, fraction):
        now = time.monotonic()
        if label != self._label:
            self._label, self._began = label, now
        if not self._active or now - self._began < PATIENCE:
            return
        done = round(WIDTH * min(1.0, max(0.0, fraction)))
        line = f"{label:<12} [{'#' * done}{' ' * (WIDTH - done)}] {100 * fraction:3.0f} %"
        if line != self._drawn:
            self._stream.write("\r" + line)
            self._stream.flush()
            self._drawn = line

    def clear(self):
        if self._drawn:
            self._stream.write("\r" + " " * len(self._drawn) + "\r")
            self._stream.flush()
            self._drawn = None
