#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks what the sources include and what lies at the top level, and prints each problem:

- cycles between files (those of one stem, as View.h and View.cxx, are one) and between folders,
  of the C++ sources and of the Python package, whose functions may import, too;
- includes against the order of the folders in includes.txt;
- a core that needs more than itself and the C++ standard library (CORE_NEEDS: three exceptions);
- public headers (vtk*.h) that need more than VTK, the standard library and one another;
- files that git tracks at the top level and that are not in TOP_FILES.

    python3 Utilities/includes.py          exit status 1: there are problems
    python3 Utilities/includes.py --draw   prints which folder includes which, the highest first
"""

import argparse
import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath
from typing import NamedTuple

TOPS = ("Core", "Parallel", "SurfelData", "Filters", "Rendering", "Plugins")
TOP_FILES = {".clang-format", ".gitignore", "CHANGELOG.md", "CITATION.cff", "CMakeLists.txt",
             "CMakePresets.json", "LICENSE", "README.md", "pyproject.toml"}
PACKAGES = "Wrapping/Python"
INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')
# The standard library's headers have neither a dot nor a folder.
STANDARD = re.compile(r"[a-z_]+")
# What else a folder of the core needs: the processor, the operating system.
CORE_NEEDS = {"Core/Simd": {"immintrin.h"},
              "Core/Files": {"fcntl.h", "sys/mman.h", "sys/stat.h", "unistd.h"},
              "Core/Base": {"sys/mman.h"}}


class Include(NamedTuple):
    source: str
    line: int
    name: str
    quoted: bool
    target: str  # the project's file, or empty

    def __str__(self):
        verb = "imports" if self.source.endswith(".py") else "includes"
        return f"{self.source}:{self.line} {verb} {self.target or self.name}"


def folder_of(path):
    return str(PurePosixPath(path).parent)


def unit_of(path):
    return str(PurePosixPath(path).with_suffix(""))


def is_public(path):
    name = PurePosixPath(path).name
    return name.startswith("vtk") and name.endswith(".h")


def find_sources(root):
    paths = (path.relative_to(root).as_posix() for top in TOPS for path in (root / top).rglob("*"))
    return sorted(path for path in paths if path.endswith((".h", ".cxx")))


def read_includes(root, sources):
    public = {PurePosixPath(path).name: path for path in sources if is_public(path)}
    known = set(sources)
    includes = []
    for source in sources:
        lines = (root / source).read_text(encoding="utf-8").splitlines()
        for number, line in enumerate(lines, 1):
            match = INCLUDE.match(line)
            if match:
                name = match[2]
                candidates = (name, f"{folder_of(source)}/{name}", public.get(name))
                target = next((path for path in candidates if path in known), "")
                includes.append(Include(source, number, name, match[1] == '"', target))
    return includes


def modules_of(node, folder):
    """[parts of the path that an import statement names, from PACKAGES on]; as many as names,
    because each may be a file in a folder."""
    if isinstance(node, ast.Import):
        return [name.name.split(".") for name in node.names]
    above = folder[:len(folder) - node.level + 1] if node.level else []
    module = [*above, *(node.module or "").split(".")]
    return [[part for part in (*module, name.name) if part] for name in node.names]


def read_imports(root):
    """The imports of the Python package's own files, anywhere in a file."""
    packages = root / PACKAGES
    known = {path.relative_to(packages).as_posix() for path in packages.rglob("*.py")}
    imports = []
    for source in sorted(known):
        tree = ast.parse((packages / source).read_text(encoding="utf-8"))
        statements = (node for node in ast.walk(tree)
                      if isinstance(node, (ast.Import, ast.ImportFrom)))
        for node in statements:
            for parts in modules_of(node, PurePosixPath(source).parent.parts):
                paths = ("/".join(names) for names in (parts, parts[:-1]))
                target = next((name for path in paths
                               for name in (f"{path}.py", f"{path}/__init__.py") if name in known),
                              None)
                if target:
                    imports.append(Include(f"{PACKAGES}/{source}", node.lineno, ".".join(parts),
                                           False, f"{PACKAGES}/{target}"))
    return imports


def package_folder_of(path):
    """A folder of the package, or a file beside those folders."""
    parts = PurePosixPath(path).relative_to(PACKAGES).parts
    return "/".join(parts[:2])


def read_order(path):
    """{folder: all folders that it may include}"""
    order = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            folder, _, lower = line.partition(":")
            for name in lower.split():
                if name not in order:
                    sys.exit(f"includes.txt: {folder} has to stand below {name}")
            order[folder] = set().union(*({name} | order[name] for name in lower.split()))
    return order


