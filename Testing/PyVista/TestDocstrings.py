# SPDX-License-Identifier: BSD-3-Clause
"""The examples of the PyVista layer's docstrings run, and every public thing has one."""

import doctest
import importlib
import inspect
import unittest

from plottercase import PlotterCase
from surfelsplatting.pyvista.accessor import SurfelAccessor
from surfelsplatting.pyvista.component import SurfelComponent
from surfelsplatting.pyvista.readers import read_pcd


class TestDocstrings(PlotterCase):
    def test_examples(self):
        for name in ("accessor", "component", "readers"):
            module = importlib.import_module(f"surfelsplatting.pyvista.{name}")
            with self.subTest(name):
                result = doctest.testmod(module)
                self.assertEqual(result.failed, 0)
                self.assertGreater(result.attempted, 5)

    def test_every_method_has_an_example(self):
        methods = [method for kind in (SurfelAccessor, SurfelComponent)
                   for name, method in inspect.getmembers(kind) if not name.startswith("_")]
        self.assertGreaterEqual(len(methods), 7)
        for thing in (SurfelAccessor, SurfelComponent, read_pcd, *methods):
            self.assertIn("Examples\n", inspect.getdoc(thing), thing)

    def test_every_parameter_is_described(self):
        for function in (SurfelAccessor.estimate, SurfelAccessor.plot, SurfelComponent.add,
                         SurfelComponent.lens):
            described = inspect.getdoc(function)
            for name in inspect.signature(function).parameters:
                if name not in ("self", "kwargs"):
                    self.assertIn(f"\n{name} : ", described, function)


if __name__ == "__main__":
    unittest.main()
