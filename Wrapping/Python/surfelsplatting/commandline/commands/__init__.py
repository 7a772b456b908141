# SPDX-License-Identifier: BSD-3-Clause
"""The commands of surfelsplat.

Each is a module with add_parser(commands), which sets the defaults check (raises UserProblem about
options that cannot be combined) and run. What a command has no option for is as render has it by
default. Only run imports what does the work: --help and completion take 55 ms less.
"""

import difflib
import os
import re

from ...version import __version__
from ..arguments import Parser, split_numbers
from ..completion import complete
from ..options import note_clouds
from . import film, info, render, view, web

COMMANDS = (view, web, render, film, info)

# What other programs call an option.
OTHER_WORDS = {**dict.fromkeys(("dof", "bokeh", "depth-of-field", "pinhole"), "blur"), "coc": "circle-of-confusion",
               **dict.fromkeys(("aperture", "fstop", "f-stop"), "f-number"), "focus": "focus-pixel",
               **dict.fromkeys(("width", "height", "resolution"), "size"), "fov": "view-angle",
               **dict.fromkeys(("color-by", "color", "colour"), "scalars"), "bg": "background",
               **dict.fromkeys(("cmap", "colourmap"), "colormap"), "clim": "range",
               **dict.fromkeys(("subsample", "stride", "skip"), "every"),
               **dict.fromkeys(("fps", "framerate", "frame-rate"), "rate"),
               **dict.fromkeys(("duration", "seconds", "length"), "frames"),
               **dict.fromkeys(("orbit", "turntable"), "turn")}


def _refuse(unknown, command):
    """Raises UserProblem about arguments that a command does not have."""
    options = {option.lstrip("-"): option for action in command._actions
               for option in action.option_strings}
    word = unknown[0].split("=")[0].lstrip("-")
    meant = ([name for name in options if name == OTHER_WORDS.get(word)]
             or [name for name in options if len(word) > 2 and name.startswith(word)]
             or difflib.get_close_matches(word, options, 1, 0.7))
    hint = f"; did you mean {options[meant[0]]}?" if meant else ""
    command.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")


def _check_command(word, parser, names):
    """A file or a wrong word in place of the command."""
    if word.startswith("-") or word in names:
        return
    similar = difflib.get_close_matches(word, names, 1)
    hint = f"give one of {', '.join(names)}"
    if os.path.exists(word):
        hint += f" first, for example surfelsplat view {word}"
    elif similar:
        hint = f"did you mean {similar[0]}?"
    parser.error(f"{word!r} is no command; {hint}")


def _with_hyphens(words):
    """The words, of which office programs may have made an option's hyphens a dash."""
    dash = re.compile("[\u2013\u2014][-\u2013\u2014]*")
    return [dash.sub("--", word, 1) if dash.match(word) and not os.path.exists(word) else word for word in words]


def parse_arguments(words):
    """-> the arguments, with run(arguments); or UserProblem."""
    parser = Parser(prog="surfelsplat", description="Draws point clouds with depth of field.",
                    epilog="For example, surfelsplat view scan.ply shows a scan.\n"
                           "surfelsplat COMMAND --help shows the options of a command that are needed first.")
    parser.add_argument("--version", action="version", version=f"surfelsplat {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True,
                                     parser_class=Parser)
    words = list(split_numbers(_with_hyphens(words)))
    if words[:1] == ["help"]:  # as in other programs
        words = [*words[1:], "--help"]
    named = {command for command in COMMANDS if command.__name__.split(".")[-1] in words[:1]}
    for command in {render, *named} if named else COMMANDS:  # the options of all take 3 ms more
        command.add_parser(commands)
    complete(parser)
    if not words:
        parser.exit(2, parser.format_help())
    _check_command(words[0], parser, list(commands.choices))
    arguments, unknown = parser.parse_known_args(words, parser.parse_args(["render", "CLOUD"]))
    if unknown and all(map(os.path.exists, unknown)):  # files behind options, too
        note_clouds(arguments, arguments.clouds + unknown)
    elif unknown:
        _refuse(unknown, commands.choices[arguments.command])
    # The options on the command line, whether or not they have their default values.
    arguments.given = sorted({word.split("=")[0] for word in words if word.startswith("-")})
    arguments.check(arguments)
    return arguments
