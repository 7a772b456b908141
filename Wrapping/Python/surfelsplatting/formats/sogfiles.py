# SPDX-License-Identifier: BSD-3-Clause
"""The files of a .sog capture, in a zip file or in a folder, read no further than they may be long."""

import io
import os
import warnings

import numpy as np

from .sogmeta import AGAIN, SogProblem

META = "meta.json"
MOST_OF_META = 1 << 20  # bytes; 20 kB are usual
MOST_ALIKE = 1000  # Gaussians for each byte of the files: even those of a grid are stored in more
MOST_UNUSED = 4  # pixels for each Gaussian
LEAST_PIXELS = 1 << 24  # images that are larger have MOST_UNUSED


def folder_meta(path):
    """-> path of the meta.json in a folder, or of any other file as it is"""
    inside = os.path.join(path, META)
    return inside if os.path.isdir(path) and os.path.isfile(inside) else path


def bytes_of(path):
    """-> bytes of a file, or of all files in a folder"""
    if not os.path.isdir(path):
        return os.path.getsize(path)
    with os.scandir(path) as entries:
        return sum(entry.stat().st_size for entry in entries if entry.is_file())


class _Folder:
    """Beside a meta.json"""

    def __init__(self, path):
        self._folder, self.meta = os.path.split(path)
        self.size = bytes_of(self._folder or os.curdir)

    def open(self, name):
        """-> file, its size in bytes"""
        path = os.path.join(self._folder, name)
        if not os.path.isfile(path):  # a pipe would never end
            raise FileNotFoundError
        return open(path, "rb"), os.path.getsize(path)

    def close(self):
        pass


class _Zip:
    meta = META

    def __init__(self, path):
        import zipfile  # takes 2 ms, which other files need not wait for

        self.size = os.path.getsize(path)
        try:
            self._zip = zipfile.ZipFile(path)
        except Exception as error:  # damage raises those of struct and of the decoder of names, too
            raise SogProblem(f"it is no readable zip file ({error}), as .sog files are; {AGAIN}") from None

    def open(self, name):
        return self._zip.open(name), self._zip.getinfo(name).file_size

    def close(self):
        self._zip.close()


class SogFiles:
    """The meta.json and the images, in a `with` statement"""

    def __init__(self, path):
        is_folder = path.lower().endswith(".json")
        self._from = _Folder(path) if is_folder else _Zip(path)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._from.close()

    def meta(self):
        return self._read(self._from.meta, MOST_OF_META)

    def _read(self, name, most):
        try:
            file, size = self._from.open(name)
            with file:
                content = file.read(min(size, most) + 1)
        except (KeyError, FileNotFoundError):
            raise SogProblem(f"its {name} is missing; {AGAIN}") from None
        except MemoryError:
            raise
        except Exception as error:  # those of zipfile, zlib, struct, and of the system
            raise SogProblem(f"its {name} cannot be read ({error}); {AGAIN}") from None
        if len(content) > most:
            raise SogProblem(f"its {name} has more than {most} bytes, which is more than it needs; {AGAIN}")
        return content

    def check_count(self, count):
        """Before anything is allocated for so many Gaussians"""
        if count > MOST_ALIKE * self._from.size:
            raise SogProblem(f"its meta.json promises {count} Gaussians, but its files have only "
                             f"{self._from.size} bytes; {AGAIN}")

    def pixels(self, name, count):
        """-> [count, 4] bytes, RGBA of the first pixels of an image"""
        image = self.image(name, count, max(MOST_UNUSED * count, LEAST_PIXELS))
        return image.reshape(-1, 4)[:count]

    def image(self, name, least, most):
        """-> [height, width, 4] bytes, RGBA of an image with so many pixels"""
        from PIL import Image, UnidentifiedImageError

        content = self._read(name, 4 * most + (1 << 16))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that it is large, which is checked here
                with Image.open(io.BytesIO(content), formats=("WEBP", "PNG")) as image:
                    width, height = image.size
                    if not least <= width * height <= most:
                        raise SogProblem(f"its {name} has {width} x {height} pixels, and not {least} to "
                                         f"{most}; {AGAIN}")
                    return np.asarray(image if image.mode == "RGBA" else image.convert("RGBA"))
        except (SogProblem, MemoryError):
            raise
        except UnidentifiedImageError:
            raise SogProblem(f"its {name} is no WebP image; {AGAIN}") from None
        except Exception as error:  # Pillow has no common class of errors
            raise SogProblem(f"its {name} cannot be decoded ({error}); {AGAIN}") from None
