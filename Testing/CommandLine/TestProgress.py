# SPDX-License-Identifier: BSD-3-Clause
"""The progress: a bar on a terminal, gone when done; lines in a log."""

import contextlib
import io
import os
import pty
import signal
import subprocess
import sys
import time
import unittest
from unittest import mock

from surfelsplatting.commandline import progress, session
from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.commandline.scan import Scan
from toolcase import SMALL, TOOL, ToolCase, sphere, wait_for, write_ply


class Terminal:
    def __init__(self, is_terminal=True):
        self.text = ""
        self._is_terminal = is_terminal

    def isatty(self):
        return self._is_terminal

    def write(self, text):
        self.text += text

    def flush(self):
        pass


class TestProgress(ToolCase):
    def test_bar(self):
        terminal = Terminal()
        with mock.patch.object(progress, "PATIENCE", 0.0):
            bar = progress.Progress(None, terminal)
            bar.show("estimation", 0.5)
            self.assertIn("\restimation   [" + "#" * 15 + " " * 15 + "]  50 %", terminal.text)
            bar.show("estimation", 1.0)
            self.assertIn("100 %", terminal.text)
            bar.clear()
        self.assertTrue(terminal.text.endswith("\r"))
        self.assertEqual(terminal.text.split("\r")[-2].strip(), "")

    def test_short_things_show_nothing(self):
        terminal = Terminal()
        bar = progress.Progress(None, terminal)
        bar.show("reading", 0.1)
        bar.clear()
        self.assertEqual(terminal.text, "")

    def test_shorter_line_replaces_a_longer_one(self):
        terminal = Terminal()
        with mock.patch.object(progress, "PATIENCE", 0.0):
            bar = progress.Progress(None, terminal)
            bar.show("frame 9/9, a long time left", 0.5)
            bar.show("frame 9/9", 0.5)
        lines = terminal.text.split("\r")
        self.assertEqual(len(lines[1]), len(lines[2]))

    def log_of(self, duration, stages, step=1.0):
        """The log of a run whose stages report each step, in seconds."""
        log, clock = Terminal(is_terminal=False), mock.Mock(return_value=100.0)
        with mock.patch.object(progress.time, "monotonic", clock):
            bar = progress.Progress(None, log)
            for stage in stages:
                for tick in range(int(duration / step)):
                    bar.show(f"{stage} {tick}" if stage == "frame" else stage, tick * step / duration)
                    clock.return_value += step
            bar.clear()
        return log.text.splitlines()

    def test_log_has_lines(self):
        self.assertEqual(self.log_of(9, ["reading", "surfels", "frame"]), [])
        self.assertEqual(self.log_of(25, ["surfels", "frame"]),
                         ["surfelsplat: surfels 40 % after 0:10",
                          "surfelsplat: surfels 80 % after 0:20",
                          "surfelsplat: frame 10 40 % after 0:10",
                          "surfelsplat: frame 20 80 % after 0:20"])
        hours = self.log_of(20000, ["surfels"])
        self.assertLess(len(hours), 70)
        self.assertIn("after 1:40", "".join(hours))
        self.assertFalse(any("\r" in line for line in hours))

    def test_log_of_the_tool(self):
        """Lines from the moment on at which a stage has taken some time, and the picture."""
        points, _ = sphere(300_000)
        write_ply("ball.ply", points)
        script = ("import sys; from surfelsplatting.commandline import main, progress; "
                  "progress.LOG_PATIENCE = 0.05; sys.exit(main(sys.argv[1:]))")
        result = subprocess.run([sys.executable, "-c", script, "render", "ball.ply", *SMALL,
                                 "--threads", "1", "-o", "out.png"],
                                capture_output=True, text=True, check=True, timeout=200)
        self.assertRegex(result.stderr, r"(?m)\Asurfelsplat: \w+ \d+ % after 0:0\d$")
        self.assertRegex(result.stderr, r"(?m)^surfelsplat: surfels \d+ % after")
        self.assertNotIn("\r", result.stderr)

    def test_hint_at_keeping(self):
        """Of surfels that took long, where nothing keeps them and something can."""
        write_ply("ball.ply", *sphere())
        self.render("ball.ply", *SMALL, "-o", "out.png", "--hierarchy", "ball.surfels")
        for patience, words, says in (
                (0, "render ball.ply -o out.png", "s; --hierarchy ball.surfels keeps them in a "
                 "file that is drawn at once"),
                (0, "film ball.ply -o out --frames 1", "s; surfelsplat render --hierarchy "
                 "ball.surfels keeps them in a file that is drawn at once"),
                (100, "render ball.ply -o out.png", None),
                (0, "render ball.ply -o out.png --hierarchy h.surfels", None),
                (0, "render ball.ply -o out.png --surfels s.vtp", None),
                (0, "render ball.ply -o out.png --no-lod", None),
                (0, "render ball.ply -o out.png --every 2", None),
                (0, "render ball.surfels -o out.png", None)):
            script = ("import sys; from surfelsplatting.commandline import main, session; "
                      f"session.LONG = {patience}; sys.exit(main(sys.argv[1:]))")
            result = subprocess.run([sys.executable, "-c", script, *words.split(), *SMALL],
                                    capture_output=True, text=True, check=True)
            if says:
                self.assertRegex(result.stderr, r"\Asurfelsplat: ball.ply: the surfels took \d+ "
                                 + says + r"\n\Z")
            else:
                self.assertEqual(result.stderr, "", words)

    def test_hint_of_windows_and_pages(self):
        write_ply("ball.ply", *sphere())
        for command in ("view", "web"):
            for patience in (0, 100):
                said = io.StringIO()
                with mock.patch.object(session, "LONG", patience), contextlib.redirect_stderr(said):
                    estimation = Scan(parse_arguments([command, "ball.ply"])).start_estimation()
                    self.addCleanup(estimation.close)
                    wait_for(estimation.poll, "the estimation")
                self.assertEqual("surfelsplat render --hierarchy ball.surfels keeps them"
                                 in said.getvalue(), patience == 0)

    def test_tool_on_a_terminal(self):
        points, colors = sphere(500_000)  # some times the bar's patience, with one thread
        write_ply("ball.ply", points, colors)
        ours, theirs = pty.openpty()
        self.addCleanup(os.close, ours)
        with subprocess.Popen([TOOL, "render", "ball.ply", *SMALL, "--threads", "1", "--hierarchy",
                               "ball.surfels", "-o", "out.png"], stderr=theirs) as process:
            os.close(theirs)
            shown = b""
            try:
                while chunk := os.read(ours, 4096):
                    shown += chunk
            except OSError:  # how a terminal says that nobody writes any more
                pass
        self.assertEqual(process.returncode, 0)
        self.assertRegex(shown.decode(), r"\rsurfels +\[#* *\] +\d+ %")
        self.assertEqual(shown.decode().split("\r")[-2].strip(), "")

    def interrupt(self, stream, first):
        """Ctrl-C once the tool has said its first word: quiet, 130, nothing left. It begins then with
        seconds of work."""
        points, _ = sphere(1_500_000)
        write_ply("ball.ply", points)
        with subprocess.Popen([TOOL, "render", "ball.ply", *SMALL, "-o", "out.png", "-v"],
                              stderr=stream) as process:
            said = first(process)
            time.sleep(0.3)
            process.send_signal(signal.SIGINT)
            if stream == subprocess.PIPE:
                said += process.stderr.read()
            process.wait(timeout=60)
        self.assertEqual(process.returncode, 130, said)
        self.assertEqual(os.listdir("."), ["ball.ply"])
        return said.decode()

    def test_interrupt(self):
        said = self.interrupt(subprocess.PIPE, lambda process: process.stderr.readline())
        self.assertIn("surfelsplat: interrupted\n", said)
        self.assertNotIn("Ctrl-C", said)

    def test_interrupt_on_a_terminal(self):
        ours, theirs = pty.openpty()
        self.addCleanup(os.close, ours)
        shown = self.interrupt(theirs, lambda process: os.read(ours, 4096))
        os.close(theirs)
        shown += os.read(ours, 65536).decode()
        self.assertNotIn("Ctrl-C", shown)


if __name__ == "__main__":
    unittest.main()
