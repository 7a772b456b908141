# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat info: what is in a point cloud."""

import json
import math
from shlex import quote

import numpy as np

from ..clouds.cloud import Cloud, is_hierarchy
from ..clouds.colors import intensity_among, is_colors
from ..clouds.stations import TO_SCANNER, scanners_of
from ..clouds.volumes import scalar_names
from ..colormaps import range_without_outliers
from ..formats.sogfiles import bytes_of
from ..notes import find_scanners, note_scan
from ..shapes.rooms import is_room, may_be_room
from ..shapes.samples import Samples
from ..shapes.up import is_open
from ..views.cameras import View
from ..views.framing import home_in, up_in
from ..views.inside import options_inside
from ..vtkarrays import to_numpy
from ..vtkSurfelFilters import vtkPointCloudCleaning, vtkSurfelHierarchy
from .session import Session, counted
from .volume import classify

NOISY = 0.05  # of the points; fewer are edges and corners
FAR_OFF = 5  # spacings, by which stray points make the bounds larger
OPAQUE = 0.9  # opacity above which a Gaussian hides what is behind it
SHOWN = 0.8  # part of the surface that shows both sides, from which --sides two changes little
NOT_UNIT = 0.01  # as far from 1 the length of normals is worth a word
LISTED = 20  # places of scanners
LONG = 20_000_000  # points that take more than a minute to become surfels
QUICK = 1_000_000  # points that take seconds


def _finite_range(values):
    finite = values[np.isfinite(values)]
    return [float(finite.min()), float(finite.max())] if len(finite) else None


def _meaning(array, data):
    if array is data.GetNormals() or array.GetName() == "Normals":
        return "normals"
    if array is data.GetScalars() and is_colors(array):
        return "colours"
    if (array.GetName() or "").startswith("Surfel"):
        return "surfels"
    if (array.GetName() or "").startswith("Gaussian"):
        return "Gaussians"
    if array.GetName() == TO_SCANNER:
        return "ways to the scanners"
    return "scalars" if array.GetNumberOfComponents() == 1 else "values"


def _field(array, data):
    """{name, meaning, type, components, range} of a point array; of normals also their length, and the
    part that has one."""
    field = {"name": array.GetName(), "meaning": _meaning(array, data),
             "type": array.GetDataTypeAsString(), "components": array.GetNumberOfComponents(),
             "range": _finite_range(to_numpy(array))}
    if field["meaning"] == "normals" and len(to_numpy(array)):
        lengths = np.linalg.norm(to_numpy(array).astype(float), axis=1)
        known = lengths[np.isfinite(lengths) & (lengths > 0)]
        field["known"] = len(known) / len(lengths)
        field["length"] = float(np.median(known)) if len(known) else 0.0
    return field


def _fields(data):
    arrays = [data.GetArray(number) for number in range(data.GetNumberOfArrays())]
    return [_field(array, data) for array in arrays if array is not None]


def _bounds(points, origin=(0.0, 0.0, 0.0)):
    """{axis: [low, high]} of the finite points, which are relative to the origin."""
    ranges = [_finite_range(points[:, i]) for i in range(3)]
    return {axis: limits and [x + shift for x in limits]
            for axis, limits, shift in zip("xyz", ranges, origin)}


def _cut_off(bounds, outer):
    """Bounds of points of which smoothing has moved some beyond the outer bounds, those of the file."""
    return {axis: limits and list(map(float, np.clip(limits, *outer[axis])))
            for axis, limits in bounds.items()}


def _clean(cloud, session):
    """-> the Cloud without stray points, and what cleaning has found."""
    cleaning = vtkPointCloudCleaning()
    cleaning.SetInputData(cloud.data)
    cleaning.GenerateShiftsOn()
    if cloud.viewpoint:
        cleaning.SetColumns(cloud.columns)
        cleaning.UseViewpointOn()
        cleaning.SetViewpoint(cloud.viewpoint)
    session.progress.update(cleaning, "cleaning")
    session.messages.check(f"{session.arguments.cloud}: ")
    cleaned = cleaning.GetOutput()
    note_scan(cleaned, cloud.viewpoint)  # the points are still the sensor's
    shift = cleaned.GetPointData().GetArray("CleaningShift")
    moved = np.linalg.norm(to_numpy(shift), axis=1) if shift else np.zeros(0)
    joined = cleaning.GetNumberOfJoinedPoints()  # the last ones
    moved = moved[:len(moved) - joined]
    moved = moved[moved > 0]
    found = {"not_finite": cleaning.GetNumberOfNonFinitePoints(),
             "duplicate": cleaning.GetNumberOfDuplicatePoints(),
             "stray": cleaning.GetNumberOfStrayPoints(),
             "twin": cleaning.GetNumberOfTwinPoints(),
             "joined": joined,
             "thick": cleaning.GetNumberOfThickPoints(),
             "noisy": cleaning.GetNumberOfMovedPoints(),
             "noise": float(np.sqrt(np.mean(moved ** 2))) if len(moved) else 0.0}
    return Cloud(cleaned, cloud.viewpoint), found


