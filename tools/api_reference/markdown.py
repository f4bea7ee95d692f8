"""Writes Markdown: headings with their anchors, tables, and text that is not markup."""

import re

CODE = re.compile(r"`[^`\n]+`")
# Characters that Markdown could take for markup, unlike an underscore within a word.
MARKUP = re.compile(r"[\\*]|<(?=[A-Za-z/!])|\](?=\()|(?<![^\W_])_|_(?![^\W_])")
LIST_ITEM = re.compile(r"^ {2}\S")


def escape(text, link=lambda text: text):
    """Returns plain text as Markdown. Text between backticks stays code.

    link: a function that makes links of the names in escaped text.
    """
    parts, end = [], 0
    for code in CODE.finditer(text):
        parts += [link(MARKUP.sub(r"\\\g<0>", text[end:code.start()])), code.group()]
        end = code.end()
    return "".join([*parts, link(MARKUP.sub(r"\\\g<0>", text[end:]))])


def slug(heading):
    """Returns the anchor that GitHub gives to a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def cell(text):
    """Returns Markdown text as a cell of a table."""
    return " ".join(text.replace("|", "\\|").split())


def table(header, rows):
    """Returns the lines of a table whose cells are Markdown."""
    lines = [f"| {' | '.join(header)} |", "|" + "---|" * len(header)]
    return [*lines, *(f"| {' | '.join(map(cell, row))} |" for row in rows)]


def in_a_cell(markdown):
    """Returns Markdown for a cell: paragraphs, and lines that are indented by two, on new lines."""
    lines = []
    for line in markdown.splitlines():
        if LIST_ITEM.match(line) or not line.strip():
            lines.append("<br>")
        lines.append(line.strip())
    return " ".join(filter(None, lines))


def first_sentence(text):
    """Returns the first sentence of a text, on one line."""
    line = " ".join(text.split("\n\n")[0].split())
    return re.split(r"(?<=[.:]) (?=[A-Z])", line, maxsplit=1)[0].rstrip(":")


class Page:
    """A page: its lines, and the anchors of its headings, which differ from each other."""

    def __init__(self, title, made_from):
        self.lines = [f"<!-- Made by `make api` from {made_from}: change that and make it again. -->", ""]
        self.anchors = set()
        self.heading(1, title)

    def heading(self, level, text):
        anchor = slug(text)
        if anchor in self.anchors:
            raise ValueError(f"two headings have the anchor {anchor}: {text}")
        self.anchors.add(anchor)
        self.block(f"{'#' * level} {text}")

    def block(self, *lines):
        """Adds lines and an empty one."""
        if lines:
            self.lines += [*lines, ""]

    def text(self):
        lines = "\n".join(self.lines)
        return re.sub(r"\n{3,}", "\n\n", lines).rstrip() + "\n"
