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
import math
import os
import statistics
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera

from surfelsplatting.vtkSurfelFilters import (vtkSurfelEstimation, vtkSurfelHierarchy,
                                              vtkSurfelNormalization)
from surfelsplatting.vtkSurfelReaders import vtkPointCloudReader
from surfelsplatting.vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper

SCENES = ("plane", "stanford-bunny", "bars", "veil")
SIZES = (512, 1024)
ERRORS = (0.5, 1.0, 2.0)


def read(path):
    reader = vtkPointCloudReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def surfels_of(cloud):
    estimation = vtkSurfelEstimation()
    estimation.SetInputData(cloud)
    normalization = vtkSurfelNormalization()
    normalization.SetInputConnection(estimation.GetOutputPort())
    normalization.Update()
    return normalization.GetOutput()


def resample(surfels, count):
    """A cloud of about `count` points drawn from the surfels' kernels, with their colours."""
    rng = np.random.default_rng(1)
    points = vtk_to_numpy(surfels.GetPoints().GetData()).astype(float)
    s = vtk_to_numpy(surfels.GetPointData().GetArray("SurfelCovariance")).astype(float)
    matrices = s[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    values, vectors = np.linalg.eigh(matrices)
    pick = rng.integers(0, len(points), count)
    steps = rng.normal(size=(count, 3)) * np.sqrt(np.maximum(values[pick], 0))
    cloud = vtkPolyData()
    moved = points[pick] + np.einsum("nij,nj->ni", vectors[pick], steps)
    array = vtkPoints()
    array.SetData(numpy_to_vtk(moved.astype(np.float32), deep=True))
    cloud.SetPoints(array)
    scalars = surfels.GetPointData().GetScalars()
    if scalars:
        colors = numpy_to_vtk(np.ascontiguousarray(vtk_to_numpy(scalars)[pick]), deep=True)
        colors.SetName("RGB")
        cloud.GetPointData().SetScalars(colors)
    return cloud


def hierarchy_of(surfels):
    hierarchy = vtkSurfelHierarchy()
    hierarchy.SetInputData(surfels)
    hierarchy.Update()
    return hierarchy.GetOutput()


def view_camera(view):
    camera = vtkCamera()
    camera.SetPosition(view["position"])
    camera.SetFocalPoint(view["focalPoint"])
    camera.SetViewUp(view["viewUp"])
    camera.SetViewAngle(view["viewAngle"])
    camera.SetFocalDistance(view["focalDistance"])
    return camera


def three_quarter_camera(surfels):
    bounds = np.array(surfels.GetBounds()).reshape(3, 2)
    center, size = bounds.mean(axis=1), np.linalg.norm(bounds[:, 1] - bounds[:, 0])
    camera = vtkCamera()
    camera.SetFocalPoint(center)
    camera.SetPosition(center + 1.9 * size * np.array([0.46, 0.37, 0.81]))
    camera.SetViewUp(0, 1, 0)
    camera.SetViewAngle(30)
    camera.SetFocalDistance(1.75 * size)
    return camera


class Drawing:
    """Surfels, without and with their hierarchy, through one camera."""

    def __init__(self, name, surfels, camera, lit):
        self.name, self.camera = name, camera
        self.plain = self._renderer(surfels, lit)
        self.detailed = self._renderer(hierarchy_of(surfels), lit)
        self.count = surfels.GetNumberOfPoints()

    def _renderer(self, surfels, lit):
        mapper = vtkSurfelMapper()
        mapper.SetInputData(surfels)
        mapper.SetScalarVisibility(surfels.GetPointData().GetScalars() is not None)
        actor = vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetLighting(lit)
        renderer = vtkSurfelImageRenderer()
        renderer.AddActor(actor)
        renderer.SetCamera(self.camera)
        renderer.GetSplatter().FrameReuseOff()
        return renderer

    def frame(self, detail, size, confusion, error=1.0, mode="Moments"):
        """One frame; confusion: radius at infinity in px, 0 = pinhole. -> the splatter"""
        renderer = self.detailed if detail else self.plain
        renderer.SetSize(size, size)
        splatter = renderer.GetSplatter()
        if confusion:
            splatter.SetLensModeToCircleOfConfusion()
            splatter.SetCircleOfConfusion(confusion)
        else:
            splatter.SetLensModeToPinhole()
        if detail:
            getattr(splatter, "SetLODModeTo" + mode)()
            splatter.SetLODError(error)
        renderer.Modified()
        renderer.Update()
        return splatter

    def picture(self, *arguments, **keywords):
        self.frame(*arguments, **keywords)
        renderer = self.detailed if arguments[0] else self.plain
        size = renderer.GetOutput().GetDimensions()
        colors = vtk_to_numpy(renderer.GetOutput().GetPointData().GetScalars())
        return colors.reshape(size[1], size[0], 4)[::-1, :, :3].astype(float)


def psnr(a, b):
    return -10 * math.log10(max(np.mean((a - b) ** 2), 1e-20))


def read_truth(dump, path):
    found = subprocess.run([dump, path], capture_output=True, check=True).stdout
    line, values = found.split(b"\n", 1)
    width, height, _, *channels = line.decode().split()
    planes = np.frombuffer(values, np.float32).reshape(len(channels), int(height), int(width))
    names = [channel.split(":")[0] for channel in channels]
    return np.stack([planes[names.index(c)] for c in "RGB"], axis=-1).astype(float)


def time_view(drawing, size, confusion, frames):
    """Medians, in turns: unit frame, without detail, with each error."""
    jobs = [(False, size, 0, 1.0, "Moments"), (False, size, confusion, 1.0, "Moments")]
    jobs += [(True, size, confusion, error, "Moments") for error in ERRORS]
    jobs += [(True, size, confusion, 1.0, "Paper")]
    times = [[] for _ in jobs]
    splats = []
    for turn in range(frames + 1):
        for job, record in zip(jobs, times):
            splatter = drawing.frame(*job)
            if turn:
                record.append(splatter.GetFrameMilliseconds())
            elif job[0]:
                splats.append(splatter.GetNumberOfSplats())
    unit, plain, *detailed = (statistics.median(record) for record in times)
    return SimpleNamespace(unit=unit, plain=plain, detailed=detailed, splats=splats)


def losses(drawing, size, confusion, truth):
    """dB lost against ground truth by each error's detail, positive: worse; or None."""
    if truth is None or truth.shape[0] != size:
        return None
    base = psnr(drawing.picture(False, size, confusion), truth)
    lost = [base - psnr(drawing.picture(True, size, confusion, error), truth) for error in ERRORS]
    lost.append(base - psnr(drawing.picture(True, size, confusion, 1.0, "Paper"), truth))
    return {"base": base, "lost": lost}


def truth_scenes(folder, dump):
    for name in SCENES:
        with open(f"{folder}/{name}.json", encoding="utf-8") as file:
            views = {view["name"]: view for view in json.load(file)["views"]}
        drawing = Drawing(name, surfels_of(read(f"{folder}/{name}.ply")),
                          view_camera(views["pinhole"]), lit=False)
        truths = {radius: read_truth(dump, f"{folder}/{name}-{view}.exr") for radius, view in
                  ((0, "pinhole"), (4, "coc4"), (12, "coc12"), (36, "coc36"))}
        yield drawing, truths


def scan_scenes(path):
    surfels = surfels_of(read(path))
    name = os.path.basename(path).split("_")[0].split(".")[0]
    camera = three_quarter_camera(surfels)
    yield Drawing(name, surfels, camera, lit=True), {}
    yield Drawing(name + " 1M", surfels_of(resample(surfels, 1_000_000)), camera, lit=True), {}


def sphere_surfels(count):
    """Surfels on the unit sphere, by formula: millions of points need no estimation here."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    ring, angle = np.sqrt(1 - z * z), k * 2.399963229728653
    normals = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    area = 4 * math.pi / count
    s = 0.25 * area * np.stack([1 - normals[:, 0] ** 2, 1 - normals[:, 1] ** 2,
                                1 - normals[:, 2] ** 2, -normals[:, 0] * normals[:, 1],
                                -normals[:, 1] * normals[:, 2], -normals[:, 0] * normals[:, 2]], 1)
    surfels = vtkPolyData()
    points = vtkPoints()
    points.SetData(numpy_to_vtk(normals.astype(np.float32), deep=True))
    surfels.SetPoints(points)
    colors = (127 + 127 * np.sin(20 * normals)).astype(np.uint8)
    for name, values in (("SurfelCovariance", s.astype(np.float32)), ("RGB", colors),
                         ("SurfelAreaVector", (area * normals).astype(np.float32))):
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        surfels.GetPointData().AddArray(array)
    surfels.GetPointData().SetActiveScalars("RGB")
    return surfels


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
                splatter = drawing.frame(True, size, radius)
                if turn:
                    times[density].append(splatter.GetFrameMilliseconds())
        unit = statistics.median(times[1])
        for density, drawing in drawings.items():
            frame = statistics.median(times[density])
            rows.append({"density": density, "surfels": drawing.count, "confusion": radius,
                         "milliseconds": frame, "ratio": frame / unit})
            print(f"| {density} | {drawing.count:,} | {radius} | {frame:.1f} | "
                  f"{frame / unit:.2f} |", flush=True)
    return rows


def generated_scene():
    """A bumpy ball of 60,000 points, without any file."""
    k = np.arange(60_000) + 0.5
    z = 1 - 2 * k / len(k)
    ring, angle = np.sqrt(1 - z * z), k * 2.399963
    unit = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    points = unit * (1 + 0.05 * np.sin(9 * unit).prod(axis=1))[:, None]
    cloud = vtkPolyData()
    array = vtkPoints()
    array.SetData(numpy_to_vtk(points.astype(np.float32), deep=True))
    cloud.SetPoints(array)
    colors = numpy_to_vtk((127 + 127 * np.sin(20 * unit)).astype(np.uint8), deep=True)
    colors.SetName("RGB")
    cloud.GetPointData().SetScalars(colors)
    surfels = surfels_of(cloud)
    yield Drawing("ball", surfels, three_quarter_camera(surfels), lit=False), {}


def largest_confusion(drawing):
    """Largest circle of confusion of any surfel over that of a point at infinity."""
    points = vtk_to_numpy(drawing.plain.GetActors().GetLastActor().GetMapper().GetInput()
                          .GetPoints().GetData()).astype(float)
    camera = drawing.camera
    depth = (points - camera.GetPosition()) @ np.array(camera.GetDirectionOfProjection())
    depth = depth[depth > 0.05 * camera.GetDistance()]
    return np.abs(1 - camera.GetFocalDistance() / np.percentile(depth, [0.5, 99.5])).max()


def measure(scenes, frames, sizes):
    rows = []
    for drawing, truths in scenes:
        reach = largest_confusion(drawing)
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
        rows += measure(generated_scene(), arguments.frames, arguments.sizes)
    with open(arguments.out + ".json", "w", encoding="utf-8") as file:
        json.dump(rows, file, indent=1)
    write_table(rows, arguments.out + ".md")
    write_plot(rows, arguments.out + ".png")


if __name__ == "__main__":
    main()
