#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How long scans take: processor seconds of vtkPointsToSurfels for a million points, its hierarchy
included, by turns with another build.

    scans.py OUT [CLOUD ...] [--against FOLDER] [--rounds N]

writes OUT.md. FOLDER: lib/python3/dist-packages of the other build. Without a CLOUD: a bumpy ball.
Two threads, each cloud in a process of its own, medians.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time

PARTS = ("all", "cleaning", "estimation")


class Quiet:
    """What the readers of the package report to."""

    @staticmethod
    def update(algorithm, _label):
        algorithm.Update()

    @staticmethod
    def check():
        pass


def points_of_file(path):
    if not path:
        from clouds import bumpy_ball

        return bumpy_ball()
    from surfelsplatting.formats.reading import read_cloud

    return read_cloud(path, Quiet, Quiet).data


def time_between(algorithm, seconds, name):
    """Adds a filter's processor time to seconds[name]."""
    def begin(*_):
        seconds[name] -= time.process_time()

    def end(*_):
        seconds[name] += time.process_time()

    algorithm.AddObserver("StartEvent", begin)
    algorithm.AddObserver("EndEvent", end)


def measure(path):
    """-> number of points, processor seconds of all and of parts"""
    from vtkmodules.vtkCommonCore import vtkObject
    from surfelsplatting.vtkSurfelFilters import vtkPointsToSurfels

    data, seconds = points_of_file(path), dict.fromkeys(PARTS, 0.0)
    vtkObject.GlobalWarningDisplayOff()
    surfels = vtkPointsToSurfels()
    time_between(surfels, seconds, "all")
    time_between(surfels.GetCleaning(), seconds, "cleaning")
    time_between(surfels.GetEstimation(), seconds, "estimation")
    surfels.SetInputData(data)
    surfels.Update()
    return data.GetNumberOfPoints(), seconds


def run(path, packages):
    """The same in a process of its own, with this package or another one."""
    environment = dict(os.environ, VTK_SMP_MAX_THREADS="2")
    if packages:
        environment["PYTHONPATH"] = packages
    command = [sys.executable, "-s", os.path.abspath(__file__), "", "--one", path]
    output = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE).stdout
    return json.loads(output.splitlines()[-1])


def row_of(path, builds, rounds):
    """A row of the table: of the other build, if there is one, all; of this one all, and parts."""
    found = {build: [] for build in builds}
    for _ in range(rounds):
        for build, packages in builds.items():
            found[build].append(run(path, packages))
    count = found["this"][0][0]
    values = {build: {part: statistics.median(seconds[part] for _, seconds in rows) * 1e6 / count
                      for part in PARTS} for build, rows in found.items()}
    cells = [values["other"]["all"]] if "other" in values else []
    cells += values["this"].values()
    return f"| {os.path.basename(path) or 'ball'} | {count:,} | " + " | ".join(
        f"{seconds:.1f}" for seconds in cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("out")
    parser.add_argument("clouds", nargs="*", metavar="CLOUD", default=[""])
    parser.add_argument("--against", metavar="FOLDER", help="dist-packages of another build")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--one", metavar="CLOUD", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one is not None:
        print(json.dumps(measure(arguments.one)))
        return
    builds = {"other": arguments.against} if arguments.against else {}
    builds["this"] = None
    before = ["before"] if arguments.against else []
    head = ["scan", "points", *before, "now", "cleaning", "estimation"]
    with open(arguments.out + ".md", "w", encoding="utf-8") as file:
        for line in ("| " + " | ".join(head) + " |", "|---" * len(head) + "|"):
            print(line, file=file)
        for path in arguments.clouds:
            line = row_of(path, builds, arguments.rounds)
            print(line, file=file, flush=True)
            print(line, flush=True)


if __name__ == "__main__":
    main()
