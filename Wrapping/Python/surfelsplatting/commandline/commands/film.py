# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat film: its options."""

import os

from ...problems import UserProblem
from ..arguments import between, checked, count, number, refuse_together
from ..options import (add_camera_options, add_clouds, add_detail_options, add_lens_options,
                       add_look_options, add_run_options, check_options, name_output)

DESCRIPTION = """\
Makes a film of a point cloud: the camera goes around it, the focus moves through it, or the camera
goes from view to view.

OUT.mp4 and OUT.gif need ffmpeg. Any other OUT is a folder, which gets the pictures 0000.png, 0001.png
and so on, and which must not hold those of another film. Ctrl-C keeps the pictures that are done; the
same command with --resume then makes the others. The pictures of a film in one file are in
the folder OUT.frames until it is complete.

CLOUD, camera, lens and look are as in surfelsplat render. Around a cloud the camera stays at a
distance from which most of it is seen all the time, unless --camera, --position or --focal-point
place it.
"""

EXAMPLES = """\
examples:
  surfelsplat film lion.ply
  surfelsplat film lion.ply -o lion.mp4 --focus-pull --size 1280 720
  surfelsplat film lion.ply -o lion.gif --frames 60 --rate 15 --size 400 300
  surfelsplat film kinect.pcd -o frames --circle-of-confusion 12
  surfelsplat film hall.e57 -o hall.mp4 --through door.json window.json --frames 300
"""

FIRST = ("--output", "--turn", "--focus-pull", "--through", "--frames", "--size", "--elevation",
         "--blur", "--focus-pixel", "--scalars")

# Nobody gives a folder such a name.
NO_FOLDERS = (".avi", ".exr", ".jpeg", ".jpg", ".m4v", ".mkv", ".mov", ".mpeg", ".mpg",
              ".ogv", ".ply", ".png", ".tif", ".tiff", ".webm", ".webp", ".wmv")
LARGEST_FILM = 1_000_000  # frames

# What a motion decides itself.
PLACING = ("--camera", "--position", "--focal-point", "--view-up", "--view-angle",
           "--focal-length", "--view", "--azimuth", "--elevation", "--roll", "--zoom", "--up")
FOCUSING = ("--focal-distance", "--focus-point", "--focus-pixel")

_distance = checked(number, lambda value: value > 0, "is not above 0")


def _add_motion_options(parser):
    group = parser.add_argument_group(
        "motion", "Without any of these: --turn 360, or --turn 40 around a depth image, which looks\n"
        "like nothing from behind.")
    motion = group.add_mutually_exclusive_group()
    motion.add_argument("--turn", type=between(-36000, 36000), metavar="DEGREES",
                        help="move the camera around the cloud, counterclockwise seen from above; "
                             "an angle below 360 is that of a swing to both sides, in all")
    motion.add_argument("--focus-pull", nargs="*", type=_distance, metavar=("NEAR", "FAR"),
                        help="move the focus from one distance to the other, along the view "
                             "direction, while the camera stands still; default: from the nearest "
                             "surface to the farthest. If no lens is given, one that shows it is "
                             "chosen")
    motion.add_argument("--through", nargs="+", metavar="FILE.json[:VIEW]",
                        help="move the camera through these views; a FILE.json with several views "
                             "means all of them, in their order")
    group.add_argument("--frames", type=between(1, LARGEST_FILM, count), default=240, metavar="N",
                       help="number of pictures (default: 240)")
    group.add_argument("--rate", type=between(1, 1000), default=30.0, metavar="R",
                       help="pictures per second of the film (default: 30)")


def add_parser(commands):
    """Adds the command and its options."""
    film = commands.add_parser("film", help="make a film: a turntable, a focus pull or a path",
                               usage="surfelsplat film CLOUD ... [-o OUT] [options]",
                               description=DESCRIPTION, epilog=EXAMPLES, first=FIRST)
    add_clouds(film)
    film.add_argument("-o", "--output", metavar="OUT", help="OUT.mp4, OUT.gif or a folder (default: of scan.ply, "
                      "scan.ply.mp4 in the current folder)")
    film.add_argument("--resume", action="store_true",
                      help="keep the pictures that an earlier run of the same command has made")
    _add_motion_options(film)
    add_camera_options(film)
    add_lens_options(film)
    add_look_options(film)
    add_detail_options(film)
    add_run_options(film)
    film.set_defaults(check=check, run=run)


def _check_motion(arguments):
    pull = arguments.focus_pull
    if pull is not None and len(pull) not in (0, 2):
        raise UserProblem(f"--focus-pull takes no distance or two, not {len(pull)}")
    refuse_together(("--focus-pull", pull is not None), ("--blur 0", arguments.blur == 0))
    for options, others in (("--through", PLACING), ("--focus-pull", FOCUSING)):
        for other in others:
            refuse_together(*((name, name in arguments.given) for name in (options, other)))


def check(arguments):
    """Raises UserProblem about options that cannot be combined."""
    check_options(arguments)
    _check_motion(arguments)
    name_output(arguments, ".mp4")
    extension = os.path.splitext(arguments.output)[1].lower()
    if extension in NO_FOLDERS and not os.path.isdir(arguments.output):
        raise UserProblem(f"{arguments.output}: {extension!r} is no film that can be written; give "
                          "OUT.mp4, OUT.gif, or a folder for numbered .png files")


def run(arguments):
    from ..film import film

    film(arguments)
