# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat view: a window."""

from ..viewer.window import Window, check_display
from .scan import Scan


def view(arguments):
    check_display()
    scan = Scan(arguments)
    Window(scan.viewer, scan.start_estimation(), scan.say).run()
