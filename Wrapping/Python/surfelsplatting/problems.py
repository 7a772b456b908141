# SPDX-License-Identifier: BSD-3-Clause
"""Errors that are reported in one line, and warnings."""

from difflib import get_close_matches
import sys
import warnings


class UserProblem(Exception):
    """An error that the user can fix; the text says what is wrong and what to do."""


def check_names(names, known, call, otherwise):
    """Raises TypeError for an argument that a call does not have: the name that was meant, or else what
    to do."""
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, 1)
            raise TypeError(f"{call} has no argument {name!r}; "
                            + (f"did you mean {near[0]!r}?" if near else otherwise))


def warn_user(text):
    """A warning of the line outside of this package that is the reason."""
    package = __name__.partition(".")[0]
    frame, level = sys._getframe(1), 2
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, stacklevel=level)
