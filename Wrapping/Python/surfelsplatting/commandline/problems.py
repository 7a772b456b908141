# SPDX-License-Identifier: BSD-3-Clause
"""What went wrong, in one line."""


class UserProblem(Exception):
    """Something the user can mend; the text says what is wrong and what to do."""
