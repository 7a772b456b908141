# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat web: a page."""

from ..viewer.web import Page, check_packages
from .scan import Scan


def web(arguments):
    check_packages()
    scan = Scan(arguments)
    Page(scan.viewer, scan.start_estimation(), arguments, scan.say).run()
