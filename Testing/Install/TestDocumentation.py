# SPDX-License-Identifier: BSD-3-Clause
"""Links and file names in the documentation: each leads to a file of the project."""

import os
import re
import unittest

SOURCE = os.environ["SOURCE"]
FILE_NAME = re.compile(r"`(?:bash )?([\w/.-]*\w\.(?:h|cxx|py|sh|md|xml|glsl|txt))`")


def place_of(heading):
    """The #name that links to it."""
    words = re.sub(r"[^\w -]", "", re.sub(r"\]\(.*?\)", "", heading))
    return words.lower().replace(" ", "-")


def project_files():
    """Paths relative to the project's top; build folders and hidden ones are left out."""
    paths = []
    for folder, folders, names in os.walk(SOURCE):
        folders[:] = [name for name in folders if not name.startswith((".", "build"))
                      and not os.path.exists(os.path.join(folder, name, "CMakeCache.txt"))]
        paths += [os.path.relpath(os.path.join(folder, name), SOURCE) for name in names]
    return paths


class TestDocumentation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.files = project_files()
        cls.texts = {}
        for path in cls.files:
            if path.endswith(".md"):
                with open(os.path.join(SOURCE, path), encoding="utf-8") as file:
                    cls.texts[path] = file.read()

    def test_links(self):
        count = 0
        for path, text in self.texts.items():
            for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
                if not re.match(r"\w+:", link):
                    target = os.path.join(SOURCE, os.path.dirname(path), link)
                    self.assertTrue(os.path.exists(target), f"{path}: {link}")
                    count += 1
        self.assertGreater(count, 20)

    def test_places_in_pages(self):
        """Of a heading."""
        count = 0
        for path, text in self.texts.items():
            for link, name in re.findall(r"\]\(([^)#\s]*)#([^)]+)\)", text):
                if not re.match(r"\w+:", link):
                    target = os.path.normpath(os.path.join(os.path.dirname(path), link)) if link else path
                    names = [place_of(line) for line in re.findall(r"^#+ (.*)$", self.texts[target], re.M)]
                    self.assertIn(name, names, f"{path}: {link}")
                    count += 1
        self.assertGreater(count, 20)

    def test_named_files(self):
        """A name with folders is a path from the top; one without is that of some file."""
        whole, last = set(self.files), {os.path.basename(path) for path in self.files}
        for path, text in self.texts.items():
            for name in FILE_NAME.findall(text):
                known = name in (whole if "/" in name else last)
                self.assertTrue(known, f"{path}: {name}")

    def test_named_folders(self):
        folders = {os.path.dirname(path) for path in self.files}
        with open(os.path.join(SOURCE, "Documentation", "README.md"), encoding="utf-8") as file:
            index = file.read()
        named = re.findall(r"\b((?:Core|Filters|Rendering|Wrapping)/[A-Z]\w+)", index)
        self.assertGreater(len(named), 15)
        for name in named:
            self.assertIn(name, folders)

    def test_every_page_is_in_the_index(self):
        index = self.texts["Documentation/README.md"]
        for path in self.texts:
            folder, name = os.path.split(path)
            if folder == "Documentation" and name != "README.md":
                self.assertIn(f"({name})", index)


if __name__ == "__main__":
    unittest.main()
