# SPDX-License-Identifier: BSD-3-Clause
"""Finds out whether a reader survives a file.

Some damaged files end a library's reader, and with it the process: in VTK a wrong type of an array
by a segmentation fault, a wrong size by an exception that nobody catches.
"""

import ctypes
import os
import resource
import signal
import sys
import tempfile
import warnings
from contextlib import contextmanager

from ..backend import vtk
from ..problems import UserProblem

SECONDS = 60  # and as many again for each SPEED bytes
SPEED = 50_000_000
PRINTED = (1, 2)  # file descriptors of what is printed


def _limit(path):
    """Neither memory nor time of the machine is used up by a wrong size."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    seconds = SECONDS + SECONDS * os.path.getsize(path) // SPEED
    for what, limit in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (limit if hard < 0 else min(limit, hard), hard))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(seconds)


def _flush():
    """Python's streams, and those of C, which C++ uses."""
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).fflush(None)


@contextmanager
def silent_libraries():
    """Nothing is printed, by libraries neither."""
    kept = {stream: os.dup(stream) for stream in PRINTED}
    _flush()
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        for stream in PRINTED:
            os.dup2(nowhere.fileno(), stream)
    try:
        yield
    finally:
        _flush()
        for stream, copy in kept.items():
            os.dup2(copy, stream)
            os.close(copy)


def check_survives(path, read):
    """-> what libraries print. Raises UserProblem if read() would end the process: a child
    process, which has all that this one has, calls it first."""
    with tempfile.TemporaryFile() as said:
        _read_in_child(path, read, said.fileno())
        said.seek(0)
        return said.read().decode(errors="replace")


def _fork():
    """-> 0 in the child. Python >= 3.12 warns where other threads run, as VTK's do between two
    parallel loops: the child might wait for a lock that one of them held. Those of VTK hold none
    then, and a child that waits for others ends after _limit's seconds."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
        return os.fork()


def _read_in_child(path, read, printed):
    """printed: file descriptor for what the child prints"""
    _flush()
    child = _fork()
    if child == 0:
        try:
            _limit(path)
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            for stream in PRINTED:
                os.dup2(printed, stream)
            vtk("vtkCommonCore").vtkSMPTools.SetBackend("Sequential")  # it has no threads
            read()
        finally:
            _flush()
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
