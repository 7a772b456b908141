# SPDX-License-Identifier: BSD-3-Clause
"""Run time against error: splatting in all its ways, multisampling, and other renderers.

    PYTHONPATH=build/lib/python3/dist-packages /usr/bin/python3 Testing/Benchmarks/accuracy.py \\
        OUT [--truth FOLDER] [--scan CLOUD.ply] [--peers] [--frames N]

writes OUT.json, OUT.md and, with python3-matplotlib, a plot OUT-SCENE.png for each scene. FOLDER
holds ray-traced scenes: SCENE.ply, SCENE.json with views, SCENE-VIEW.exr (read by the DumpEXR of
the build's tests). Always there: meshes of the benchmark's own and a cloud sampled from them, with
--peers seen by VTK's passes in a window (xvfb-run) and by Mitsuba 3 where it is installed. FLIP
needs the package flip-evaluator. (All three from pip, in a virtual environment with
--system-site-packages.)

Two yardsticks, kept apart. "Own": the mean of N pinhole pictures of the same splatter, N = --points;
what is off is the depth of field alone. "Truth": ray-traced pictures of the meshes that the clouds
were sampled from; sampling and reconstruction count, too.

Frames are timed in turns, so that what else the machine does hits all alike; medians. A speed-up at
equal error is the time of multisampling at the number of lens points, interpolated, that has the
error of the splatter's one picture, over that picture's time. Multisampling uses the same hierarchy
and the best lens points known here (Core/Lens/SubApertures.h).
"""

import argparse
import json
import math
import os
import statistics
import sys

from clouds import TRUTH_SCENES, largest_confusion, read, read_exr, surfels_of, truth_views
from measures import errors
from meshes import MeshScene
from renderers import view_camera
from report import write_plots, write_tables
from scenes import DEFAULT, Drawing, Way, multisampling, scan_drawing

CELLS = (4, 7, 19, 37)
WAYS = (DEFAULT, Way(error=0.5), Way(error=2.0), Way(lod="Off"), Way("Gaussian"),
        Way("Gaussian", "Paper"), Way("Gaussian", "Off"), *(Way(cells=k) for k in CELLS))


class View:
    """A blur of a scene and the reference picture that it is compared with."""

    def __init__(self, drawing, confusion, size, truth=None, mesh=None):
        self.drawing, self.confusion, self.size = drawing, confusion, size
        self.truth, self.mesh = truth, mesh
        self.reference = None

    def rate(self, picture):
        """-> errors against both yardsticks"""
        rated = {}
        if self.reference is not None:
            rated["own"] = errors(picture, self.reference)
        if self.truth is not None:
            rated["truth"] = errors(picture, self.truth)
        return rated


def row_of(way, frame, milliseconds, view):
    return {"way": str(way), "kernel": way.kernel, "lod": way.lod, "lod_error": way.error,
            "cells": way.cells, "pinholes": way.pinholes,
            "milliseconds": milliseconds, "splats": frame.splats, "fragments": frame.fragments, **view.rate(frame.picture)}


def time_ways(view, ways, frames):
    """Rows; frames in turns."""
    times = [[] for _ in ways]
    last = []
    for turn in range(frames + 1):
        last = [view.drawing.frame(way, view.size, view.confusion) for way in ways]
        for record, frame in zip(times, last):
            if turn:
                record.append(frame.milliseconds)
    return [row_of(way, frame, statistics.median(record), view)
            for way, frame, record in zip(ways, last, times)]


def lens_points(most):
    """1, 2, 4, ... and, where one picture's error is, more densely."""
    powers = [2 ** i for i in range(1 + int(math.log2(most)))]
    return sorted({n for n in powers + [3, 5, 6, 7, 10, 12, 14, 19, 24, 37, 48] if n <= most})


def multisample(view, most, frames):
    rows = []
    for count in lens_points(most):
        turns = frames if count <= 16 else 1
        frames_of = [view.drawing.frame(multisampling(count), view.size, view.confusion)
                     for _ in range(turns)]
        milliseconds = statistics.median(f.milliseconds for f in frames_of)
        rows.append(row_of(multisampling(count), frames_of[-1], milliseconds, view))
    return rows


def equal_error(rows, way_row, yardstick="own"):
    """-> (lens points, milliseconds) of multisampling with the error of another row."""
    wanted = way_row[yardstick]["rmse"]
    curve = [(r["cells"], r[yardstick]["rmse"], r["milliseconds"]) for r in rows if r["pinholes"]]
    for before, after in zip(curve, curve[1:]):
        if after[1] <= wanted < before[1]:
            t = math.log(before[1] / wanted) / math.log(before[1] / max(after[1], 1e-12))

            def between(i):
                return math.exp((1 - t) * math.log(before[i]) + t * math.log(after[i]))
            return between(0), between(2)
    return None


def speed_ups(rows):
    default = next(r for r in rows if r["way"] == str(DEFAULT))
    found = {"milliseconds": default["milliseconds"]}
    equal = equal_error(rows, default) if "own" in default else None
    if equal:
        found["points"] = equal[0]
        found["at_equal_error"] = equal[1] / default["milliseconds"]
    views = [r for r in rows if r["pinholes"] and r["cells"] <= 64]
    per_point = statistics.median(r["milliseconds"] / r["cells"] for r in views)
    found["over_200_points"] = 200 * per_point / default["milliseconds"]
    return found


