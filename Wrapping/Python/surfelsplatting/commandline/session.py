# SPDX-License-Identifier: BSD-3-Clause
"""What all commands do first: read a cloud, and make surfels and their hierarchy."""

import os
import sys
from contextlib import contextmanager
from dataclasses import replace
from shlex import quote

import numpy as np

from ..backend import vtk
from ..clouds.colors import hidden_intensity
from ..clouds.stations import TO_SCANNER
from ..clouds.thinning import may_be_thinned, one_of
from ..colormaps import check_scalars, colors_of, range_of, range_without_outliers, with_scalars
from ..formats.several import read_clouds
from ..shapes.outward import turn_outward
from ..shapes.precision import why_stepped
from ..shapes.sensor import keep_sensor
from ..views.backs import share_facing_away
from ..vtkarrays import to_numpy
from ..vtkmessages import VtkMessages
from .estimation import check_memory, make_hierarchy, make_surfels, without_unused_arrays
from .interrupts import Interrupts
from .memory import reuse_memory
from .noeffect import mixes_as_stored, without_effect_on
from .progress import Progress
from .runstatistics import RunStatistics
from .volume import splat_volume, take_scalars

RENDER = "surfelsplat render "  # has --hierarchy, which other commands lack
IN_MIDDLE = "the middle of the picture (--focus-pixel X Y moves it)"
LONG = 5.0  # s to make surfels, from which on it is worth a hint that they can be kept


def counted(count, things):
    """'1 point', '2 points'; things: their plural, which ends in s"""
    return f"{count} {things[:-1] if count == 1 else things}"


