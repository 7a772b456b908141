#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How fast: filters and frames with one thread and with two, stage by stage, and a window's frame
against vtkPointGaussianMapper's with the same points at the same footprint.

    speed.py OUT [--points N] [--size PX] [--scan CLOUD] [--frames N] [--search PROGRAM]

writes OUT.json and OUT.md. PROGRAM, NeighborSpeed, is the search that the filters are held against. Threads are set when VTK starts: every row is a process of its own, the
rows by turns, medians. Needs a display (xvfb-run -a).
"""

import argparse
import json
import math
import os
import subprocess
import sys
import time

import numpy as np

ROUNDS = 3
FILTERS = ("estimation", "normalization", "hierarchy")


def cloud(arguments):
    from clouds import points_of, read, resample, surfels_of
    from surfelsplatting.vtkarrays import named_array
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    if arguments.scan:
        return resample(surfels_of(read(arguments.scan)), arguments.points)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(arguments.points, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    bumps = 1 + 0.08 * np.prod(np.sin(9 * directions), axis=1)
    data = vtkPolyData()
    data.SetPoints(points_of(directions * bumps[:, None]))
    data.GetPointData().SetScalars(
        named_array("RGB", 128 + 100 * np.sin(40 * directions), np.uint8))
    return data


def updated(algorithm, data, repeats):
    """-> output, median seconds"""
    algorithm.SetInputData(data)
    times = []
    for _ in range(repeats):
        algorithm.Modified()
        began = time.perf_counter()
        algorithm.Update()
        times.append(time.perf_counter() - began)
    return algorithm.GetOutput(), float(np.median(times))


def measure_filters(arguments):
    from surfelsplatting.vtkSurfelFilters import (vtkSurfelEstimation, vtkSurfelHierarchy,
                                                  vtkSurfelNormalization)
    data, row = cloud(arguments), {}
    for name, kind in zip(FILTERS, (vtkSurfelEstimation, vtkSurfelNormalization,
                                    vtkSurfelHierarchy)):
        data, row[name] = updated(kind(), data, arguments.frames // 3 + 1)
    return row


def camera_for(surfels):
    from vtkmodules.vtkRenderingCore import vtkCamera

    bounds = np.array(surfels.GetBounds()).reshape(3, 2)
    center, reach = bounds.mean(axis=1), 0.5 * (bounds[:, 1] - bounds[:, 0]).max()
    camera = vtkCamera()
    camera.SetFocalPoint(center)
    camera.SetPosition(center + np.array([0.3, 0.4, 3.0]) * reach)
    camera.SetViewAngle(45)
    camera.SetFocalDistance(2.4 * reach)
    return camera


def measure_frames(arguments):
    from clouds import surfels_of
    from scenes import DEFAULT, Drawing, Way

    surfels = surfels_of(cloud(arguments))
    drawing = Drawing("cloud", surfels, camera_for(surfels), lit=False)
    ways = {"in focus": (DEFAULT, 0), "in focus, no detail": (Way(lod="Off"), 0),
            "blurred": (DEFAULT, arguments.size / 16),
            "blurred, 7 cells": (Way(cells=7), arguments.size / 16)}
    rows = {name: [] for name in ways}
    for _ in range(arguments.frames + 1):
        for name, (way, confusion) in ways.items():
            drawing.frame(way, arguments.size, confusion)
            renderer = drawing._plain if way.lod == "Off" else drawing._detailed
            splatter = renderer.GetSplatter()
            stages = {splatter.GetStageName(s): splatter.GetStageMilliseconds(s)
                      for s in range(splatter.GetNumberOfStages())}
            rows[name].append({"frame": splatter.GetFrameMilliseconds(), **stages})
    return {name: {key: float(np.median([frame[key] for frame in frames[1:]]))
                   for key in frames[0]} for name, frames in rows.items()}


def gaussians(window, surfels, camera):
    """vtkPointGaussianMapper with our kernels' mean footprint, pixel filter included, ended where
    ours are (2c / tau = 2.54 deviations)."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPointGaussianMapper

    trace = vtk_to_numpy(surfels.GetPointData().GetArray("SurfelCovariance"))[:, :3].sum(axis=1)
    pixel = 2 * camera.GetDistance() * math.tan(math.radians(camera.GetViewAngle()) / 2) / window.size
    mapper = vtkPointGaussianMapper()
    mapper.SetInputData(surfels)
    mapper.SetScaleFactor(math.sqrt(np.median(trace) / 2 + pixel ** 2))
    mapper.SetTriangleScale(2.54)
    mapper.EmissiveOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetLighting(False)
    window.renderer.AddActor(actor)