def measure_view(view, arguments):
    reference = view.drawing.frame(multisampling(arguments.points), view.size, view.confusion)
    view.reference = reference.picture
    ways = WAYS if view.confusion else (DEFAULT, Way(lod="Off"))
    rows = time_ways(view, ways, arguments.frames)
    if view.confusion:
        rows += multisample(view, arguments.points // 2, min(3, arguments.frames))
    result = {"scene": view.drawing.name, "surfels": view.drawing.count, "size": view.size,
              "confusion": view.confusion,
              "largest": view.confusion * largest_confusion(view.drawing.surfels,
                                                            view.drawing.camera), "rows": rows}
    if view.truth is not None:
        result["own_reference"] = errors(view.reference, view.truth)
    if view.confusion:
        result["speed_up"] = speed_ups(rows)
    if arguments.peers and view.truth is not None:
        from peerways import peers

        result["peers"] = peers(view, arguments.frames)
    print(f"{view.drawing.name}, {view.confusion:g} px: "
          + "; ".join(f"{r['way']} {r['own']['psnr']:.1f} dB {r['milliseconds']:.0f} ms"
                      for r in rows if not r["pinholes"]), flush=True)
    return result


def mesh_views(arguments):
    """Truth by Mitsuba, or else by VTK from as many lens points as the reference has."""
    scene = MeshScene(arguments.mesh_detail, arguments.mesh_points)
    drawing = Drawing(scene.name, surfels_of(scene.cloud()), scene.camera(), lit=False)
    for confusion in arguments.blurs:
        truth = None
        if arguments.peers:
            from peerways import mesh_truth

            truth = mesh_truth(scene, arguments.size, confusion, arguments.points)
        yield View(drawing, confusion, arguments.size, truth, scene)


def truth_scene_views(arguments):
    for name in TRUTH_SCENES:
        views = truth_views(arguments.truth, name)
        drawing = Drawing(name, surfels_of(read(f"{arguments.truth}/{name}.ply")),
                          view_camera(views[0][0]), lit=False)
        for confusion, (_, path) in views.items():
            if confusion in arguments.blurs:
                yield View(drawing, confusion, 512, read_exr(arguments.dump_exr, path))


def scan_views(arguments):
    drawing = scan_drawing(arguments.scan)
    reach = largest_confusion(drawing.surfels, drawing.camera)
    for largest in (0, 12, 24):
        yield View(drawing, round(largest / reach, 2), 512)


def check(results):
    """What must hold of any scene; for the tests. -> problems"""
    for result in results:
        rows = {row["way"]: row for row in result["rows"]}
        if any(not math.isfinite(row["own"]["rmse"]) for row in result["rows"]):
            yield f"{result['scene']}: an error is not a number"
        if not result["confusion"]:
            continue
        cells = [rows[str(way)]["own"]["rmse"] for way in (DEFAULT, Way(cells=7), Way(cells=37))]
        points = [row["own"]["rmse"] for row in result["rows"] if row["pinholes"]]
        # One-sided bars: 43.6, 53.8 and 58.9 dB, a factor of 1.8 at the end; two-sided ones, of 2.0.
        if not cells[0] > cells[1] > 1.5 * cells[2]:
            yield f"{result['scene']}: more cells are not more accurate: {cells}"
        if not points[0] > 4 * points[-1]:
            yield f"{result['scene']}: more lens points are not more accurate: {points}"
        if rows[str(DEFAULT)]["own"]["psnr"] < 30:
            yield f"{result['scene']}: {rows[str(DEFAULT)]['own']['psnr']:.1f} dB"
        for row in result.get("peers", []):
            if "N = 64" in row["way"] and row["truth"]["psnr"] < 35:
                yield f"{result['scene']}: {row['way']} is off by {row['truth']['psnr']:.1f} dB"


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--truth", metavar="FOLDER")
    parser.add_argument("--dump-exr", default=os.environ.get("DUMP_EXR", "build/bin/DumpEXR"))
    parser.add_argument("--scan", metavar="CLOUD")
    parser.add_argument("--peers", action="store_true", help="other renderers, too; needs a display")
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--points", type=int, default=1024, help="of the reference")
    parser.add_argument("--size", type=int, default=512, help="of the meshes' views, px")
    parser.add_argument("--blurs", type=float, nargs="+", default=[0, 4, 12, 36],
                        help="of infinity, px")
    parser.add_argument("--mesh-points", type=int, default=400_000)
    parser.add_argument("--mesh-detail", type=float, default=1.0)
    parser.add_argument("--check", action="store_true", help="fail where the figures are absurd")
    return parser.parse_args()


def main():
    arguments = parse()
    results = [measure_view(view, arguments) for view in mesh_views(arguments)]
    if arguments.truth:
        results += [measure_view(view, arguments) for view in truth_scene_views(arguments)]
    if arguments.scan:
        results += [measure_view(view, arguments) for view in scan_views(arguments)]
    with open(arguments.out + ".json", "w", encoding="utf-8") as file:
        json.dump(results, file, indent=1)
    write_tables(results, arguments.out + ".md")
    write_plots(results, arguments.out)
    problems = list(check(results)) if arguments.check else []
    print("\n".join(problems), end="")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
