#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sizes of files and functions, in lines, by folder, and names that two files of a library have.

    python3 Utilities/codestatistics.py            prints a table
    python3 Utilities/codestatistics.py --limits   lists what is too long, and names that two files
                                                   have; then exit status 1

The wheel compiles several files of a library as one: what is in their anonymous namespaces must not
have the same names. A function's lines go from its name to its closing brace. A lambda counts as a
function, and its lines also belong to the function around it. Needs universal-ctags; exit status
77: it is missing.
"""

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath
from typing import NamedTuple

FOLDERS = ("Core/", "Filters/", "Rendering/", "Parallel/", "SurfelData/", "Plugins/")
MAX_LINES_OF_A_FILE = 600
MAX_LINES_OF_A_FUNCTION = 60
MAX_PARAMETERS = 6


class Function(NamedTuple):
    path: str
    line: int
    name: str
    lines: int  # 0: declared here and not defined
    parameters: int


def count_parameters(signature):
    """How many a signature has, as "(const std::map<int, int>& a, int b = f(1, 2)) const"."""
    depth = commas = 0
    for i, letter in enumerate(signature):
        if letter in "([{<":
            depth += 1
        elif letter in ")]}" or (letter == ">" and signature[i - 1] != "-"):
            depth -= 1
            if depth == 0:
                inside = signature[1:i].strip()
                return commas + 1 if inside not in ("", "void") else 0
        elif letter == "," and depth == 1:
            commas += 1
    return 0


def find_files(root, folder):
    paths = (path for path in (root / folder).rglob("*") if path.suffix in (".h", ".cxx"))
    return {path.relative_to(root).as_posix(): len(path.read_bytes().splitlines())
            for path in sorted(paths)}


def has_universal_ctags():
    """Other programs of that name know neither ends nor JSON."""
    return shutil.which("ctags") and "Universal Ctags" in subprocess.run(
        ["ctags", "--version"], capture_output=True, text=True, check=False).stdout


def find_tags(root, files, kinds):
    result = subprocess.run(
        ["ctags", "--quiet", "--options=NONE", "--language-force=C++", f"--kinds-C++={kinds}",
         "--fields=+neS", "--output-format=json", "-L", "-", "-f", "-"],
        input="\n".join(files), cwd=root, check=True, stdout=subprocess.PIPE, text=True)
    return [json.loads(line) for line in result.stdout.splitlines()]


def library_of(root, path):
    """The nearest folder around a file that has a CMakeLists.txt"""
    return next((folder for folder in PurePosixPath(path).parents
                 if (root / folder / "CMakeLists.txt").exists()), PurePosixPath(path).parents[-2])


def find_same_names(root, files):
    """-> problems: names in the anonymous namespaces of two files of a library"""
    found = {}
    for tag in find_tags(root, [path for path in files if path.endswith(".cxx")], "cfgsv"):
        if tag.get("scopeKind") == "namespace" and "__anon" in tag["scope"]:
            key = library_of(root, tag["path"]), tag["name"], tag.get("signature", "")
            found.setdefault(key, {})[tag["path"]] = tag["line"]
    return [f"{name} is in the anonymous namespaces of {' and '.join(places)}"
            for (_, name, _), places in found.items() if len(places) > 1]


def find_functions(root, files):
    functions = []
    for tag in find_tags(root, files, "fp"):
        begin = tag["line"]
        lines = tag["end"] - begin + 1 if tag["kind"] == "function" else 0
        name = "a lambda" if tag["name"].startswith("__anon") else tag["name"]
        functions.append(Function(tag["path"], begin, name, lines,
                                  count_parameters(tag.get("signature", "()"))))
    return functions


def at_share(values, share):
    values = sorted(values)
    return values[min(int(len(values) * share), len(values) - 1)] if values else 0


def spread(values, share):
    return f"{at_share(values, 0.5)} / {at_share(values, share)} / {max(values, default=0)}"


def print_table(files, functions):
    print("| folder | files / lines | file median / p90 / max | functions | median / p99 / max "
          "| > 50 lines | > 6 parameters |")
    print("|---|---|---|---|---|---|---|")
    for folder in (*FOLDERS, ""):
        lengths = [lines for path, lines in files.items() if path.startswith(folder)]
        defined = [f for f in functions if f.path.startswith(folder) and f.lines]
        lines = [f.lines for f in defined]
        long = sum(count > 50 for count in lines) / max(len(lines), 1)
        wide = sum(f.parameters > MAX_PARAMETERS for f in defined)
        print(f"| {folder[:-1] or 'all'} | {len(lengths)} / {sum(lengths) / 1000:.1f}k "
              f"| {spread(lengths, 0.9)} | {len(lines)} | {spread(lines, 0.99)} "
              f"| {100 * long:.1f} % | {wide} |")


def past_limits(files, functions):
    problems = [f"{path}: {lines} lines, at most {MAX_LINES_OF_A_FILE}"
                for path, lines in files.items() if lines > MAX_LINES_OF_A_FILE]
    for f in functions:
        where = f"{f.path}:{f.line}: {f.name}"
        if f.lines > MAX_LINES_OF_A_FUNCTION:
            problems.append(f"{where} has {f.lines} lines, at most {MAX_LINES_OF_A_FUNCTION}")
        if f.parameters > MAX_PARAMETERS:
            problems.append(f"{where} has {f.parameters} parameters, at most {MAX_PARAMETERS}")
    return problems


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parent.parent,
                        help="folder of the project")
    parser.add_argument("--limits", action="store_true")
    arguments = parser.parse_args()
    if not has_universal_ctags():
        print("SKIPPED, sizes are not measured: universal-ctags is not installed", file=sys.stderr)
        sys.exit(77)

    files = {}
    for folder in FOLDERS:
        files.update(find_files(arguments.root, folder))
    functions = find_functions(arguments.root, files)
    if not arguments.limits:
        print_table(files, functions)
        return
    problems = past_limits(files, functions) + find_same_names(arguments.root, files)
    print("\n".join(problems) or f"{len(files)} files, {len(functions)} functions: none too long, no name twice")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
