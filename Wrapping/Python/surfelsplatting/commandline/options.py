# SPDX-License-Identifier: BSD-3-Clause
"""Groups of options that several commands have."""

import argparse
import os

from ..problems import UserProblem
from ..surfels import HUGE
from ..views.cameras import AXES, LARGEST_BLUR, SIDES, STILL_CELLS, check_size
from .arguments import (angle, between, count, lens_parts, not_negative, number, pixel_number,
                        positive, refuse_together)

TRIPLE = dict(nargs=3, type=number, metavar=("X", "Y", "Z"))


def note_clouds(arguments, paths):
    """Notes the files, and what messages call the cloud that they are."""
    arguments.clouds = paths
    more = len(paths) - 1
    arguments.cloud = f"{paths[0]} and {more} more" if more else paths[0]


class _Clouds(argparse.Action):
    def __call__(self, parser, namespace, values, option_string=None):
        note_clouds(namespace, values)


def name_output(arguments, extension):
    """The default is a name that nothing else has: scan.png beside scan.obj may be its texture."""
    arguments.is_output_chosen = arguments.output is None
    if arguments.is_output_chosen:
        arguments.output = os.path.basename(os.path.abspath(arguments.clouds[0])) + extension


def add_clouds(parser, text="the point cloud; several files are one cloud"):
    parser.add_argument("clouds", metavar="CLOUD", nargs="+", action=_Clouds, help=text)


def add_camera_options(parser):
    """Where the camera is: by words and angles, and exactly."""
    seen = parser.add_argument_group(
        "view", "Without any of these, the camera shows the whole cloud in a three-quarter view,\n"
        "a depth image from its sensor, or a capture from a camera of its training.")
    seen.add_argument("--view", choices=SIDES, help="the side from which the whole cloud is seen")
    seen.add_argument("--azimuth", type=number, default=0.0, metavar="A",
                      help="move the camera to the right, around what it looks at, by A degrees")
    seen.add_argument("--elevation", type=number, default=0.0, metavar="A",
                      help="move the camera up, around what it looks at, by A degrees")
    seen.add_argument("--roll", type=number, default=0.0, metavar="A",
                      help="turn the camera clockwise about its view direction, by A degrees")
    seen.add_argument("--zoom", type=positive, default=1.0, metavar="Z",
                      help="show things Z times as large")
    seen.add_argument("--up", choices=(*AXES, "auto"),
                      help="the axis of the cloud that is up (default: that of --camera, or auto: "
                           "the ground, the normals and the coordinates tell it)")
    seen.add_argument("--size", nargs=2, type=count, metavar=("W", "H"),
                      help="width and height of the picture in pixels; the blur of --camera grows "
                           "with it (default: that of --camera, or 800 600; 1280 800 in view and "
                           "web)")
    camera = parser.add_argument_group(
        "exact camera", "Each option of these groups overrides the value from --camera.")
    camera.add_argument("--camera", metavar="FILE.json[:VIEW]",
                        help="camera, lens and size from this file (default VIEW: the first one); "
                             "of a cameras.json or transforms.json, with the cameras of a "
                             "capture's training, VIEW is an image or a number from 0")
    camera.add_argument("--position", help="position of the camera", **TRIPLE)
    camera.add_argument("--focal-point", help="the point that the camera looks at; it is in "
                        "focus unless a focus is given", **TRIPLE)
    camera.add_argument("--view-up", help="the direction that is up in the picture", **TRIPLE)
    camera.add_argument("--view-angle", type=angle, metavar="A",
                        help="vertical angle of view in degrees (default: 30)")
    camera.add_argument("--focal-length", type=positive, metavar="MM",
                        help="instead of --view-angle: as on 35 mm film, whose shorter side is 24 "
                             "mm; 45 is about 30 degrees")


def add_lens_options(parser):
    """What is in focus, and how much the rest is blurred."""
    focus = parser.add_argument_group(
        "focus", "Default: the surface in the middle of the picture. Without a lens all is sharp.")
    focus.add_argument("--focus-pixel", nargs=2, type=pixel_number, metavar=("X", "Y"),
                       help="the surface that is seen at this pixel of the picture, counted "
                            "from its upper left corner")
    focus.add_argument("--focus-point", help="the plane through this point, parallel to the "
                       "picture", **TRIPLE)
    focus.add_argument("--focal-distance", type=not_negative, metavar="F",
                       help="the plane at this distance along the view direction (0: default)")
    lens = parser.add_argument_group(
        "lens", "Everything is sharp unless --camera or one of these gives a lens.")
    lens.add_argument("--blur", type=between(0, LARGEST_BLUR), metavar="PX",
                      help="radius of the blur in pixels at the far end of what is seen, or at the "
                           "near end if that is farther from the focus; try 10. 0 takes away the lens of "
                           "--camera")
    lens.add_argument("--circle-of-confusion", type=between(0, LARGEST_BLUR), metavar="PX",
                      help="radius of the blur in pixels of very distant points; things twice as "
                           "far as the focus have half of it")
    lens.add_argument("--f-number", type=positive, metavar="N",
                      help="focal length over diameter, as cameras have it, for clouds in metres; "
                           "see --focal-length")
    lens.add_argument("--focal-disk", type=not_negative, metavar="D",
                      help="diameter of the lens in world units, 0 = pinhole")


