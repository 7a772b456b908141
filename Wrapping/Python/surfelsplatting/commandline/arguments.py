# SPDX-License-Identifier: BSD-3-Clause
"""The options of surfelsplat, and what their values must be."""

import argparse
import math
import re

from .problems import UserProblem

LARGEST_SIDE = 65536  # px, vtkSurfelImageRenderer's
LARGEST_LENS_PARTS = 65536  # vtkSurfelSplatter's
LARGEST_PART = 10_000_000  # points; 4.5 GB
LARGEST_PICTURE = 1 << 28  # px; 4 GiB of float RGBA

DESCRIPTION = """\
Renders a point cloud as a surface, with depth of field where a lens is given.

CLOUD is a .ply, .pcd, .xyz, .txt or .vtp file. Colours, alpha and normals in it are used. Text
files have columns x y z, then intensity, r g b, or normals. A .vtp that holds surfels or their
hierarchy already (see --surfels and --hierarchy) is drawn as it is.

OUT.exr holds RGBA floats, premultiplied, alpha = coverage, and Z, the distance along the view
direction. OUT.png holds 8 bits, 255 times the float's value, over the background. Colours are mixed
as they are; --linear-light mixes the light that they stand for.
"""

CHANNELS = ("normal", "coc", "coverage", "fragments", "level")

EXAMPLES = """\
examples:
  surfelsplat render bunny.ply -o bunny.png
  surfelsplat render bunny.ply --circle-of-confusion 12 -o bunny.png
  surfelsplat render scene.ply --camera scene.json:coc12 --unlit -o scene.exr
  surfelsplat render scene.ply --circle-of-confusion 12 --lens-cells 7 --deep -o deep.exr
  surfelsplat render scene.ply --circle-of-confusion 12 --channels normal,coc -o channels.exr
"""


class _Parser(argparse.ArgumentParser):
    def __init__(self, *args, **kwargs):
        super().__init__(*args, allow_abbrev=False, **kwargs)
        # argparse takes -1e-3 for an option.
        self._negative_number_matcher = re.compile(r"^-(\d|\.\d|inf|nan)", re.IGNORECASE)

    def error(self, message):
        raise UserProblem(message + " (surfelsplat render --help lists the options)")


def _number(text):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def _channels(text):
    names = text.split(",")
    unknown = [name for name in names if name not in (*CHANNELS, "all")]
    if unknown:
        raise argparse.ArgumentTypeError(
            f"{unknown[0]!r} is none of {', '.join(CHANNELS)}, all")
    return CHANNELS if "all" in names else tuple(names)


