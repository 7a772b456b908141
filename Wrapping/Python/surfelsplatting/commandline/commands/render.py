# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat render: its options."""

import argparse

from ...problems import UserProblem
from ..arguments import PICTURES, refuse_together
from ..options import (add_camera_options, add_clouds, add_detail_options, add_lens_options,
                       add_look_options, add_other_outputs, add_run_options, check_options,
                       name_output)

DESCRIPTION = """\
Renders a point cloud as a surface, with depth of field if a lens is given.

CLOUD is one of these; surfelsplat info tells what is in it:
  points     .ply .pcd .las .laz .e57 .ptx .csv .tsv .xyz .xyzn .xyzrgb .txt .asc .pts .npy .bin .vtp
             .vtu .vtk, with their colours, alpha and normals; meshes, by their vertices or by points
             on their faces: .obj .stl .off .gltf .glb, and .ply .vtp .vtk with faces
  captures   of 3D Gaussian splatting: .ply .spz .sog .splat, and folders with the meta.json of .sog
  volumes    .vti .vtk .mhd .mha .nrrd .nhdr
  surfels    that --hierarchy or --surfels has written: .surfels .vtp
"""

# Names of vtkSurfelSplatter's CHANNEL_...
CHANNELS = {"normal": "NORMAL", "coc": "CIRCLE_OF_CONFUSION", "coverage": "COVERAGE",
            "fragments": "FRAGMENTS", "level": "LEVEL"}

EXAMPLES = """\
examples:
  surfelsplat render bunny.ply
                        the whole cloud, all of it sharp: bunny.ply.png
  surfelsplat render tiles/*.laz -o hills.png
                        all tiles of a survey as one cloud
  surfelsplat render bunny.ply -o bunny.png --view left --blur 20 --focus-pixel 310 240
                        from the left, sharp at a pixel of the picture before
  surfelsplat render bunny.ply -o bunny.png --blur 20 --save-camera bunny.json
                        keeps the view, and so
  surfelsplat render bunny.ply -o large.png --camera bunny.json --size 3200 2400
                        makes the same picture, larger
  surfelsplat render hills.las -o hills.png --scalars z --elevation 20
                        coloured by height, from above
"""

MORE = """\
  surfelsplat render head.vti -o head.png --opacity 300:0,600:0.1 --shade
                        a volume, of which scalars from 300 upwards are seen, lit
  surfelsplat render scene.ply -o deep.exr --blur 12 --lens-cells 7 --deep
                        all layers, for compositing

OUT.exr holds RGBA floats, premultiplied, alpha = coverage, and Z, the distance along the view
direction. OUT.png and OUT.jpg hold 8 bits, 255 times the float values, over the background. Colours
are mixed as they are stored; with --linear-light they are converted from sRGB to linear light first.
"""

FIRST = ("--output", "--size", "--view", "--azimuth", "--elevation", "--zoom", "--blur",
         "--focus-pixel", "--scalars", "--background")


def _channels(text):
    """Values of CHANNELS."""
    names = text.split(",")
    unknown = [name for name in names if name not in (*CHANNELS, "all")]
    if unknown:
        raise argparse.ArgumentTypeError(
            f"{unknown[0]!r} is unknown; choose from {', '.join(CHANNELS)}, all")
    return tuple(CHANNELS[name] for name in (CHANNELS if "all" in names else names))


def add_parser(commands):
    """Adds the command and its options."""
    render = commands.add_parser("render", help="render a point cloud to .png, .jpg or .exr",
                                 usage="surfelsplat render CLOUD ... [-o OUT] [options]",
                                 description=DESCRIPTION, epilog=EXAMPLES, more=MORE, first=FIRST)
    add_clouds(render)
    render.add_argument("-o", "--output", metavar="OUT",
                        help="OUT.png, OUT.jpg or OUT.exr (default: of scan.ply, scan.ply.png in the current "
                             "folder)")
    render.add_argument("--transparent", action="store_true",
                        help="write OUT.png without background, with an alpha channel; .exr files "
                             "have one in any case")
    render.add_argument("--deep", action="store_true",
                        help="write the layers to OUT.exr: deep scan lines with R, G, B, A and Z "
                             "of each sample, of volumes also ZBack, nearest first, without "
                             "background")
    render.add_argument("--channels", type=_channels, metavar="NAME,...",
                        help="also write these channels to OUT.exr: normal (N.X, N.Y, N.Z, world "
                             "axes), coc (CoC, px, negative in front of the focus), coverage, "
                             "fragments, level (of the hierarchy); or all of them: all")
    add_camera_options(render)
    add_lens_options(render)
    add_look_options(render)
    add_detail_options(render)
    add_other_outputs(render)
    add_run_options(render)
    render.set_defaults(check=check, run=run)


def _check_pictures(arguments):
    pictures = [path for path in arguments.clouds if path.lower().endswith(PICTURES)]
    if pictures:
        raise UserProblem(f"{pictures[0]} is a picture, not a cloud; to write it, give -o "
                          f"{pictures[0]}")


def check(arguments):
    """Raises UserProblem about options that cannot be combined."""
    check_options(arguments)
    _check_pictures(arguments)
    name_output(arguments, ".exr" if arguments.deep or arguments.channels else ".png")
    refuse_together(("--no-lod", arguments.no_lod), ("--hierarchy", arguments.hierarchy))
    for option, is_given in (("--deep", arguments.deep), ("--channels", arguments.channels)):
        if is_given and not arguments.output.lower().endswith(".exr"):
            raise UserProblem(f"{option} needs an OUT.exr, not {arguments.output}")
    if arguments.transparent and not arguments.output.lower().endswith(".png"):
        raise UserProblem(f"--transparent needs an OUT.png, not {arguments.output}")
    refuse_together(("--transparent", arguments.transparent), ("--background", arguments.background))
    for option, is_given in (("--channels", arguments.channels),
                             ("--background", arguments.background)):
        refuse_together(("--deep", arguments.deep), (option, is_given))


def run(arguments):
    from ..render import render

    render(arguments)
