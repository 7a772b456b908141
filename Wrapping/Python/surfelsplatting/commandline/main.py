# SPDX-License-Identifier: BSD-3-Clause
"""Entry point: an error that the user can fix is one line on stderr and exit code 2."""

import sys

from .arguments import parse_arguments
from .problems import UserProblem


def main(words=None):
    try:
        arguments = parse_arguments(sys.argv[1:] if words is None else words)
        # Imported here, so that --help and wrong options do not load numpy and the readers.
        from .render import render

        render(arguments)
    except UserProblem as problem:
        print("surfelsplat: " + " ".join(str(problem).split()), file=sys.stderr)
        return 2
    except MemoryError:
        print("surfelsplat: out of memory; use fewer points or a smaller picture",
              file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("surfelsplat: interrupted", file=sys.stderr)
        return 130
    return 0
