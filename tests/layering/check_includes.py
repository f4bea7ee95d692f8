"""Fails when a room includes what it may not.

The table ROOMS is the layer diagram of docs/architecture.md: for each room, the rooms and the
libraries that its sources may include. A room includes only what stands below it, so the table must
be free of circles, and so must the headers. A library that a room hides may stand in a header of
that room, but then no other room may include that header, nor one that includes it. Tests and what
only they use stand outside (*_test.cc, *_testing.cc, *_benchmark.cc, *_fuzzer.cc, folders called
testing): they may look anywhere.

    check_includes.py [ROOT]    prints a line for each violation; exit code 1 when there is one
"""

import pathlib
import re
import sys

# What the libraries are called in ROOMS, by the beginning of the header's name.
LIBRARIES = {
    "absl/": "absl",
    "Eigen/": "eigen",
    "geos_c.h": "geos",
    "sqlite3.h": "sqlite",
    "tiff": "tiff",
    "png.h": "png",
    "zip.h": "zip",
    "zlib.h": "zlib",
    "yaml-cpp/": "yaml",
    "nlohmann/": "json",
    "CLI/": "cli11",
    "pcl/": "pcl",
    "cairo.h": "cairo",
    "spdlog/": "spdlog",
    "grpc/": "grpc",
    "grpcpp/": "grpc",
    "google/protobuf/": "protobuf",
    "openssl/": "openssl",
}

# Standard headers that bring in files, threads or clocks. `map/` has none of these.
OUTSIDE_WORLD = re.compile(
    r"(chrono|condition_variable|csignal|cstdio|ctime|filesystem|fstream|future|iostream|latch"
    r"|mutex|semaphore|shared_mutex|stop_token|thread"
    r"|absl/(synchronization/.*|time/clock\.h)"
    r"|(sys/.*|arpa/.*|netinet/.*|[a-z_]+\.h))$"
)

DOMAIN = {"absl", "eigen"}


class Room:
    """What a folder (with those below it that have no line of their own) may include."""

    def __init__(self, rooms=(), libraries=(), hidden=(), outside_world=True):
        self.rooms = set(rooms)
        self.libraries = set(libraries)
        self.hidden = set(hidden)  # libraries that it uses and other rooms must not see
        self.outside_world = outside_world


def pure(*rooms, hidden=()):
    return Room(rooms, DOMAIN, hidden, outside_world=False)


MAP = ["map", "map/geometry", "map/frames", "map/values", "map/layers", "map/observations",
       "map/query", "map/edits", "map/watch"]

