# SPDX-License-Identifier: BSD-3-Clause
"""Entry point: an error that the user can fix is one line on stderr and exit code 2."""

import os
import sys
from contextlib import suppress

from .commands import parse_arguments
from ..problems import UserProblem


def main(words=None):
    try:
        arguments = parse_arguments(sys.argv[1:] if words is None else words)
        arguments.run(arguments)
        print(end="", flush=True)  # does nothing if the caller has closed stdout
    except UserProblem as problem:
        print("surfelsplat: " + " ".join(str(problem).split()), file=sys.stderr)
        return 2
    except MemoryError:
        print("surfelsplat: out of memory; use fewer points or a smaller picture",
              file=sys.stderr)
        return 2
    except BrokenPipeError:  # of a pipe to head, for example
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except KeyboardInterrupt as interrupt:
        print("; ".join(filter(None, ("surfelsplat: interrupted", str(interrupt)))),
              file=sys.stderr)
        return 130
    return 0


def run():
    """The program. It ends without destructors: those of a cloud of a million points and of the
    libraries take 40 ms."""
    streams = [stream for stream in (sys.stdout, sys.stderr) if stream]  # None: closed by the caller
    for stream in streams:
        stream.reconfigure(errors="backslashreplace")  # names of files may be no text
    code = main()
    for stream in streams:
        with suppress(BrokenPipeError):  # what was printed before an error
            stream.flush()
    os._exit(code)
