# SPDX-License-Identifier: BSD-3-Clause
"""Faults put into a copy of the sources are found and named: by Utilities/includes.py, and by
Testing/Core/Alone for headers that do not compile on their own."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["SOURCE"])


class Includes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.root = cls.folder / "copy"
        for top in ("Core", "Parallel", "SurfelData", "Filters", "Rendering", "Plugins",
                    "Wrapping"):
            shutil.copytree(SOURCE / top, cls.root / top)
        cls.before = cls.problems()

    @classmethod
    def problems(cls):
        """What includes.py finds in the copy; the lines of a cycle are one problem."""
        result = subprocess.run(
            [sys.executable, SOURCE / "Utilities" / "includes.py", "--root", cls.root],
            capture_output=True, text=True, check=False)
        assert result.stderr == "", result.stderr
        problems = re.split(r"\n(?!  )", result.stdout.rstrip())
        assert result.returncode == (0 if problems[-1].endswith("no problems") else 1)
        return problems

    def put(self, path, *lines):
        """A new file in the copy, for this test."""
        file = self.root / path
        self.assertFalse(file.exists())
        first = ["#pragma once"] if path.endswith((".h", ".cxx")) else []
        file.write_text("\n".join([*first, *lines, ""]), encoding="utf-8")
        self.addCleanup(file.unlink)

    def new_problems(self):
        return [line for line in self.problems() if line not in self.before]

    def test_cycle_between_two_files(self):
        self.put("Core/Base/First.h", "", '#include "Core/Base/Second.h"')
        self.put("Core/Base/Second.h", '#include "Core/Base/First.h"')
        self.assertEqual(self.new_problems()[0],
                         "a cycle between files:\n"
                         "  Core/Base/First.h:3 includes Core/Base/Second.h\n"
                         "  Core/Base/Second.h:2 includes Core/Base/First.h")

    def test_cycle_through_a_source_file(self):
        self.put("Core/Base/First.h")
        self.put("Core/Base/Second.h", '#include "Core/Base/First.h"')
        self.put("Core/Base/First.cxx", '#include "Core/Base/Second.h"')
        self.assertEqual(self.new_problems()[0],
                         "a cycle between files:\n"
                         "  Core/Base/First.cxx:2 includes Core/Base/Second.h\n"
                         "  Core/Base/Second.h:2 includes Core/Base/First.h")

    def test_cycle_of_python_files(self):
        package = "Wrapping/Python/surfelsplatting"
        self.put(f"{package}/clouds/first.py", "def late():", "    from .second import name")
        self.put(f"{package}/clouds/second.py", "from . import first")
        self.assertEqual(self.new_problems()[0],
                         "a cycle between files:\n"
                         f"  {package}/clouds/first.py:2 imports {package}/clouds/second.py\n"
                         f"  {package}/clouds/second.py:1 imports {package}/clouds/first.py")

    def test_cycle_of_python_folders(self):
        package = "Wrapping/Python/surfelsplatting"
        self.put(f"{package}/clouds/upward.py", "import surfelsplatting.shapes.up")
        cycle = next(text for text in self.new_problems()
                     if text.startswith("a cycle between folders"))
        self.assertIn(f"{package}/clouds/upward.py:1 imports {package}/shapes/up.py", cycle)

    def test_cycle_between_folders_alone(self):
        self.put("Core/Simd/Lower.h")
        self.put("Core/Picture/Higher.h", '#include "Core/Simd/Lower.h"')
        self.put("Core/Simd/Other.h", '#include "Core/Picture/Higher.h"')
        problems = self.new_problems()
        self.assertFalse([text for text in problems if text.startswith("a cycle between files")])
        self.assertIn("a cycle between folders:\n"
                      "  Core/Picture/Higher.h:2 includes Core/Simd/Lower.h\n"
                      "  Core/Simd/Other.h:2 includes Core/Picture/Higher.h", problems)
        self.assertIn("Core/Simd/Other.h:2 includes Core/Picture/Higher.h: "
                      "Core/Picture is above Core/Simd", problems)

    def test_upward_include(self):
        self.put("Filters/Partition/Higher.h")
        self.put("Filters/Common/Lower.h", '#include "Filters/Partition/Higher.h"')
        self.assertIn("Filters/Common/Lower.h:2 includes Filters/Partition/Higher.h: "
                      "Filters/Partition is above Filters/Common", self.new_problems())

    def test_filters_and_rendering_stay_apart(self):
        self.put("Filters/vtkOther.h")
        self.put("Rendering/Scene/Filtered.h", '#include "vtkOther.h"')
        self.assertEqual(self.new_problems(), [
            "Rendering/Scene/Filtered.h:2 includes Filters/vtkOther.h: "
            "Filters is not below Rendering/Scene"])

    def test_folder_without_a_place(self):
        (self.root / "Core" / "Attic").mkdir()
        self.addCleanup((self.root / "Core" / "Attic").rmdir)
        self.put("Core/Attic/Old.h")
        self.assertEqual(self.new_problems(), ["includes.txt has no line for Core/Attic"])

    def test_core_with_other_libraries(self):
        includes = ("<vtkPolyData.h>", '"vtkPolyData.h"', "<GL/gl.h>", "<pcl/point_types.h>",
                    "<immintrin.h>", '"Pool.h"', '"Core/Base/Missing.h"')
        self.put("Core/Base/Impure.h", *(f"#include {include}" for include in includes))
        problems = self.new_problems()
        self.assertEqual(len(problems), len(includes), problems)
        for line, problem in enumerate(problems, 2):
            self.assertTrue(problem.startswith(f"Core/Base/Impure.h:{line} includes "), problem)

    def test_public_header_with_private_ones(self):
        includes = ("<pcl/point_types.h>", "<flann/flann.hpp>", "<OpenEXR/ImfHeader.h>",
                    "<Eigen/Core>", '"Core/Base/Pool.h"', "<vector>", '"vtkPolyData.h"')
        self.put("Filters/vtkPublic.h", *(f"#include {include}" for include in includes))
        problems = self.new_problems()
        self.assertEqual(len(problems), len(includes) - 2, problems)
        for line, problem in enumerate(problems, 2):
            self.assertTrue(problem.startswith(f"Filters/vtkPublic.h:{line} includes "), problem)

    def test_stray_file_at_the_top_level(self):
        for name in ("README.md", "wheel-1.0-py3-none-any.whl", "Core/Base/Stray.whl"):
            (self.root / name).touch()
        git = ["git", "-C", self.root]
        subprocess.run([*git, "init", "--quiet"], check=True)
        self.addCleanup(shutil.rmtree, self.root / ".git")
        subprocess.run([*git, "add", "--all", "."], check=True)
        self.assertEqual(self.new_problems(), [
            "wheel-1.0-py3-none-any.whl does not belong to the top level (TOP_FILES)"])

    def test_headers_of_the_core_that_do_not_compile_alone(self):
        """Those that their own source includes first are compiled with it, all others in a file of their own."""
        self.put("Core/Base/Whole.h", "#include <vector>", "using Whole = std::vector<int>;")
        self.put("Core/Base/Half.h", "using Half = std::vector<int>;")
        core = self.root / "Core"
        later = core / "Base" / "Executor.cxx"
        text = later.read_text(encoding="utf-8")
        self.addCleanup(later.write_text, text, encoding="utf-8")
        later.write_text("#include <vector>\n" + text, encoding="utf-8")
        build = self.folder / "alone"
        project = SOURCE / "Testing" / "Core" / "Alone"
        subprocess.run(
            [os.environ["CMAKE"], "-S", project, "-B", build, "-G", os.environ["GENERATOR"],
             f"-DCORE_DIR={core}",
             f"-DCMAKE_CXX_COMPILER={os.environ['CXX']}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"],
            check=True, stdout=subprocess.DEVNULL)
        entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
        commands = {Path(entry["file"]).name: entry for entry in entries}
        exceptions = (project / "CMakeLists.txt").read_text(encoding="utf-8")
        for header in core.rglob("*.h"):
            path, source = header.relative_to(core), header.with_suffix(".cxx")
            name = "_".join(path.parts).replace(".", "_")
            if source.name in commands and source.is_file():
                found = re.findall("^#include.*", source.read_text(encoding="utf-8"), re.M)
                if found[0] == f'#include "Core/{path}"':
                    continue
            self.assertTrue(f"{name}.cxx" in commands or f'"{name}"' in exceptions, header)
        self.assertIn("Base_Executor_h.cxx", commands)

        def compile_alone(name):
            command = commands[name]
            return subprocess.run(command["command"], shell=True, cwd=command["directory"],
                                  capture_output=True, text=True, check=False)

        self.assertEqual(compile_alone("Base_Whole_h.cxx").returncode, 0)
        failure = compile_alone("Base_Half_h.cxx")
        self.assertNotEqual(failure.returncode, 0)
        self.assertIn("Core/Base/Half.h:2", failure.stderr)


if __name__ == "__main__":
    unittest.main()
