# SPDX-License-Identifier: BSD-3-Clause
"""No library of PCL comes along with the plugin's filters, and no second VTK."""

import ctypes
import os

from paraview import simple

from plugincase import PluginCase


class LoadedLibrary(ctypes.Structure):
    """The beginning of struct dl_phdr_info; /proc is not there."""
    _fields_ = [("address", ctypes.c_size_t), ("name", ctypes.c_char_p)]


def loaded_libraries():
    names = set()

    def visit(library, _size, _data):
        names.add(os.path.basename(library.contents.name.decode()))
        return 0

    callback = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(LoadedLibrary), ctypes.c_size_t,
                                ctypes.c_void_p)
    ctypes.CDLL(None).dl_iterate_phdr(callback(visit), None)
    return names


class Libraries(PluginCase):
    def test_one_vtk(self):
        simple.SurfelEstimation(self.points).UpdatePipeline()
        loaded = loaded_libraries()
        self.assertIn("libvtkSurfelFilters.so", {name.split(".so")[0] + ".so" for name in loaded})
        self.assertFalse([name for name in loaded if name.startswith("libpcl_")])
        cores = {name for name in loaded if name.startswith("libvtkCommonCore")}
        self.assertEqual(len(cores), 1, cores)
