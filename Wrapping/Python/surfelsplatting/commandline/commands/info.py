# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat info: its options."""

from ..options import add_clouds, add_run_options

DESCRIPTION = """\
Says what is in a point cloud: how many points and where, what the columns or arrays of the file
were taken for, how noisy it is, and which options suit it.
"""

EXAMPLES = """\
examples:
  surfelsplat info lion.ply
  surfelsplat info survey.csv --json > survey.json
"""


def add_parser(commands):
    """Adds the command and its options."""
    info = commands.add_parser("info", help="say what is in a point cloud",
                               usage="surfelsplat info CLOUD ... [options]",
                               description=DESCRIPTION, epilog=EXAMPLES)
    add_clouds(info)
    info.add_argument("--json", action="store_true", help="print the same as JSON")
    add_run_options(info)
    # The cleaning is done apart from the rest, to see what it does.
    info.set_defaults(check=lambda arguments: None, run=run, cleaning="off", no_lod=True)


def run(arguments):
    from ..info import info

    info(arguments)
