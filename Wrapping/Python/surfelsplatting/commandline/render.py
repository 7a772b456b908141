# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat render: cloud -> surfels -> picture."""

from ..clouds.cloud import is_hierarchy
from ..problems import UserProblem
from ..shapes.samples import Samples
from ..shapes.sensor import sensor_of
from ..surfels import needs_hierarchy
from ..views.cameras import asked_view, camera_files
from ..views.faint import why_faint
from ..views.focus import (blur_at, depths_of, distance_in_focus, ends_of, focused_on_front,
                           has_focus, settle_focus, sharp_depths)
from ..views.framing import complete_view, extent_of, is_from_sensor
from ..views.homes import home_of
from ..views.trained import files_of
from .arguments import PICTURES
from .noeffect import without_effect
from .outputs import (HIERARCHIES, check_distinct, check_output, write_hierarchy,
                      write_json, write_picture, write_surfels, write_view)
from .scene import make_renderer
from .session import IN_MIDDLE, Session

NO_BLUR = 0.5  # px, radius of a blur that cannot be seen


def _check_outputs(arguments):
    clouds = arguments.clouds
    check_distinct((*clouds, *camera_files(arguments.camera), *files_of(clouds[0])),
                   (arguments.output, arguments.surfels, arguments.hierarchy, arguments.stats,
                    arguments.save_camera))
    check_output(arguments.output, PICTURES)
    if arguments.surfels:
        check_output(arguments.surfels, (".vtp",))
    if arguments.hierarchy:
        check_output(arguments.hierarchy, HIERARCHIES)
    for path in filter(None, (arguments.stats, arguments.save_camera)):
        check_output(path, (".json",))


def _check_hierarchy(cloud, arguments):
    path = arguments.hierarchy
    if path and cloud.is_gaussians and not path.lower().endswith(".vtp"):
        raise UserProblem(f"{path}: such files hold surfels, but {arguments.cloud} holds Gaussians "
                          "in space; give --hierarchy an OUT.vtp")


def _needs_hierarchy(asked, cloud, arguments):
    return not arguments.no_lod and bool(
        needs_hierarchy(cloud.data, asked.has_lens) or cloud.is_gaussians
        or is_hierarchy(cloud.data) or arguments.hierarchy or arguments.lod_error is not None
        or "LEVEL" in (arguments.channels or ()))


def _place(view, cloud, surfels, samples, session):
    """-> the complete view"""
    if is_from_sensor(view, sensor_of(cloud, surfels)):
        session.say("the camera is at the sensor of the depth image")
    home = home_of(cloud, samples) if session.arguments.verbose and not view.position else None
    if home:
        session.say(home.what)
    return complete_view(view, cloud, surfels, session.note, samples)


def _picture_port(arguments):
    """The output of the renderer that is written: 0 has floats, 1 bytes."""
    return 0 if arguments.transparent or arguments.output.lower().endswith(".exr") else 1


def _render_frame(renderer, session):
    renderer.Modified()  # render it, although it may be what was focused on
    session.progress.update(renderer, "rendering", _picture_port(session.arguments))
    session.messages.check()
    session.run.note_frame(renderer.GetSplatter())


def _write_outputs(renderer, surfels, drawn, arguments, session):
    with session.run.stage("write"):
        write_picture(renderer.GetOutput(_picture_port(arguments)), arguments.output, arguments.deep,
                      arguments.linear_light, session.messages, arguments.transparent)
        if arguments.surfels:
            write_surfels(surfels, arguments.surfels, session.messages)
        if arguments.hierarchy:
            session.warn(write_hierarchy(drawn, arguments.hierarchy, session.messages))


def _focus(renderer, asked, view, drawn, session):
    """-> the view with what is in focus, and the depths of the picture without the lens, or None
    where nothing needs them. Warns of a capture that is hardly seen."""
    def update(algorithm):
        session.progress.update(algorithm, "focusing")
        session.messages.check()

    arguments = session.arguments
    if asked.has_lens or arguments.save_camera or arguments.verbose:
        view = focused_on_front(asked, view, renderer, update)
    are_needed = arguments.verbose or view.wishes.blur is not None or view.wishes.focus_pixel
    depths = sharp_depths(renderer, update) if are_needed else None
    view = settle_focus(view, renderer, update, depths)
    session.warn(filter(None, [why_faint(drawn, renderer, update)]))
    return view, depths


def _say_what_is_seen(renderer, depths, asked, view, session):
    """Prints what is in focus and how much the rest is blurred, with a lens also without --verbose where
    nobody has said what shall be in focus; warns of a lens that blurs nothing.

    depths: of the picture without the lens; None: those of this one, if it needs them
    """
    if session.run.is_empty():
        session.warn(["the camera sees nothing of the cloud; check its position and focal point"])
    if not (session.arguments.verbose or view.has_lens):
        return
    ends = ends_of(depths_of(renderer) if depths is None else depths)
    if ends is None:
        return
    is_in_middle = not has_focus(asked)
    blurs = [blur_at(view, end) for end in ends] if view.has_lens else [0.0]
    seen = (f"in focus at {distance_in_focus(view):.5g}{', ' + IN_MIDDLE if is_in_middle else ''}; seen from "
            f"{ends[0]:.5g} to {ends[1]:.5g} along the view direction")
    if view.has_lens:
        seen += ", blurred there by {:g} and {:g} px".format(*(round(blur, 2) for blur in blurs))
    (session.tell if view.has_lens and is_in_middle else session.say)(seen)
    if view.has_lens and max(blurs) < NO_BLUR:
        metres = ("; --f-number takes the units of the cloud for metres"
                  if session.arguments.f_number else "")
        session.warn([f"the lens blurs nothing that is seen by more than {max(blurs):.2g} px; "
                      f"--blur PX opens it as far as that blur needs{metres}"])


def render(arguments):
    asked = asked_view(arguments)
    _check_outputs(arguments)
    session = Session(arguments)
    session.warn(without_effect(arguments, asked))
    with session.progress_shown():
        cloud = session.read()
        _check_hierarchy(cloud, arguments)
        session.needs_hierarchy = _needs_hierarchy(asked, cloud, arguments)
        points = cloud.data.GetNumberOfPoints()
        all_arrays = arguments.hierarchy is not None
        surfels = session.surfels(cloud, not arguments.surfels, all_arrays)
        samples = Samples(surfels)
        view = _place(asked, cloud, surfels, samples, session)
        what = "Gaussians" if cloud.is_gaussians else "surfels"
        del cloud  # frees the memory of a large cloud
        count = surfels.GetNumberOfPoints()
        if arguments.verbose:
            session.say(f"{count} {what}; {extent_of(samples)}")
        drawn = session.drawable(surfels, all_arrays)
        session.hint_at_keeping(session.run.seconds_to_hierarchy())
        surfels = surfels if arguments.surfels else None
        renderer = make_renderer(drawn, view, arguments)
        session.show_backs(renderer, samples, [view])
        view, depths = _focus(renderer, asked, view, drawn, session)
        session.say(str(view))
        _render_frame(renderer, session)
    _say_what_is_seen(renderer, depths, asked, view, session)
    _write_outputs(renderer, surfels, drawn, arguments, session)
    if arguments.save_camera:
        write_view(view, arguments.save_camera)
    if arguments.stats:
        write_json(session.run.summary(points, count, view), arguments.stats)
    say = session.tell if arguments.is_output_chosen else session.say
    say(f"{arguments.output} written")
