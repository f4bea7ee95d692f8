"""Fails if a room includes a header that it must not include, or may include a room for nothing.

The table of allowed includes is rooms.py. Cycles are forbidden between rooms, between folders with
or without a line in the table, between headers, and between top folders, except those that
CYCLES_OF_TOP_FOLDERS names. Tests and their support (*_test.cc, *_benchmark.cc,
*_fuzzer.cc, folders called testing) may include anything.

    check_includes.py [ROOT]    prints a line for each violation; exit code 1 when there is one
"""

import pathlib
import re
import sys

from rooms import CYCLES_OF_TOP_FOLDERS, LIBRARIES, ROOMS, Room

# Standard headers for files, threads and clocks. Rooms of `map/` must not include them.
OUTSIDE_WORLD = re.compile(
    r"(chrono|condition_variable|csignal|cstdio|ctime|filesystem|fstream|future|iostream|latch"
    r"|mutex|semaphore|shared_mutex|stop_token|thread"
    r"|absl/(synchronization/.*|time/clock\.h)"
    r"|(sys/.*|arpa/.*|linux/.*|netinet/.*|[a-z_]+\.h))$"
)

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
TEST_FILE = re.compile(r"_(test|benchmark|fuzzer)\.(cc|h)$")


def room_of(path, rooms):
    """Returns the innermost room that contains `path`, or None if it is in no room."""
    folders = pathlib.PurePosixPath(path).parents
    return next((str(folder) for folder in folders if str(folder) in rooms), None)


def sources(root, rooms):
    for top in sorted({room.split("/")[0] for room in rooms}):
        for path in sorted((root / top).rglob("*")):
            name = path.relative_to(root).as_posix()
            if path.suffix in (".cc", ".h") and not TEST_FILE.search(name):
                if "testing" not in path.parts:
                    yield name, path.read_text(encoding="utf-8")


def includes(text):
    """Yields (line, quoted, header) for each include."""
    for match in INCLUDE.finditer(text):
        yield text.count("\n", 0, match.start(2)) + 1, match[1] == '"', match[2]


def target_of(header, quoted, tops):
    """Classifies an include by the origin of its header.

    Returns ("room", path), ("library", name), ("standard", header) or ("unknown", header).
    """
    if re.match(r"(grpc|hypermap)/.*\.pb\.h$", header):
        return "room", "proto"
    if "/" in header and header.split("/")[0] in tops:
        return "room", header
    for beginning, library in LIBRARIES.items():
        if header.startswith(beginning):
            return "library", library
    if not quoted and (re.fullmatch(r"[a-z0-9_]+", header) or OUTSIDE_WORLD.match(header)):
        return "standard", header
    return "unknown", header


def check_include(name, header, quoted, rooms, private):
    """Returns the violation of an include, or None. `private`: headers only for their own room."""
    own = room_of(name, rooms)
    if own is None:
        return "lies in no room of the table"
    room = rooms[own]
    kind, target = target_of(header, quoted, {r.split("/")[0] for r in rooms})
    outside_world = target in ("absl", header) and OUTSIDE_WORLD.match(header)
    if outside_world and not room.outside_world:
        return f"{own} has no files, threads or clocks"
    if kind == "room":
        other = target if target == "proto" else room_of(target, rooms)
        if other != own and other not in room.rooms:
            return f"{own} must not include {other or target}"
        if other != own and header in private:
            return f"is private to {other}"
    elif kind == "library" and target not in room.libraries | room.hidden:
        return f"{own} must not use {target}"
    elif kind == "unknown":
        return "is of no library in the table"
    return None


def private_headers(files, rooms):
    """Returns the headers that include a library which their room hides, directly or indirectly."""
    private = set()
    while True:
        more = {
            name
            for name, found in files.items()
            if name.endswith(".h") and name not in private and (own := room_of(name, rooms))
            for _, quoted, header in found
            if header in private
            or target_of(header, quoted, ())[1] in rooms[own].hidden
        }
        if not more:
            return private
        private |= more


def find_cycle(edges):
    """Returns a cycle in the graph {node: [node]}, the first node repeated at the end, or None."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return None
        path.append(node)
        for other in edges.get(node, ()):
            if cycle := visit(other):
                return cycle
        path.pop()
        done.add(node)
        return None

    return next((cycle for node in sorted(edges) if (cycle := visit(node))), None)


def merged(edges, group):
    """Returns the graph of the groups of nodes; an edge within a group is left out."""
    graph = {}
    for node, others in edges.items():
        targets = graph.setdefault(group(node), set())
        targets.update(group(other) for other in others)
        targets.discard(group(node))
    return {node: sorted(targets) for node, targets in graph.items()}


def folder(path):
    return str(pathlib.PurePosixPath(path).parent)


def top_folder(path):
    return path.split("/")[0]


def violations(root, rooms=None, exceptions=CYCLES_OF_TOP_FOLDERS):
    """Returns one line for each violation below `root`."""
    rooms = ROOMS if rooms is None else rooms
    found = []
    table = {name: sorted(room.rooms) for name, room in rooms.items()}
    if cycle := find_cycle(table):
        found.append("the table has a cycle: " + " -> ".join(cycle))
    ordinary = {name: [other for other in others if (name, other) not in exceptions]
                for name, others in table.items()}
    if cycle := find_cycle(merged(ordinary, top_folder)):
        found.append("top folders in a cycle: " + " -> ".join(cycle))
    files = {name: list(includes(text)) for name, text in sources(pathlib.Path(root), rooms)}
    private = private_headers(files, rooms)
    for name, found_here in files.items():
        for line, quoted, header in found_here:
            if wrong := check_include(name, header, quoted, rooms, private):
                found.append(f"{name}:{line}: {header}: {wrong}")
    edges = {name: [h for _, quoted, h in found_here if quoted]
             for name, found_here in files.items()}
    if cycle := find_cycle(edges):
        found.append("headers in a cycle: " + " -> ".join(cycle))
    if cycle := find_cycle(merged(edges, folder)):
        found.append("folders in a cycle: " + " -> ".join(cycle))
    return found


def unused(root, rooms=None):
    """Returns one line for each entry of the table that no source needs."""
    rooms = ROOMS if rooms is None else rooms
    tops = {room.split("/")[0] for room in rooms}
    used = set()
    for name, text in sources(pathlib.Path(root), rooms):
        for _, quoted, header in includes(text):
            kind, target = target_of(header, quoted, tops)
            if kind == "room":
                used.add((room_of(name, rooms), room_of(target, rooms) or target))
    return [
        f"{name} may include {other}, but does not"
        for name, room in rooms.items()
        for other in sorted(room.rooms - {"base/status"})
        if (name, other) not in used
    ]


def main(arguments):
    root = pathlib.Path(arguments[0] if arguments else pathlib.Path(__file__).parents[2])
    found = violations(root) + unused(root)
    for line in found:
        print(line)
    checked = sum(1 for _ in sources(root, ROOMS))
    print(f"{checked} files, {len(found)} violations")
    return 1 if found or checked == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
