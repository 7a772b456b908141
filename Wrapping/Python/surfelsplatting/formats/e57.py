# SPDX-License-Identifier: BSD-3-Clause
"""Reads .e57 files, where the Python package pye57 is installed."""

import numpy as np

from ..clouds.colors import colors_and_intensity
from ..clouds.polydata import polydata_of
from ..clouds.stations import trusted_places, ways_of
from ..problems import UserProblem
from .packages import package_for


def _read_e57_scan(file, index):
    """-> places, colours or None, intensities or None, in the coordinates of all scans."""
    data = file.read_scan(index, colors=True, intensity=True, transform=True,
                          ignore_missing_fields=True)

    def columns(*names):
        return np.column_stack([data[n] for n in names]) if names[0] in data else None

    return (columns("cartesianX", "cartesianY", "cartesianZ"),
            columns("colorRed", "colorGreen", "colorBlue"), data.get("intensity"))


def read_e57_cloud(path):
    """-> vtkPolyData with double points, which know their scanners, and the place of the scanner if it
    was one scan."""
    pye57 = package_for(path, "pye57", "pye57", b"ASTM-E57")
    try:
        with pye57.E57(path) as file:
            if file.scan_count == 0:
                raise ValueError("it holds no scans")
            parts = list(zip(*(_read_e57_scan(file, i) for i in range(file.scan_count))))
            headers = [file.get_header(i) for i in range(file.scan_count)]
            scanners = trusted_places([tuple(map(float, header.translation)) if header.has_pose()
                                       else None for header in headers])
        ways = ways_of(parts[0], scanners)
        # What one of the scans lacks cannot be shown for all.
        places, *attributes = (None if any(p is None for p in part) else np.concatenate(part)
                               for part in parts)
        cloud = polydata_of(places, {**colors_and_intensity(*attributes), **ways})
    except Exception as error:  # pye57 has no common class of errors
        reason = str(error).partition("\n")[0]  # then libE57Format says where it is in its source
        raise UserProblem(f"{path} is not a readable .e57 file: {reason}; was all of it copied?") from error
    return cloud, scanners[0] if len(scanners) == 1 else None
