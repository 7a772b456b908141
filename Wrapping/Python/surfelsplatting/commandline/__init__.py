# SPDX-License-Identifier: BSD-3-Clause
"""The command line tool surfelsplat."""

from .main import main, run  # noqa: F401
