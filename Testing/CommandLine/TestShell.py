# SPDX-License-Identifier: BSD-3-Clause
"""Help, completion in a shell, and the manual pages."""

import functools
import importlib.util
import os
import re
import shutil
import subprocess
import unittest

from surfelsplatting.commandline.commands import COMMANDS
from surfelsplatting.commandline.options import AXES
from toolcase import TOOL, ToolCase

MANUAL = os.environ.get("SURFELSPLAT_MANUAL", "")
NAMES = [command.__name__.rsplit(".", 1)[-1] for command in COMMANDS]


FEW = 50  # lines that are read without scrolling


@functools.lru_cache(None)
def printed(*words):
    result = subprocess.run([TOOL, *words], capture_output=True, text=True, check=True,
                            env=dict(os.environ, COLUMNS="100"))
    return result.stdout


def described_in(text):
    """The options that a help describes, in their order."""
    return re.findall(r"^  (?:-\w, |-\w \S+, )?(--[\w-]+)", text, re.MULTILINE)


def options_of(command):
    """All options of a command."""
    return set(described_in(printed(command, "--help", "all")))


class TestHelp(unittest.TestCase):
    def test_first_options_fit_a_screen(self):
        for command in set(NAMES) - {"info"}:  # which has few
            text = printed(command, "--help")
            self.assertLessEqual(len(text.splitlines()), FEW, command)
            self.assertLess(set(described_in(text)), options_of(command))
            count = len(options_of(command))
            self.assertIn(f"surfelsplat {command} --help all shows all of the {count} options", text)

    def test_render_begins_with_what_is_needed_first(self):
        first = described_in(printed("render", "-h"))
        self.assertEqual(len(first), 10)
        self.assertEqual((first[0], first[-1]), ("--output", "--background"))

    def test_all_options(self):
        text = printed("render", "--help", "all")
        for part in ("--points-per-part", "--deep", "OUT.exr holds RGBA floats"):
            self.assertIn(part, text)
            self.assertNotIn(part, printed("render", "--help"))
        self.assertEqual(printed("render", "--help=all"), text)
        self.assertEqual(printed("info", "--help", "all"), printed("info", "--help"))

    def test_word_help(self):
        self.assertEqual(printed("help", "film"), printed("film", "--help"))
        self.assertEqual(printed("help"), printed("--help"))


@unittest.skipUnless(importlib.util.find_spec("argcomplete"), "there is no argcomplete")
class TestCompletion(ToolCase):
    def offered(self, line):
        """What bash is offered for the last word of the line, by argcomplete's protocol: on file
        descriptor 8."""
        environment = dict(os.environ, _ARGCOMPLETE="1", COMP_LINE=line, COMP_POINT=str(len(line)),
                           COMP_TYPE="9", _ARGCOMPLETE_IFS="\n", _ARGCOMPLETE_COMP_WORDBREAKS=" ")
        result = subprocess.run(["bash", "-c", '"$0" 8>&1 9>/dev/null 1>/dev/null', TOOL],
                                env=environment, capture_output=True, text=True, timeout=60,
                                check=False)
        self.assertNotIn("Traceback", result.stderr)
        return {word.strip() for word in result.stdout.split("\n") if word.strip()}

    def test_commands_and_options(self):
        self.assertLessEqual(set(NAMES), self.offered("surfelsplat "))
        for command in NAMES:
            self.assertEqual(self.offered(f"surfelsplat {command} --"), options_of(command))

    def test_values(self):
        self.assertEqual(self.offered("surfelsplat render --view "),
                         {"front", "back", "left", "right", "top", "bottom", "iso"})
        self.assertLessEqual({axis for axis in AXES if axis[0] != "-"} | {"auto"},
                             self.offered("surfelsplat render --up "))

    def test_files(self):
        for name in ("lion.ply", "lion.json"):
            with open(name, "w"):
                pass
        self.assertEqual(self.offered("surfelsplat render li"), {"lion.ply", "lion.json"})
        self.assertEqual(self.offered("surfelsplat render --camera lion.j"), {"lion.json"})
        self.assertEqual(self.offered("surfelsplat render --blur li"), set())


@unittest.skipUnless(os.path.isdir(MANUAL) and shutil.which("man"), "there are no manual pages")
class TestManual(unittest.TestCase):
    def page(self, name):
        result = subprocess.run(["man", "-l", "--warnings", os.path.join(MANUAL, name + ".1")],
                                capture_output=True, text=True, check=True,
                                env=dict(os.environ, MANWIDTH="200", MAN_KEEP_FORMATTING="",
                                         LC_ALL="C.UTF-8"))
        self.assertEqual(result.stderr, "")
        return result.stdout

    def test_pages(self):
        overview = self.page("surfelsplat")
        for command in NAMES:
            self.assertRegex(overview, rf"(?m)^ +{command} +\S")
            self.assertIn(f"surfelsplat-{command}(1)", overview)
            page = self.page(f"surfelsplat-{command}")
            self.assertRegex(page, rf"NAME\n +surfelsplat-{command} - \S")
            self.assertRegex(page, rf"SYNOPSIS\n +surfelsplat {command} ")
            shown = set(re.findall(r"^ +(?:-\w, |-\w \S+, )?(--[\w-]+)", page, re.MULTILINE))
            self.assertLessEqual(options_of(command), shown)
            self.assertNotIn(os.path.dirname(TOOL), page)


if __name__ == "__main__":
    unittest.main()
