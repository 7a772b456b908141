# SPDX-License-Identifier: BSD-3-Clause
"""How far the work is: a bar on a terminal, lines in a log."""

import sys
import time

WIDTH = 30
PATIENCE = 0.3  # s before the bar appears
LOG_PATIENCE = 10.0  # s before the first line of a log, and at least between two lines
LOG_GROWTH = 0.1  # of the time so far, at least between two lines: long work keeps the log short


class Progress:
    """Writes to stderr."""

    def __init__(self, interrupts, stream=None):
        self._interrupts = interrupts
        self._stream = stream or sys.stderr
        self._on_terminal = self._stream.isatty()
        self._stage = ""
        self._drawn = None  # the line on the terminal
        self._began = 0.0
        self._logged = 0.0

    def update(self, algorithm, label, port=0):
        """Updates an output of the algorithm; Ctrl-C stops it."""
        observer = algorithm.AddObserver(
            "ProgressEvent", lambda caller, _event: self.show(label, caller.GetProgress()))
        with self._interrupts.stopping(algorithm):
            algorithm.Update(port)
        algorithm.RemoveObserver(observer)

    def show(self, label, fraction):
        """label: what is done; its first word tells the stage, whose time counts."""
        now = time.monotonic()
        stage = label.split()[0]
        if stage != self._stage:
            self._stage, self._began, self._logged = stage, now, now
        percent = f"{100 * min(1.0, max(0.0, fraction)):3.0f} %"
        if not self._on_terminal:
            self._log(f"{label} {percent.strip()}", now)
        elif now - self._began >= PATIENCE:
            self._draw(label, fraction, percent)

    def _log(self, text, now):
        elapsed = now - self._began
        if now - self._logged >= max(LOG_PATIENCE, LOG_GROWTH * elapsed):
            self._logged = now
            minutes, seconds = divmod(round(elapsed), 60)
            self._stream.write(f"surfelsplat: {text} after {minutes}:{seconds:02}\n")
            self._stream.flush()

    def _draw(self, label, fraction, percent):
        done = round(WIDTH * min(1.0, max(0.0, fraction)))
        line = f"{label:<12} [{'#' * done}{' ' * (WIDTH - done)}] {percent}"
        if line != self._drawn:
            left_over = " " * (len(self._drawn or "") - len(line))
            self._stream.write("\r" + line + left_over)
            self._stream.flush()
            self._drawn = line

    def clear(self):
        if self._drawn:
            self._stream.write("\r" + " " * len(self._drawn) + "\r")
            self._stream.flush()
            self._drawn = None
