"""Writes the API reference in docs/api from the protos and the docstrings of the Python client.

    generate.py            writes the pages (make api)
    generate.py --check    fails if a page differs from what would be written, or a comment is missing
"""

import argparse
import difflib
import pathlib
import sys

from proto_pages import proto_pages
from protos import read_protos, without_comment
from python_page import aliases_without_comment, python_page
from python_source import Package, without_docstring

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = pathlib.PurePath("docs/api")
# Lines of a difference that are enough to see what changed.
SHOWN_LINES = 20


def make_pages(root):
    """Returns (pages by file name, complaints about missing comments)."""
    protos, package = read_protos(root), Package(root)
    pages = {**proto_pages(protos), "python.md": python_page(package)}
    missing = [*without_comment(protos), *without_docstring(package), *aliases_without_comment(package)]
    return pages, [f"{name} has no comment" for name in missing]


def written_pages(folder):
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.md"))}


def differences(written, pages):
    """Yields complaints about pages that are not as they would be written."""
    for name in sorted({*written, *pages}):
        old, new = written.get(name, ""), pages.get(name, "")
        if old == new:
            continue
        yield f"{FOLDER / name} is not up to date: run `make api`"
        changes = difflib.unified_diff(old.splitlines(), new.splitlines(), "as it is", "as it should be",
                                       lineterm="", n=1)
        yield from list(changes)[:SHOWN_LINES]


def write_pages(folder, pages):
    """Writes pages, and removes those of protos that are gone."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in written_pages(folder).keys() - pages.keys():
        (folder / name).unlink()
    for name, text in pages.items():
        (folder / name).write_text(text, encoding="utf-8")


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare, and write nothing")
    check = parser.parse_args(arguments).check
    pages, complaints = make_pages(ROOT)
    if check:
        complaints += differences(written_pages(ROOT / FOLDER), pages)
    else:
        write_pages(ROOT / FOLDER, pages)
    print(*complaints, sep="\n", end="\n" if complaints else "")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
