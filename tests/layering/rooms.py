"""The rooms of the house: the one table of who may include whom.

ROOMS is what `check_includes.py` holds the sources against, `check_links.py` the CMake targets, and
`draw.py` draws docs/architecture.md's diagram from. A room is a folder with all folders below it that
have no line of their own. It includes only the rooms and the libraries that its line names, so the
table has no circle. A library that a room hides may stand in a header of that room, but then no other
room may include that header, nor one that includes it.
"""

# Names of the libraries in ROOMS, by the prefix of their headers.
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

DOMAIN = {"absl", "eigen"}


class Room:
    """What a folder (with those below it that have no line of their own) may include.

    target: the CMake library, by default named like the folder; None for a room without one.
    rooms, libraries: what its headers and sources may include.
    hidden: libraries that it uses and other rooms must not see.
    outside_world: whether it may use files, threads and clocks.
    """

    def __init__(self, rooms=(), libraries=(), hidden=(), outside_world=True, target=""):
        self.rooms = set(rooms)
        self.libraries = set(libraries)
        self.hidden = set(hidden)
        self.outside_world = outside_world
        self.target = target


def pure(*rooms, hidden=(), target=""):
    return Room({"base/status", *rooms}, DOMAIN, hidden, outside_world=False, target=target)


CONTENT = ["base/status", "map/geometry", "map/frames", "map/values", "map/grid", "map/objects",
           "map/layers"]
MAP = [*CONTENT, "map", "map/query", "map/edits", "map/watch", "map/observations"]

ROOMS = {
    "base/status": Room([], {"absl"}, outside_world=False),
    "base/images": Room(["base/status"], {"absl"}, hidden={"png"}),
    "base/sync": Room([], {"absl"}),
    "base/tls": Room(["base/status"], {"absl", "grpc"}, hidden={"openssl"}),

    "map/geometry": pure(hidden={"geos"}),
    "map/values": pure(),
    "map/frames": pure("map/geometry"),
    "map/grid": pure("map/geometry", "map/frames", "map/values"),
    "map/objects": pure("map/geometry", "map/values"),
    "map/layers": pure("map/geometry", "map/frames", "map/values", "map/grid", "map/objects"),
    "map": pure(*CONTENT),
    "map/query": pure("map", *CONTENT),
    "map/edits": pure("map", *CONTENT),
    "map/watch": pure("map", "map/edits", "map/query", *CONTENT),
    "map/observations": pure(*CONTENT),
    "map/matching": pure(),
    "map/exploration": pure(*CONTENT),
    "map/evaluation": pure("map/geometry", "map/values", "map/matching"),
    # json: parameters and checkpoints are the strategies' own texts.
    "map/fusion": pure("map/matching", "map/observations", *CONTENT, hidden={"json"}),

    # grpc: the only mapping between absl::Status and grpc::Status.
    "wire": Room(["proto", "map/exploration", *MAP], {"absl", "protobuf", "grpc"}),

    "storage": Room(MAP, {"absl"}),
    "storage/sqlite": Room(["base/status"], {"absl", "sqlite"}),
    "storage/geopackage": Room(
        ["base/images", "base/sync", "storage", "storage/sqlite", *MAP], {"absl"},
        hidden={"sqlite", "tiff", "zlib", "json"}
    ),
    "storage/outbox": Room(
        ["base/status", "storage/sqlite"], {"absl"}, target="outbox_file"
    ),
    "storage/interchange": Room(
        ["base/images", *MAP], {"absl"}, hidden={"zip", "zlib", "yaml", "tiff", "json"}
    ),

    "server/fusion": Room(
        ["map/fusion", "storage", *MAP], {"absl", "spdlog"}, target="map_fusion"
    ),
    "server/session": Room(
        ["base/sync", "map/fusion", "server/fusion", "storage", *MAP], {"absl", "spdlog"}
    ),
    "server/exploration": Room(
        ["base/sync", "map/exploration", "server/session", "storage", *MAP], {"absl", "spdlog"},
        target="map_exploration"
    ),
    "server/rpc": Room(
        ["base/sync", "proto", "server/session", "storage", "wire", *MAP],
        {"absl", "grpc", "protobuf", "spdlog"},
    ),
    "server/watch": Room(
        ["base/sync", "proto", "server/rpc", "server/session", "storage", "wire", *MAP],
        {"absl", "grpc", "protobuf", "spdlog"}, target="watch_service"
    ),
    "server/services": Room(
        ["base/sync", "base/tls", "map/exploration", "proto", "server/exploration",
         "server/fusion", "server/rpc", "server/session", "server/watch", "storage",
         "storage/interchange", "wire", *MAP],
        {"absl", "grpc", "protobuf", "spdlog"},
    ),
    "server": Room(
        ["base/tls", "server/fusion", "server/rpc", "server/services", "server/session",
         "server/watch", "storage", "storage/geopackage", "wire", *MAP],
        {"absl", "cli11", "grpc", "spdlog"}, target=None
    ),

    "ingest/perception": Room(["base/sync", *MAP], DOMAIN),
    "ingest/perception/pcl": Room(
        ["ingest/perception"], DOMAIN, hidden={"pcl"}, target="pcl_segmenter"
    ),
    # storage/interchange: reads the map in which a robot localises itself.
    "ingest/sources": Room(
        ["base/images", "ingest/perception", "storage/interchange", *MAP],
        DOMAIN,
        hidden={"json", "yaml"},
    ),
    "ingest/frame_service": Room(
        ["base/sync", "ingest/sources", "ingest/perception", "client_libs/cpp", "wire", "proto",
         *MAP],
        DOMAIN,
        hidden={"grpc", "protobuf"},
    ),
    "ingest/worker": Room(
        ["base/sync", "ingest/sources", "ingest/perception", "ingest/perception/pcl",
         "ingest/frame_service", "simulation/worlds", "simulation/robots", "client_libs/cpp",
         "client_libs/flags", *MAP],
        DOMAIN | {"cli11"},
        hidden={"json"},
    ),

    "simulation/worlds": Room(
        ["base/images", "ingest/perception", "map/exploration", *MAP], {"absl", "eigen", "cli11"},
        hidden={"json"}
    ),
    # Simulated robots, which reach the server only through the client.
    "simulation/robots": Room(
        ["simulation/worlds", "ingest/perception", "client_libs/cpp", "map/exploration", *MAP],
        DOMAIN,
    ),

    "client_libs/cpp": Room(
        ["base/sync", "base/tls", "wire", "proto", "map/exploration", *MAP], {"absl"},
        hidden={"grpc", "protobuf"}, target="client"
    ),
    # wire: encodes requests to bytes for the queue.
    "client_libs/cpp/outbox": Room(
        ["base/sync", "client_libs/cpp", "storage/outbox", "wire", *MAP], {"absl"}
    ),
    # The robot's own copy of a map. The client itself does not depend on a database.
    "client_libs/cpp/replica": Room(
        ["base/sync", "client_libs/cpp", "storage", "storage/geopackage", "wire", *MAP], {"absl"}
    ),
    "client_libs/flags": Room(
        ["base/status", "base/tls", "client_libs/cpp"], {"absl", "cli11"},
        target="connection_flags"
    ),
    # yaml: finds the image that a nav2 map names, which is sent along. storage/interchange: reads
    # ground truth from files.
    "client_libs/cli": Room(
        ["client_libs/cpp", "client_libs/flags", "storage/interchange", "map/evaluation",
         "map/exploration", *MAP],
        {"absl", "cli11", "json"},
        hidden={"cairo", "yaml"},
    ),
}
