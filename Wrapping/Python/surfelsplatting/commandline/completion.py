# SPDX-License-Identifier: BSD-3-Clause
"""Completion of commands, options and their values in a shell, by argcomplete."""

import argparse
import importlib
import os

FILES = ("CLOUD", "OUT", "FILE")  # in the metavar of options that take a file


def _name_files(parser, completer):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _name_files(command, completer)
        elif any(word in str(action.metavar) for word in FILES):
            action.completer = completer


def complete(parser):
    """Answers the shell and ends the program, if it is a shell that asks."""
    if "_ARGCOMPLETE" not in os.environ:
        return
    try:
        argcomplete = importlib.import_module("argcomplete")
    except ImportError:
        raise SystemExit(1) from None  # nothing is completed
    _name_files(parser, argcomplete.completers.FilesCompleter())
    argcomplete.autocomplete(parser, default_completer=argcomplete.completers.SuppressCompleter())