def _up(up):
    return {"up": [float(x) for x in up.axis], "up_is_clear": bool(up.is_clear)}


def _surface(cleaned, cloud, session):
    """What the surfels say: spacing, up, the part that is visible from both sides.

    cleaned: the Cloud without stray points. cloud: the same as it is in the file.
    """
    surfels = session.surfels(cleaned)
    samples = Samples(surfels)
    up = up_in(View(), cloud, surfels)
    room = "yes" if is_room(samples) else "maybe" if may_be_room(samples) else "no"
    inside = {} if room == "no" else {"inside": options_inside(samples, up.axis)}
    return {"bounds_without_stray": _bounds(samples.points), "spacing": samples.spacing,
            **_up(up), "room": room, **inside,
            "two_sided": float(np.mean(samples.two_sided)), "open": is_open(samples)}


def _gaussians(cloud):
    """What the Gaussians are: degree of the harmonics, share of opaque ones, typical size."""
    data = cloud.data.GetPointData()
    samples = Samples(cloud.data)
    finite = samples.covariances[np.isfinite(samples.covariances).all(axis=1)]
    variances = np.linalg.eigvalsh(finite[:, (0, 3, 5, 3, 1, 4, 5, 4, 2)].reshape(-1, 3, 3))
    size = np.sqrt(np.median(np.maximum(variances[:, 2], 0.0))) if len(finite) else 0.0
    found = {"bounds_without_stray": _bounds(samples.points), "size": float(size),
             **_up(up_in(View(), cloud, cloud.data))}
    home = home_in(cloud, cloud.data)
    if home:
        found["seen_from"] = home.what
    harmonics, opacity = data.GetArray("GaussianHarmonics"), data.GetArray("GaussianOpacity")
    if harmonics:
        found["harmonics_degree"] = math.isqrt(harmonics.GetNumberOfComponents() // 3) - 1
    if opacity:
        found["opaque"] = float(np.mean(to_numpy(opacity) > OPAQUE))
    return found


def _volume(cloud, session):
    """-> what a volume is, and how it would be drawn."""
    data = cloud.data
    report = {"file": session.arguments.cloud, "bytes": bytes_of(cloud.path),
              "holds": "volume", "points": data.GetNumberOfPoints(), "read_as": cloud.how,
              "fields": _fields(data.GetPointData()) + _fields(data.GetCellData()),
              "bounds": dict(zip("xyz", np.reshape(data.GetBounds(), (3, 2)).tolist())),
              "spacing": list(data.GetSpacing())}
    found = classify(cloud, session.arguments)
    report.update(scalars=found.scalars, opacity=found.opacities, unit_distance=found.unit_distance)
    suggestions = [("--blur 10", "adds a lens"),
                   (f"--opacity {found.opacity_text}", "is the default, to be edited"),
                   (f"--unit-distance {found.unit_distance / 2:.4g}",
                    "draws all of it twice as dense")]
    bulk = range_without_outliers(found.samples, found.limits)
    if bulk:
        suggestions.append((f"--range {' '.join(bulk)}", "99 % of the values are there"))
    suggestions += [(f"--scalars {quote(name)}", "shows this array")
                    for name in scalar_names(data) if name != found.scalars]
    report["suggestions"] = [{"options": options, "reason": reason}
                             for options, reason in suggestions]
    return report


def _suggestions(report, cloud):
    """[{options, reason}]"""
    found = [("--blur 10", "adds a lens: what is farthest from the focus gets a blur of 10 px")]
    scalars = [field["name"] for field in report["fields"] if field["meaning"] == "scalars"]
    has_colors = any(field["meaning"] == "colours" for field in report["fields"])
    if scalars and not has_colors:
        name = intensity_among(scalars) or scalars[0]
        values = to_numpy(cloud.data.GetPointData().GetArray(name))
        bulk = range_without_outliers(values, _finite_range(values) or (0.0, 0.0))
        within = f" --range {' '.join(bulk)}" if bulk else ""
        found.append((f"--scalars {quote(name)}{within}", "there are no colours, but there are values"
                      + (", 99 % of them in this range" if bulk else "")))
    if "inside" in report:
        found.append((report["inside"], "looks into the room" if report["room"] == "yes" else
                      "looks into it, if it is a room"))
    if (report.get("open") and report["two_sided"] < SHOWN
            and not (cloud.columns or cloud.image or cloud.is_surfels)):
        found.append(("--sides two", "the surface is open; this shows it from its back as well"))
    if cloud.is_antialiased:
        found.append(("--capture-filter antialiased", "the capture was trained with it"))
    if "points_found" in report:
        points, cleaned = report["points"], report["points_found"]
        changed = sum(cleaned[what] for what in ("noisy", "thick", "joined", "twin"))
        if not cleaned["stray"] and changed < NOISY * points:
            found.append(("--cleaning off", "saves time: the points are clean"))
        elif cleaned["noise"] > report["spacing"] and not cloud.columns:
            found.append(("--neighbors 40", "the noise is larger than the spacing"))
        if points > LONG:
            found.append(("--hierarchy OUT.surfels", "keeps the surfels, which take minutes to make"))
            found.append((f"--every {-(-points // QUICK)}", "shows it within seconds, with less detail"))
    return [{"options": options, "reason": reason} for options, reason in found]


def _report(cloud, session):
    if cloud.is_volume:
        return _volume(cloud, session)
    clouds = session.arguments.clouds
    data = cloud.data
    kind = ("Gaussians" if cloud.is_gaussians else "hierarchy" if is_hierarchy(data) else
            "surfels" if cloud.is_surfels else "points")
    points, origin = to_numpy(data.GetPoints().GetData()), [0.0, 0.0, 0.0]
    vtkSurfelHierarchy.ReadOrigin(data, origin)
    report = {"file": session.arguments.cloud, "bytes": sum(map(bytes_of, clouds)), "holds": kind,
              "points": data.GetNumberOfPoints(), "read_as": cloud.how or "as the file says",
              "fields": _fields(data.GetPointData()), "bounds": _bounds(points, origin)}
    if cloud.viewpoint:
        report["sensor"] = list(map(float, cloud.viewpoint))
    elif kind == "points":
        is_told = data.GetPointData().HasArray(TO_SCANNER) or not find_scanners(data)
        places, known = scanners_of(data)
        if known:
            report["scanners"] = {"places": places, "known": known, "told_by": "file" if is_told
                                  else "the order of the points"}
    if cloud.columns:
        report["depth_image"] = [cloud.columns, data.GetNumberOfPoints() // cloud.columns]
    if kind == "Gaussians":
        report.update(_gaussians(cloud))
    elif kind == "points":
        cleaned, report["points_found"] = _clean(cloud, session)
        report.update(_surface(cleaned, cloud, session))
        report["bounds_without_stray"] = _cut_off(report["bounds_without_stray"], report["bounds"])
    else:
        report.update(_surface(cloud, cloud, session))
    report["suggestions"] = _suggestions(report, cloud)
    return report


def _size(count):
    for unit in ("bytes", "kB", "MB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"


def _bounds_text(bounds, spacing):
    """With as many digits as the spacing has a meaning for."""
    largest = max(abs(x) for limits in bounds.values() for x in limits or (0.0,))
    digits = max(4, min(17, 2 + math.ceil(math.log10(max(1.0, largest / max(spacing, 1e-300))))))
    return ", ".join(f"{axis} {limits[0]:.{digits}g} to {limits[1]:.{digits}g}" if limits else
                     f"{axis} unknown" for axis, limits in bounds.items())


def _differ(report, spacing):
    """Whether the bounds without stray points are smaller by more than some spacings."""
    return any(abs(x - y) > FAR_OFF * spacing
               for axis, limits in report["bounds"].items()
               for x, y in zip(limits or (), report["bounds_without_stray"][axis] or ()))


def _field_text(field):
    text = f"{field['name']}: {field['meaning']}, {field['type']}"
    if field["components"] > 1:
        text += f", {field['components']} values a point"
    if field["range"] and field["meaning"] not in ("normals", "surfels", "Gaussians", "ways to the scanners"):
        text += ", {:.7g} to {:.7g}".format(*field["range"])
    if field.get("known", 1) < 1:
        share = f"{100 - 100 * field['known']:.3g} % of the" if field["known"] else "all"
        text += f"; {share} points have none (zero, or no number), and get theirs from the shape"
    if field.get("length") and abs(field["length"] - 1) > NOT_UNIT:
        text += f"; {field['length']:.3g} long, of which only the direction counts"
    return text


def _place_text(place):
    return "at " + " ".join(f"{x:.7g}" for x in place)


def _scanner_lines(found):
    part = "" if found["known"] == 1 else f", of {100 * found['known']:.3g} % of the points"
    places = found["places"]
    if places is None:
        yield "scanners", f"known{part}, and with them the sides; at too many places to list"
        return
    how = "" if found["told_by"] == "file" else f", told by {found['told_by']}"
    yield "scanners", f"{len(places)}{how}, which tell the sides{part}"
    for place in places[:LISTED]:
        yield "scanners", _place_text(place)
    if len(places) > LISTED:
        yield "scanners", f"and at {len(places) - LISTED} other places"


def _found_lines(report):
    found = report["points_found"]
    points = report["points"]
    if found["noisy"]:
        yield "noise", (f"{found['noisy']} points ({100 * found['noisy'] / points:.3g} %) are off a "
                        f"smooth surface, by {found['noise']:.3g} (rms), "
                        f"{found['noise'] / report['spacing']:.2g} spacings")
    if found["thick"]:
        yield "noise", (f"{found['thick']} points ({100 * found['thick'] / points:.3g} %) fill space: "
                        "foliage, or noise of more than two spacings, too much to smooth")
    if not (found["noisy"] or found["thick"]):
        yield "noise", "none that can be seen"
    if found["joined"] or found["twin"]:
        yield "scans", (f"two: the last {found['joined'] + found['twin']} points are a second scan, "
                        f"which moves to the first; {found['twin']} of them fall on points of the "
                        "first and are left out")
    lost = (("stray", "stray points", ""), ("duplicate", "duplicates", " (at the place of another point)"),
            ("not_finite", "points", " without finite coordinates"))
    texts = [counted(found[name], things) + more for name, things, more in lost if found[name]]
    yield "left out", ", ".join(texts) or "nothing"


def _gaussian_lines(report):
    yield "size", f"{report['size']:.4g}: median of the largest standard deviation of a Gaussian"
    if "opaque" in report:
        yield "opaque", f"{100 * report['opaque']:.3g} % have an opacity above {OPAQUE:g}"
    if "harmonics_degree" in report:
        yield "colours", f"spherical harmonics of degree {report['harmonics_degree']}"
    if "seen_from" in report:
        yield "view", report["seen_from"]


def _suggestion_lines(suggestions):
    width = max([15, *(len(suggestion["options"]) for suggestion in suggestions)])
    for suggestion in suggestions:
        yield "try", f"{suggestion['options']:<{width}}  {suggestion['reason']}"


def _volume_lines(report):
    size, spacing = _size(report["bytes"]), report["spacing"]
    yield "file", f"{report['file']}, {size}, {report['read_as']} points"
    yield "bounds", _bounds_text(report["bounds"], min(spacing))
    yield "spacing", " x ".join(f"{x:.4g}" for x in spacing)
    for field in report["fields"]:
        yield "field", _field_text(field)
    yield from _suggestion_lines(report["suggestions"])


def _lines(report):
    """Yields (heading, text)."""
    if report["holds"] == "volume":
        yield from _volume_lines(report)
        return
    size = _size(report["bytes"])
    is_tree = report["holds"] == "hierarchy"
    held = counted(report["points"], "surfels" if is_tree else report["holds"])
    yield "file", f"{report['file']}, {size}, {held}{' with a hierarchy' if is_tree else ''}"
    spacing = report["size" if "size" in report else "spacing"]
    yield "bounds", _bounds_text(report["bounds"], spacing)
    if _differ(report, spacing):
        yield "bounds", _bounds_text(report["bounds_without_stray"], spacing) + ", without stray points"
    if "spacing" in report:
        yield "spacing", f"{spacing:.4g}, of points on the surface"
    yield "read", report["read_as"]
    for field in report["fields"] or [None]:
        yield "field", _field_text(field) if field else "none but coordinates"
    if "sensor" in report:
        yield "sensor", _place_text(report["sensor"])
    if "scanners" in report:
        yield from _scanner_lines(report["scanners"])
    if "depth_image" in report:
        yield "image", "a depth image of {} x {} pixels".format(*report["depth_image"])
    if "points_found" in report:
        yield from _found_lines(report)
    if "size" in report:
        yield from _gaussian_lines(report)
    if "up" in report:
        yield "up", (" ".join(f"{round(x, 3) + 0.0:g}" for x in report["up"])  # no -0
                     + ("" if report["up_is_clear"] else ", a guess; --up turns it"))
    if report.get("room") == "yes":
        yield "room", "seen from inside: a wall that turns its back to the camera is not drawn"
    if report.get("two_sided"):
        share = f"{100 * report['two_sided']:.3g} %".replace("100 %", "all")
        yield "sides", f"{share} of the surface is drawn from both sides, as its outside is not known"
    yield from _suggestion_lines(report["suggestions"])


def info(arguments):
    session = Session(arguments)
    with session.progress_shown():
        report = _report(session.load(with_note=False), session)
    if arguments.json:
        print(json.dumps(report, indent=1, allow_nan=False))
        return
    last = None
    for heading, text in _lines(report):
        print(f"{heading if heading != last else '':<9}{text}")
        last = heading
