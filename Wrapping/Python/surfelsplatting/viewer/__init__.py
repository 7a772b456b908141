# SPDX-License-Identifier: BSD-3-Clause
"""Looking at a scan: what is shown and how (viewer.py), drawn in a window or in a page."""
