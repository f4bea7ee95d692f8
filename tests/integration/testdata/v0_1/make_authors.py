#!/usr/bin/python3
"""Writes authors.gpkg.xz, a map of version 0.1 whose log has authors that are no UTF-8.

    make_authors.py CHECKOUT [FOLDER]

CHECKOUT is a checkout of commit 743c4b9 with hypermapd in build/bin. The file goes to FOLDER
(default: the folder of this script). Version 0.1 took any bytes for the author of a change, and cut
long names within a character. ../../test_authors.py checks that later versions read the log.
"""

import lzma
import os
import pathlib
import subprocess
import sys
import tempfile

CHECKOUT = pathlib.Path(sys.argv[1]).resolve()
HERE = pathlib.Path(__file__).resolve().parent
FOLDER = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else HERE
MAP = "authors"
AUTHORS = [b"\xff\xfe", "é".encode() * 100, b"an honest name"]

os.environ["HYPERMAP_BIN"] = str(CHECKOUT / "build" / "bin")
GENERATED = tempfile.TemporaryDirectory()
subprocess.run(["protoc", f"-I{CHECKOUT}/proto", f"--python_out={GENERATED.name}",
                *map(str, (CHECKOUT / "proto").rglob("*.proto"))], check=True)
sys.path[:0] = [GENERATED.name, str(CHECKOUT / "tests" / "integration"),
                str(HERE.parents[2] / "attack")]

import http2  # noqa: E402
import rpc  # noqa: E402
from google.protobuf import json_format  # noqa: E402
from hypermap.v1 import edit_service_pb2  # noqa: E402
from processes import Server  # noqa: E402


def put(label):
    """Returns the body of an ApplyEdits call that puts a square."""
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return http2.grpc_message(json_format.ParseDict(
        {"map": MAP, "edits": [{"put_object": {"layer": "things", "object": {
            "label": label, "existence": 1,
            "polygon": {"outer": {"points": [{"x": x, "y": y} for x, y in corners]}}}}}]},
        edit_service_pb2.ApplyEditsRequest()).SerializeToString())


with tempfile.TemporaryDirectory() as folder:
    with Server(folder) as server, rpc.Client(server.address) as client:
        client.CreateMap(map=MAP)
        client.CreateLayer(map=MAP, layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
        with http2.Connection(server.address) as connection:
            for i, author in enumerate(AUTHORS):
                headers = http2.grpc_headers("EditService/ApplyEdits",
                                             (b"x-hypermap-author", author))
                status, message = connection.call(headers, put(f"thing {i}"))
                assert status == 0, message
        assert server.stop() == 0
    written = pathlib.Path(folder, f"{MAP}.gpkg").read_bytes()
    (FOLDER / "authors.gpkg.xz").write_bytes(lzma.compress(written, preset=9))
