# SPDX-License-Identifier: BSD-3-Clause
"""scene.py FOLDER SCENES...: draws those of TestProcesses.py, each in a folder of its own, by pvbatch, on
one or several ranks, or by pvpython as the client of a server (PORT)."""

import os
import sys
import time

from paraview import simple

from views import plain_view, show_splats

FOLDER, *SCENES = sys.argv[1:]
DATA = os.environ["DATA"]
CIRCLES_OF_CONFUSION = (0, 12, 36)


def connect_to(port):
    """A server that may still be starting: up to a minute."""
    for _ in range(60):
        try:
            if simple.Connect("127.0.0.1", port):
                return
        except RuntimeError:
            pass
        time.sleep(1)
    sys.exit("no server")


def start():
    if os.environ.get("PORT"):
        connect_to(int(os.environ["PORT"]))
        simple.LoadPlugin(os.environ["PLUGIN"], remote=True, ns=simple.__dict__)
    simple.LoadPlugin(os.environ["PLUGIN"], remote=False, ns=simple.__dict__)
    simple._DisableFirstRenderCameraReset()


def make_view(kind, threshold):
    view = plain_view(kind, [0.1, 0.2, 0.3], [0.5, 0.4, 6])
    view.CameraFocalDistance = 5.8
    simple.GetSettingsProxy("RenderViewSettings").RemoteRenderThreshold = threshold
    view.RemoteRenderThreshold = threshold
    return view


class Scene:
    """Is rendered where its pieces are if they have more than threshold MB."""

    def __init__(self, kind, folder, threshold=0.0):
        self.kind, self.folder = kind, f"{FOLDER}/{folder}"
        os.makedirs(self.folder, exist_ok=True)
        self.view = make_view(kind, threshold)
        self.displays = {}
        for name, color in (("near", [1, 0.8, 0.6]), ("wall", [0.5, 0.9, 0.6]),
                            ("far", [1, 1, 1])):
            source = simple.XMLPartitionedPolydataReader(FileName=[f"{DATA}/{name}.pvtp"])
            self.displays[name] = show_splats(source, self.view, color)

    def see_through(self, radius):
        """A lens of this circle of confusion, px."""
        if self.kind == "SurfelRenderView":
            self.view.LensMode = "Circle of confusion"
            self.view.CircleOfConfusion = radius
            return
        for display in self.displays.values():
            display.SurfelLensMode = "Circle of confusion"
            display.SurfelCircleOfConfusion = radius

    def add_mesh(self):
        mesh = simple.Sphere(
            Center=[-0.6, 0.1, 1.3], Radius=0.5, ThetaResolution=64, PhiResolution=64)
        display = simple.Show(mesh, self.view)
        display.DiffuseColor = display.AmbientColor = [1, 0.2, 0.2]

    def save(self, name):
        simple.SaveScreenshot(f"{self.folder}/{self.kind}-{name}.png", self.view)


def draw_all():
    scene = Scene("RenderView", "all")
    for kind in ("opaque", "translucent", "mesh"):
        scene.displays["near"].Opacity = 0.5 if kind == "translucent" else 1.0
        scene.displays["far"].Opacity = 0.4 if kind == "translucent" else 1.0
        if kind == "mesh":
            scene.add_mesh()
        for radius in CIRCLES_OF_CONFUSION:
            scene.see_through(radius)
            scene.save(f"{kind}-{radius}")
    scene = Scene("SurfelRenderView", "all")
    scene.add_mesh()
    for radius in CIRCLES_OF_CONFUSION:
        scene.see_through(radius)
        scene.save(f"mesh-{radius}")
    scene.view.LensCells = 3
    scene.save("cells")


def draw_camera_lens(folder, threshold):
    """The lens that the camera itself has."""
    for kind in ("RenderView", "SurfelRenderView"):
        scene = Scene(kind, folder, threshold)
        scene.view.CameraFocalDisk = 0.5
        for display in scene.displays.values():
            display.SurfelLensMode = "Camera"
        if kind == "SurfelRenderView":
            scene.view.LensMode = "Camera"
        scene.save("camera")


DRAW = {"all": draw_all,
        "camera": lambda: draw_camera_lens("camera", 0.0),
        "collected": lambda: draw_camera_lens("collected", 1000.0)}
start()
for name in SCENES:
    DRAW[name]()
rank = simple.servermanager.vtkProcessModule.GetProcessModule().GetPartitionId()
if os.environ.get("DYING") == str(rank):
    os._exit(3)
if os.environ.get("DYING"):
    DRAW["camera"]()
os.write(1, b"drawn\n")  # ParaView's own stdout may be lost at the end below
if os.environ.get("PORT"):
    os._exit(0)
