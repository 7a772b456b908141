# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat web: its options, and a page."""

from ..arguments import between
from ..options import add_clouds
from .view import FIRST, add_scan_options

DESCRIPTION = """\
Shows a point cloud in a page of a browser, with depth of field: drag to turn, click on what should
be sharp, open the aperture with the slider. Pictures are rendered here, without OpenGL or display.

Needs the Python packages trame and trame-rca; without them, the command says how to install them.
"""


def _port(text):
    return between(0, 65535, int)(text)


def add_parser(commands):
    """Adds the command and its options."""
    parser = commands.add_parser("web", help="look at a point cloud in a browser",
                                 usage="surfelsplat web CLOUD ... [options]",
                                 description=DESCRIPTION,
                                 first=("--port", "--token", "--host", *FIRST))
    add_clouds(parser, "the point cloud; several files are one cloud; see surfelsplat render")
    page = parser.add_argument_group("page")
    page.add_argument("--port", type=_port, default=8080, metavar="N",
                      help="port of the page; 0: any that is free (default: 8080)")
    page.add_argument("--token", action="store_true",
                      help="let nobody in without a secret word, which is part of the address that "
                           "is printed; for machines with several users")
    page.add_argument("--host", default="127.0.0.1", metavar="ADDRESS",
                      help="listen at this address of the machine, 0.0.0.0 for all, so that other "
                           "machines can see the page; they need the token (default: 127.0.0.1, "
                           "this machine only)")
    add_scan_options(parser)
    parser.set_defaults(run=run)


def run(arguments):
    from ...viewer.web import Page, check_packages
    from ..scan import Scan

    check_packages()
    scan = Scan(arguments)
    Page(scan.viewer, scan.start_estimation(), arguments, scan.say).run()
