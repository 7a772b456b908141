# SPDX-License-Identifier: BSD-3-Clause
"""Frame time and error against blur, with and without level of detail.

    PYTHONPATH=build/lib/python3/dist-packages /usr/bin/python3 Testing/Benchmarks/detail.py \\
        OUT [--truth FOLDER] [--scan CLOUD.ply] [--frames N]

writes OUT.json, OUT.md (the table) and OUT.png (the plot; needs python3-matplotlib). FOLDER holds
ray-traced scenes: SCENE.ply, SCENE.json with views, SCENE-VIEW.exr (read by the DumpEXR of the
build's tests). A scan is drawn as it is and resampled to a million points. Without either, a
generated scene alone.

Frames are timed in turns, so that what else the machine does hits all alike; medians. The unit is
the frame without lens and without level of detail at the same size.
"""

import argparse
import json
import os
import statistics
import sys
from types import SimpleNamespace

from vtkmodules.vtkRenderingCore import vtkCamera

from clouds import (TRUTH_SCENES, largest_confusion, read, read_exr, resample, sphere_surfels,
                    surfels_of, truth_views)
from measures import psnr
from renderers import view_camera
from scenes import DEFAULT, Drawing, Way, ball_drawing, scan_drawing

SIZES = (512, 1024)
ERRORS = (0.5, 1.0, 2.0)
UNIT = Way(lod="Off")
WAYS = (UNIT, *(Way(error=error) for error in ERRORS), Way(lod="Paper"))


def time_view(drawing, size, confusion, frames):
    """Medians, in turns: unit frame, without detail, with each error, paper's detail."""
    jobs = [(UNIT, 0), *((way, confusion) for way in WAYS)]
    times = [[] for _ in jobs]
    splats = []
    for turn in range(frames + 1):
        for (way, blur), record in zip(jobs, times):
            frame = drawing.frame(way, size, blur)
            if turn:
                record.append(frame.milliseconds)
            elif way != UNIT:
                splats.append(frame.splats)
    unit, plain, *detailed = (statistics.median(record) for record in times)
    return SimpleNamespace(unit=unit, plain=plain, detailed=detailed, splats=splats)


def losses(drawing, size, confusion, truth):
    """dB lost against ground truth by each error's detail, positive: worse; or None."""
    if truth is None or truth.shape[0] != size:
        return None
    base, *others = (psnr(drawing.frame(way, size, confusion).picture, truth) for way in WAYS)
    return {"base": base, "lost": [base - other for other in others]}


def truth_scenes(folder, dump):
    for name in TRUTH_SCENES:
        views = truth_views(folder, name)
        drawing = Drawing(name, surfels_of(read(f"{folder}/{name}.ply")),
                          view_camera(views[0][0]), lit=False)
        yield drawing, {blur: read_exr(dump, path) for blur, (_, path) in views.items()}


def scan_scenes(path):
    scan = scan_drawing(path)
    dense = surfels_of(resample(scan.surfels, 1_000_000))
    yield scan, {}
    yield Drawing(scan.name + " 1M", dense, scan.camera, lit=True), {}


def measure_density(frames):
    """Frame time against surfels for each covered pixel, at the same view."""
    size, pixels = 512, 102_000  # pi/4 of 360 x 360
    camera = vtkCamera()
    camera.SetPosition(0, 0, 5.4)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewAngle(30)
    camera.SetFocalDistance(4.4)
    drawings = {density: Drawing(f"sphere x{density}", sphere_surfels(2 * pixels * density),
                                 camera, lit=False) for density in (1, 10, 100)}
    rows = []
    for radius in (0, 12):
        times = {density: [] for density in drawings}
        for turn in range(frames + 1):
            for density, drawing in drawings.items():
                frame = drawing.frame(DEFAULT, size, radius)
                if turn:
                    times[density].append(frame.milliseconds)
        unit = statistics.median(times[1])
        for density, drawing in drawings.items():
            frame = statistics.median(times[density])
            rows.append({"density": density, "surfels": drawing.count, "confusion": radius,
                         "milliseconds": frame, "ratio": frame / unit})
            print(f"| {density} | {drawing.count:,} | {radius} | {frame:.1f} | "
                  f"{frame / unit:.2f} |", flush=True)
    return rows


