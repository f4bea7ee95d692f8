"""Draws the diagram of docs/architecture.md from the table rooms.py.

    draw.py            rewrites the diagram
    draw.py --check    fails if the diagram differs from the table

An arrow leads from a room to one that it may include. Arrows that follow from others are left out: when
`storage` may include `map/edits` and that `map`, there is none from `storage` to `map`.
"""

import pathlib
import sys

from rooms import ROOMS

DOCUMENT = pathlib.Path(__file__).parents[2] / "docs" / "architecture.md"
BEGIN = "<!-- Drawn by tests/layering/draw.py. -->"
END = "<!-- End of the drawing. -->"
# Rooms that nearly all others use. Their arrows would hide the rest of the diagram.
EVERYWHERE = {"base/cancellation", "base/limits", "base/metering", "base/status"}


def reachable(edges, start):
    """Returns all rooms that can be reached from `start` over one or more arrows."""
    found, open_rooms = set(), list(edges[start])
    while open_rooms:
        room = open_rooms.pop()
        if room not in found:
            found.add(room)
            open_rooms += edges[room]
    return found


def reduced(rooms):
    """Returns the transitive reduction of the table, as {room: rooms that it may include}."""
    names = {*rooms, *(other for room in rooms.values() for other in room.rooms)}
    edges = {name: (rooms[name].rooms if name in rooms else set()) - EVERYWHERE for name in names}
    below = {name: reachable(edges, name) for name in names}
    return {
        name: {other for other in edges[name]
               if not any(other in below[third] for third in edges[name] - {other})}
        for name in names - EVERYWHERE
    }


def node(name):
    return name.replace("/", "_") + "_"


def draw(rooms):
    """Returns the diagram as Mermaid text, with one box for each top folder."""
    edges = reduced(rooms)
    lines = ["```mermaid", "flowchart TD"]
    for top in sorted({name.split("/")[0] for name in edges}):
        lines.append(f"  subgraph {top}")
        lines += [f'    {node(name)}["{name}"]'
                  for name in sorted(edges) if name.split("/")[0] == top]
        lines.append("  end")
    lines += [f"  {node(name)} --> {node(other)}"
              for name in sorted(edges) for other in sorted(edges[name])]
    return "\n".join([*lines, "```"])


def with_diagram(text, rooms):
    """Returns the document with a new diagram between its marks."""
    begin, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    return f"{text[:begin]}\n{draw(rooms)}\n{text[end:]}"


def main(arguments):
    text = DOCUMENT.read_text(encoding="utf-8")
    drawn = with_diagram(text, ROOMS)
    if "--check" in arguments:
        if drawn != text:
            print(f"{DOCUMENT.name} differs from rooms.py: run tests/layering/draw.py")
        return 0 if drawn == text else 1
    DOCUMENT.write_text(drawn, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
