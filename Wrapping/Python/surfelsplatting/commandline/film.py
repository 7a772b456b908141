# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat film: cloud -> surfels -> pictures -> film."""

import os
import time
from contextlib import contextmanager
from dataclasses import replace

from ..pictures import png_bytes
from ..problems import UserProblem
from ..shapes.samples import Samples
from ..shapes.sensor import sensor_of
from ..version import __version__
from ..views.cameras import asked_view, camera_files, overridden, read_views
from ..views.filming import focused_in_the_middle, whole_turn
from ..views.focus import ends_of, focused_on_front, has_focus, settle_focus, sharp_depths
from ..views.framing import complete_view, home_in, is_from_sensor, up_in
from ..views.paths import check_views, focus_pull, through, turntable
from ..views.trained import files_of
from ..views.vtkcamera import make_camera, set_lens
from .frames import Frames
from .movie import MOVIES, find_ffmpeg, write_movie
from .noeffect import without_effect
from .outputs import check_distinct, check_output
from .scene import backdrop_of, make_renderer
from .session import IN_MIDDLE, RENDER, Session

PULL_BLUR = 0.025  # of a pull's own lens: radius of the largest blur at its begin, picture heights

# These change neither the pictures nor their number.
WITHOUT_EFFECT = ("check", "command", "given", "is_output_chosen", "output", "rate", "resume", "run", "threads",
                  "verbose")


def _is_movie(arguments):
    return arguments.output.lower().endswith(MOVIES)


def _stamp(path):
    """What changes when the file does."""
    status = os.stat(path)
    return [os.path.realpath(path), status.st_size, status.st_mtime_ns]


def _files(arguments):
    """-> paths of the input files that exist."""
    texts = [arguments.camera, *(arguments.through or ())]
    candidates = [*arguments.clouds, *files_of(arguments.clouds[0]),
                  *(path for text in texts for path in camera_files(text))]
    return [path for path in candidates if os.path.exists(path)]


def _record(arguments):
    """What the pictures depend on."""
    options = {name: value for name, value in vars(arguments).items()
               if name not in WITHOUT_EFFECT and value is not None}
    return {"version": __version__, "files": [_stamp(path) for path in _files(arguments)],
            **options}


def _asked_views(arguments):
    """The views of --through, or the one that the camera begins with; as the options say."""
    if not arguments.through:
        return [_with_pull_lens(asked_view(arguments), arguments)]
    views = [view for text in arguments.through for view in read_views(text)]
    if len(views) < 2:
        raise UserProblem(f"--through {arguments.through[0]} is one view; give at least two")
    return [replace(overridden(view, arguments), size=tuple(arguments.size or views[0].size))
            for view in views]


def _with_pull_lens(view, arguments):
    """A focus pull shows with a lens only."""
    if arguments.focus_pull is None or view.has_lens:
        return view
    return replace(view, wishes=replace(view.wishes, blur=PULL_BLUR * view.size[1]))


def _pull(view, renderer, arguments):
    """-> the views of a focus pull"""
    distances = arguments.focus_pull
    if not distances:
        renderer.SetCamera(make_camera(view))
        distances = ends_of(sharp_depths(renderer))
    if distances is None:
        raise UserProblem("the camera sees nothing of the cloud, so that the focus has no way to "
                          "go; move the camera or give --focus-pull NEAR FAR")
    near, far = distances
    view = settle_focus(replace(view, focal_distance=near, focus_point=None), renderer)
    return focus_pull(view, near, far, arguments.frames)


def _turntable(asked, view, cloud, surfels, arguments):
    """-> a function that gives the views of so many frames"""
    # A depth image looks like nothing from behind.
    sensor = sensor_of(cloud, surfels)
    home = home_in(cloud, surfels)
    default = 40.0 if sensor or cloud.columns else home.turn if home else 360.0
    degrees = default if arguments.turn is None else arguments.turn
    axis = up_in(asked, cloud, surfels).axis
    # What complete_view has focused on in a volume is seen from the first place only.
    view = replace(view, focal_distance=asked.focal_distance)
    if asked.position or asked.focal_point or is_from_sensor(asked, sensor) or home:
        return lambda frames: turntable(view, view.focal_point, axis, frames, degrees)
    return whole_turn(view, axis, surfels, degrees)


def _turn(asked, turn, renderer, arguments):
    """-> the views of a turn, with the asked focus or that on the surface in the middle"""
    if has_focus(asked) or not asked.has_lens:
        return _settled(turn(arguments.frames), renderer)
    return _settled(focused_in_the_middle(turn, arguments.frames, renderer), renderer)