def _not_negative(text):
    value = _number(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value


def _cutoff(text):
    value = _number(text)
    if not 1 <= value <= 20:
        raise argparse.ArgumentTypeError(f"{text} is not between 1 and 20")
    return value


def _fraction(text):
    value = _number(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def _angle(text):
    value = _number(text)
    if not 0 < value < 180:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 180 degrees")
    return value


def _count(text):
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1 on")
    return value


def _part_size(text):
    value = _count(text)
    if not 1000 <= value <= 1 << 30:
        raise argparse.ArgumentTypeError(f"{text} is not between 1000 and {1 << 30}")
    return value


def _lens_parts(text):
    value = _count(text)
    if value > LARGEST_LENS_PARTS:
        raise argparse.ArgumentTypeError(f"{text} is more than {LARGEST_LENS_PARTS}")
    return value


def _neighbors(text):
    value = _count(text)
    if not 4 <= value <= 256:
        raise argparse.ArgumentTypeError(f"{text} is not between 4 and 256")
    return value


def _add_camera_options(parser):
    camera = parser.add_argument_group(
        "camera", "Each of these overrides what --camera says. Without any of them: a "
        "three-quarter view that fits the cloud.")
    camera.add_argument("--camera", metavar="FILE.json[:VIEW]",
                        help="a view of this file (the first one where VIEW is left out)")
    triple = dict(nargs=3, type=_number, metavar=("X", "Y", "Z"))
    camera.add_argument("--position", help="where the lens stands", **triple)
    camera.add_argument("--focal-point", help="what it looks at", **triple)
    camera.add_argument("--view-up", help="what is up", **triple)
    camera.add_argument("--view-angle", type=_angle, metavar="A", help="vertical, in degrees")
    camera.add_argument("--size", nargs=2, type=_count, metavar=("W", "H"),
                        help="of the picture in pixels (default: the view's, else 800 600)")


def _add_lens_options(parser):
    lens = parser.add_argument_group(
        "lens", "Everything is sharp unless --camera or one of these gives a lens.")
    lens.add_argument("--focal-disk", type=_not_negative, metavar="D",
                      help="diameter of the lens in world units, 0 = pinhole")
    lens.add_argument("--focal-distance", type=_not_negative, metavar="F",
                      help="distance in focus along the view direction (default: 0, the distance "
                           "to the focal point; without a camera, the surface in the middle)")
    lens.add_argument("--circle-of-confusion", type=_not_negative, metavar="PX",
                      help="instead of --focal-disk: the lens that blurs a point at infinity to "
                           "a disc of this radius in pixels")
    lens.add_argument("--pinhole", action="store_true", help="no lens, whatever the camera says")
    lens.add_argument("--lens-sectors", action="store_true",
                      help="tell apart what covers which side of the lens: more accurate where "
                           "blurred things cover one another, up to three times slower")
    parts = lens.add_mutually_exclusive_group()
    parts.add_argument("--lens-cells", type=_lens_parts, default=1, metavar="K",
                       help="see through K smaller lenses and take the mean: more accurate where "
                            "things cover one another, K times slower; 7 is a good step "
                            "(default: 1)")
    parts.add_argument("--reference", type=_lens_parts, metavar="N",
                       help="see through N pinholes all over the lens instead: exact when N is "
                            "large, some hundreds")


def _add_look_options(parser):
    look = parser.add_argument_group("look")
    look.add_argument("--unlit", action="store_true",
                      help="colours as they are (default: a light at the camera)")
    look.add_argument("--linear-light", action="store_true",
                      help="mix light instead of colours, which are taken for sRGB: OUT.exr is "
                           "linear light, OUT.png shows sRGB again (default: colours as they are)")
    look.add_argument("--background", nargs=3, type=_fraction, metavar=("R", "G", "B"),
                      help="0 to 1; makes the picture opaque (default: none in .exr; in .png "
                           "0.16 0.17 0.19, or black with --unlit)")
    look.add_argument("--neighbors", type=_neighbors, metavar="K",
                      help="points that a normal is estimated from, 4 to 256; more for noisy scans "
                           "(default: 16, or 30 for depth images)")
    look.add_argument("--kernel", choices=("pearson", "gaussian"), default="pearson",
                      help="of blurred splats: near a lens's disc, or the paper's Gaussian "
                           "(default: pearson)")
    look.add_argument("--cutoff", type=_cutoff, metavar="C",
                      help="where a splat ends: exponent of its Gaussian, 1 to 20 (default: 2.5)")


def _add_detail_options(parser):
    detail = parser.add_argument_group(
        "detail", "Blurred and tiny things are drawn by fewer, larger splats.")
    detail.add_argument("--lod", choices=("moments", "paper"), default="moments",
                        help="how splats stand for several surfels: by their moments and colour "
                             "gradients, or as in Krivanek et al. 2003 (default: moments)")
    detail.add_argument("--lod-error", type=_not_negative, metavar="E",
                        help="how coarse: less is more accurate and slower (default: 1)")
    detail.add_argument("--no-lod", action="store_true",
                        help="every surfel on its own, without a hierarchy")
    detail.add_argument("--color-by", choices=("level",), metavar="level",
                        help="splats in the colour of their level: surfels white, then blue, "
                             "green, yellow, orange, red, violet, brown for 2, 4, 8, .. of them")
    detail.add_argument("--hierarchy", metavar="OUT.vtp",
                        help="also write the hierarchy; a CLOUD of its own, drawn without "
                             "estimating again")


def _add_run_options(parser):
    run = parser.add_argument_group("run")
    run.add_argument("--surfels", metavar="OUT.vtp", help="also write the surfels")
    run.add_argument("--points-per-part", type=_part_size, default=LARGEST_PART, metavar="N",
                     help="clouds of more points are made surfels of part by part, which takes "
                          "70 bytes a point and 320 for each of a part; where no normals are "
                          "given the surfels then are two-sided (default: 10 million)")
    run.add_argument("--threads", type=_count, metavar="N", help="default: all cores")
    run.add_argument("--repeat", type=_count, default=1, metavar="N",
                     help="render N times (for --stats)")
    run.add_argument("--stats", metavar="FILE.json",
                     help="write counts and times: medians over the frames after the first one")
    run.add_argument("-v", "--verbose", action="store_true", help="say what is done")


def _build_parser():
    from ..version import __version__

    parser = _Parser(prog="surfelsplat", description="Depth-of-field splatting of point clouds.",
                     epilog="surfelsplat render --help lists the options.")
    parser.add_argument("--version", action="version", version=f"surfelsplat {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True,
                                     parser_class=_Parser)
    render = commands.add_parser("render", help="render a point cloud to .png or .exr",
                                 formatter_class=argparse.RawDescriptionHelpFormatter,
                                 description=DESCRIPTION, epilog=EXAMPLES)
    render.add_argument("cloud", metavar="CLOUD", help="the point cloud")
    render.add_argument("-o", "--output", required=True, metavar="OUT", help="OUT.png or OUT.exr")
    render.add_argument("--deep", action="store_true",
                        help="OUT.exr keeps the layers: deep scan lines, R, G, B, A and Z of each "
                             "sample, nearest first, without background")
    render.add_argument("--channels", type=_channels, metavar="NAME,...",
                        help="OUT.exr has these besides R, G, B, A and Z: normal (N.X, N.Y, N.Z, in "
                             "the world), coc (CoC, px, negative before the focus), coverage, "
                             "fragments, level (of the hierarchy); or all of them: all")
    _add_camera_options(render)
    _add_lens_options(render)
    _add_look_options(render)
    _add_detail_options(render)
    _add_run_options(render)
    return parser


def _check(arguments):
    lenses = [name for name, given in (
        ("--pinhole", arguments.pinhole),
        ("--focal-disk", arguments.focal_disk is not None),
        ("--circle-of-confusion", arguments.circle_of_confusion is not None)) if given]
    if len(lenses) > 1:
        raise UserProblem(f"{' and '.join(lenses)} exclude each other: give one of them")
    if arguments.no_lod and (arguments.lod_error is not None or arguments.hierarchy):
        other = "--hierarchy" if arguments.hierarchy else "--lod-error"
        raise UserProblem(f"--no-lod and {other} exclude each other: give one of them")
    if arguments.deep and not arguments.output.lower().endswith(".exr"):
        raise UserProblem(f"--deep needs an OUT.exr, not {arguments.output}")
    if arguments.channels and not arguments.output.lower().endswith(".exr"):
        raise UserProblem(f"--channels needs an OUT.exr, not {arguments.output}")
    for option, given in (("--channels", arguments.channels),
                          ("--background", arguments.background)):
        if arguments.deep and given:
            raise UserProblem(f"--deep and {option} exclude each other: give one of them")
    check_size(arguments.size)


def check_size(size):
    if size and (max(size) > LARGEST_SIDE or size[0] * size[1] > LARGEST_PICTURE):
        raise UserProblem(f"the picture's size {size[0]} x {size[1]} is too large; at most "
                          f"{LARGEST_SIDE} pixels a side and {LARGEST_PICTURE} in all")


def parse_arguments(words):
    arguments = _build_parser().parse_args(words)
    _check(arguments)
    return arguments
