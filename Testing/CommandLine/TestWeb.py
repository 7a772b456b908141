# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat web, with the real clicks of a headless Chromium, and what it refuses.

    TestWeb.py FOLDER [TESTS]

Without trame, trame-rca and playwright, they are installed into a virtual environment in FOLDER,
which is kept from run to run. Skipped without a network or Chromium.
"""

import http.client
import importlib.util
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest

import numpy as np

from toolcase import PATIENCE, ToolCase, content_of, sphere, wait_for, write, write_ply

SKIPPED = 77
PACKAGES = ("trame", "trame-rca", "playwright")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), "")
WIDTH, HEIGHT = 800, 500
LOOK = ["--position", "0", "0", "6", "--focal-point", "0", "0", "0", "--view-up", "0", "1", "0"]
MASK = (slice(None), slice(0, 500))  # of the picture, what nothing covers


def has_packages():
    return all(importlib.util.find_spec(name.replace("-", "_")) for name in PACKAGES)


def run_in_environment(folder):
    """Runs this test with the interpreter of a virtual environment that has the packages."""
    python = os.path.join(folder, "bin", "python")
    done = os.path.join(folder, "done")
    if not os.path.exists(done):
        shutil.rmtree(folder, ignore_errors=True)
        made = subprocess.run([sys.executable, "-m", "venv", "--without-pip",
                               "--system-site-packages", folder], check=False)
        fetched = made.returncode == 0 and subprocess.run(
            [sys.executable, "-m", "pip", "--python", python, "install", "--quiet",
             *PACKAGES], capture_output=True, text=True, check=False)
        if not fetched or fetched.returncode:
            print("SKIPPED: pip cannot fetch " + ", ".join(PACKAGES))
            sys.exit(SKIPPED)
        with open(done, "w", encoding="utf-8"):
            pass
    os.execv(python, [python, *sys.argv])


def server_environment():
    """Without a display, and without the wheel's tests' way to import cvista as vtkmodules."""
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    paths = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    environment["PYTHONPATH"] = os.pathsep.join(
        path for path in paths if not os.path.exists(os.path.join(path, "sitecustomize.py")))
    return environment


class Server:
    """A running surfelsplat web, without a display."""

    def __init__(self, *words):
        self.log = open("web.log", "w", encoding="utf-8")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "surfelsplatting", "web", *words, "-v"],
            stdout=self.log, stderr=self.log, env=server_environment())
        wait_for(lambda: "open http" in self.read_log() or self.process.poll() is not None, "page")
        found = re.search(r"http://([^:]*):(\d+)/(\?token=(\S+))?", self.read_log())
        if found:
            self.address, self.port, self.token = found[0], int(found[2]), found[4]

    def read_log(self):
        with open("web.log", encoding="utf-8") as file:
            return file.read()

    def wait_for_surfels(self):
        wait_for(lambda: "surfels are shown" in self.read_log() or self.process.poll() is not None,
                 "the surfels")

    def get(self, path, **headers):
        """-> status, content, cookies"""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.putrequest("GET", path, skip_host="Host" in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        response = connection.getresponse()
        content = response.read() if response.status != 101 else b""
        connection.close()
        return response.status, content, response.getheader("Set-Cookie", "")

    def open_socket(self, **headers):
        """-> status of the request for a web socket; 101 if it is open"""
        return self.get("/ws", Connection="Upgrade", Upgrade="websocket", **{
            "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
            **headers})[0]

    def listens_at(self):
        """-> addresses, as the kernel writes them"""
        found = set()
        for table in ("tcp", "tcp6"):
            with open(f"/proc/net/{table}", encoding="utf-8") as file:
                for line in file.readlines()[1:]:
                    address, port = line.split()[1].split(":")
                    if int(port, 16) == self.port and line.split()[3] == "0A":
                        found.add(address)
        return found


class WebCase(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(20_000)
        write_ply("scan.ply", points, colors)

    def serve(self, *words):
        server = Server("scan.ply", *LOOK, "--port", "0", *words)
        self.addCleanup(server.log.close)
        self.addCleanup(server.process.wait)
        self.addCleanup(server.process.kill)
        return server

    def render(self, *words):
        super().render("scan.ply", *words, "-o", "rendered.png")
        return content_of("rendered.png")


class TestPage(WebCase):
    """With a browser."""

    def open(self, *words):
        from playwright.sync_api import sync_playwright

        server = self.serve(*words)
        server.wait_for_surfels()
        playwright = sync_playwright().start()
        self.addCleanup(playwright.stop)
        browser = playwright.chromium.launch(executable_path=BROWSER,
                                             args=["--no-sandbox", "--disable-gpu"])
        self.addCleanup(browser.close)
        self.page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        self.said = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.goto(server.address)
        self.root = f"http://127.0.0.1:{server.port}/"
        self.wait_for_picture(server)
        return server

    def wait_for_picture(self, server):
        """Once in some hundred times, on a busy machine, a page that has just been loaded shows
        nothing for 30 s; why is not known. As a person would, the test loads it again, once, and
        prints what browser and server have said."""
        from playwright.sync_api import TimeoutError as TookTooLong

        picture = self.page.locator("img[src^=blob]")
        try:
            picture.wait_for()
        except TookTooLong:
            print("The browser shows no picture. It said:", *self.said, "The server said:",
                  server.read_log(), sep="\n", file=sys.stderr)
            self.page.reload()
            picture.wait_for()
        wait_for(lambda: self.camera()["size"] == [WIDTH, HEIGHT], "the size")

    def download(self, which):
        """Clicks. -> the content of camera.json or picture.png"""
        name = {"camera": "camera.json", "picture": "picture.png"}[which]
        with self.page.expect_download() as download:
            self.page.locator(f"#{which}").click()
        download.value.save_as(name)
        content = content_of(name)
        return json.loads(content) if which == "camera" else content

    def camera(self):
        """-> the camera now"""
        return self.page.request.get(self.root + "camera.json").json()

    def wait_for_change(self, before):
        """-> the camera when it is another one and rests"""
        last = [before]

        def has_changed():
            time.sleep(0.5)
            previous, last[0] = last[0], self.camera()
            return before != last[0] == previous

        wait_for(has_changed, "a change of the camera")
        return last[0]

    def click_until(self, condition, place):
        """Clicks again after a while: a page that is busy may miss a click."""
        def click():
            self.page.mouse.click(*place)
            for _ in range(20):
                time.sleep(0.25)
                if condition():
                    return True
            return False

        wait_for(click, "focusing")

    def drag(self, right, down):
        mouse = self.page.mouse
        mouse.move(300, 250)
        mouse.down()
        mouse.move(300 + right, 250 + down, steps=5)
        mouse.up()

    def test_focus_aperture_and_saving(self):
        server = self.open()
        first = self.download("camera")
        self.assertEqual(first, self.camera())
        self.assertEqual(self.download("picture"), self.render("--camera", "camera.json"))
        shutil.copy("camera.json", "first.json")
        self.click_until(lambda: self.camera() != first, (330, 190))
        second = self.camera()
        self.assertEqual({key for key in second if second[key] != first.get(key)}, {"focusPoint"})
        slider = self.page.locator("#aperture").bounding_box()
        self.page.mouse.click(slider["x"] + 0.72 * slider["width"], slider["y"] + 8)
        third = self.wait_for_change(second)
        aperture = third["circleOfConfusion"]
        self.assertIn(aperture, (22, 32, 45))
        self.page.get_by_text(f"Aperture {aperture:g} px, blur up to").wait_for()
        self.assertEqual(self.download("camera"), third)
        picture = self.download("picture")
        self.assertEqual(picture, self.render("--camera", "camera.json"))
        # As --focus-pixel puts it, to the last bit.
        self.assertEqual(picture, self.render("--camera", "first.json", "--focus-pixel", "330",
                                              "190", "--circle-of-confusion", aperture))
        self.check_shown()
        self.page.mouse.click(5, 5)
        self.page.get_by_text("nothing is seen at the pixel 5 5").wait_for()
        self.assertEqual(self.camera(), third)
        server.process.send_signal(signal.SIGINT)
        self.assertEqual(server.process.wait(PATIENCE), 0)
        self.assertNotIn("Traceback", server.read_log())

    def check_shown(self):
        """The browser shows the saved picture, but for JPEG's errors."""
        time.sleep(1)  # until it is sent in high quality
        self.page.screenshot(path="page.png")
        shown, saved = (self.read_png(name)[MASK].astype(int)[..., :3]
                        for name in ("page.png", "picture.png"))
        self.assertLess(abs(shown - saved).mean(), 2)

    def test_moving_and_colors(self):
        self.open()
        start = self.camera()
        self.drag(60, 30)
        turned = self.wait_for_change(start)
        self.assertLess(turned["position"][0], -1)  # the mouse takes the front with it
        self.assertGreater(turned["position"][1], 0.5)
        self.assertAlmostEqual(np.linalg.norm(turned["position"]), 6, delta=1e-6)
        self.assertEqual(turned["focusPoint"], start["focusPoint"])
        self.page.mouse.wheel(0, -120)
        nearer = self.wait_for_change(turned)
        self.assertLess(np.linalg.norm(nearer["position"]), 5.9)
        self.page.locator("#colors").select_option("z")
        self.page.get_by_text("0.9999", exact=True).wait_for()  # the bar's end
        self.assertEqual(self.download("camera"), nearer)
        self.assertEqual(self.download("picture"),
                         self.render("--camera", "camera.json", "--scalars", "z", "--lod-error", "1"))
        self.check_shown()
        self.page.locator("#reset").click()
        self.assertEqual(self.wait_for_change(nearer), start)
        self.page.mouse.move(300, 250)
        self.page.mouse.click(300, 250)
        self.page.keyboard.press("l")
        self.page.get_by_text("Aperture 32 px").wait_for()

    def test_page_sends_nonsense(self):
        """Nothing is read, written or lost."""
        server = self.open()
        before, files = self.camera(), sorted(os.listdir("."))
        session = "trame.client.getConnection().getSession()"
        for values in ("'/etc/passwd'", "'../scan.ply'", "-1", "1e9", "null", "[1]", "{a: 1}",
                       "NaN"):
            for name in ("stop", "scalars", "names", "news"):
                self.page.evaluate(f"trame.state.set('{name}', {values})")
            for call in (f"'trame.trigger', [{values}, [], {{}}]",
                         f"'trame.rca.event', ['scan', 'x', {values}]",
                         "'trame.rca.event', ['scan', 'x', {type: 'MouseWheel', "
                         f"spinY: {values}}}]",
                         "'trame.rca.event', ['scan', 'x', {type: 'LeftButtonPress', "
                         f"x: {values}, y: 1}}]",
                         f"'trame.rca.size', ['scan', 'x', {{w: {values}, h: {values}}}]",
                         f"'file.server.read', [{values}]",
                         f"'trame.lifecycle.update', [{values}]"):
                self.page.evaluate(f"{session}.call({call}).catch(e => 0)")
        self.page.reload()
        self.wait_for_picture(server)
        self.click_until(lambda: self.camera()["focusPoint"] != before["focusPoint"],
                         (WIDTH // 2, HEIGHT // 2))
        self.assertTrue(np.isfinite(self.camera()["position"]).all())
        self.assertEqual(sorted(os.listdir(".")), files)
        self.assertIsNone(server.process.poll())


class TestAccess(WebCase):
    PATHS = ("/", "/index.html", "/picture.png", "/camera.json", "/vue.global.js", "/nothing")

    def test_this_machine_only(self):
        server = self.serve()
        self.assertEqual(server.listens_at(), {"0100007F"})
        self.assertIsNone(server.token)
        self.assertEqual(server.get("/index.html")[0], 200)
        self.assertEqual(server.open_socket(), 101)
        host = f"127.0.0.1:{server.port}"
        self.assertEqual(server.open_socket(Origin=f"http://{host}"), 101)
        # A page of another site, and a name of another site that leads here.
        for headers in ({"Origin": "http://example.org"}, {"Host": f"example.org:{server.port}"},
                        {"Origin": "null"}, {"Origin": f"http://127.0.0.1:{server.port + 1}"}):
            self.assertEqual(server.open_socket(**headers), 403, headers)
            for path in self.PATHS:
                self.assertEqual(server.get(path, **headers)[0], 403, (path, headers))

    def test_no_other_files(self):
        server = self.serve()
        write("secret.txt", "secret")
        for path in ("/secret.txt", "/scan.ply", "/web.log", "/etc/passwd"):
            for prefix in ("", "/..", "/../../../../../..", "/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e",
                           "/assets/../../../../../../../..", "/..%2f..%2f..%2f..%2f..", "//"):
                for folder in ("", os.getcwd()):
                    status, content, _ = server.get(prefix + folder + path)
                    self.assertGreaterEqual(status, 400, prefix + folder + path)
                    self.assertNotIn(b"secret", content)
                    self.assertNotIn(b"root:", content)
        status, content, _ = server.get("/picture.png?path=secret.txt&file=/etc/passwd")
        self.assertEqual((status, content[1:4]), (200, b"PNG"))
        self.assertEqual(sorted(os.listdir(".")), ["scan.ply", "secret.txt", "web.log"])

    def check_token(self, server):
        self.assertGreaterEqual(len(server.token), 20)
        for query in ("", "?token=", "?token=wrong", f"?token={server.token}x", "?token=%C3%A4"):
            for path in self.PATHS:
                self.assertEqual(server.get(path + query)[0], 403, path + query)
        self.assertEqual(server.open_socket(), 403)
        status, _, cookie = server.get(f"/?token={server.token}")
        self.assertEqual(status, 302)
        self.assertIn("HttpOnly", cookie)
        name, _, value = cookie.split(";")[0].partition("=")
        for given, code in ((f"{name}={value}", 200), (f"{name}=wrong", 403),
                            (f"x{name}={value}", 403)):
            self.assertEqual(server.get("/camera.json", Cookie=given)[0], code)
            self.assertEqual(server.open_socket(Cookie=given), 101 if code == 200 else 403)

    def test_token(self):
        server = self.serve("--token")
        self.assertEqual(server.listens_at(), {"0100007F"})
        self.check_token(server)
        self.assertNotEqual(self.serve("--token").token, server.token)

    def test_other_machines_need_the_token(self):
        server = self.serve("--host", "0.0.0.0")
        self.assertEqual(server.listens_at(), {"00000000"})
        self.check_token(server)

    def test_browser_with_token(self):
        page = TestPage(methodName="open")
        page.serve = self.serve
        self.addCleanup(page.doCleanups)
        page.open("--token")
        self.assertNotIn("token", page.page.url)
        self.assertEqual(page.camera()["size"], [WIDTH, HEIGHT])

    def test_what_cannot_be_served(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = str(taken.getsockname()[1])
            for words, says in ((["--port", port], f"port {port}: .*in use"),
                                (["--host", "no.such.host.invalid"], "no.such.host.invalid"),
                                (["--port", "70000"], "70000 is not between 0 and 65535"),
                                (["--sides", "given", "--port", "0"], "has no normals")):
                result = subprocess.run(
                    [sys.executable, "-m", "surfelsplatting", "web", "scan.ply",
                     *words],
                    capture_output=True, text=True, timeout=PATIENCE, check=False,
                    env=server_environment())
                self.assertEqual(result.returncode, 2, (words, result.stderr))
                self.assertRegex(result.stderr, says)
                self.assertEqual(result.stderr.count("\n"), 1, result.stderr)


if __name__ == "__main__":
    if not BROWSER:
        print("SKIPPED: there is no Chromium")
        sys.exit(SKIPPED)
    if has_packages():
        unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
    if len(sys.argv) < 2:
        print("SKIPPED: there is no " + " or ".join(PACKAGES))
        sys.exit(SKIPPED)
    run_in_environment(sys.argv[1])
