# SPDX-License-Identifier: BSD-3-Clause
"""Renders a scan as Surfel Splats with depth of field, in focus at a given place of the picture.

    pvpython depth_of_field.py SCAN PICTURE [--plugin SurfelSplatting.so] [--blur 12]
                               [--focus 0.5 0.5] [--seen-from 0 -1 0] [--up 0 0 1] [--zoom 1.4]
"""

import argparse
import math

from paraview import simple


def open_scan(path):
    """A point cloud: .pcd, .ply, .vtp or another format that ParaView reads."""
    scan = simple.OpenDataFile(path)
    if scan is None:
        raise SystemExit(f"{path}: ParaView has no reader for it. For .pcd, load the plugin.")
    scan.UpdatePipeline()
    return scan


def show(scan, size=(900, 700), seen_from=(0, -1, 0), up=(0, 0, 1), zoom=1.4):
    """-> view and display of a scan, without blur, seen from a direction."""
    simple._DisableFirstRenderCameraReset()  # as in traces: keeps the camera below
    view = simple.CreateView("RenderView")
    view.ViewSize = size
    view.OrientationAxesVisibility = 0
    display = simple.Show(scan, view)
    display.Representation = "Surfel Splats"
    if "RGB" in scan.PointData.keys():
        simple.ColorBy(display, ("POINTS", "RGB"))
    bounds = scan.GetDataInformation().GetBounds()
    center = [(low + high) / 2 for low, high in zip(bounds[0::2], bounds[1::2])]
    distance = math.dist(bounds[0::2], bounds[1::2]) / 2 / math.sin(math.radians(15)) / zoom
    distance /= math.hypot(*seen_from)
    view.CameraFocalPoint = center
    view.CameraPosition = [c + distance * d for c, d in zip(center, seen_from)]
    view.CameraViewUp = up
    simple.Render(view)
    return view, display


def focus_at(view, display, x, y):
    """Focuses on the surface at x, y of the view: fractions from the lower left corner."""
    renderer = view.GetClientSideObject().GetRenderer()
    place = [round(f * (s - 1)) for f, s in zip((x, y), view.ViewSize)]
    depth = renderer.GetZ(*place)
    if depth >= 1.0:
        raise SystemExit(f"Nothing is visible at {x}, {y}; choose another --focus.")
    renderer.SetDisplayPoint(*place, depth)
    renderer.DisplayToWorld()
    *point, w = renderer.GetWorldPoint()
    display.SurfelFocusMode = "Point"
    display.SurfelFocusPoint = [c / w for c in point]


def blur(display, radius):
    """Sets a lens by its blur radius at infinity, px."""
    display.SurfelLensMode = "Circle of confusion"
    display.SurfelCircleOfConfusion = radius


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scan")
    parser.add_argument("picture")
    parser.add_argument("--plugin", help="its path, if ParaView does not load it by itself")
    parser.add_argument("--blur", type=float, default=12.0, help="radius at infinity, px")
    parser.add_argument("--focus", type=float, nargs=2, default=(0.5, 0.5), metavar=("X", "Y"))
    parser.add_argument("--seen-from", type=float, nargs=3, default=(0, -1, 0),
                        metavar=("X", "Y", "Z"), help="direction from the scan to the camera")
    parser.add_argument("--up", type=float, nargs=3, default=(0, 0, 1), metavar=("X", "Y", "Z"))
    parser.add_argument("--zoom", type=float, default=1.4, help="1 shows the whole scan")
    parser.add_argument("--size", type=int, nargs=2, default=(900, 700), metavar=("W", "H"))
    arguments = parser.parse_args()
    if arguments.plugin:
        simple.LoadPlugin(arguments.plugin, remote=False, ns=simple.__dict__)
    view, display = show(open_scan(arguments.scan), arguments.size, arguments.seen_from,
                         arguments.up, arguments.zoom)
    focus_at(view, display, *arguments.focus)
    blur(display, arguments.blur)
    simple.SaveScreenshot(arguments.picture, view)


if __name__ == "__main__":
    main()
