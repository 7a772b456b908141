# SPDX-License-Identifier: BSD-3-Clause
"""The parser of surfelsplat's arguments, and the types of their values."""

import argparse
import math
import re
from difflib import get_close_matches

from ..backend import vtk
from ..problems import UserProblem

LARGEST_LENS_PARTS = 65536  # vtkSurfelSplatter's

# The files that pictures are written to, by their extensions.
JPEGS = (".jpg", ".jpeg")
PICTURES = (".png", *JPEGS, ".exr")

# Options with several numbers, which may be one word.
NUMBERS = {"--size": 2, "--focus-pixel": 2, "--range": 2, "--focus-pull": 2, "--position": 3,
           "--focal-point": 3, "--focus-point": 3, "--view-up": 3, "--background": 3}
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?", re.IGNORECASE)
TUPLE = re.compile(rf"{NUMBER.pattern}(?:(?:\s*[,x×*]\s*|\s+){NUMBER.pattern})+", re.IGNORECASE)


class _Help(argparse.Action):
    """--help: the options that are needed first. --help all: all of them."""

    def __init__(self, option_strings, dest):
        super().__init__(option_strings, argparse.SUPPRESS, nargs="?", metavar="all",
                         help="show the options that are needed first, or all")

    def __call__(self, parser, namespace, value, option_string=None):
        print(parser.format_help() if value == "all" else parser.format_first(), end="")
        parser.exit()


class Parser(argparse.ArgumentParser):
    """first: the options that --help shows, in this order; --help all shows all. Without: both do.
    more: text that only --help all shows, at its end.
    """

    def __init__(self, *args, first=(), more="", **kwargs):
        super().__init__(*args, allow_abbrev=False, add_help=not first,
                         formatter_class=argparse.RawDescriptionHelpFormatter, **kwargs)
        self._first, self._more = first, more
        if first:
            self.add_argument("-h", "--help", action=_Help)
        # Without this argparse takes -1e-3 for an option, and -z as well.
        self._negative_number_matcher = re.compile(r"^-(\d|\.\d|inf|nan|[xyz]$)", re.IGNORECASE)

    def _get_nargs_pattern(self, action):
        # Since Python 3.13 argparse takes options ("O") for numbers that are missing.
        return super()._get_nargs_pattern(action).replace("[AO]{", "A{")

    def _get_value(self, action, text):
        value = super()._get_value(action, text)
        return value.lower() if action.option_strings and action.choices else value

    def _match_argument(self, action, pattern):
        try:
            return super()._match_argument(action, pattern)
        except argparse.ArgumentError as problem:  # says how many, but not of what
            if isinstance(action.metavar, tuple):
                problem.message += f": {' '.join(action.metavar)}"
            raise

    def format_first(self):
        """-> the help with the options that are needed first"""
        named = self._option_string_actions
        formatter = self._get_formatter()
        formatter.add_usage(self.usage, self._actions, self._mutually_exclusive_groups)
        formatter.add_text(self.description)
        formatter.start_section("the options that are needed first")
        formatter.add_arguments([named[option] for option in self._first])
        formatter.end_section()
        formatter.add_text(self.epilog)
        formatter.add_text(f"{self.prog} --help all shows all of the {len(set(named.values()))} options.")
        return formatter.format_help()

    def format_help(self):
        return super().format_help() + self._more

    def error(self, message):
        which = " all" if self._first else ""
        raise UserProblem(f"{message} ({self.prog} --help{which} lists the options)")


def _rgb(name):
    """-> [3] the numbers, as words, of a colour such as white, light grey or #ffc080"""
    known = vtk("vtkCommonColor").vtkNamedColors()
    plain = re.sub(r"[\s-]", "_", name)
    *rgb, alpha = (known.GetColor4ub(plain) if known.ColorExists(plain) else
                   known.HTMLColorToRGBA(name))
    if alpha == 0:  # VTK's answer to what it does not know
        near = get_close_matches(plain.lower(), known.GetColorNames().split(), 1)
        raise UserProblem(f"--background: {name!r} is no colour; "
                          + (f"did you mean {near[0]}?" if near else
                             "give red, green and blue, 0 to 1 each, or a name such as white or "
                             "#ffc080"))
    return [f"{value / 255:.9g}" for value in rgb]


def _spelt_out(words):
    """The words with numbers in place of the name of a colour."""
    for i, word in enumerate(words):
        option, _, name = word.partition("=")
        if option == "--background" and name and not NUMBER.match(name):
            yield from [option, *_rgb(name)]
        elif i and words[i - 1] == "--background" and not NUMBER.match(word) and word[:1] != "-":
            yield from _rgb(word)
        else:
            yield word


def split_numbers(words):
    """Words such as 1920x1080 or 0,0.5,2 after one of NUMBERS as so many words; a file may have such a
    name."""
    words = list(_spelt_out(words))
    for i, word in enumerate(words):
        option, equals, text = word.partition("=")
        if not equals and i and words[i - 1] in NUMBERS:
            option, text = words[i - 1], word
        numbers = NUMBER.findall(text) if TUPLE.fullmatch(text) else []
        if numbers and len(numbers) == NUMBERS.get(option):
            yield from [option, *numbers] if equals else numbers
        else:
            yield word


def number(text):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        comma = "; the decimal point is a point" if "," in text else ""
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number{comma}")
    return value


def count(text):
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return value


def checked(convert, is_valid, problem):
    """An argument type: convert, with an error that names the problem unless is_valid."""
    def check(text):
        value = convert(text)
        if not is_valid(value):
            raise argparse.ArgumentTypeError(f"{text} {problem}")
        return value

    return check


def between(low, high, convert=number):
    return checked(convert, lambda value: low <= value <= high,
                   f"is not between {low} and {high}")


def pixel_number(text):
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None


positive = checked(number, lambda value: value > 0, "is not above 0")
not_negative = checked(number, lambda value: value >= 0, "is negative")
angle = checked(number, lambda value: 0 < value < 180, "is not between 0 and 180 degrees")
lens_parts = checked(count, lambda value: value <= LARGEST_LENS_PARTS,
                     f"is more than {LARGEST_LENS_PARTS}")


def refuse_together(*options):
    """options: (name, whether it is given)."""
    given = [name for name, is_given in options if is_given]
    if len(given) > 1:
        raise UserProblem(f"{' and '.join(given)} cannot be combined; give one of them")
