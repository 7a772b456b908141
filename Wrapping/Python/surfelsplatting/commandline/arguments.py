# SPDX-License-Identifier: BSD-3-Clause
"""The options of surfelsplat and the checks of their values."""

import argparse
import math
import re

from .problems import UserProblem

LARGEST_SIDE = 65536  # px, vtkSurfelImageRenderer's
LARGEST_LENS_PARTS = 65536  # vtkSurfelSplatter's
LARGEST_PART = 10_000_000  # points; 3.2 GB while a part is processed
LARGEST_PICTURE = 1 << 28  # px; 4 GiB of float RGBA

DESCRIPTION = """\
Renders a point cloud as a surface, with depth of field if a lens is given.

CLOUD is a .ply, .pcd, .xyz, .txt or .vtp file; with the Python packages laspy or pye57 also a .las,
.laz or .e57 file. Its colours, alpha and normals are used. Text files have columns x y z, then
intensity, r g b, or normals. A .vtp file that already holds surfels or a hierarchy (see --surfels
and --hierarchy) is rendered directly.

OUT.exr holds RGBA floats, premultiplied, alpha = coverage, and Z, the distance along the view
direction. OUT.png holds 8 bits, 255 times the float values, over the background. Colours are mixed
as they are stored; with --linear-light they are converted from sRGB to linear light first.
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
        # Without this argparse takes -1e-3 for an option.
        self._negative_number_matcher = re.compile(r"^-(\d|\.\d|inf|nan)", re.IGNORECASE)

    def _get_nargs_pattern(self, action):
        # Since Python 3.13 argparse takes options ("O") for numbers that are missing.
        return super()._get_nargs_pattern(action).replace("[AO]{", "A{")

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
            f"{unknown[0]!r} is unknown; choose from {', '.join(CHANNELS)}, all")
    return CHANNELS if "all" in names else tuple(names)


def _count(text):
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return value


def _checked(convert, is_valid, problem):
    """An argument type: convert, with an error that names the problem unless is_valid."""
    def check(text):
        value = convert(text)
        if not is_valid(value):
            raise argparse.ArgumentTypeError(f"{text} {problem}")
        return value

    return check


def _between(low, high, convert=_number):
    return _checked(convert, lambda value: low <= value <= high,
                    f"is not between {low} and {high}")


_not_negative = _checked(_number, lambda value: value >= 0, "is negative")
_angle = _checked(_number, lambda value: 0 < value < 180, "is not between 0 and 180 degrees")
_lens_parts = _checked(_count, lambda value: value <= LARGEST_LENS_PARTS,
                       f"is more than {LARGEST_LENS_PARTS}")


def _add_camera_options(parser):
    camera = parser.add_argument_group(
        "camera", "Each of these overrides the value from --camera. Without any of them, the "
        "camera shows the whole cloud in a three-quarter view.")
    camera.add_argument("--camera", metavar="FILE.json[:VIEW]",
                        help="a view from this file (default VIEW: the first one)")
    triple = dict(nargs=3, type=_number, metavar=("X", "Y", "Z"))
    camera.add_argument("--position", help="position of the camera", **triple)
    camera.add_argument("--focal-point", help="the point that the camera looks at", **triple)
    camera.add_argument("--view-up", help="the direction that is up in the picture", **triple)
    camera.add_argument("--view-angle", type=_angle, metavar="A", help="vertical, in degrees")
    camera.add_argument("--size", nargs=2, type=_count, metavar=("W", "H"),
                        help="of the picture in pixels (default: the view's, or 800 600)")


def _add_lens_options(parser):
    lens = parser.add_argument_group(
        "lens", "Everything is sharp unless --camera or one of these gives a lens.")
    lens.add_argument("--focal-disk", type=_not_negative, metavar="D",
                      help="diameter of the lens in world units, 0 = pinhole")
    lens.add_argument("--focal-distance", type=_not_negative, metavar="F",
                      help="distance in focus along the view direction (default: 0, the distance "
                           "to the focal point; without a camera, the surface in the middle)")
    lens.add_argument("--circle-of-confusion", type=_not_negative, metavar="PX",
                      help="instead of --focal-disk: blur radius of very distant points in "
                           "pixels; it decreases towards the focus")
    lens.add_argument("--pinhole", action="store_true", help="no lens; ignore the camera's lens")
    parts = lens.add_mutually_exclusive_group()
    parts.add_argument("--lens-cells", type=_lens_parts, default=1, metavar="K",
                       help="average the pictures of K smaller lenses: more accurate where things "
                            "overlap, K times slower; try 7 (default: 1)")
    parts.add_argument("--reference", type=_lens_parts, metavar="N",
                       help="average N pinhole pictures from points all over the lens: exact if N "
                            "is large, several hundred")


def _add_look_options(parser):
    look = parser.add_argument_group("look")
    look.add_argument("--unlit", action="store_true",
                      help="show the colours without lighting (default: a light at the camera)")
    look.add_argument("--linear-light", action="store_true",
                      help="convert colours from sRGB to linear light before they are mixed; "
                           "OUT.exr is linear light, OUT.png is sRGB (default: colours are mixed "
                           "as they are stored)")
    look.add_argument("--background", nargs=3, type=_between(0, 1), metavar=("R", "G", "B"),
                      help="0 to 1; makes the picture opaque (default: none in .exr; in .png "
                           "0.16 0.17 0.19, or black with --unlit)")
    look.add_argument("--cleaning", choices=("off", "outliers", "full"), default="full",
                      help="what is done to the points first: outliers removes those that belong "
                           "to no surface, full also smooths noisy surfaces (default: full)")
    look.add_argument("--neighbors", type=_between(4, 256, _count), metavar="K",
                      help="number of points from which a normal is estimated, 4 to 256; more for "
                           "noisy scans (default: 16, or 30 for depth images)")
    look.add_argument("--sides", choices=("auto", "two", "given"), default="auto",
                      help="auto: the normals in the file say which side is outside, or its "
                           "viewpoint does; without them surfaces whose outside is known are "
                           "visible from there only. two: all are visible from both sides. given: "
                           "the normals in the file decide, nothing else (default: auto)")
    look.add_argument("--kernel", choices=("pearson", "gaussian"), default="pearson",
                      help="of splats: pearson is close to the disc of a lens, gaussian "
                           "is the paper's (default: pearson)")
    look.add_argument("--cutoff", type=_between(1, 20), metavar="C",
                      help="exponent at which a splat of the gaussian kernel ends, 1 to 20 "
                           "(default: 2.5)")


def _add_detail_options(parser):
    detail = parser.add_argument_group(
        "detail", "Blurred and tiny things are drawn with fewer, larger splats.")
    detail.add_argument("--lod", choices=("moments", "paper"), default="moments",
                        help="how one splat represents several surfels: by their moments and "
                             "colour gradients, or as in Krivanek et al. 2003 (default: moments)")
    detail.add_argument("--lod-error", type=_not_negative, metavar="E",
                        help="error of the level of detail: smaller is more accurate and slower "
                             "(default: 1)")
    detail.add_argument("--no-lod", action="store_true",
                        help="draw every surfel, without a hierarchy")
    detail.add_argument("--color-by", choices=("level",), metavar="level",
                        help="colour each splat by its level: white for a single surfel, then "
                             "blue, green, yellow, orange, red, violet, brown for 2, 4, 8, ... of "
                             "them")
    detail.add_argument("--hierarchy", metavar="OUT.vtp",
                        help="also write the hierarchy; a later run can use it as CLOUD and skip "
                             "the estimation")


def _add_run_options(parser):
    run = parser.add_argument_group("run")
    run.add_argument("--surfels", metavar="OUT.vtp", help="also write the surfels")
    run.add_argument("--points-per-part", type=_between(1000, 1 << 30, _count),
                     default=LARGEST_PART, metavar="N",
                     help="larger clouds are processed in parts, which takes 70 bytes for each "
                          "point and 320 for each point of one part; surfels without given normals "
                          "are then two-sided (default: 10 million)")
    run.add_argument("--threads", type=_count, metavar="N", help="default: all cores")
    run.add_argument("--repeat", type=_count, default=1, metavar="N",
                     help="render N times (for --stats)")
    run.add_argument("--stats", metavar="FILE.json",
                     help="write counts and times: medians over all frames but the first")
    run.add_argument("-v", "--verbose", action="store_true", help="print messages")


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
                        help="write the layers to OUT.exr: deep scan lines with R, G, B, A and Z "
                             "of each sample, nearest first, without background")
    render.add_argument("--channels", type=_channels, metavar="NAME,...",
                        help="also write these channels to OUT.exr: normal (N.X, N.Y, N.Z, world "
                             "axes), coc (CoC, px, negative in front of the focus), coverage, "
                             "fragments, level (of the hierarchy); or all of them: all")
    _add_camera_options(render)
    _add_lens_options(render)
    _add_look_options(render)
    _add_detail_options(render)
    _add_run_options(render)
    return parser


def _refuse_together(*options):
    """options: (name, whether it is given)."""
    given = [name for name, is_given in options if is_given]
    if len(given) > 1:
        raise UserProblem(f"{' and '.join(given)} cannot be combined; give one of them")


def _check(arguments):
    _refuse_together(("--pinhole", arguments.pinhole),
                     ("--focal-disk", arguments.focal_disk is not None),
                     ("--circle-of-confusion", arguments.circle_of_confusion is not None))
    for option, is_given in (("--hierarchy", arguments.hierarchy),
                             ("--lod-error", arguments.lod_error is not None)):
        _refuse_together(("--no-lod", arguments.no_lod), (option, is_given))
    for option, is_given in (("--deep", arguments.deep), ("--channels", arguments.channels)):
        if is_given and not arguments.output.lower().endswith(".exr"):
            raise UserProblem(f"{option} needs an OUT.exr, not {arguments.output}")
    for option, is_given in (("--channels", arguments.channels),
                             ("--background", arguments.background)):
        _refuse_together(("--deep", arguments.deep), (option, is_given))
    check_size(arguments.size)


def check_size(size):
    if size and (max(size) > LARGEST_SIDE or size[0] * size[1] > LARGEST_PICTURE):
        raise UserProblem(f"the picture's size {size[0]} x {size[1]} is too large; at most "
                          f"{LARGEST_SIDE} pixels per side and {LARGEST_PICTURE} in total")


def parse_arguments(words):
    arguments = _build_parser().parse_args(words)
    _check(arguments)
    return arguments
