# SPDX-License-Identifier: BSD-3-Clause
"""What a pixel sees, so that the lens can focus on it; and how much the lens blurs."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from ..problems import UserProblem
from ..shapes.directions import unit
from ..vtkarrays import to_numpy
from ..vtkmessages import errors_of
from ..vtkSurfelRendering import vtkSurfelSplatter
from .cameras import LARGEST_BLUR, Wishes, check_pixel, dot, subtract
from .vtkcamera import make_camera, set_lens

SMALL = 120  # px, height of a picture that shows what is in the middle
WIDEST = 16  # times its height; of strips it shows the middle
LEAST_SEEN = 0.02  # alpha of what is seen, as of a volume
ENDS = (1, 99)  # percent of the pixels that are nearer than the near and the far end of a picture


@contextmanager
def one_sharp_picture(renderer, channels=0):
    """Without the lens, through which a pixel sees a mixture, and without background."""
    splatter, opacity = renderer.GetSplatter(), renderer.GetBackgroundAlpha()
    settings = ("LensMode", "LensCells", "LensPinholes", "DeepSamples", "Channels")
    kept = {name: getattr(splatter, "Get" + name)() for name in settings}
    splatter.SetLensModeToPinhole()
    splatter.SetLensCells(1)
    splatter.LensPinholesOff()
    splatter.DeepSamplesOff()
    splatter.SetChannels(channels)
    renderer.SetBackgroundAlpha(0.0)
    try:
        yield
    finally:
        renderer.SetBackgroundAlpha(opacity)
        for name, value in kept.items():
            getattr(splatter, "Set" + name)(value)


def _update(renderer):
    """UserProblem if there is no picture, for example of a file that is damaged."""
    with errors_of(renderer.GetSplatter(), renderer, renderer.GetExecutive()) as errors:
        renderer.Update()
    if errors:
        raise UserProblem(errors[0])


def plane_of(renderer, name):
    """[height, width] of the picture, top row first; the last component"""
    values = to_numpy(renderer.GetOutput().GetPointData().GetArray(name))
    width, height = renderer.GetSize()
    return values.reshape(height, width, -1)[::-1, :, -1]


def depths_of(renderer):
    """[height, width], top row first: distance along the view direction, 0 where nothing is seen."""
    return plane_of(renderer, "Depth")


def _shows_volume(renderer):
    actors = renderer.GetActors()
    inputs = (actors.GetItemAsObject(i).GetMapper().GetInput()
              for i in range(actors.GetNumberOfItems()))
    return any(data and data.GetPointData().HasArray("GaussianExtinction") for data in inputs)


def _draw_sharp(renderer, update):
    """Draws without the lens. -> the array of depths. Of a volume, which may be translucent everywhere,
    they are those at which half of what a pixel sees has been gathered."""
    of_volume = _shows_volume(renderer)
    with one_sharp_picture(renderer, of_volume and renderer.GetSplatter().CHANNEL_MEDIAN_DEPTH):
        update(renderer)
    return "MedianDepth" if of_volume else "Depth"


def sharp_depths(renderer, update=_update):
    """What depths_of gives, without the lens."""
    name = _draw_sharp(renderer, update)
    if name == "Depth":
        return np.array(depths_of(renderer))
    return np.where(plane_of(renderer, "Color") < LEAST_SEEN, 0.0, plane_of(renderer, name))


def _point(camera, size, pixel, depth):
    """The point at this distance along the view direction that the middle of a pixel shows."""
    forward = np.array(camera.GetDirectionOfProjection())
    right = unit(np.cross(forward, camera.GetViewUp()))
    above = np.cross(right, forward)
    # Half the height of the picture is the tangent of half the view angle.
    px = 2 * np.tan(np.radians(camera.GetViewAngle()) / 2) / size[1]
    x = (pixel[0] + 0.5 - size[0] / 2) * px
    y = (size[1] / 2 - pixel[1] - 0.5) * px
    point = np.array(camera.GetPosition()) + depth * (forward + x * right + y * above)
    return tuple(map(float, point))


def _nearest_that_sees(depths, pixel):
    """-> column, row, or None if no pixel sees anything"""
    rows, columns = np.nonzero(depths)
    if len(rows) == 0:
        return None
    nearest = np.argmin((columns - pixel[0]) ** 2 + (rows - pixel[1]) ** 2)
    return int(columns[nearest]), int(rows[nearest])


def _point_in(depths, camera, pixel):
    column, row = pixel
    if not depths[row, column] > 0:
        seen = _nearest_that_sees(depths, pixel)
        if seen is None:
            raise UserProblem("the camera sees nothing of the cloud, so no pixel can be in focus; "
                              "check its position and focal point")
        raise UserProblem(f"nothing is seen at the pixel {column} {row}, so it cannot be in focus; "
                          f"the nearest one that sees a surface is {seen[0]} {seen[1]}")
    return _point(camera, depths.shape[::-1], pixel, float(depths[row, column]))


def point_at_pixel(renderer, pixel, update=_update):
    """-> the point (x, y, z) of the surface that a pixel sees, or UserProblem if it sees none.

    renderer: a vtkSurfelImageRenderer with camera and size. Its lens does not matter.
    pixel: column and row, counted from the upper left corner, as programs for pictures count.
    update: updates the renderer, for example with progress.
    """
    check_pixel(pixel, renderer.GetSize())
    return _point_in(sharp_depths(renderer, update), renderer.GetCamera(), pixel)


def fronts_of(views, renderer, update=_update):
    """-> [n] distances to the front of the surface in the middle of each view, on which a photographer
    would focus; 0 where nothing is seen. Of small pictures, so that what is hidden does not count."""
    size, camera = renderer.GetSize(), renderer.GetCamera()
    fronts = []
    for view in views:
        aspect = min(WIDEST, view.size[0] / view.size[1])
        renderer.SetSize(max(1, round(SMALL * aspect)), SMALL)
        renderer.SetCamera(make_camera(view))
        _draw_sharp(renderer, update)
        fronts.append(vtkSurfelSplatter.FindFront(renderer.GetOutput()))
    renderer.SetSize(*size)
    renderer.SetCamera(camera)
    return np.array(fronts)


def has_focus(asked):
    """Whether a view that is not complete says what is in focus."""
    is_aimed = asked.focal_point and not asked.wishes.finds_focus
    return bool(asked.focal_distance or asked.focus_point or is_aimed or asked.wishes.focus_pixel)


def focused_on_front(asked, view, renderer, update=_update):
    """The complete view, in focus at the front of the surface in its middle unless another focus was
    asked for. Of a volume complete_view has found what is in focus."""
    if has_focus(asked) or _shows_volume(renderer):
        return view
    [front] = fronts_of([view], renderer, update)
    return replace(view, focal_distance=front or view.focal_distance)


def distance_in_focus(view):
    """Along the view direction, world units. view: a complete one."""
    arm = subtract(view.focal_point, view.position)
    length = dot(arm, arm) ** 0.5
    if view.focus_point:
        return dot(subtract(view.focus_point, view.position), arm) / length
    return view.focal_distance or length


def ends_of(depths):
    """-> distance of the near and the far end of what a picture shows, or None if it is empty."""
    seen = depths[depths > 0]
    return tuple(map(float, np.percentile(seen, ENDS))) if len(seen) else None


def blur_at(view, depth):
    """Radius of the circle of confusion of the lens, px: C = f R |1/z_f - 1/z| as in
    Core/Lens/Lens.h; f in px, and f R / z_f is what circle_of_confusion is."""
    focus = distance_in_focus(view)
    if view.circle_of_confusion:
        infinite = view.circle_of_confusion
    else:
        focal_length = view.size[1] / 2 / np.tan(np.radians(view.view_angle) / 2)
        infinite = focal_length * view.focal_disk / 2 / focus
    return float(infinite * abs(1 - focus / depth))


def largest_blur(view, samples):
    """Radius of the blur at the end of what faces the camera in the picture that blurs more, px."""
    rays = samples.points - np.asarray(view.position)
    forward = unit(np.subtract(view.focal_point, view.position))
    right = unit(np.cross(forward, view.view_up))
    depths = rays @ forward
    high = np.tan(np.radians(view.view_angle) / 2) * depths
    wide = high * view.size[0] / view.size[1]
    is_seen = (np.abs(rays @ np.cross(right, forward)) < high) & (np.abs(rays @ right) < wide)
    is_seen &= samples.two_sided | (np.einsum("ij,ij->i", rays, samples.areas) < 0)
    return max((blur_at(view, end) for end in ends_of(depths[is_seen]) or ()), default=0.0)


def _with_blur(view, depths):
    """The view with a lens that gives the end of the picture farther from the focus this blur."""
    ends = ends_of(depths)
    if ends is None or not view.wishes.blur:
        return replace(view, circle_of_confusion=0.0)  # render warns of an empty picture
    focus = distance_in_focus(view)
    near, far = ends
    end = far if far - focus >= focus - near else near
    share = abs(1 - focus / end)
    if view.wishes.blur > LARGEST_BLUR * share:
        raise UserProblem(f"no lens blurs what is seen by {view.wishes.blur:g} px, as all of it, from {near:.7g} "
                          f"to {far:.7g} along the view direction, is in focus; move the focus or the camera")
    return replace(view, circle_of_confusion=view.wishes.blur / share)


def settle_focus(view, renderer, update=_update, depths=None):
    """-> the view with its last wishes granted: the pixel in focus, and the blur.

    view: a complete one. renderer: a vtkSurfelImageRenderer with the scene; gets the view's camera,
    lens and size. depths: sharp_depths of this picture if they are known.
    """
    renderer.SetCamera(make_camera(view))
    renderer.SetSize(*view.size)
    pixel, blur = view.wishes.focus_pixel, view.wishes.blur
    if pixel:
        check_pixel(pixel, view.size)
    if depths is None and (pixel or blur is not None):
        depths = sharp_depths(renderer, update)
    if pixel:
        point = _point_in(depths, renderer.GetCamera(), pixel)
        view = replace(view, focus_point=point, focal_distance=0.0)
    if blur is not None:
        view = _with_blur(view, depths)
    view = replace(view, wishes=Wishes())
    set_lens(renderer.GetSplatter(), view)
    return view
