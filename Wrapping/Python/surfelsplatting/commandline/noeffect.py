# SPDX-License-Identifier: BSD-3-Clause
"""Options that have no effect beside the others, or for a cloud."""

from ..clouds.thinning import may_be_thinned
from ..clouds.volumes import color_components


def _texts(arguments, options, reason):
    """One warning for those of the options that are on the command line."""
    given = [option for option in options if option in arguments.given]
    if not given:
        return []
    verb = "has" if len(given) == 1 else "have"
    return [f"{' and '.join(given)} {verb} no effect {reason}"]


def _of_lens(arguments, view):
    if view.has_lens:
        return []
    options = ["--lens-cells", "--reference"]
    if not arguments.save_camera:  # a saved camera keeps the focus
        options = ["--focus-pixel", "--focus-point", "--focal-distance", *options]
    return _texts(arguments, options, "without a lens; add one, for example --blur 10")


def without_effect(arguments, view):
    """-> texts about options that change nothing, whatever the cloud. view: the asked one."""
    texts = _of_lens(arguments, view)
    if arguments.unlit and not (arguments.hierarchy or arguments.surfels):  # which keep the normals
        texts += _texts(arguments, ("--shade",), "with --unlit")
    return texts


def mixes_as_stored(cloud, arguments):
    """Whether the colours are harmonics, which stay as they are stored with --linear-light."""
    return bool(cloud.data.GetPointData().HasArray("GaussianHarmonics")) and not arguments.scalars


def _of_gaussians(cloud, arguments):
    texts = []
    if mixes_as_stored(cloud, arguments):
        texts += _texts(arguments, ["--linear-light"],
                        f"on {arguments.cloud}, whose colours are harmonics; they are made to be "
                        "mixed as they are stored")
        texts += _texts(arguments, ["--lit"],
                        f"on {arguments.cloud}, whose colours are harmonics; they hold its light")
    return texts + _of_normals(arguments)


def _of_normals(arguments):
    if "NORMAL" not in (arguments.channels or ()):
        return []
    return [f"the channel normal is 0 on {arguments.cloud}: it holds those of surfaces, not of "
            "Gaussians in space"]


def _of_kind(cloud, arguments):
    """Options for volumes and captures only, and for scalars."""
    texts = []
    if not cloud.is_volume:
        texts += _texts(arguments, ("--opacity", "--unit-distance", "--shade"),
                        f"on {arguments.cloud}, which is no volume")
        if not arguments.scalars:
            texts += _texts(arguments, ("--colormap", "--range"), "without --scalars")
    else:
        if not arguments.shade:
            texts += _texts(arguments, ("--lit",), "without --shade")
        if color_components(cloud.data, arguments.scalars or arguments.volume_scalars):
            options = ("--colormap", "--range") if arguments.opacity else ("--colormap",)
            texts += _texts(arguments, options, f"on {arguments.cloud}, which has colours")
    if not cloud.data.GetPointData().HasArray("GaussianOpacity"):
        texts += _texts(arguments, ("--capture-filter",),
                        f"on {arguments.cloud}, which is no capture of 3D Gaussian splatting")
    return texts


def without_effect_on(cloud, arguments):
    """-> texts about options that change nothing for this cloud."""
    options = ("--every", "--cleaning", "--sides", "--neighbors")
    texts = _of_kind(cloud, arguments)
    if cloud.is_volume:
        return (_texts(arguments, (*options, "--points-per-part"),
                       f"on {arguments.cloud}, which is a volume; only points of surfaces become "
                       "surfels") + texts + _of_normals(arguments))
    if cloud.is_gaussians:
        return (_texts(arguments, (*options, "--points-per-part"),
                       f"on {arguments.cloud}, which holds Gaussians in space; only points of "
                       "surfaces become surfels") + texts + _of_gaussians(cloud, arguments))
    if not cloud.is_surfels:
        if not may_be_thinned(cloud):
            texts += _texts(arguments, ["--every"], f"on {arguments.cloud}, which is a depth image")
        return texts
    return _texts(arguments, options,
                  f"on {arguments.cloud}, which holds surfels already; give the points that they "
                  "were made of") + texts
