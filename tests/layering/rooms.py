"""The table of rooms: the folders of the code base, and what each of them may include.

`check_includes.py` compares the sources with ROOMS and `check_links.py` the CMake targets.
`draw.py` draws the diagram of docs/architecture.md from it. A room is a folder with all
folders below it that have no line of their own. It may include only the rooms and libraries that
its line names. The table must have no cycle. A header of a room may include a library that the room
hides, but then no other room may include that header, directly or indirectly.
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
    "prometheus/": "prometheus",
    "civetweb.h": "civetweb",
    "grpc/": "grpc",
    "grpcpp/": "grpc",
    "google/protobuf/": "protobuf",
    "utf8cpp/": "utf8cpp",
    "openssl/": "openssl",
    "fastdds/": "fastdds",
    "fastrtps/": "fastdds",
    "gmock/": "gtest",
    "gtest/": "gtest",
    "tests/support/": "test_support",
    "libpq-fe.h": "pq",
}

DOMAIN = {"absl", "eigen"}


class Room:
    """The allowed includes of a folder, and of the folders below it without a line of their own.

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


def pure(*rooms, hidden=()):
    """A room of the domain: no files, threads or clocks."""
    return Room({"base/status", *rooms}, DOMAIN, hidden, outside_world=False)


# Includes between rooms that may close a cycle of top folders. Without them there must be none.
# `hypermap-ingest simulate` runs the simulated robots, which use the perception of real ones.
CYCLES_OF_TOP_FOLDERS = {("ingest/worker", "simulation/robots")}

