# SPDX-License-Identifier: BSD-3-Clause
"""The numbered pictures of a film in a folder, which a later run can continue."""

import glob
import json
import os
from contextlib import suppress

from ..problems import UserProblem
from .outputs import whole_file, write_json

RECORD = "film.json"  # what the pictures show
PNG_BEGIN, PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"


def _is_whole(path):
    """Whether the file begins and ends as a .png file."""
    try:
        with open(path, "rb") as file:
            begin = file.read(len(PNG_BEGIN))
            file.seek(-len(PNG_END), os.SEEK_END)
            return begin == PNG_BEGIN and file.read() == PNG_END
    except OSError:
        return False


class Frames:
    """A folder of pictures 0000.png, 0001.png, ... and the record of what they show."""

    def __init__(self, folder, count):
        self.folder = folder
        self.count = count
        self._digits = max(4, len(str(count - 1)))

    @property
    def pattern(self):
        """As ffmpeg names the pictures."""
        folder = os.path.abspath(self.folder).replace("%", "%%")
        return os.path.join(folder, f"%0{self._digits}d.png")

    def path(self, number):
        return self.pattern % number

    def missing(self):
        """Numbers of the pictures that are not there."""
        return [number for number in range(self.count) if not _is_whole(self.path(number))]

    def _record(self):
        """What the pictures in the folder show; None if they are not a film's."""
        try:
            with open(os.path.join(self.folder, RECORD), encoding="utf-8") as file:
                record = json.load(file)
        except (OSError, ValueError):
            return None
        return record if isinstance(record, dict) else None

    def check(self):
        """Raises UserProblem if the folder cannot be used, before anything is computed."""
        if os.path.exists(self.folder) and not os.path.isdir(self.folder):
            raise UserProblem(f"{self.folder} is a file; give a folder for the pictures")
        if not os.path.isdir(self.folder):
            parent = os.path.dirname(os.path.realpath(self.folder))
            if not os.path.isdir(parent):
                raise UserProblem(f"cannot write {self.folder}: the folder {parent} does not exist; "
                                  "make it first")
            if not os.access(parent, os.W_OK):
                raise UserProblem(f"cannot write {self.folder}: {parent} is not writable")
        elif not os.access(self.folder, os.W_OK):
            raise UserProblem(f"cannot write into {self.folder}: the folder is not writable")
        elif os.listdir(self.folder) and self._record() is None:
            raise UserProblem(f"{self.folder} holds other files than those of a film; give a new "
                              "folder")

    def _pictures(self, ending=".png"):
        """Paths of the pictures in the folder, whatever they show."""
        return glob.glob(os.path.join(glob.escape(self.folder), "[0-9]*" + ending))

    def _check_record(self, record):
        """Raises UserProblem if the folder has pictures that show something else."""
        found = self._record()
        if found is None or not self._pictures():
            return
        record = json.loads(json.dumps(record))  # tuples are lists there
        different = sorted(key for key in {*found, *record} if found.get(key) != record.get(key))
        if different:
            verb = "differs" if len(different) == 1 else "differ"
            raise UserProblem(f"{self.folder} holds another film: {', '.join(different)} {verb}; "
                              "remove it, or give another OUT; --resume continues it with the same "
                              "input and options as before")

    def begin(self, record, resume):
        """Makes the folder, without pictures unless they are resumed. Never removes those of another
        film.

        record: what the pictures will show.
        """
        self._check_record(record)
        os.makedirs(self.folder, exist_ok=True)
        for path in self._pictures(".part.png" if resume else ".png"):
            os.remove(path)
        write_json(record, os.path.join(self.folder, RECORD))

    def write(self, number, content):
        with whole_file(self.path(number)) as temporary, open(temporary, "wb") as file:
            file.write(content)

    def remove(self):
        """Removes the pictures, and the folder if that leaves nothing in it."""
        for number in range(self.count):
            with suppress(FileNotFoundError):
                os.remove(self.path(number))
        os.remove(os.path.join(self.folder, RECORD))
        if not os.listdir(self.folder):
            os.rmdir(self.folder)
