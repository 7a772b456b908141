# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat view: its options, and a window."""

from ..options import (add_camera_options, add_clouds, add_lens_options, add_look_options,
                       add_run_options, check_options)

FIRST = ("--blur", "--scalars", "--view", "--up", "--background", "--camera", "--every")

DESCRIPTION = """\
Shows a point cloud in a window, with depth of field: drag to turn, click on what should be sharp,
open the aperture with the key Up. The key h lists all keys. The points are shown at once, and
their surfels when they are estimated.

The key s writes CLOUD-1.png and CLOUD-1.camera.json to the current folder, the next time CLOUD-2;
surfelsplat render CLOUD --camera CLOUD-1.camera.json -o OUT.png makes the same picture.
"""


def add_scan_options(parser):
    """Adds what the window and the page have in common."""
    add_camera_options(parser)
    add_lens_options(parser)
    add_look_options(parser)
    add_run_options(parser)
    # As in a saved camera, a focus has an effect without a lens, too, which may be opened later.
    parser.set_defaults(check=check_options, save_camera=True)


def add_parser(commands):
    """Adds the command and its options."""
    parser = commands.add_parser("view", help="look at a point cloud in a window",
                                 usage="surfelsplat view CLOUD ... [options]",
                                 description=DESCRIPTION, first=FIRST)
    add_clouds(parser, "the point cloud; several files are one cloud; see surfelsplat render")
    add_scan_options(parser)
    parser.set_defaults(run=run)


def run(arguments):
    from ...viewer.window import Window, check_display
    from ..scan import Scan

    check_display()
    scan = Scan(arguments)
    Window(scan.viewer, scan.start_estimation(), scan.say).run()
