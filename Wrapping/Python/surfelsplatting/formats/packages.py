# SPDX-License-Identifier: BSD-3-Clause
"""Python packages that some formats need."""

import importlib

from ..problems import UserProblem, how_to_install


def package_for(path, name, requirement):
    """-> the package that reads the file; UserProblem if it is not installed. requirement: pip's name of it"""
    try:
        return importlib.import_module(name)
    except ImportError:
        how = how_to_install(f"'{requirement}'")
        raise UserProblem(f"{path}: such files need the Python package {name}: {how}; or "
                          f"convert the file, for example with `pdal translate {path} out.ply`") from None
