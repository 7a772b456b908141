# SPDX-License-Identifier: BSD-3-Clause
"""Errors that are reported in one line."""


class UserProblem(Exception):
    """An error that the user can fix; the text says what is wrong and what to do."""
