# SPDX-License-Identifier: BSD-3-Clause
"""Finds out whether a reader survives a file.

Some damaged files end a library's reader, and with it the process: in VTK a wrong type of an array
by a segmentation fault, a wrong size by an exception that nobody catches.
"""

import os
import resource
import signal
import sys

from ..backend import vtk
from ..problems import UserProblem

SECONDS = 60  # and as many again for each SPEED bytes
SPEED = 50_000_000


def _limit(path):
    """Neither memory nor time of the machine is used up by a wrong size."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    seconds = SECONDS + SECONDS * os.path.getsize(path) // SPEED
    for what, limit in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (limit if hard < 0 else min(limit, hard), hard))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(seconds)


def check_survives(path, read):
    """Raises UserProblem if read() would end the process: a child process, which has all that this
    one has, calls it first."""
    sys.stderr.flush()
    child = os.fork()
    if child == 0:
        try:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            vtk("vtkCommonCore").vtkSMPTools.SetBackend("Sequential")  # it has no threads
            _limit(path)
            read()
        finally:
            os._exit(0)  # other failures are reported by the parent
    try:
        _, status = os.waitpid(child, 0)
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    if os.WIFSIGNALED(status):
        raise UserProblem(f"{path} is damaged, or too large for the memory: the reader of "
                          f"{os.path.splitext(path)[1].lower()} files does not get through it")