ROOMS = {
    "map/geometry": pure(hidden={"geos"}),
    "map/values": pure(),
    "map/frames": pure("map/geometry"),
    "map/layers": pure("map/geometry", "map/frames", "map/values"),
    "map/observations": pure("map/geometry", "map/frames", "map/layers"),
    "map/exploration": pure("map/geometry", "map/layers"),
    "map/evaluation": pure("map/geometry", "map/values"),
    "map": pure("map/geometry", "map/frames", "map/values", "map/layers"),
    "map/query": pure("map", "map/geometry", "map/frames", "map/values", "map/layers"),
    "map/edits": pure("map", "map/geometry", "map/frames", "map/values", "map/layers"),
    "map/watch": pure("map", "map/geometry", "map/frames", "map/values", "map/layers",
                      "map/edits", "map/query"),
    # grpc: the one mapping between absl::Status and grpc::Status.
    "wire": Room(
        ["proto", "map/exploration", *MAP], {"absl", "protobuf", "grpc"}, hidden={"openssl"}
    ),
    "storage": Room(MAP, {"absl"}),
    "storage/sqlite": Room([], {"absl", "sqlite"}),
    "storage/geopackage": Room(
        ["storage", "storage/sqlite", *MAP], {"absl"},
        hidden={"sqlite", "tiff", "png", "zlib", "json"}
    ),
    "storage/outbox": Room(["storage/sqlite"], {"absl"}),
    "storage/interchange": Room(
        MAP, {"absl"}, hidden={"zip", "zlib", "yaml", "png", "tiff", "json"}
    ),
    "ingest/fusion": pure("map/evaluation", *MAP, hidden={"json"}),
    "server/session": Room(
        ["ingest/fusion", "storage", "map/exploration", *MAP], {"absl", "spdlog"}
    ),
    "server/services": Room(
        ["server/session", "wire", "proto", "storage", "storage/interchange", "map/exploration",
         *MAP],
        {"absl", "grpc", "protobuf", "spdlog"},
    ),
    "server": Room(
        ["server/services", "server/session", "storage", "storage/geopackage"],
        {"absl", "cli11", "grpc", "spdlog"},
    ),
    "ingest/perception": Room(MAP, DOMAIN),
    "ingest/perception/pcl": Room(["ingest/perception"], DOMAIN, hidden={"pcl"}),
    # storage/interchange: the map that a robot localises itself in.
    "ingest/sources": Room(
        ["ingest/perception", "storage/interchange", *MAP],
        DOMAIN,
        hidden={"json", "png", "yaml"},
    ),
    "ingest/simulation": Room(
        ["ingest/perception", "map/exploration", *MAP], {"absl", "eigen", "cli11"},
        hidden={"png", "json"}
    ),
    "ingest/frame_service": Room(
        ["ingest/sources", "ingest/perception", "client_libs/cpp", "wire", "proto", *MAP],
        DOMAIN,
        hidden={"grpc", "protobuf"},
    ),
    # Simulated robots, which know the server by the client alone.
    "ingest/robots": Room(
        ["ingest/simulation", "ingest/perception", "client_libs/cpp", "map/exploration", *MAP],
        DOMAIN,
    ),
    "ingest/worker": Room(
        ["ingest/sources", "ingest/perception", "ingest/frame_service", "ingest/robots",
         "client_libs/cpp", "client_libs/flags", *MAP],
        DOMAIN | {"cli11"},
        hidden={"json"},
    ),
    "client_libs/cpp": Room(
        ["wire", "proto", "map/exploration", *MAP], {"absl"}, hidden={"grpc", "protobuf"}
    ),
    # The robot's own copy of a map, and what it has not sent yet (wire: as bytes); the client itself
    # knows no database.
    "client_libs/cpp/replica": Room(
        ["client_libs/cpp", "storage", "storage/geopackage", "storage/outbox", "wire", *MAP],
        {"absl"},
    ),
    "client_libs/flags": Room(["client_libs/cpp"], {"absl", "cli11"}),
    # yaml: a nav2 map names its image, which is sent along. storage/interchange: truth in files.
    "client_libs/cli": Room(
        ["client_libs/cpp", "client_libs/flags", "storage/interchange", "map/evaluation",
         "map/exploration", *MAP],
        {"absl", "cli11", "json"},
        hidden={"cairo", "yaml"},
    ),
}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
TEST_FILE = re.compile(r"_(test|testing|benchmark|fuzzer)\.(cc|h)$")


def room_of(path, rooms):
    """The room with the longest name that `path` lies in; None outside of all rooms."""
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
    """(line, quoted, header) of each include."""
    for match in INCLUDE.finditer(text):
        yield text.count("\n", 0, match.start(2)) + 1, match[1] == '"', match[2]


def target_of(header, quoted, tops):
    """("room", path), ("library", name), ("standard", header) or ("unknown", header)."""
    if re.match(r"hypermap/v1/.*\.pb\.h$", header):
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
    """What is wrong with the include, or None. `private`: headers that their room keeps."""
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
    """Headers that bring in a library which their room hides, also by way of others."""
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


def find_circle(edges):
    """A circle in the graph {node: [node]}, as a list that ends where it begins; else None."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return None
        path.append(node)
        for other in edges.get(node, ()):
            if circle := visit(other):
                return circle
        path.pop()
        done.add(node)
        return None

    return next((circle for node in sorted(edges) if (circle := visit(node))), None)


def violations(root, rooms=None):
    """One line for each violation below `root`."""
    rooms = ROOMS if rooms is None else rooms
    found = []
    if circle := find_circle({name: sorted(room.rooms) for name, room in rooms.items()}):
        found.append("the table has a circle: " + " -> ".join(circle))
    files = {name: list(includes(text)) for name, text in sources(pathlib.Path(root), rooms)}
    private = private_headers(files, rooms)
    for name, found_here in files.items():
        for line, quoted, header in found_here:
            if wrong := check_include(name, header, quoted, rooms, private):
                found.append(f"{name}:{line}: {header}: {wrong}")
    edges = {name: [h for _, quoted, h in found_here if quoted]
             for name, found_here in files.items()}
    if circle := find_circle(edges):
        found.append("headers in a circle: " + " -> ".join(circle))
    return found


def main(arguments):
    root = pathlib.Path(arguments[0] if arguments else pathlib.Path(__file__).parents[2])
    found = violations(root)
    for line in found:
        print(line)
    checked = sum(1 for _ in sources(root, ROOMS))
    print(f"{checked} files, {len(found)} violations")
    return 1 if found or checked == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
