# SPDX-License-Identifier: BSD-3-Clause
"""Table 1 and Figure 6 of Krivanek, Zara, Bouatouch 2003, beside ours.

    PYTHONPATH=build/lib/python3/dist-packages /usr/bin/python3 Testing/Benchmarks/paper.py \\
        OUT [--truth FOLDER] [--scan CLOUD.ply] [--frames N] [--size PX]

The plane is FOLDER/plane.ply, the lion any scan; without them a generated ball. Writes OUT.md, the
table: fragments, points (splats), time with and without level of detail at two apertures, and the
time of 200 multisampled images; and OUT-SCENE.png, the figure: from top to bottom the aperture
grows; from left to right the paper's method (its Gaussian and its level of detail), ours, and the
reference of 200 images. PSNR against the reference.
"""

import argparse
import statistics

import numpy as np
from surfelsplatting import write_png

from clouds import largest_confusion, read, surfels_of, truth_views
from measures import psnr
from renderers import view_camera
from scenes import DEFAULT, PAPER, Drawing, Way, ball_drawing, multisampling, scan_drawing

APERTURES = (12, 48)  # largest circle of confusion in px: the paper's differ by 4, too
IMAGES = 200
METHODS = (("paper", PAPER,
            Way("Gaussian", "Off", coarse_grids=False)), ("ours", DEFAULT, Way(lod="Off")))
COLUMNS = (PAPER, DEFAULT)


def table_rows(drawing, size, frames):
    reach = largest_confusion(drawing.surfels, drawing.camera)
    for aperture in APERTURES:
        confusion = aperture / reach
        ways = [(name, lod, way) for name, with_lod, without in METHODS
                for lod, way in (("yes", with_lod), ("no", without))]
        times = [[] for _ in ways]
        for turn in range(frames + 1):
            drawn = [drawing.frame(way, size, confusion) for _, _, way in ways]
            for record, frame in zip(times, drawn):
                if turn:
                    record.append(frame.milliseconds)
        reference = drawing.frame(multisampling(IMAGES), size, confusion)
        for (name, lod, _), record, frame in zip(ways, times, drawn):
            yield (f"| {drawing.name} | {aperture} px | {name} | {lod} | "
                   f"{frame.fragments / 1000:,.0f} | {frame.splats:,} | "
                   f"{statistics.median(record):.0f} | "
                   f"{psnr(frame.picture, reference.picture):.1f} |")
        yield (f"| {drawing.name} | {aperture} px | {IMAGES} images | | | | "
               f"{reference.milliseconds:,.0f} | |")


def figure(drawing, size):
    reach = largest_confusion(drawing.surfels, drawing.camera)
    rows = []
    for aperture in (APERTURES[0], sum(APERTURES) / 2, APERTURES[1]):
        confusion = aperture / reach
        pictures = [drawing.frame(way, size, confusion).picture for way in COLUMNS]
        pictures.append(drawing.frame(multisampling(IMAGES), size, confusion).picture)
        rows.append(np.concatenate(pictures, axis=1))
    return np.concatenate(rows, axis=0)


def drawings(arguments):
    if arguments.truth:
        view, _ = truth_views(arguments.truth, "plane")[0]
        yield Drawing("plane", surfels_of(read(arguments.truth + "/plane.ply")), view_camera(view),
                      lit=False)
    if arguments.scan:
        yield scan_drawing(arguments.scan)
    if not arguments.truth and not arguments.scan:
        yield ball_drawing()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--truth", metavar="FOLDER")
    parser.add_argument("--scan", metavar="CLOUD")
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--size", type=int, default=512)
    arguments = parser.parse_args()
    with open(arguments.out + ".md", "w", encoding="utf-8") as file:
        file.write("| data | largest blur | method | LOD | #FRAG, thousands | #PTS | time, ms | PSNR "
                   f"to {IMAGES} images, dB |\n" + "|---" * 8 + "|\n")
        for drawing in drawings(arguments):
            for row in table_rows(drawing, arguments.size, arguments.frames):
                file.write(row + "\n")
                print(row, flush=True)
            picture = np.round(255 * np.clip(figure(drawing, arguments.size), 0, 1))
            write_png(picture.astype(np.uint8), f"{arguments.out}-{drawing.name}.png")


if __name__ == "__main__":
    main()
