# SPDX-License-Identifier: BSD-3-Clause
"""What view and web begin with: the cloud, a viewer of it, and the estimation of its surfels."""

import argparse

from ..clouds.cloud import is_hierarchy
from ..viewer.viewer import Viewer
from ..views.cameras import asked_view
from .awaitedsurfels import AwaitedSurfels
from .noeffect import without_effect
from .outputs import write_picture, write_view
from .scene import backdrop_of, make_actor, set_splatter
from .session import RENDER, Session

SIZE = (1280, 800)


class Look:
    """How the options say that a scan looks, and how its pictures are written: for a Viewer."""

    def __init__(self, arguments, session):
        self._arguments, self._messages = arguments, session.messages
        self.hint = session.note
        self.path, self.scalars = arguments.clouds[0], arguments.scalars
        self.background = backdrop_of(arguments)
        self.may_show_backs = not session.keeps_sides

    def make_actor(self, surfels, scalars):
        values = dict(vars(self._arguments), scalars=scalars)
        if scalars != self.scalars:
            values["range"] = None  # which is that of the other scalars
        return make_actor(surfels, argparse.Namespace(**values))

    def set_splatter(self, splatter):
        set_splatter(splatter, self._arguments)

    def write(self, picture, view, picture_path, camera_path):
        write_picture(picture, picture_path, False, self._arguments.linear_light, self._messages)
        write_view(view, camera_path)


class Scan:
    def __init__(self, arguments):
        if not arguments.camera:
            arguments.size = arguments.size or SIZE
        asked = asked_view(arguments)
        session = Session(arguments)
        session.warn(without_effect(arguments, asked))
        with session.progress_shown():
            cloud = session.read()
        self._arguments, self._session = arguments, session
        self._is_complete = is_hierarchy(cloud.data) or (cloud.is_drawable and arguments.no_lod)
        self.viewer = Viewer(cloud, asked, Look(arguments, session), session.messages)
        self.say = session.say

    def start_estimation(self):
        """-> AwaitedSurfels, or None if the file holds all"""
        return None if self._is_complete else AwaitedSurfels(
            self._arguments, lambda seconds: self._session.hint_at_keeping(seconds, RENDER))
