# SPDX-License-Identifier: BSD-3-Clause
"""Errors that are reported in one line, and warnings."""

import glob
import os
import sys
import warnings

OWN_PACKAGES = "~/.local/share/surfelsplat"  # of pip, where the system's Python takes none


class UserProblem(Exception):
    """An error that the user can fix; the text says what is wrong and what to do."""


def no_points(path):
    return UserProblem(f"{path} holds no points; give a file with some, or make it again")


def shortened(text, most=60):
    return text if len(text) <= most else text[:most - 3] + "..."


def _takes_packages():
    """Whether pip may install beside the packages of this Python: not where the system's installer does it,
    as on Debian."""
    import sysconfig

    return sys.prefix != sys.base_prefix or not os.path.exists(
        os.path.join(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED"))


def how_to_install(packages):
    """The command that installs packages of pip, for messages: where find_own_packages finds them."""
    from importlib.util import find_spec  # with sysconfig takes 3 ms, and only errors need it

    if _takes_packages():
        return f"pip install {packages}"
    pip = "" if find_spec("pip") else "sudo apt install python3-pip && "
    return f"{pip}{sys.executable} -m pip install --prefix {OWN_PACKAGES} {packages}, and then the same again"


def find_own_packages():
    """Lets Python find what a command of how_to_install has installed for its version."""
    if sys.prefix != sys.base_prefix:
        return  # an environment, whose packages are its own
    version = "python{}.{}".format(*sys.version_info)
    for between in ("", "local"):  # which is Debian's
        pattern = os.path.join(os.path.expanduser(OWN_PACKAGES), between, "lib*", version, "*-packages")
        sys.path[1:1] = [folder for folder in glob.glob(pattern) if folder not in sys.path]


def warn_user(text):
    """A warning of the line outside of this package that is the reason."""
    package = __name__.partition(".")[0]
    frame, level = sys._getframe(1), 2
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, stacklevel=level)
