# SPDX-License-Identifier: BSD-3-Clause
"""The process that estimates surfels for view and web: awaitedsurfels.py starts it.

    python -m surfelsplatting.commandline.estimationprocess FILE_DESCRIPTOR < ARGUMENTS.json
"""

import argparse
import json
import os
import signal
import sys
import time

from ..problems import UserProblem
from .awaitedsurfels import file_of
from .outputs import write_polydata
from .progress import Progress
from .session import Session

NICENESS = 5  # so that turning stays smooth
PERIOD = 0.1  # s between two lines of progress


def _say(**values):
    sys.stdout.write(json.dumps(values) + "\n")
    sys.stdout.flush()


class _Lines(Progress):
    """Progress as lines for the process that waits."""

    _said = 0.0

    def show(self, label, fraction):
        now = time.monotonic()
        if now - self._said > PERIOD:
            self._said = now
            _say(stage=label, fraction=fraction)


def _estimate(arguments):
    session = Session(arguments, is_silent=True)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the window is told, too, and ends this process
    session.progress = _Lines(session.interrupts)
    cloud = session.drawn_as_points(session.cloud())
    surfels = session.surfels(cloud, with_hierarchy=True)
    return session.drawable(surfels, all_arrays=True)


def main():
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # the window is gone
    os.nice(NICENESS)
    arguments = argparse.Namespace(**json.load(sys.stdin))
    try:
        if not write_polydata(_estimate(arguments), file_of(sys.argv[1])):
            raise UserProblem("the surfels do not fit into memory; use fewer points")
    except UserProblem as problem:
        _say(problem=str(problem))
    except MemoryError:
        _say(problem="out of memory; use fewer points")
    # Without the destructors of large arrays.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