def measure(scenes, frames, sizes):
    rows = []
    for drawing, truths in scenes:
        reach = largest_confusion(drawing.surfels, drawing.camera)
        for size in sizes:
            # At infinity as in the ray-traced views, and until the scene's own reaches W/8.
            at_infinity = [0, 4, 12, 36, 64] if truths else [
                0, *(round(part * size / 8 / reach, 2) for part in (0.06, 0.2, 0.55, 1.0))]
            scale = size / 512 if truths else 1
            for radius in at_infinity:
                timed = time_view(drawing, size, radius * scale, frames)
                rows.append({
                    "scene": drawing.name, "surfels": drawing.count, "size": size,
                    "confusion_at_infinity": radius * scale,
                    "largest_confusion": radius * scale * reach,
                    "unit_ms": timed.unit, "plain": timed.plain / timed.unit,
                    "detailed": [t / timed.unit for t in timed.detailed],
                    "splats": timed.splats,
                    "psnr": losses(drawing, size, radius * scale, truths.get(radius))})
                print(row_text(rows[-1]), flush=True)
    return rows


def row_text(row):
    text = (f"| {row['scene']} | {row['size']} | {row['confusion_at_infinity']:.0f} "
            f"({row['largest_confusion']:.0f}) | {row['unit_ms']:.0f} | {row['plain']:.2f} | ")
    text += " | ".join(f"{ratio:.2f}" for ratio in row["detailed"]) + " | "
    if row["psnr"]:
        lost = " / ".join(f"{-value:+.2f}" for value in row["psnr"]["lost"])
        return text + f"{row['psnr']['base']:.2f} | {lost} |"
    return text + "| |"


def write_table(rows, path):
    errors = " | ".join(f"error {error:g}" for error in ERRORS)
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"| scene | px | blur at infinity (largest), px | unit, ms | no detail | {errors} "
                   "| paper | PSNR, dB | change with detail, dB |\n")
        file.write("|" + "---|" * (7 + len(ERRORS) + 1) + "\n")
        file.writelines(row_text(row) + "\n" for row in rows)


def write_plot(rows, path):
    try:
        import matplotlib
    except ImportError:
        print("no plot: install python3-matplotlib", file=sys.stderr)
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot

    sizes = sorted({row["size"] for row in rows})
    figure, axes = pyplot.subplots(1, len(sizes), figsize=(5.2 * len(sizes), 4.2), squeeze=False)
    for axis, size in zip(axes[0], sizes):
        for number, scene in enumerate(dict.fromkeys(row["scene"] for row in rows)):
            here = [row for row in rows if row["scene"] == scene and row["size"] == size]
            x = [row["largest_confusion"] for row in here]
            color = f"C{number}"
            axis.plot(x, [row["detailed"][ERRORS.index(1.0)] for row in here], "o-", color=color,
                      label=scene)
            axis.plot(x, [row["plain"] for row in here], ":", color=color)
        axis.axhline(1, color="grey", linewidth=0.8)
        axis.set(title=f"{size} x {size}", xlabel="largest circle of confusion, px",
                 ylabel="frame over pinhole frame without detail", ylim=(0, None))
    axes[0][0].legend(fontsize=8, loc="upper left", ncols=2)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--truth")
    parser.add_argument("--dump-exr", default=os.environ.get("DUMP_EXR", "build/bin/DumpEXR"))
    parser.add_argument("--scan")
    parser.add_argument("--density", action="store_true",
                        help="only: the same view of clouds of 1, 10 and 100 surfels a pixel")
    parser.add_argument("--frames", type=int, default=9)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    arguments = parser.parse_args()
    if arguments.density:
        with open(arguments.out + ".json", "w", encoding="utf-8") as file:
            json.dump(measure_density(arguments.frames), file, indent=1)
        return
    rows = []
    if arguments.truth:
        rows += measure(truth_scenes(arguments.truth, arguments.dump_exr), arguments.frames,
                        arguments.sizes)
    if arguments.scan:
        rows += measure(scan_scenes(arguments.scan), arguments.frames, arguments.sizes)
    if not rows:
        rows += measure([(ball_drawing(), {})], arguments.frames, arguments.sizes)
    with open(arguments.out + ".json", "w", encoding="utf-8") as file:
        json.dump(rows, file, indent=1)
    write_table(rows, arguments.out + ".md")
    write_plot(rows, arguments.out + ".png")


if __name__ == "__main__":
    main()
