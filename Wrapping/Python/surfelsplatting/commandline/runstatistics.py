# SPDX-License-Identifier: BSD-3-Clause
"""Counts and times of one run, for --stats."""

import resource
import time
from contextlib import contextmanager

from ..version import __version__


class RunStatistics:
    def __init__(self, threads):
        self._threads = threads
        self._milliseconds = {}
        self._stage, self._began = None, 0.0
        self._counts = {"splats": 0, "fragments": 0}
        self._detail = {}
        self._skipped = {}
        self._lens = {}
        self.normals_problem = ""  # what the estimation found wrong with those of the file
        self._invalid = {"points": 0, "surfels": 0}
        self._cleaned = dict.fromkeys(
            ("duplicate", "stray", "twin", "joined", "moved", "recolored", "thick"), 0)

    @contextmanager
    def stage(self, name):
        self.begin(name)
        yield
        self.begin(None)

    def begin(self, stage):
        """Ends the stage before; None: nothing is measured."""
        now = time.perf_counter()
        if self._stage:
            self._milliseconds[self._stage] = 1000 * (now - self._began)
        self._stage, self._began = stage, now

    def note_cleaning(self, cleaning):
        self._invalid["points"] = cleaning.GetNumberOfNonFinitePoints()
        self._cleaned = {"duplicate": cleaning.GetNumberOfDuplicatePoints(),
                         "stray": cleaning.GetNumberOfStrayPoints(),
                         "twin": cleaning.GetNumberOfTwinPoints(),
                         "joined": cleaning.GetNumberOfJoinedPoints(),
                         "moved": cleaning.GetNumberOfMovedPoints(),
                         "recolored": cleaning.GetNumberOfRecoloredPoints(),
                         "thick": cleaning.GetNumberOfThickPoints()}

    def note_estimation(self, estimation):
        self._invalid["points"] += estimation.GetNumberOfNonFinitePoints()

    def note_frame(self, splatter):
        self._milliseconds |= {splatter.GetStageName(i): splatter.GetStageMilliseconds(i)
                               for i in range(splatter.GetNumberOfStages())}
        self._milliseconds["frame"] = splatter.GetFrameMilliseconds()
        self._counts = {"splats": splatter.GetNumberOfSplats(),
                        "fragments": splatter.GetNumberOfFragments()}
        self._counts["blurred"] = splatter.GetNumberOfBlurredSplats()
        self._detail = {"chosen": splatter.GetNumberOfChosenNodes(),
                        "visited": splatter.GetNumberOfVisitedNodes(),
                        "prepared": splatter.GetNumberOfPreparedSurfels()}
        self._skipped = {"outside": splatter.GetNumberOfSurfelsOutside(),
                         "facing_away": splatter.GetNumberOfSurfelsFacingAway(),
                         "hidden": splatter.GetNumberOfHiddenSurfels(),
                         "hidden_pairs": splatter.GetNumberOfHiddenPairs()}
        self._lens = {"cells": splatter.GetLensCells(),
                      "pinholes": bool(splatter.GetLensPinholes())}
        self._invalid["surfels"] = splatter.GetNumberOfInvalidSurfels()

    def seconds_to_hierarchy(self):
        """From points to the hierarchy; 0 if the file held surfels already."""
        stages = ("surfels", "hierarchy") if "surfels" in self._milliseconds else ()
        return sum(self._milliseconds.get(stage, 0.0) for stage in stages) / 1000

    def is_empty(self):
        return self._counts["splats"] == 0

    def summary(self, points, surfels, view):
        """The contents of the .json file. points, surfels: their numbers."""
        return {
            "version": __version__,
            "points": points,
            "surfels": surfels,
            **self._counts,
            "detail": self._detail,
            "skipped": self._skipped,
            "lens": self._lens,
            "invalid": self._invalid,
            "cleaned": self._cleaned,
            "size": list(view.size),
            "threads": self._threads,
            "peak_memory_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            "milliseconds": {name: round(value, 3) for name, value in self._milliseconds.items()},
        }