def _settled(views, renderer):
    """The views with the focus and the lens that the first of them gets."""
    first = settle_focus(views[0], renderer)
    return [replace(view, focus_point=first.focus_point, focal_disk=first.focal_disk,
                    circle_of_confusion=first.circle_of_confusion, wishes=first.wishes)
            for view in views]


def _views(asked, cloud, surfels, renderer, arguments):
    """-> the view of each frame."""
    complete = [complete_view(view, cloud, surfels) for view in asked]
    renderer.SetSize(*complete[0].size)
    if arguments.through:
        focused = [focused_on_front(*views, renderer) for views in zip(asked, complete)]
        views = through([settle_focus(view, renderer) for view in focused], arguments.frames)
    elif arguments.focus_pull is not None:
        views = _pull(complete[0], renderer, arguments)
    else:
        turn = _turntable(asked[0], complete[0], cloud, surfels, arguments)
        views = _turn(asked[0], turn, renderer, arguments)
    check_views(views)
    return views


class _Clock:
    """Estimates how long the rest takes."""

    def __init__(self, count):
        self._count, self._done, self._began = count, 0, time.monotonic()

    def left(self):
        """", m:ss left,", or nothing before the first is done."""
        if not self._done:
            return ""
        each = (time.monotonic() - self._began) / self._done
        seconds = round(each * (self._count - self._done))
        return f", {seconds // 60}:{seconds % 60:02} left,"

    def one_done(self):
        self._done += 1


def _draw(renderer, views, frames, numbers, session):
    """Renders these frames and writes their pictures."""
    clock = _Clock(len(numbers))
    for number in numbers:
        label = f"frame {number + 1}/{frames.count}{clock.left()}"
        session.progress.show(label, number / frames.count)
        renderer.SetCamera(make_camera(views[number]))
        set_lens(renderer.GetSplatter(), views[number])
        with session.interrupts.stopping(renderer):
            renderer.Update(1)  # bytes
        session.messages.check()
        frames.write(number, png_bytes(renderer.GetOutput(1)))
        clock.one_done()


def _make_renderer(drawn, view, arguments):
    """Films are opaque."""
    renderer = make_renderer(drawn, view, arguments)
    renderer.SetBackground(backdrop_of(arguments))
    renderer.SetBackgroundAlpha(1.0)
    return renderer


def _make_pictures(asked, frames, arguments, session):
    with session.progress_shown():
        cloud = session.read()
        surfels = session.surfels(cloud, with_hierarchy=True, all_arrays=False)
        drawn = session.drawable(surfels)
        session.hint_at_keeping(session.run.seconds_to_hierarchy(), RENDER)
        first = complete_view(asked[0], cloud, surfels, session.note)
        renderer = _make_renderer(drawn, first, arguments)
        views = _views(asked, cloud, surfels, renderer, arguments)
        del cloud, surfels  # frees the memory of a large cloud
        if views[0].has_lens and arguments.focus_pull is None and not all(map(has_focus, asked)):
            session.tell(f"in focus: {IN_MIDDLE}")
        session.say(f"first frame: {views[0]}")
        session.show_backs(renderer, Samples(drawn), views)
        _draw(renderer, views, frames, frames.missing(), session)


def _check_outputs(arguments, frames):
    check_distinct(_files(arguments), (arguments.output,))
    if _is_movie(arguments):
        check_output(arguments.output, MOVIES)
    frames.check()


@contextmanager
def _kept_when_interrupted(frames):
    """Says where the pictures are that Ctrl-C has left; leaves nothing if there are none."""
    try:
        yield
    except BaseException as stop:
        done = frames.count - len(frames.missing())
        if done == 0:
            frames.remove()
        elif isinstance(stop, KeyboardInterrupt):
            raise KeyboardInterrupt(
                f"{done} of {frames.count} pictures are in {frames.folder}; the same command with "
                "--resume makes the others") from None
        raise


def film(arguments):
    movie = _is_movie(arguments)
    program = find_ffmpeg(arguments.output) if movie else None
    folder = os.path.splitext(arguments.output)[0] + ".frames" if movie else arguments.output
    frames = Frames(folder, arguments.frames)
    asked = _asked_views(arguments)
    _check_outputs(arguments, frames)
    session = Session(arguments)
    session.warn(without_effect(arguments, asked[0]))
    record = _record(arguments)
    frames.begin(record, arguments.resume)
    with _kept_when_interrupted(frames):
        if frames.missing():
            _make_pictures(asked, frames, arguments, session)
        if movie:
            write_movie(program, frames.pattern, arguments.rate, arguments.output)
            frames.remove()
    say = session.tell if arguments.is_output_chosen else session.say
    say(f"{arguments.output} written")