def make_graph(includes, node_of):
    """{node: {node that it includes: the first such include}}"""
    graph = {}
    for include in includes:
        if include.target:
            begin, end = node_of(include.source), node_of(include.target)
            graph.setdefault(end, {})
            if begin != end:
                graph.setdefault(begin, {}).setdefault(end, include)
    return graph


def shortest_cycle(graph, start):
    """The nodes of the shortest way from a node back to it; empty: there is none."""
    ways = [[start]]
    seen = set()
    for way in ways:
        for node in graph[way[-1]]:
            if node == start:
                return way
            if node not in seen:
                seen.add(node)
                ways.append([*way, node])
    return []


def find_cycles(graph, what):
    """The shortest cycle through each node, every cycle once."""
    cycles = {}
    for node in sorted(graph):
        cycle = shortest_cycle(graph, node)
        if cycle:
            cycles.setdefault(frozenset(cycle), cycle)
    problems = []
    for cycle in cycles.values():
        includes = (graph[a][b] for a, b in zip(cycle, [*cycle[1:], cycle[0]]))
        problems.append("\n  ".join([f"a cycle between {what}:", *map(str, includes)]))
    return problems


def check_order(sources, includes, order):
    folders = {folder_of(source) for source in sources}
    problems = [f"includes.txt has no line for {folder}" for folder in sorted(folders - order.keys())]
    problems += [f"includes.txt: {folder} has no sources" for folder in sorted(order.keys() - folders)]
    for include in includes:
        begin, end = folder_of(include.source), folder_of(include.target)
        if include.target and begin != end and end not in order.get(begin, {end}):
            above = begin in order.get(end, ())
            problems.append(f"{include}: {end} is {'above' if above else 'not below'} {begin}")
    return problems


def is_allowed_in_core(include):
    if include.quoted:
        return include.target == include.name and include.name.startswith("Core/")
    return STANDARD.fullmatch(include.name) or include.name in CORE_NEEDS.get(
        folder_of(include.source), ())


def is_allowed_in_public_header(include):
    if include.target:
        return is_public(include.target)
    return include.name.startswith("vtk") or STANDARD.fullmatch(include.name)


def check_surroundings(includes):
    problems = []
    for include in includes:
        if include.source.startswith("Core/"):
            if not is_allowed_in_core(include):
                problems.append(f"{include}: neither \"Core/...\" nor the C++ standard library")
        elif include.name.startswith(tuple(f"{top}/" for top in TOPS)) and not include.target:
            problems.append(f"{include}: there is no such file")
        if is_public(include.source) and not is_allowed_in_public_header(include):
            problems.append(f"{include}: a public header needs what is not installed with it")
    return problems


def check_top_level(root):
    """Tools leave files there that `git add --all` takes along. Without git nothing is known."""
    if not shutil.which("git"):
        return []
    tracked = subprocess.run(["git", "-C", root, "ls-files", "--full-name", ":/"],
                             capture_output=True, text=True, check=False).stdout.splitlines()
    return [f"{name} does not belong to the top level (TOP_FILES)" for name in tracked
            if "/" not in name and name not in TOP_FILES]


def check(sources, includes, order):
    return [*find_cycles(make_graph(includes, unit_of), "files"),
            *find_cycles(make_graph(includes, folder_of), "folders"),
            *check_order(sources, includes, order),
            *check_surroundings(includes)]


def draw(includes, order):
    """Arrows that follow from others are left out."""
    graph = make_graph(includes, folder_of)
    for folder in reversed(order):
        lower = graph.get(folder, {})
        implied = set().union(*(order[name] for name in lower))
        direct = [name for name in reversed(order) if name in lower and name not in implied]
        print(f"{folder:<30}{'-> ' if direct else ''}{', '.join(direct)}".rstrip())


def main():
    here = Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=here.parent, help="folder of the project")
    parser.add_argument("--draw", action="store_true")
    arguments = parser.parse_args()

    sources = find_sources(arguments.root)
    if len(sources) < 10:
        sys.exit(f"includes.py: only {len(sources)} sources in {arguments.root}: wrong folder?")
    includes = read_includes(arguments.root, sources)
    order = read_order(here / "includes.txt")
    if arguments.draw:
        draw(includes, order)
        return
    imports = read_imports(arguments.root)
    problems = [*check(sources, includes, order),
                *find_cycles(make_graph(imports, unit_of), "files"),
                *find_cycles(make_graph(imports, package_folder_of), "folders"),
                *check_top_level(arguments.root)]
    print("\n".join(problems) or f"{len(sources)} C++ sources, {len(includes)} includes, "
          f"{len(imports)} imports of Python: no problems")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