class Session:
    """One run of a command: its messages, progress and statistics.

    arguments: those of options.add_look_options, add_detail_options and add_run_options.
    is_silent: whether another process prints what is to be said of the cloud.
    needs_hierarchy: whether pictures are drawn with level of detail.
    """

    def __init__(self, arguments, is_silent=False):
        self.arguments = arguments
        self._is_silent = is_silent
        self.needs_hierarchy = not arguments.no_lod
        self.keeps_sides = False  # whether the user has said which sides are visible
        self.messages = VtkMessages(arguments.verbose)
        self.interrupts = Interrupts()
        reuse_memory()
        self.progress = Progress(self.interrupts)
        smp_tools = vtk("vtkCommonCore").vtkSMPTools
        if arguments.threads:
            # TBB warns about more threads than cores.
            smp_tools.Initialize(min(arguments.threads, len(os.sched_getaffinity(0))))
        self.run = RunStatistics(smp_tools.GetEstimatedNumberOfThreads())

    def say(self, text):
        """Prints a line for --verbose."""
        if self.arguments.verbose:
            self.tell(text)

    def tell(self, text):
        """Prints a line, whether verbose or not."""
        self.progress.clear()
        if not self._is_silent:
            print("surfelsplat: " + text, file=sys.stderr)

    def note(self, text):
        """Prints a line about the cloud, whether verbose or not."""
        self.tell(f"{self.arguments.cloud}: {text}")

    def warn(self, texts):
        self.progress.clear()
        for text in texts:
            print("surfelsplat: warning: " + text, file=sys.stderr)

    def hint_at_keeping(self, seconds, command=""):
        """Says how surfels are kept that took long, if they are not. command: that has --hierarchy."""
        options = self.arguments
        is_kept = options.hierarchy or options.surfels or options.no_lod
        if seconds > LONG and not (is_kept or options.every > 1):
            name = os.path.splitext(os.path.basename(options.clouds[0]))[0] + ".surfels"
            self.note(f"the surfels took {seconds:.0f} s; {command}--hierarchy {name} keeps them in a file "
                      "that is drawn at once")

    @contextmanager
    def progress_shown(self):
        """Takes the progress bar away at the end."""
        try:
            yield
        finally:
            self.progress.clear()

    def cloud(self):
        """-> Cloud as it is in the file, but for sides that are plainly wrong there, and thinned"""
        cloud = read_clouds(self.arguments.clouds, self.messages, self.progress)
        if self.arguments.every > 1 and may_be_thinned(cloud):
            cloud = one_of(self.arguments.every, cloud)
        if self.arguments.sides == "auto":
            turn_outward(cloud)
        return cloud

    def load(self, with_note=True):
        """-> Cloud, and says how it was read. with_note: also where that was a guess, without -v"""
        path = self.arguments.cloud
        if self.arguments.colormap:
            colors_of(self.arguments.colormap)  # UserProblem, before all that takes time
        with self.run.stage("read"):
            cloud = self.cloud()
        self.say(f"{path}: {counted(cloud.data.GetNumberOfPoints(), 'points')}"
                 + (f"; {cloud.how}" if cloud.how else ""))
        if with_note and cloud.is_unsure and not self.arguments.verbose:
            self.note(cloud.how)
        if not cloud.is_volume and self.arguments.scalars:
            check_scalars(cloud.data, self.arguments.scalars)
        self.warn(without_effect_on(cloud, self.arguments))
        self.keeps_sides = self.arguments.sides == "given" and not cloud.is_drawable
        if mixes_as_stored(cloud, self.arguments):
            self.arguments.linear_light = False
        return cloud

    def drawn_as_points(self, cloud):
        """-> Cloud: a volume as Gaussians in space, any other as it is"""
        if not cloud.is_volume:
            return cloud
        take_scalars(self.arguments)
        return splat_volume(cloud, self)

    def read(self):
        """-> Cloud of points"""
        cloud = self.drawn_as_points(self.load())
        intensity = hidden_intensity(cloud)
        if intensity and not self.arguments.scalars:
            self.note(f"it has no colours, but intensity: --scalars {quote(intensity)} shows it")
        return cloud

    def surfels(self, cloud, with_hierarchy=False, all_arrays=True):
        """-> vtkPolyData with the arrays of the data contract

        with_hierarchy: whether a hierarchy may come along, if there is need of one
        all_arrays: False: only those that a picture needs, if a hierarchy may come along
        """
        if self.needs_hierarchy:
            check_memory(cloud, self.arguments)
        if with_hierarchy and not all_arrays and not cloud.is_drawable:
            cloud = replace(cloud, data=without_unused_arrays(
                cloud.data, self.arguments.scalars, TO_SCANNER, *cloud.normals))
        with_hierarchy = with_hierarchy and self.needs_hierarchy
        surfels = make_surfels(
            cloud, self.arguments, with_hierarchy, self.messages, self.progress, self.run)
        if self.run.normals_problem:
            self.note(f"{self.run.normals_problem}; --sides given keeps them")
        keep_sensor(cloud, surfels)
        if not cloud.is_drawable:
            self.warn(filter(None, [why_stepped(cloud.data, surfels)]))
        return surfels

    def show_backs(self, renderer, samples, views):
        """Lets a renderer draw both sides, if the views would show the backs of most of what it draws,
        unless keeps_sides. A line says what is done."""
        share = share_facing_away(samples, views)
        if not share:
            return
        seen = (f"{100 * share:.0f} % of the surface turns its back to the camera"
                + (" in a frame" if len(views) > 1 else ""))
        if self.keeps_sides:
            self.warn([f"{seen} and is not drawn; --sides auto shows it"])
            return
        self.note(f"{seen}, so that both sides are drawn")
        for actor in renderer.GetActors():
            actor.GetMapper().ShowBacksOn()

    def _note_range(self, surfels, name):
        values = to_numpy(surfels.GetPointData().GetArray(name))
        if np.isnan(values).all():
            self.note(f"the scalars {name} are NaN everywhere, so that all has one colour")
            return
        bulk = range_without_outliers(values, range_of(surfels, name))
        if bulk and not self.arguments.range:
            self.note(f"99 % of {name} is from {bulk[0]} to {bulk[1]}, and the rest takes most of "
                      f"the colours; --range {' '.join(bulk)} leaves it out")

    def drawable(self, surfels, all_arrays=False):
        """-> the hierarchy of the surfels, or where there is no need of one the surfels; with the
        arrays that a picture needs, or with all"""
        scalars = self.arguments.scalars
        if scalars:
            surfels = with_scalars(surfels, scalars)
            self._note_range(surfels, scalars)
        drawn = surfels if all_arrays else without_unused_arrays(surfels, scalars)
        if not self.needs_hierarchy:
            return drawn
        return make_hierarchy(drawn, self.messages, self.progress, self.run)
