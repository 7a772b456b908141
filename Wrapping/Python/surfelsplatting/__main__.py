# SPDX-License-Identifier: BSD-3-Clause
"""python -m surfelsplatting: the command line tool."""

from .commandline import run

run()
