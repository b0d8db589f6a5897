#!/usr/bin/env python3
"""What the tree says of its documents holds: cited documents and headings exist, relative links lead somewhere, and
options that the documents name are options of the command. Usage: docs_test.py ROOT [CLARUS]"""

import os
import pathlib
import re
import subprocess
import sys
import unittest

root = pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent
tool = sys.argv[2] if len(sys.argv) > 2 else None

source_suffixes = {".cpp", ".h", ".c", ".cl", ".clh", ".py", ".cmake", ".sh"}
left_out = re.compile(r"^(build.*|demo|\..*)$")  # made by ./run and CMake, and what is hidden


def files(suffixes):
    for folder, folders, names in os.walk(root):
        if pathlib.Path(folder) == root:
            folders[:] = [name for name in folders if not left_out.match(name)]
        folders.sort()
        for name in sorted(names):
            if pathlib.Path(name).suffix in suffixes:
                yield pathlib.Path(folder) / name


def without_code(text):
    return re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)


def headings(path):
    text = without_code(path.read_text())
    return [re.sub(r"[`*]", "", found).strip() for found in re.findall(r"^#+ +(.*)$", text, flags=re.M)]


def anchor(heading):
    """As GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def prose(text):
    """A source's text with its comments' lines joined, as a citation may go on in the next one."""
    return re.sub(r"[ \t]*\n[ \t]*(?:///?|#|\*)?[ \t]*", " ", text)


citation = re.compile(r'docs/(?!FILE\b)([\w-]+\.md)(?:, "([^"]+)")?')  # FILE stands for any


class Documents(unittest.TestCase):
    def test_cited_documents_and_headings_exist(self):
        count = 0
        for path in files(source_suffixes | {".md"}):
            for name, heading in citation.findall(prose(path.read_text())):
                count += 1
                document = root / "docs" / name
                where = path.relative_to(root)
                self.assertTrue(document.is_file(), f"{where} cites docs/{name}, which is not there")
                if heading:
                    known = headings(document)
                    self.assertIn(heading, known, f"{where} cites a heading that docs/{name} has not")
        self.assertGreater(count, 50)

    def test_documents_are_cited_with_their_folder(self):
        names = "|".join(re.escape(path.name) for path in (root / "docs").glob("*.md") if path.name != "README.md")
        bare = re.compile(rf"(?<![\w/.(\[-])(?:{names})(?![\w)\]])")
        for path in files(source_suffixes):
            if path != pathlib.Path(__file__).resolve():
                self.assertEqual(bare.findall(path.read_text()), [], f"{path.relative_to(root)}: docs/ is missing")

    def test_links_lead_somewhere(self):
        count = 0
        for path in files({".md"}):
            for target in re.findall(r"\]\(([^)\s]+)\)", without_code(path.read_text())):
                if re.match(r"\w+:", target):
                    continue
                count += 1
                name, _, fragment = target.partition("#")
                file = (path.parent / name).resolve() if name else path
                where = path.relative_to(root)
                self.assertTrue(file.exists(), f"{where} links to {target}, which is not there")
                if fragment and file.suffix == ".md":
                    known = [anchor(heading) for heading in headings(file)]
                    self.assertIn(fragment, known, f"{where} links to {target}")
        self.assertGreater(count, 50)

    def test_every_document_is_in_the_index(self):
        index = (root / "docs" / "README.md").read_text()
        for path in (root / "docs").glob("*.md"):
            if path.name != "README.md":
                self.assertIn(f"]({path.name})", index)

    @unittest.skipUnless(tool, "no program given")
    def test_options_are_the_programs(self):
        def run_help(*words):
            return subprocess.run([tool, *words, "--help"], capture_output=True, text=True, check=True).stdout

        def described(text):
            """An option is described at the beginning of a line."""
            return set(re.findall(r"^\s+(?:-\w,\s*)?(--[a-z][\w-]*)", text, flags=re.M)) | {"--help"}

        commands = re.findall(r"^  ([a-z]+) ", run_help().split("Subcommands:")[1], flags=re.M)
        options = {command: described(run_help(command)) for command in commands}
        for sub in ("compare", "placement"):
            options["bench " + sub] = described(run_help("bench", sub))
        if "render" in options:
            self.assertIn("--samples", options["render"])

        count = 0
        called = re.compile(r"(?<![\w/])clarus ((?:bench )?[a-z]+)((?: [^\n`|;]*)?)")
        for path in [root / "README.md", *sorted((root / "docs").glob("*.md"))]:
            for words, rest in called.findall(path.read_text()):
                name = words if words in options else words.split()[0]
                if name not in options:
                    continue
                for option in re.findall(r"(?<![\w-])--[a-z][\w-]*", rest.split("#")[0]):
                    count += 1
                    self.assertIn(option, options[name], f"{path.relative_to(root)}: clarus {words}{rest}")
        self.assertGreater(count, 20)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
