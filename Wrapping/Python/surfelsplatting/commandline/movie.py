# SPDX-License-Identifier: BSD-3-Clause
"""Numbered pictures to a .mp4 or .gif file, by ffmpeg."""

import importlib
import os
import shutil
import subprocess
import tempfile

from ..problems import UserProblem
from .outputs import whole_file

MOVIES = (".mp4", ".gif")
# The sizes of H.264's usual form are even. Without its name players guess how colours were coded.
FILTERS = "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"
CODING = ("-c:v", "libx264", "-preset", "medium", "-crf", "16", "-colorspace", "bt709",
          "-color_primaries", "bt709", "-color_trc", "bt709", "-movflags", "+faststart")


def find_ffmpeg(path):
    """The program, of the system or of the Python package imageio-ffmpeg; or UserProblem."""
    program = shutil.which("ffmpeg")
    if program:
        return program
    try:
        return importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise UserProblem(f"{path}: films in one file need ffmpeg: apt install ffmpeg, or pip install "
                          "imageio-ffmpeg; or give a folder, for numbered .png files") from None


def _run(words, what, pattern):
    # In a session of its own, so that Ctrl-C reaches this program only, which then ends it.
    result = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                            start_new_session=True, check=False)
    if result.returncode != 0:
        lines = result.stderr.decode(errors="replace").strip().splitlines()
        reason = lines[-1] if lines else f"it ended with {result.returncode}"
        raise UserProblem(f"cannot write {what}: ffmpeg: {reason}; the pictures are still "
                          "there, as " + pattern)


def write_movie(program, pattern, rate, path):
    """pattern: of the pictures' names. The same pictures make the same bytes."""
    exact = ("-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1")
    words = [program, "-v", "error", "-nostdin", "-y", "-framerate", f"{rate:g}", "-i", pattern]
    with whole_file(path) as temporary, tempfile.TemporaryDirectory() as folder:
        if path.lower().endswith(".gif"):  # the 256 colours of all pictures, then the pictures in these
            palette = os.path.join(folder, "palette.png")
            _run([*words, "-vf", "palettegen", palette], path, pattern)
            coding = ("-i", palette, "-lavfi", "paletteuse")
        else:
            coding = ("-vf", FILTERS, *CODING)
        _run([*words, *coding, *exact, temporary], path, pattern)