def _add_color_options(parser):
    look = parser.add_argument_group("look")
    look.add_argument("--scalars", metavar="NAME",
                      help="colour by this column or array, such as intensity, or by a coordinate: "
                           "x, y or z; for a volume: the array to show")
    look.add_argument("--colormap", metavar="NAME",
                      help="for --scalars and volumes: viridis, plasma, inferno, magma, cividis, "
                           "turbo, coolwarm, gray, or one of matplotlib if that is installed "
                           "(default: viridis)")
    look.add_argument("--range", nargs=2, type=number, metavar=("A", "B"),
                      help="the scalars that get the first and the last colour (default: the "
                           "smallest and the largest)")
    look.add_argument("--background", nargs=3, type=between(0, 1), metavar=("R", "G", "B"),
                      help="colour behind the cloud, 0 to 1 each, or a name such as white or "
                           "#ffc080; makes the picture opaque (default: none in .exr; 0.16 0.17 "
                           "0.19 in .png, or black with --unlit)")
    light = look.add_mutually_exclusive_group()
    light.add_argument("--lit", action="store_true",
                       help="light the cloud, most from the upper left (default: on, but off for "
                            "colours as varied as those of photographs, which have light in them "
                            "already)")
    light.add_argument("--unlit", action="store_true", help="show the colours as they are")
    look.add_argument("--linear-light", action="store_true",
                      help="convert colours from sRGB to linear light before they are mixed; "
                           "OUT.exr is linear light, OUT.png is sRGB (default: colours are mixed "
                           "as they are stored)")


def _opacities(text):
    """[(scalar, opacity)], sorted, of "V:O,V:O,..." """
    points = []
    for part in text.split(","):
        try:
            scalar, opacity = map(number, part.split(":"))
        except (ValueError, argparse.ArgumentTypeError):
            raise argparse.ArgumentTypeError(
                f"{part!r} is not SCALAR:OPACITY; for example 100:0,200:0.5") from None
        if not 0 <= opacity <= 1:
            raise argparse.ArgumentTypeError(f"{part!r} has an opacity that is not from 0 to 1")
        points.append((scalar, opacity))
    if len({scalar for scalar, _ in points}) < len(points):
        raise argparse.ArgumentTypeError(f"{text!r} has two opacities for one scalar")
    return sorted(points)


def _add_gaussian_options(parser):
    volume = parser.add_argument_group(
        "volumes", "--scalars chooses the array, --colormap and --range its colours. An array of\n"
        "colours keeps them: the last of four components is the scalar, of three it is the\n"
        "luminance.")
    volume.add_argument("--opacity", type=_opacities, metavar="V:O,...",
                        help="opacity O, 0 to 1, of scalar V, and so on; linear between them, "
                             "constant beyond (default: the most frequent scalar is transparent, "
                             "and those farthest from it are most opaque; -v prints it)")
    volume.add_argument("--unit-distance", type=positive, metavar="U",
                        help="length in world units over which the opacities hold; smaller is "
                             "denser (default: about the diagonal of a cell, as in ParaView)")
    volume.add_argument("--shade", action="store_true",
                        help="light the volume as if it had surfaces where its scalars change "
                             "fastest; opacities and colours are chosen to show them, unless "
                             "--opacity and --range are given (default: no light)")
    capture = parser.add_argument_group("captures")
    capture.add_argument("--capture-filter", choices=("classic", "antialiased"), default="classic",
                         help="how to draw what is smaller than a pixel: larger, as in the "
                              "published method, with which most captures are trained, or fainter, "
                              "as in Mip-Splatting, for captures trained with that and for views "
                              "from afar (default: classic)")