def measure_windows(arguments):
    from clouds import surfels_of
    from peers import Window
    from renderers import hierarchy_of
    from surfelsplatting.vtkSurfelRendering import vtkSurfelSplattingPass

    surfels = surfels_of(cloud(arguments))
    camera = camera_for(surfels)
    ours, theirs = Window(arguments.size), Window(arguments.size)
    ours.add_surfels(hierarchy_of(surfels))
    splatting = vtkSurfelSplattingPass()
    splatting.GetSplatter().FrameReuseOff()
    ours.renderer.SetPass(splatting)
    gaussians(theirs, surfels, camera)
    times = {"vtkSurfelSplattingPass": [], "vtkPointGaussianMapper": []}
    for window in (ours, theirs):
        window.see(camera, 0)
    for _ in range(arguments.frames + 1):
        for name, window in zip(times, (ours, theirs)):
            times[name].append(window.frame()[1])
    return {name: float(np.median(t[1:])) for name, t in times.items()}


PARTS = {"filters": measure_filters, "frames": measure_frames, "windows": measure_windows}


def run_part(script, part, arguments, options=(), **variables):
    """A part in a process of its own. -> its times"""
    command = [sys.executable, os.path.abspath(script), arguments.out, "--part", part,
               "--points", str(arguments.points), "--size", str(arguments.size),
               "--frames", str(arguments.frames), *options]
    if arguments.scan:
        command += ["--scan", arguments.scan]
    output = subprocess.run(command, env={**os.environ, **variables}, check=True,
                            stdout=subprocess.PIPE).stdout
    return json.loads(output.splitlines()[-1])


def run(part, threads, arguments):
    return run_part(__file__, part, arguments, VTK_SMP_MAX_THREADS=threads, LP_NUM_THREADS=threads)


def search_alone(arguments):
    environment = dict(os.environ, VTK_SMP_MAX_THREADS="2")
    command = [arguments.search, str(arguments.points), "3"]
    return json.loads(subprocess.run(command, env=environment, check=True,
                                     stdout=subprocess.PIPE).stdout)


def median(rows):
    """Medians of the values of nested dictionaries with the same keys."""
    if isinstance(rows[0], dict):
        return {key: median([row[key] for row in rows]) for key in rows[0]}
    return float(np.median(rows))


def table(result, points):
    one, two = result["1"], result["2"]
    lines = ["| filter | 1 thread, s | 2 threads, s | ratio |", "|---|---|---|---|"]
    for name in FILTERS:
        a, b = one["filters"][name], two["filters"][name]
        lines.append(f"| {name} | {a:.2f} | {b:.2f} | {a / b:.2f} |")
    total = sum(two["filters"].values())
    search = ", ".join(f"{name} {seconds:.2f} s ({total / seconds:.1f})"
                       for name, seconds in two.get("search", {}).items())
    stages = [name for name in next(iter(two["frames"].values())) if name != "frame"]
    lines += ["", f"All three with two threads: {points / total / 1e6:.2f} million points a second.",
              f"16 neighbours alone (filters to it): {search}." if search else "", "", "| frame | 1 thread, ms | 2 threads, ms | ratio | " + " | ".join(stages) + " |",
              "|---" * (4 + len(stages)) + "|"]
    for name, frame in two["frames"].items():
        a, b = one["frames"][name]["frame"], frame["frame"]
        lines.append(f"| {name} | {a:.1f} | {b:.1f} | {a / b:.2f} | " +
                     " | ".join(f"{frame[s]:.1f}" for s in stages) + " |")
    lines += ["", "| window, in focus, 2 threads | ms |", "|---|---|"]
    lines += [f"| {name} | {value:.1f} |" for name, value in two["windows"].items()]
    return "\n".join(lines) + "\n"


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("out")
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--frames", type=int, default=9)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--scan", metavar="CLOUD", help="resampled, instead of a bumpy sphere")
    parser.add_argument("--search", metavar="PROGRAM", help="NeighborSpeed, by turns with the rest")
    parser.add_argument("--part", choices=PARTS, help=argparse.SUPPRESS)
    return parser.parse_args()


def main():
    arguments = parse()
    if arguments.part:
        print(json.dumps(PARTS[arguments.part](arguments)))
        return
    rows = {"1": [], "2": []}
    for _ in range(arguments.rounds):
        for threads, row in rows.items():
            parts = PARTS if threads == "2" else ("filters", "frames")
            row.append({part: run(part, threads, arguments) for part in parts})
            if arguments.search and threads == "2":
                row[-1]["search"] = search_alone(arguments)
    result = {threads: median(row) for threads, row in rows.items()}
    with open(arguments.out + ".json", "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)
    text = table(result, arguments.points)
    with open(arguments.out + ".md", "w", encoding="utf-8") as file:
        file.write(text)
    print(text)


if __name__ == "__main__":
    main()
