"""Fails if a room's CMake target links other rooms than its sources include.

A library links the rooms that its headers include as PUBLIC, and those that only its sources
include as PRIVATE. Tests and programs are not checked.

    check_links.py [--fix]    prints a line for each target that differs; --fix rewrites its links
"""

import pathlib
import re
import sys
import textwrap

import check_includes
from rooms import ROOMS

LIBRARY = re.compile(r"hypermap_library\(\s*(\w+)( PCH \w+)?([^)]*)\)", re.DOTALL)
KEYWORDS = ("SOURCES", "PUBLIC", "PRIVATE")


def target_name(name, room):
    return room.target if room.target != "" else name.split("/")[-1]


def included_rooms(root, rooms):
    """Returns {room: (rooms that its headers include, rooms that only its sources include)}."""
    found = {name: (set(), set()) for name in rooms}
    tops = {name.split("/")[0] for name in rooms}
    for name, text in check_includes.sources(root, rooms):
        own = check_includes.room_of(name, rooms)
        for _, quoted, header in check_includes.includes(text):
            kind, target = check_includes.target_of(header, quoted, tops)
            if kind != "room":
                continue
            other = target if target == "proto" else check_includes.room_of(target, rooms)
            if other and other != own:
                found[own][0 if name.endswith(".h") else 1].add(other)
    return {name: (public, private - public) for name, (public, private) in found.items()}


def parse(call):
    """Parses the arguments of a hypermap_library call to {keyword: [words]}."""
    words, key = {k: [] for k in KEYWORDS}, None
    for word in call.split():
        if word in KEYWORDS:
            key = word
        else:
            words[key].append(word)
    return words


def rooms_in(words):
    return {word.removeprefix("hypermap::") for word in words if word.startswith("hypermap::")}


def render(target, words):
    lines = []
    for key in KEYWORDS:
        if words[key]:
            lines += textwrap.wrap(f"{key} {' '.join(words[key])}", 98, initial_indent="  ",
                                   subsequent_indent="    ", break_on_hyphens=False)
    return f"hypermap_library({target}\n" + "\n".join(lines) + ")"


def differences(root, rooms=None, fix=False):
    """Returns one line for each target whose links differ from the includes of its sources."""
    rooms = ROOMS if rooms is None else rooms
    root = pathlib.Path(root)
    targets = {name: target_name(name, room) for name, room in rooms.items()} | {"proto": "proto"}
    found = []
    for name, (public, private) in included_rooms(root, rooms).items():
        target = targets[name]
        path = root / name / "CMakeLists.txt"
        if target is None or not path.exists():
            continue
        text = path.read_text(encoding="utf-8")
        call = next((m for m in LIBRARY.finditer(text) if m[1] == target), None)
        if call is None:
            found.append(f"{name}/CMakeLists.txt: no hypermap_library({target} ...)")
            continue
        words = parse(call[3])
        wanted = {"PUBLIC": {targets[room] for room in public},
                  "PRIVATE": {targets[room] for room in private}}
        for key, rooms_wanted in wanted.items():
            linked = rooms_in(words[key])
            if linked == rooms_wanted:
                continue
            more, less = sorted(linked - rooms_wanted), sorted(rooms_wanted - linked)
            found.append(f"{name}/CMakeLists.txt: {key}"
                         + (f" links {' '.join(more)} for nothing" if more else "")
                         + (" and" if more and less else "")
                         + (f" lacks {' '.join(less)}" if less else ""))
            words[key] = [f"hypermap::{room}" for room in sorted(rooms_wanted)] + [
                word for word in words[key] if not word.startswith("hypermap::")]
        if fix:
            path.write_text(text[:call.start()] + render(target + (call[2] or ""), words) + text[call.end():],
                            encoding="utf-8")
    return found


def main(arguments):
    root = pathlib.Path(__file__).parents[2]
    found = differences(root, fix="--fix" in arguments)
    for line in found:
        print(line)
    print(f"{len(ROOMS)} rooms, {len(found)} differences")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
