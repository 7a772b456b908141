#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Frames of this build against those of another one: the same surfels and cameras, by turns.

    versions.py OUT --against FOLDER [--truth FOLDER] [--scan CLOUD] [--rounds N] [--size PX]
    versions.py OUT --against FOLDER --sphere N [--rounds N] [--size PX]

writes OUT.md: per view the medians and their ratio, last the geometric mean of the ratios.
--against: lib/python3/dist-packages of the other build; without it this build is held against
itself. --truth: ray-traced scenes, as in accuracy.py. Two threads.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time

from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

from renderers import camera_view, hierarchy_of, image_renderer, set_blur, view_camera

FRAMES = 5  # of a turn; the first one brings the caches back and is not counted


def views_of(scene, camera, blurs, lit):
    """The views of a scene, as the workers read them."""
    return [{"scene": scene, "blur": blur, "lit": lit, **camera_view(camera)} for blur in blurs]


def scenes(arguments):
    """-> surfels and views, scene by scene"""
    from clouds import TRUTH_SCENES, bumpy_ball, framed_camera, read, surfels_of, truth_views
    from meshes import MeshScene
    from speed import camera_for

    if arguments.sphere:
        surfels = surfels_of(bumpy_ball(arguments.sphere))
        yield surfels, views_of("sphere", camera_for(surfels), (0, arguments.size / 16), lit=False)
        return
    for name in TRUTH_SCENES if arguments.truth else ():
        camera = view_camera(truth_views(arguments.truth, name)[12][0])
        yield (surfels_of(read(f"{arguments.truth}/{name}.ply")),
               views_of(name, camera, (12, 36), lit=False))
    mesh = MeshScene(points=arguments.points)
    yield surfels_of(mesh.cloud()), views_of("mesh", mesh.camera(), (12, 36), lit=False)
    if arguments.scan:
        surfels = surfels_of(read(arguments.scan))
        yield surfels, views_of("scan", framed_camera(surfels), (45, 91), lit=True)


def prepare(arguments, folder):
    """Writes the surfels for the workers. -> views"""
    views = []
    for surfels, of_scene in scenes(arguments):
        path = f"{folder}/{of_scene[0]['scene']}.vtp"
        writer = vtkXMLPolyDataWriter()
        writer.SetFileName(path)
        writer.SetInputData(surfels)
        if not writer.Write():
            raise OSError(f"cannot write {path}; is the disk full?")
        views += [{**view, "path": path, "size": arguments.size} for view in of_scene]
    return views


def renderer_of(view):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(view["path"])
    reader.Update()
    renderer = image_renderer(hierarchy_of(reader.GetOutput()), view_camera(view), view["lit"])
    renderer.SetSize(view["size"], view["size"])
    return renderer


def milliseconds(renderer):
    """Of a frame"""
    renderer.Modified()
    began = time.perf_counter()
    renderer.Update()
    return 1e3 * (time.perf_counter() - began)


def work():
    """A worker: a line with a view asks for the times of FRAMES frames."""
    scene = renderer = None
    for line in sys.stdin:
        view = json.loads(line)
        if view["scene"] != scene:
            scene, renderer = view["scene"], renderer_of(view)
        set_blur(renderer.GetSplatter(), view["blur"])
        print(json.dumps([milliseconds(renderer) for _ in range(FRAMES)]), flush=True)


class Worker:
    """A process that draws with one of the builds."""

    def __init__(self, packages):
        environment = dict(os.environ, VTK_SMP_MAX_THREADS="2")
        if packages:
            environment["PYTHONPATH"] = packages
        self.process = subprocess.Popen([sys.executable, "-s", os.path.abspath(__file__), "",
                                         "--work"], env=environment, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def times(self, view):
        self.process.stdin.write(json.dumps(view) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"a worker failed on {view['scene']}; its error is above")
        return json.loads(answer)

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def compare(workers, view, rounds):
    """-> median milliseconds of a frame, by worker"""
    found = [[] for _ in workers]
    for turn in range(rounds + 1):
        for times, worker in zip(found, workers):
            frames = worker.times(view)[1:]
            times += frames if turn else []
    return [statistics.median(times) for times in found]


def table(views, medians):
    lines = ["| view, blur at infinity, px | before, ms | now, ms | ratio |", "|---|---|---|---|"]
    ratios = [now / before for before, now in medians]
    for view, (before, now), ratio in zip(views, medians, ratios):
        name = f"{view['scene']}, {view['blur']:g}"
        lines.append(f"| {name} | {before:.1f} | {now:.1f} | {ratio:.3f} |")
    mean = math.exp(statistics.mean(map(math.log, ratios)))
    return "\n".join([*lines, f"| geometric mean | | | {mean:.3f} |"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("out")
    parser.add_argument("--against", metavar="FOLDER", help="dist-packages of another build")
    parser.add_argument("--truth", metavar="FOLDER", help="ray-traced scenes")
    parser.add_argument("--scan", metavar="CLOUD", help="drawn with 45 and 91 px of blur")
    parser.add_argument("--points", type=int, default=400_000, help="of the mesh scene")
    parser.add_argument("--sphere", type=int, metavar="N",
                        help="only a sphere of N points, in focus and blurred by SIZE / 16 px")
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--rounds", type=int, default=13)
    parser.add_argument("--work", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.work:
        work()
        return
    with tempfile.TemporaryDirectory() as folder:
        views = prepare(arguments, folder)
        workers = [Worker(arguments.against), Worker(None)]
        medians = [compare(workers, view, arguments.rounds) for view in views]
        for worker in workers:
            worker.close()
    text = table(views, medians)
    with open(arguments.out + ".md", "w", encoding="utf-8") as file:
        file.write(text)
    print(text)


if __name__ == "__main__":
    main()
