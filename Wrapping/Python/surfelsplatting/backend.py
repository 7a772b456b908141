# SPDX-License-Identifier: BSD-3-Clause
"""Which VTK this package works with: cvista, PyVista's build of VTK, or the package vtkmodules.

The compiled modules are built with one of them. Objects of the two do not mix.
"""

import functools
import importlib
import importlib.util
import os
import re
import sys
from contextlib import contextmanager

from .version import SYSTEM, VTK_PACKAGE, VTK_VERSION


def vtk(name):
    """A module of VTK: vtk("vtkRenderingCore")."""
    return importlib.import_module(f"{VTK_PACKAGE}.{name}")


def wanted_package():
    """The VTK that PyVista works with or would choose: the one that PYVISTA_VTK_BACKEND names, else
    cvista if it is installed, else vtkmodules."""
    loaded = getattr(sys.modules.get("pyvista"), "vtk_backend", None)
    name = loaded() if loaded else os.environ.get("PYVISTA_VTK_BACKEND")
    if name:
        return "vtkmodules" if name == "vtk" else name
    return "cvista" if importlib.util.find_spec("cvista") else "vtkmodules"


def _requirement():
    """How pip names the VTK that this package was built with; None where apt installed both."""
    from importlib import metadata  # takes 30 ms, and only errors need it

    try:
        lines = metadata.requires("surfelsplatting") or ()
    except metadata.PackageNotFoundError:
        return None
    return next((line for line in lines if line.startswith(VTK_PACKAGE)), None)


def _built_for():
    return f"surfelsplatting was built with {VTK_PACKAGE} {VTK_VERSION} for {SYSTEM}"


def _advice():
    requirement = _requirement()
    if requirement:
        return f"Install its requirements: pip install '{requirement}'"
    return ("Use the interpreter that it was built for, without packages of the user; on Debian "
            "/usr/bin/python3 -s")


def check_choice():
    """Raises ImportError if PyVista works, or is told to work, with another VTK."""
    wanted = wanted_package()
    if wanted == VTK_PACKAGE:
        return
    if not importlib.util.find_spec(VTK_PACKAGE):
        raise ImportError(f"{_built_for()}, and there is no {VTK_PACKAGE}. {_advice()}")
    by_pyvista = "pyvista" in sys.modules
    if by_pyvista or os.environ.get("PYVISTA_VTK_BACKEND"):
        who = "PyVista works with" if by_pyvista else "PYVISTA_VTK_BACKEND names"
        value = "vtk" if VTK_PACKAGE == "vtkmodules" else VTK_PACKAGE
        raise ImportError(f"{_built_for()}, but {who} {wanted}. Set the environment variable "
                          f"PYVISTA_VTK_BACKEND={value} before Python starts")
    # Otherwise nobody has chosen yet.


@contextmanager
def _binding_late():
    """Functions of libraries that are loaded meanwhile are looked up at their first call. VTK's modules
    have tens of thousands, which takes a tenth of the time to start; of ours all are looked up, so that
    another VTK than theirs is an ImportError, not the end of the process."""
    if not hasattr(sys, "setdlopenflags"):
        yield
        return
    flags = sys.getdlopenflags()
    sys.setdlopenflags(flags & ~os.RTLD_NOW | os.RTLD_LAZY)
    try:
        yield
    finally:
        sys.setdlopenflags(flags)


def load(names):
    """Imports modules of VTK. Raises ImportError if they are missing or of another version."""
    check_choice()
    try:
        with _binding_late():
            for name in names:
                vtk(name)
        found = vtk("vtkCommonCore").vtkVersion.GetVTKVersion()
    except ImportError as error:
        raise cannot_load(error) from error
    if found != VTK_VERSION:
        folder = os.path.dirname(importlib.import_module(VTK_PACKAGE).__file__)
        raise ImportError(f"{_built_for()}, but {folder} has {found}. {_advice()}")


def cannot_load(error):
    """The ImportError to raise when a module of VTK or of ours cannot be loaded."""
    import platform  # takes 3 ms, and only errors need it

    system = f"{platform.system()} {platform.machine()}"
    if system != SYSTEM:
        return ImportError(f"{_built_for()}; this is {system}. Build it from source")
    return ImportError(f"{error}. {_built_for()}. {_advice()}")


def _foreign_class(value):
    """The class that made an object of another VTK than ours; None for other objects."""
    if not hasattr(value, "GetClassName") or isinstance(value, vtk("vtkCommonCore").vtkObjectBase):
        return None
    # PyVista's classes derive from VTK's, vtkOpenGLActor is made by vtkActor().
    names = ((c, c.__name__) for c in type(value).__mro__)
    return next((c for c, n in names if n.startswith("vtk") and "OpenGL" not in n), type(value))


def _explaining(method):
    @functools.wraps(method)
    def call(self, *arguments):
        try:
            return method.__get__(self)(*arguments)  # method(self, ...) would not be virtual
        except TypeError as error:
            for foreign in filter(None, map(_foreign_class, arguments)):
                package, _, module = foreign.__module__.partition(".")
                raise TypeError(
                    f"{method.__name__}: the {foreign.__name__} is an object of {package}, and "
                    f"surfelsplatting works with those of {VTK_PACKAGE}. Import all classes of VTK "
                    f"from there: 'from {VTK_PACKAGE}.{module} import ...'") from error
            raise

    return call


def explain_mixing(classes):
    """Lets methods that take objects say what to do when they get those of another VTK."""
    if VTK_PACKAGE != "cvista":
        return  # the methods of stock VTK's classes cannot be replaced, and name what they need
    for cls in classes:
        for name in dir(cls):
            method = getattr(cls, name)
            if (type(method).__name__ == "method_descriptor"
                    and re.match(r"(Set|Add)\w+\(self[^)]*:vtk", method.__doc__)):
                setattr(cls, name, _explaining(method))