ROOMS = {
    "base/status": Room([], {"absl"}, outside_world=False),
    "base/access": Room(
        ["base/digest", "base/identity", "base/limits", "base/status", "base/text"],
        {"absl"}, hidden={"yaml"},
    ),
    "base/containers": Room([], {"absl"}, outside_world=False),
    # grpc: its server gets the connections that the room accepts.
    "base/admission": Room(["base/status", "base/sync"], {"absl", "grpc"}),
    "base/digest": Room([], {"absl"}, hidden={"openssl"}, outside_world=False),
    "base/cancellation": Room([], {"absl"}),
    "base/identity": Room([], {"absl"}),
    "base/images": Room(["base/cancellation", "base/status"], {"absl"}, hidden={"png"}),
    "base/limits": Room([], {"absl"}, outside_world=False),
    # The only room that uses spdlog.
    "base/logging": Room([], {"absl"}, hidden={"json", "spdlog"}),
    "base/metering": Room(["base/status"], {"absl"}),
    "base/sync": Room([], {"absl"}),
    "base/text": Room([], {"absl"}, hidden={"utf8cpp"}, outside_world=False),
    "base/time": Room(["base/logging", "base/sync"], {"absl"}),
    "base/tls": Room(["base/status"], {"absl", "grpc"}, hidden={"openssl"}),

    "map/geometry": pure("base/cancellation", hidden={"geos"}),
    "map/values": pure("base/containers"),
    "map/frames": pure("base/containers", "map/geometry"),
    "map/grid": pure("base/cancellation", "base/digest", "map/frames", "map/geometry", "map/values"),
    "map/objects": pure("base/cancellation", "base/digest", "map/geometry", "map/values"),
    "map/layers": pure(
        "base/cancellation", "map/geometry", "map/grid", "map/objects", "map/values",
    ),
    "map": pure("base/cancellation", "base/containers", "map/frames", "map/grid", "map/layers"),
    "map/digest": Room(
        ["base/cancellation", "base/digest", "map", "map/frames", "map/geometry", "map/grid",
         "map/layers", "map/objects"],
        DOMAIN, outside_world=False, target="content_digest",
    ),
    "map/query": pure(
        "base/cancellation", "base/metering", "map", "map/geometry", "map/grid", "map/layers",
        "map/objects", "map/values",
    ),
    "map/edits": pure(
        "base/cancellation", "base/limits", "base/status", "map", "map/frames", "map/grid",
        "map/layers", "map/objects",
    ),
    "map/watch": pure(
        "base/cancellation", "map", "map/edits", "map/frames", "map/geometry", "map/grid", "map/layers",
        "map/objects", "map/query", "map/values",
    ),
    "map/observations": pure("map/frames", "map/geometry", "map/objects"),
    # simulation/robots has the target that is named like the folder.
    "map/robots": Room(
        ["base/limits", "base/status", "map", "map/frames"], DOMAIN, outside_world=False,
        target="robot_reports",
    ),
    "map/matching": pure(),
    "map/exploration": pure(
        "base/cancellation", "map/frames", "map/geometry", "map/grid", "map/layers", "map/objects",
    ),
    "map/registration": pure(
        "base/cancellation", "base/metering", "map", "map/exploration", "map/frames",
        "map/geometry", "map/grid", "map/layers", "map/values",
    ),
    "map/smoothing": pure(
        "base/cancellation", "base/status", "map/frames", "map/grid", "map/layers", "map/observations",
    ),
    "map/evaluation": pure("map/geometry", "map/matching", "map/values"),
    # json: parameters and checkpoints are the strategies' own texts.
    "map/fusion": pure(
        "base/cancellation", "map/geometry", "map/grid", "map/matching", "map/objects",
        "map/observations", hidden={"json"},
    ),

    # grpc: the only mapping between absl::Status and grpc::Status.
    "wire": Room(
        ["base/cancellation", "base/identity", "base/limits", "base/status", "base/sync", "map",
         "map/digest", "map/edits",
         "map/exploration", "map/frames", "map/geometry", "map/grid", "map/layers", "map/objects",
         "map/observations", "map/query", "map/registration", "map/robots", "map/watch", "proto"],
        {"absl", "grpc", "protobuf"},
    ),
    # protobuf: sends the descriptors of the messages. It knows nothing of the domain.
    "wire/reflection": Room(["base/status", "base/sync", "proto"], {"absl", "grpc", "protobuf"}),
    # wire/reflection: its tickets admit the calls.
    "wire/health": Room(
        ["base/status", "base/sync", "proto", "wire/reflection"], {"absl", "grpc", "protobuf"},
    ),

    "storage": Room(
        ["base/cancellation", "base/status", "base/text", "map", "map/edits", "map/layers", "map/objects", "map/observations"],
        {"absl"},
    ),
    # Stores that add to what another one does, whichever that is.
    "storage/decorators": Room(["base/sync", "storage"], {"absl"}, target="store_decorators"),
    # Tests of what every store promises, which therefore know none of them.
    "storage/conformance": Room(
        ["base/cancellation", "base/metering", "map/edits", "map/layers", "storage",
         "storage/transfer"],
        {"absl", "gtest", "test_support"},
    ),
    "storage/sqlite": Room(["base/status"], {"absl", "sqlite", "zlib"}),
    # Codecs of columns that all stores have.
    "storage/encoding": Room(
        ["base/cancellation", "base/images", "base/status", "map/edits", "map/frames",
         "map/geometry", "map/grid", "map/layers", "map/objects"],
        {"absl"}, hidden={"json", "tiff", "zlib"}, target="storage_encoding",
    ),
    # The only room that uses libpq.
    "storage/libpq": Room(
        ["base/cancellation", "base/status", "base/sync", "base/text"], {"absl"}, hidden={"pq"},
    ),
    "storage/geopackage": Room(
        ["base/cancellation", "base/metering", "base/status", "base/sync", "base/text", "map",
         "map/edits", "map/frames", "map/geometry", "map/grid", "map/layers", "map/objects",
         "storage", "storage/encoding", "storage/sqlite"],
        {"absl"},
    ),
    "storage/postgres": Room(
        ["base/cancellation", "base/metering", "base/status", "base/sync", "map", "map/edits",
         "map/frames", "map/layers", "map/objects",
         "storage", "storage/decorators", "storage/encoding", "storage/libpq", "storage/transfer"],
        {"absl"},
    ),
    # Copies maps from store to store, and so knows none of them.
    "storage/transfer": Room(
        ["base/cancellation", "base/status", "map", "map/digest", "map/edits", "map/layers", "storage",
         "storage/encoding"],
        {"absl"},
    ),
    "storage/outbox": Room(["base/status", "storage/sqlite"], {"absl"}, target="outbox_file"),
    "storage/interchange": Room(
        ["base/cancellation", "base/images", "base/limits", "base/metering", "base/status", "map",
         "map/edits", "map/frames", "map/geometry", "map/grid", "map/layers", "map/objects",
         "map/values"],
        {"absl"}, hidden={"json", "yaml", "zip"},
    ),

    "server/fusion": Room(
        ["base/cancellation", "base/limits", "base/metering", "base/status", "map", "map/edits",
         "map/fusion", "map/geometry", "map/layers", "map/observations", "storage"],
        {"absl"}, target="map_fusion",
    ),
    "server/presence": Room(
        ["base/limits", "base/status", "base/sync", "base/time", "map/robots"], {"absl"},
    ),
    "server/session": Room(
        ["base/admission", "base/cancellation", "base/limits", "base/logging", "base/metering",
         "base/status", "base/sync", "base/time", "map", "map/digest", "map/edits", "map/layers",
         "map/objects", "map/observations", "map/query", "map/smoothing", "map/watch",
         "server/fusion", "server/presence", "storage"],
        {"absl"},
    ),
    "server/exploration": Room(
        ["base/admission", "base/cancellation", "base/limits", "base/metering", "base/status",
         "base/sync", "map", "map/edits", "map/exploration", "map/frames", "map/geometry",
         "map/grid", "map/layers", "map/robots", "server/session", "storage"],
        {"absl"}, target="map_exploration",
    ),
    # grpc: identifies callers by their metadata and certificates.
    "server/auth": Room(
        ["base/access", "base/identity", "base/logging", "base/status", "base/sync", "base/time"],
        {"absl", "grpc"},
    ),
    # grpc: calls other servers with requests that it does not parse.
    "server/forward": Room(
        ["base/metering", "base/sync", "server/auth", "wire"], {"absl", "grpc"},
    ),
    "server/rpc": Room(
        ["base/access", "base/admission", "base/cancellation", "base/digest", "base/limits",
         "base/logging", "base/metering", "base/status", "base/sync", "base/text", "map",
         "map/layers", "map/query", "proto", "server/auth", "server/forward", "server/session", "wire"],
        {"absl", "grpc", "protobuf"},
    ),
    "server/metrics": Room(
        ["base/access", "base/limits", "base/logging", "base/status", "base/sync", "map",
         "map/observations", "server/auth", "server/rpc", "server/session", "storage/decorators"],
        {"absl", "prometheus"}, hidden={"civetweb"},
    ),
    "server/watch": Room(
        ["base/cancellation", "base/limits", "base/metering", "base/status",
         "base/sync", "map/watch", "proto", "server/rpc", "server/session", "wire"],
        {"absl", "grpc", "protobuf"}, target="watch_service",
    ),
    "server/services": Room(
        ["base/admission", "base/cancellation", "base/limits", "base/logging",
         "base/metering", "base/status", "base/sync", "base/tls", "map", "map/digest", "map/layers",
         "map/observations", "map/query", "map/registration", "map/robots", "map/values", "proto", "server/auth",
         "server/exploration", "server/forward", "server/fusion", "server/presence", "server/rpc",
         "server/session", "server/watch", "storage/interchange", "wire", "wire/health", "wire/reflection"],
        {"absl", "grpc"},
    ),
    "server": Room(
        ["base/admission", "base/cancellation", "base/limits", "base/logging", "base/status",
         "base/sync", "base/tls", "map", "server/auth", "server/forward", "server/metrics",
         "server/rpc", "server/services", "server/session", "storage", "storage/decorators",
         "storage/geopackage", "storage/postgres",
         "storage/sqlite"],
        {"absl", "grpc"}, hidden={"yaml"}, target=None,
    ),

    "ingest/perception": Room(
        ["base/cancellation", "base/status", "base/sync", "map/frames", "map/geometry", "map/grid",
         "map/layers", "map/objects", "map/observations"],
        {"absl", "eigen"},
    ),
    "ingest/perception/pcl": Room(
        ["ingest/perception"],
        set(), hidden={"pcl"}, target="pcl_segmenter",
    ),
    # storage/interchange: reads the map in which a robot localises itself.
    "ingest/sources": Room(
        ["base/images", "base/limits", "base/status", "ingest/perception", "map/edits",
         "map/layers", "map/observations", "storage/interchange"],
        {"absl", "eigen"}, hidden={"json", "yaml"},
    ),
    "ingest/frame_service": Room(
        ["base/admission", "base/cancellation", "base/status", "base/sync", "client_libs/cpp",
         "ingest/perception", "ingest/sources", "proto", "wire", "wire/health",
         "wire/reflection"],
        {"absl"}, hidden={"grpc"},
    ),
    "ingest/worker": Room(
        ["base/admission", "base/status", "base/sync", "client_libs/cpp", "client_libs/flags",
         "ingest/frame_service", "ingest/perception", "ingest/perception/pcl", "ingest/sources",
         "map/layers", "map/observations", "simulation/robots"],
        {"absl", "cli11", "eigen"}, hidden={"json"},
    ),

    "simulation/worlds": Room(
        ["base/images", "base/status", "ingest/perception", "map/exploration", "map/frames",
         "map/geometry", "map/grid", "map/objects"],
        {"absl", "cli11", "eigen"}, hidden={"json"},
    ),
    # Simulated robots, which reach the server only through the client.
    "simulation/robots": Room(
        ["base/status", "client_libs/cpp", "ingest/perception", "map/exploration", "map/frames",
         "map/geometry", "map/grid", "map/layers", "map/objects", "map/observations",
         "simulation/worlds"],
        {"absl"},
    ),

    "client_libs/cpp": Room(
        ["base/identity", "base/status", "base/sync", "base/tls", "map", "map/digest", "map/edits",
         "map/exploration",
         "map/frames", "map/geometry", "map/grid", "map/layers", "map/objects", "map/observations",
         "map/query", "map/registration", "map/robots", "map/watch", "proto", "wire"],
        {"absl"}, hidden={"grpc"}, target="client",
    ),
    # wire: encodes requests to bytes for the queue.
    "client_libs/cpp/outbox": Room(
        ["base/status", "base/sync", "client_libs/cpp", "map/edits", "map/observations",
         "storage/outbox", "wire"],
        {"absl"},
    ),
    # The robot's own copy of a map. The client itself does not depend on a database.
    "client_libs/cpp/replica": Room(
        ["base/limits", "base/status", "base/sync", "client_libs/cpp", "map", "map/digest", "map/edits",
         "map/geometry", "map/grid", "map/layers", "map/query", "map/values", "map/watch",
         "storage", "storage/geopackage"],
        {"absl"},
    ),
    # The load of a fleet, made by `hypermap bench`.
    "client_libs/bench": Room(
        ["base/status", "base/sync", "client_libs/cpp", "client_libs/cpp/replica", "map",
         "map/edits", "map/geometry", "map/objects", "map/observations"],
        {"absl"}, target="fleet_bench",
    ),
    "client_libs/flags": Room(
        ["base/status", "client_libs/cpp"],
        {"absl", "cli11"}, hidden={"json"}, target="connection_flags",
    ),
    # yaml: finds the image that a nav2 map names, which is sent along. storage/interchange: reads
    # ground truth from files. storage/geopackage: checks and repairs files of maps.
    "client_libs/ros2/cdr": Room([], {"absl"}, outside_world=False, target="ros2_cdr"),
    "client_libs/ros2/messages": Room(
        ["base/status"], {"absl"}, outside_world=False, target="ros2_messages",
    ),
    "client_libs/ros2/conversion": Room(
        ["base/images", "base/status", "base/text", "client_libs/ros2/messages", "map", "map/frames",
         "map/geometry", "map/grid", "map/layers", "map/objects", "map/query", "map/robots",
         "map/values", "proto"],
        {"absl", "eigen", "protobuf"}, outside_world=False, target="ros2_conversion",
    ),
    # zlib: CRCs.
    "client_libs/ros2/mcap": Room(
        ["base/status"], {"absl"}, hidden={"zlib"}, outside_world=False, target="ros2_mcap",
    ),
    "client_libs/ros2/recording": Room(
        ["base/status", "client_libs/cpp", "client_libs/ros2/cdr", "client_libs/ros2/conversion",
         "client_libs/ros2/mcap", "client_libs/ros2/messages", "map", "map/frames", "map/geometry",
         "map/layers", "map/watch"],
        {"absl"}, target="ros2_recording",
    ),
    # The only room that knows Fast DDS.
    "client_libs/ros2/dds": Room(
        ["base/logging", "base/status", "base/sync", "client_libs/ros2/cdr",
         "client_libs/ros2/messages"],
        {"absl"}, hidden={"fastdds"}, target="ros2_dds",
    ),
    # grpc: the stream of frames to an ingest worker.
    "client_libs/ros2/bridge": Room(
        ["base/logging", "base/status", "base/sync", "client_libs/cpp", "client_libs/cpp/replica",
         "client_libs/ros2/cdr", "client_libs/ros2/conversion", "client_libs/ros2/dds",
         "client_libs/ros2/messages", "map", "map/layers", "map/values", "proto", "wire"],
        {"absl"}, hidden={"grpc"}, target="ros2_bridge",
    ),
    "client_libs/ros2": Room(
        ["base/logging", "base/status", "client_libs/cpp", "client_libs/flags",
         "client_libs/ros2/bridge", "client_libs/ros2/conversion", "client_libs/ros2/dds"],
        {"absl", "cli11"}, target=None,
    ),
    "client_libs/cli": Room(
        ["base/access", "base/identity", "base/status", "client_libs/bench", "client_libs/cpp",
         "client_libs/flags", "client_libs/ros2/recording", "map", "map/edits", "map/evaluation", "map/exploration",
         "map/frames", "map/geometry", "map/grid", "map/layers", "map/objects", "map/query",
         "map/registration", "map/values", "storage", "storage/geopackage", "storage/interchange", "storage/postgres",
         "storage/sqlite", "storage/transfer"],
        {"absl", "cli11", "json"}, hidden={"cairo", "yaml"},
    ),
}
