# SPDX-License-Identifier: BSD-3-Clause
"""Python packages that some formats need."""

import importlib
import os

from ..problems import UserProblem, find_own_packages, how_to_install


def _check_begin(path, begin):
    with open(path, "rb") as file:
        found = file.read(len(begin))
    if found != begin:
        kind = os.path.splitext(path)[1].lower()
        raise UserProblem(f"{path} is not a readable {kind} file: it begins with {found!r}, not with {begin!r}; "
                          "is its name right, and was all of it downloaded?")


def package_for(path, name, requirement, begin):
    """-> the package that reads the file; UserProblem if it is not installed, or if the file is of another
    kind. requirement: pip's name of the package. begin: the first bytes of such files
    """
    _check_begin(path, begin)
    find_own_packages()
    try:
        return importlib.import_module(name)
    except ImportError:
        how = how_to_install(f"'{requirement}'")
        raise UserProblem(f"{path}: such files need the Python package {name}: {how}; or "
                          f"convert the file, for example with `pdal translate {path} out.ply`") from None
