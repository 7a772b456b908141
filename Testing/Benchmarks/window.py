#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How long a window's frame takes: a mesh through the lens, and surfels against the same picture
without a window.

    window.py OUT [--frames N] [--points N] [--size PX] [--scan CLOUD] [--only PART]
                  [--against FOLDER] [--processor-time]

writes OUT.md. The mesh is a sphere of 40,000 triangles that fills 0.6 of 1024 x 1024 px. FOLDER is
another build's dist-packages: both take turns. Medians. --processor-time adds up the time of all
threads instead, where other programs share the processor. Needs a display (xvfb-run -a).
"""

import argparse
import json
import time

import numpy as np

from speed import camera_for, cloud, median, run_part

ROUNDS = 3
# Radius of the lens and distance in focus, by the blur of the sphere in 1024 px.
BLURS = {"less than 0.5 px": (0.0026, 3.9), "7 to 10 px": (0.0298, 2.43),
         "17 to 25 px": (0.0795, 2.5)}


clock = time.perf_counter  # or that of the process


def milliseconds(action):
    began = clock()
    action()
    return 1000 * (clock() - began)


def sphere():
    """40,000 lit triangles with stripes."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkFiltersSources import vtkSphereSource
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    source = vtkSphereSource()
    source.SetRadius(1.0)
    source.SetThetaResolution(200)
    source.SetPhiResolution(102)
    source.Update()
    mesh = source.GetOutput()
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    colors = (128 + 100 * np.sin(14 * points)).astype(np.uint8)
    mesh.GetPointData().SetScalars(numpy_to_vtk(colors, deep=True))
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh)
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


class MeshFrames:
    """A window with the sphere."""

    def __init__(self, size):
        from peers import Window
        from surfelsplatting.vtkSurfelRendering import vtkSurfelSplattingPass

        self.window = Window(size)
        self.window.renderer.AddActor(sphere())
        self.splatting = vtkSurfelSplattingPass()
        self.window.renderer.SetPass(self.splatting)
        self.turn = 0

    def see(self, radius, focus):
        camera = self.window.renderer.GetActiveCamera()
        camera.SetViewAngle(30)
        camera.SetPosition(0, 0, 4.48)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetFocalDisk(2 * radius)
        camera.SetFocalDistance(focus)
        self.window.renderer.ResetCameraClippingRange()

    def moving(self):
        """-> milliseconds of a frame after a small turn"""
        self.turn += 1
        self.window.renderer.GetActiveCamera().Azimuth(0.5 if self.turn % 2 else -0.5)
        return milliseconds(self.window.draw)

    def still(self):
        return milliseconds(self.window.draw)


def measure_meshes(arguments):
    frames = MeshFrames(arguments.size)
    splatter = frames.splatting.GetSplatter()
    times = {}
    for name, lens in BLURS.items():
        frames.see(*lens)
        frames.window.draw()
        rows = []
        for _ in range(arguments.frames):
            elapsed = frames.moving()
            rows.append((elapsed, frames.still()))
        rows = np.median(np.array(rows), axis=0)
        times[name] = {"frame": rows[0], "still": rows[1]}
    frames.see(*BLURS["7 to 10 px"])
    splatter.SetLensCells(7)
    frames.window.draw()
    times["7 to 10 px, seven cells"] = {"frame": np.median(
        [frames.moving() for _ in range(max(1, arguments.frames // 4))])}
    return times


class SurfelFrames:
    """Surfels in a window, the same without one, and a window without anything."""

    def __init__(self, surfels, camera, width, height):
        from peers import Window
        from surfelsplatting.vtkSurfelRendering import (vtkSurfelImageRenderer,
                                                        vtkSurfelSplattingPass)

        self.full, self.empty = Window(height), Window(height)
        actor = self.full.add_surfels(surfels)
        splatting = vtkSurfelSplattingPass()
        splatting.GetSplatter().FrameReuseOff()
        self.full.renderer.SetPass(splatting)
        for window in (self.full, self.empty):
            window.window.SetSize(width, height)
            own = window.see(camera, 0)
        self.image = vtkSurfelImageRenderer()
        self.image.AddActor(actor)
        self.image.SetCamera(own)
        self.image.SetSize(width, height)
        self.image.GetSplatter().FrameReuseOff()

    def without_window(self):
        self.image.Modified()
        self.image.Update()

    def times(self, frames):
        rows = []
        for _ in range(frames + 1):
            rows.append([milliseconds(self.without_window),
                         milliseconds(self.full.draw), milliseconds(self.empty.draw)])
        alone, full, empty = np.median(np.array(rows[1:]), axis=0)
        return {"without window": alone, "empty window": empty, "window": full,
                "window / (without + empty)": full / (alone + empty)}


def measure_surfels(arguments):
    from clouds import surfels_of
    from renderers import hierarchy_of

    surfels = hierarchy_of(surfels_of(cloud(arguments)))
    camera = camera_for(surfels)
    size = arguments.size
    sizes = (size, size), (size * 15 // 8, size * 135 // 128)  # 1024: 1920 x 1080
    return {f"{width} x {height}": SurfelFrames(surfels, camera, width, height).times(
        arguments.frames) for width, height in sizes}


PARTS = {"meshes": measure_meshes, "surfels": measure_surfels}


def run(part, packages, arguments):
    options = ["--processor-time"] if arguments.processor_time else []
    variables = {"PYTHONPATH": packages} if packages else {}
    return run_part(__file__, part, arguments, options, **variables)


def table(rows):
    """Rows of (build, part, scene, times)."""
    lines = []
    for build, part, scene, times in rows:
        values = ", ".join(f"{name} {value:.2f}" if "/" in name else f"{name} {value:.1f} ms"
                           for name, value in times.items())
        lines.append(f"| {part} | {scene} | {build} | {values} |")
    return "\n".join(["| part | scene | build | times |", "|---|---|---|---|"] + lines) + "\n"


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("out")
    parser.add_argument("--frames", type=int, default=15)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--size", type=int, default=1024, help="of the window, px")
    parser.add_argument("--scan", metavar="CLOUD", help="resampled, instead of a bumpy sphere")
    parser.add_argument("--against", metavar="FOLDER", help="dist-packages of another build")
    parser.add_argument("--processor-time", action="store_true")
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--part", choices=PARTS, help=argparse.SUPPRESS)
    return parser.parse_args()


def main():
    arguments = parse()
    if arguments.part:
        global clock
        clock = time.process_time if arguments.processor_time else clock
        print(json.dumps(PARTS[arguments.part](arguments)))
        return
    builds = {"this": None}
    if arguments.against:
        builds["other"] = arguments.against
    parts = [arguments.only] if arguments.only else list(PARTS)
    found = {(build, part): [] for part in parts for build in builds}
    for _ in range(arguments.rounds):
        for (build, part), times in found.items():
            times.append(run(part, builds[build], arguments))
    rows = [(build, part, scene, times) for (build, part), each in found.items()
            for scene, times in median(each).items()]
    text = table(rows)
    with open(arguments.out + ".md", "w", encoding="utf-8") as file:
        file.write(text)
    print(text)


if __name__ == "__main__":
    main()