def _add_surfel_options(parser):
    points = parser.add_argument_group("points to surfels")
    points.add_argument("--every", type=count, default=1, metavar="N",
                        help="use one of every N points, chosen at random: a large cloud is seen "
                             "sooner, with less detail (default: 1)")
    points.add_argument("--cleaning", choices=("off", "outliers", "full"), default="full",
                        help="what to do to the points first: outliers removes those that belong "
                             "to no surface, full also smooths noisy surfaces (default: full)")
    points.add_argument("--sides", choices=("auto", "two", "given"), default="auto",
                        help="from which sides surfaces are visible. auto: from outside, as the "
                             "normals or the scanners in the file tell it, or else the shape, "
                             "also where these normals cannot be right; "
                             "from both sides where nothing does, and where the camera would "
                             "see backs only; parts that are inside out are turned. two: from "
                             "both sides. given: as the normals or faces in the file tell it "
                             "(default: auto)")
    points.add_argument("--neighbors", type=between(4, 256, count), metavar="K",
                        help="number of points that a normal is estimated from, 4 to 256; more "
                             "for noisy scans (default: 16, or 30 for depth images)")


def add_look_options(parser):
    """Colours, volumes and captures, and how points become surfels."""
    _add_color_options(parser)
    _add_gaussian_options(parser)
    _add_surfel_options(parser)
    parser.set_defaults(volume_scalars=None)


def _add_accuracy_options(parser):
    accuracy = parser.add_argument_group("accuracy")
    parts = accuracy.add_mutually_exclusive_group()
    parts.add_argument("--lens-cells", type=lens_parts, metavar="K",
                       help="average the pictures of K smaller lenses where things overlap: more "
                            f"accurate and slower; 1 is fastest (default: {STILL_CELLS}; 1 for deep "
                            "pictures)")
    parts.add_argument("--reference", type=lens_parts, metavar="N",
                       help="average N pinhole pictures from points all over the lens: exact if N "
                            "is large, several hundred")
    accuracy.add_argument("--kernel", choices=("pearson", "gaussian"), default="pearson",
                          help="shape of the splats: pearson is close to the disc of a lens, "
                               "gaussian is the paper's (default: pearson)")


def add_detail_options(parser):
    """Accuracy against time."""
    _add_accuracy_options(parser)
    detail = parser.add_argument_group(
        "level of detail", "A hierarchy has fewer, larger splats for blurred and tiny things. One sharp\n"
        "picture of up to 10 million points takes less time without it, and has one only if\n"
        "an option needs it, such as --lod-error or --hierarchy.")
    detail.add_argument("--lod-error", type=not_negative, metavar="E",
                        help="error of the level of detail: smaller is more accurate and slower "
                             "(default: 1)")
    detail.add_argument("--no-lod", action="store_true",
                        help="draw every surfel, without a hierarchy")


def add_other_outputs(parser):
    """What surfelsplat render writes beside its picture."""
    outputs = parser.add_argument_group("other outputs")
    outputs.add_argument("--save-camera", metavar="OUT.json",
                         help="also write camera, lens and size; --camera OUT.json makes the same "
                              "picture again")
    outputs.add_argument("--hierarchy", metavar="OUT.surfels",
                         help="also write the hierarchy; a later run can take it as CLOUD and skip "
                              "the estimation. A .surfels file opens at once, however large it "
                              "is; OUT.vtp is for captures and other programs")
    outputs.add_argument("--surfels", metavar="OUT.vtp", help="also write the surfels")
    outputs.add_argument("--stats", metavar="OUT.json", help="write counts and times")


def add_run_options(parser):
    run = parser.add_argument_group("run")
    run.add_argument("-v", "--verbose", action="store_true",
                     help="print what is read, what is seen, what is in focus, and messages")
    run.add_argument("--threads", type=count, metavar="N",
                     help="number of threads (default: all cores)")
    run.add_argument("--points-per-part", type=between(1000, 1 << 30, count),
                     default=HUGE, metavar="N",
                     help="process larger clouds in parts of N points, to save memory: it takes "
                          "70 bytes for each point, up to 140 while they are cleaned, and 320 for "
                          "each point of one part. Surfels are then two-sided unless normals "
                          "or scanners are known (default: 10 million)")


# Of each of these at most one can be given.
EXCLUSIVE = (("--view", "--position"), ("--up", "--view-up"), ("--view-angle", "--focal-length"),
             ("--focus-pixel", "--focus-point", "--focal-distance"),
             ("--focal-disk", "--circle-of-confusion", "--f-number", "--blur"),
             ("--no-lod", "--lod-error"))


def check_options(arguments):
    """Raises UserProblem about options of the groups above that contradict each other."""
    for names in EXCLUSIVE:
        refuse_together(*((name, name in arguments.given) for name in names))
    limits = arguments.range
    if limits and limits[0] == limits[1]:
        raise UserProblem(f"--range is from {limits[0]:g} to {limits[1]:g}; give two numbers that "
                          "differ")
    check_size(arguments.size)
