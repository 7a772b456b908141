# SPDX-License-Identifier: BSD-3-Clause
"""Errors that are reported in one line, and warnings."""

from difflib import get_close_matches
import os
import sys
import warnings


class UserProblem(Exception):
    """An error that the user can fix; the text says what is wrong and what to do."""


def no_points(path):
    return UserProblem(f"{path} holds no points; give a file with some, or make it again")


def shortened(text, most=60):
    return text if len(text) <= most else text[:most - 3] + "..."


def how_to_install(packages):
    """The command that installs packages of pip, for messages. Where the system's packages are left to
    its own installer, as on Debian, pip needs an environment."""
    import shlex  # with sysconfig takes 3 ms, and only errors need it
    import sysconfig

    is_managed = os.path.exists(os.path.join(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED"))
    if sys.prefix != sys.base_prefix or not is_managed:
        return f"pip install {packages}"
    return (f"{sys.executable} -m venv --system-site-packages ~/surfelenv && ~/surfelenv/bin/pip "
            f"install {packages}, and then ~/surfelenv/bin/python {shlex.join(sys.argv)}")


def check_names(names, known, call, otherwise, elsewhere=()):
    """Raises TypeError for an argument that a call does not have: the name that was meant, or else what
    to do.

    elsewhere: what to do by the names that other calls have, with {} for the name
    """
    for name in names:
        if name not in known:
            near = [] if name in elsewhere else get_close_matches(name, known, 1)
            if name in elsewhere:
                otherwise = elsewhere[name].format(name)
            raise TypeError(f"{call} has no argument {name!r}; "
                            + (f"did you mean {near[0]!r}?" if near else otherwise))


def warn_user(text):
    """A warning of the line outside of this package that is the reason."""
    package = __name__.partition(".")[0]
    frame, level = sys._getframe(1), 2
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, stacklevel=level)
