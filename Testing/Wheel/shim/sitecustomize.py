# SPDX-License-Identifier: BSD-3-Clause
"""On PYTHONPATH this lets the tests, which import vtkmodules, work with cvista: vtkmodules.X is the
module cvista.X."""

import importlib
import importlib.abc
import importlib.machinery
import sys


class _Redirection(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, fullname, path=None, target=None):
        if fullname.partition(".")[0] == "vtkmodules":
            return importlib.machinery.ModuleSpec(fullname, self, is_package=True)
        return None

    def create_module(self, spec):
        module = importlib.import_module("cvista" + spec.name[len("vtkmodules"):])
        self.own_spec = module.__spec__
        return module

    def exec_module(self, module):
        module.__spec__ = self.own_spec  # the import system has replaced it


sys.meta_path.insert(0, _Redirection())
