# SPDX-License-Identifier: BSD-3-Clause
"""Twelve plots, opened and closed: neither objects nor memory nor OpenGL's names remain."""

import ctypes
import gc
import os
import unittest
import weakref

import numpy as np
import pyvista as pv

from plottercase import FRONT, PlotterCase

PLOTS = 12
SETTLED = 5  # plots after which everything that is made once has been made
GROWTH = 2.5 * 2**20  # bytes over 6 plots, up to 1.6 of which are noise; a window of 480 x 180 alone has 1 MiB of pixels and depths
GL_OBJECTS = ("Texture", "Framebuffer", "Buffer", "Renderbuffer")


def resident_bytes():
    """Bytes in use. What the allocator holds back goes first: it varies by 12 MiB from plot to plot."""
    gc.collect()
    ctypes.CDLL("libc.so.6").malloc_trim(0)
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def open_files():
    return len(os.listdir("/proc/self/fd"))


def gl_objects():
    """How many objects of each kind exist in the current OpenGL context."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p

    def function(name, *arguments):
        return ctypes.CFUNCTYPE(*arguments)(egl.eglGetProcAddress(name.encode()))

    counts = {}
    for kind in GL_OBJECTS:
        exists = function(f"glIs{kind}", ctypes.c_ubyte, ctypes.c_uint)
        counts[kind] = sum(exists(name) for name in range(1, 2000))
    return counts


class TestLeaks(PlotterCase):
    def setUp(self):
        self.alive = set()

    def watch(self, name, thing):
        """Notes that an object of VTK exists, until it is deleted."""
        self.alive.add(name)
        thing.AddObserver("DeleteEvent", lambda *_: self.alive.discard(name))

    def assert_no_growth(self, step):
        memory = []
        for number in range(PLOTS):
            step(number)
            memory.append(resident_bytes())
        self.assertLess(memory[-1] - memory[SETTLED], GROWTH, np.array(memory) / 2**20)

    def fill(self, pl, number):
        """Two subplots: scalars with a bar and a mesh; colours of points and a lens."""
        actor = pl.surfels.add(self.surfels, "height", cmap="viridis", name="scan")
        self.watch(f"mapper {number}", actor.mapper)
        pl.add_mesh(pv.Cube(center=(0, 0, 1.5), x_length=0.5), color="red")
        pl.camera_position = FRONT
        pl.subplot(0, 1)
        pl.surfels.add(self.cloud if number % 4 == 0 else self.surfels, "RGB")
        pl.camera_position = FRONT
        pl.surfels.lens(coc=10 + number, focus=(360, 90), cells=1 + number % 2)
        self.watch(f"pass {number}", pl.surfels.render_pass)
        self.watch(f"splatter {number}", pl.surfels.splatter)

    def plot(self, number):
        pl = pv.Plotter(shape=(1, 2), window_size=(480, 180))
        self.fill(pl, number)
        pl.screenshot(return_img=True)
        pl.surfels.lens(coc=0)
        pl.screenshot(return_img=True)
        # What the window alone holds: PyVista removes the observers of a window that it closes.
        self.watch(f"window {number}", pl.render_window.GetRenderers())
        pl.close()
        return weakref.ref(pl)

    def test_closed_plots(self):
        files, plotters = [], []

        def step(number):
            plotters.append(self.plot(number))
            files.append(open_files())

        self.assert_no_growth(step)
        self.assertEqual(self.alive, set())
        self.assertEqual([ref() for ref in plotters if ref() is not None], [])
        self.assertEqual(files[-1], files[SETTLED])

    def test_plots_by_one_call(self):
        self.assert_no_growth(lambda number: self.surfels.surfels.plot(
            scalars="height", coc=number, window_size=(240, 180)))

    def test_an_open_window(self):
        """Surfels, sizes and lenses come and go in one window."""
        pl = pv.Plotter(shape=(1, 2), window_size=(480, 180))
        self.addCleanup(pl.close)
        objects = []

        def step(number):
            pl.clear_actors()
            pl.subplot(0, 0)
            self.fill(pl, number)
            pl.window_size = (480 + 20 * (number % 2), 180)
            pl.screenshot(return_img=True)
            pl.surfels.lens(coc=0, cells=1)
            pl.screenshot(return_img=True)
            pl.render_window.MakeCurrent()
            objects.append(gl_objects())

        self.assert_no_growth(step)
        left = [name for name in self.alive if name.startswith("mapper")]
        self.assertLessEqual(len(left), 1)
        self.assertGreater(objects[-1]["Texture"], 3)
        self.assertEqual(objects[-1], objects[SETTLED], objects)

    def test_pictures_of_arrays(self):
        import surfelsplatting

        self.assert_no_growth(lambda number: surfelsplatting.render(
            self.cloud.points, colors=self.cloud["RGB"], lens=number))

    def test_failures(self):
        """What raises an exception leaves nothing either."""

        def step(_):
            for call in (lambda: self.surfels.surfels.plot(scalars="none"),
                         lambda: self.surfels.surfels.plot(coc=3, focus=(2000, 0)),
                         lambda: pv.PolyData().surfels.plot()):
                with self.assertRaises(ValueError):
                    call()

        self.assert_no_growth(step)


if __name__ == "__main__":
    unittest.main()
