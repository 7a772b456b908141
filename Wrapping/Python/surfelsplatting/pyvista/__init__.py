# SPDX-License-Identifier: BSD-3-Clause
"""What PyVista finds by its entry points: ``dataset.surfels``, ``plotter.surfels``, ``.pcd`` files."""
