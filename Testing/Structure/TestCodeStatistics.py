# SPDX-License-Identifier: BSD-3-Clause
"""Utilities/codestatistics.py counts lines and parameters, and finds what is past the limits."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(os.environ["SOURCE"]) / "Utilities" / "codestatistics.py"


def function(name, parameters, lines):
    return [f"void {name}({', '.join(parameters)})", "{", *["  ;"] * (lines - 3), "}"]


class CodeStatistics(unittest.TestCase):
    def measure(self, lines, *options, **others):
        """Runs the statistics on a project whose files have these lines: Only.cxx, and others."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "Core").mkdir()
            for name, content in {"Only": lines, **others}.items():
                (Path(folder) / "Core" / f"{name}.cxx").write_text("\n".join([*content, ""]))
            result = subprocess.run([sys.executable, SCRIPT, "--root", folder, *options],
                                    capture_output=True, text=True, check=False)
        if result.returncode == 77:
            self.skipTest(result.stderr)
        self.assertEqual(result.stderr, "")
        return result.returncode, result.stdout

    def test_table(self):
        _, table = self.measure([
            *function("Ten", ["int a", "std::map<int, int> b = {{1, 2}, {3, 4}}"], 10),
            "struct S {", "  S(int x)", "    : X{ x }", "    , Y(x)", "  {", "    X = 1;", "  }",
            "  int X, Y;", "};"])
        row = [cell.strip() for cell in table.splitlines()[-1].split("|")]
        self.assertEqual(row[1:-1], ["all", "1 / 0.0k", "19 / 19 / 19", "2", "10 / 10 / 10",
                                     "0.0 %", "0"])

    def test_at_the_limits(self):
        six = [f"const std::array<int, 3>& a{i}" for i in range(6)]
        status, output = self.measure([*function("AtMost", six, 60), *["//"] * 540], "--limits")
        self.assertEqual(status, 0, output)

    def test_past_the_limits(self):
        seven = [f"int a{i}" for i in range(7)]
        status, output = self.measure([
            "struct S { virtual void Wide(" + ", ".join(seven) + ") = 0; };",
            *function("S::Long", [], 61), *["//"] * 540], "--limits")
        self.assertEqual(status, 1)
        self.assertEqual(sorted(output.splitlines()), [
            "Core/Only.cxx: 602 lines, at most 600",
            "Core/Only.cxx:1: Wide has 7 parameters, at most 6",
            "Core/Only.cxx:2: Long has 61 lines, at most 60"])


    def test_names_of_files_that_are_compiled_as_one(self):
        here = ["namespace", "{", "constexpr int Least = 1;", "int Twice(int x)", "{", "  return x;", "}", "}"]
        other = ["namespace", "{", "float Twice(float x)", "{", "  return x;", "}", "}",
                 "struct Least {};"]
        status, output = self.measure(here, "--limits", Other=other)
        self.assertEqual(status, 0, output)
        status, output = self.measure(here, "--limits", Other=here[:3] + ["}"])
        self.assertEqual(status, 1)
        self.assertEqual(output, "Least is in the anonymous namespaces of Core/Only.cxx and Core/Other.cxx\n")


if __name__ == "__main__":
    program = unittest.main(exit=False)
    ran = program.result
    sys.exit(77 if ran.wasSuccessful() and ran.skipped else not ran.wasSuccessful())
