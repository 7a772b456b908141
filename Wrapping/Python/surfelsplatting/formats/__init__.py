# SPDX-License-Identifier: BSD-3-Clause
"""Files of points, meshes, captures and volumes, each format in a file of its own."""
