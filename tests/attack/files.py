"""Attacks by files that are imported and backed up. Each is a generator as in connections.py."""

import io
import itertools
import math
import pathlib
import stat
import threading
import time
import zipfile

import numpy
from hypermap.v1 import catalog_service_pb2, edit_service_pb2

import http2
from site_under_attack import PREY, client_stream, unary

_IMPORT = "CatalogService/ImportMap"
_RESTORE = "CatalogService/RestoreMap"
_CHUNK_BYTES = 4 << 20


def _header(map_name):
    return catalog_service_pb2.ImportMapRequest(header=catalog_service_pb2.ImportHeader(
        map=map_name, format=catalog_service_pb2.FILE_FORMAT_HMAP, create_map=True)
    ).SerializeToString()


def _chunk(data):
    return catalog_service_pb2.ImportMapRequest(chunk=catalog_service_pb2.FileChunk(
        file_name="a.hmap", data=data)).SerializeToString()


def _requests(map_name, data):
    """Returns the messages that import a file."""
    return [_header(map_name), *(_chunk(data[i:i + _CHUNK_BYTES])
                                 for i in range(0, len(data), _CHUNK_BYTES))]


def _semantic_hmap(pieces):
    """Returns an .hmap file whose only layer, a semantic one, has this text."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("hmap_config.yaml",
                         "layers:\n  - name: things\n    frame_id: map\n    load_file: true\n"
                         "    file: things.yaml\n    class: SemanticLayer\n")
        with archive.open("things.yaml", "w") as member:
            for piece in pieces:
                member.write(piece)
    return file.getvalue()


def _import_again_and_again(site, data):
    """Imports a file as new maps, one after the other, while the attack goes on."""
    numbers = itertools.count()
    with site.channel() as channel:
        while site.attacking():
            site.tell_result(client_stream(
                channel, _IMPORT, iter(_requests(f"map-{next(numbers)}", data)), 20))


def self_crossing_hulls(site):
    """A5: two files with 200,000 self-crossing 12-gons, given up after 5 s."""
    # Each vertex is the fifth next of a regular 12-gon.
    turns = [2 * math.pi * 5 * i / 12 for i in range(13)]
    shape = ",".join(f"{math.cos(a):.3f} {math.sin(a):.3f}" for a in turns)
    data = _semantic_hmap(
        f"- name: star{i}\n  shape: POLYGON(({shape}))\n  tags: ~\n  confidence: ~\n".encode()
        for i in range(site.size(200_000, 50_000)))
    files = [_requests(f"stars-{i}", data) for i in range(2)]
    yield
    with site.channel() as channel:
        calls = [client_stream(channel, _IMPORT, iter(file), site.size(5, 2)) for file in files]
        for call in calls:
            site.tell_result(call)
    yield


def unfinished_imports(site):
    """B6: 30 imports that send 250 MB each and then nothing."""
    count, chunk = site.size(30, 6), _chunk(bytes(_CHUNK_BYTES))
    stop, lock = threading.Event(), threading.Lock()
    sent = [0] * count

    def messages(number):
        yield _header(f"upload-{number}")
        for _ in range(62):
            if stop.is_set():
                return
            with lock:
                sent[number] += 1
            yield chunk
        stop.wait()

    yield
    with site.channel() as channel:
        calls = [client_stream(channel, _IMPORT, messages(i), 90) for i in range(count)]
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and not all(
                call.done() or sent[i] == 62 for i, call in enumerate(calls)):
            time.sleep(0.05)
        while site.attacking():
            time.sleep(0.05)
        for call in calls:
            if call.done():
                site.tell_result(call)
            else:
                call.cancel()
                site.tell("held until cancelled")
        stop.set()
    site.tell("MB sent", sum(sent) * _CHUNK_BYTES // 1_000_000)
    yield


def unpacking_member(site):
    """B8: a file of 1 MB whose semantic member unpacks to 900 MB."""
    letters = b"a" * 1_000_000

    def pieces():
        yield b"- name: "
        for _ in range(site.size(900, 600)):
            yield letters
        yield b"\n  shape: POLYGON((0 0,0 1,1 1,0 0))\n  tags: ~\n  confidence: ~\n"

    data = _semantic_hmap(pieces())
    yield
    _import_again_and_again(site, data)
    yield


def unclosed_list(site):
    """A file of 60 KB whose semantic member is the begin of a list in flow style, which a parser of
    YAML holds back until it knows the end."""
    items = b"a," * 500_000
    data = _semantic_hmap(itertools.chain([b"["], itertools.repeat(items, 60)))
    yield
    _import_again_and_again(site, data)
    yield


def _disk_bytes(site):
    """Returns the bytes of all files of the data folder, with deleted ones that are open."""
    sizes = {}
    for path in itertools.chain(pathlib.Path(site.data_dir).rglob("*"),
                                pathlib.Path(f"/proc/{site.pid}/fd").iterdir()):
        try:
            about, name = path.stat(), path.readlink() if path.is_symlink() else path
        except OSError:
            continue  # It was removed or closed meanwhile.
        if str(name).startswith(site.data_dir) and stat.S_ISREG(about.st_mode):
            sizes[about.st_dev, about.st_ino] = about.st_blocks * 512
    return sum(sizes.values())


def _write_noise(site):
    """Writes 10 million cells to the attacked map that do not compress: 40 MB in its file."""
    side = 1000
    random = numpy.random.default_rng(1)
    with site.client() as client, site.channel() as channel:
        client.CreateLayer(map=PREY, layer={
            "name": "noise", "kind": "LAYER_KIND_SCALAR",
            "grid": {"origin": {"x": 0, "y": 0, "yaw": 0}, "resolution_m": 0.5}})
        for i in range(10):
            request = edit_service_pb2.ApplyEditsRequest(map=PREY)
            write = request.edits.add().write_cells
            write.layer = "noise"
            write.box.row_begin, write.box.row_end = side * i, side * (i + 1)
            write.box.col_end = side
            write.values.extend(random.random(side * side))
            unary(channel, "EditService/ApplyEdits", request.SerializeToString(), 60).result()


def restored_backups(site):
    """A backup of 40 MB is restored again and again, whole and damaged, while maps are checked."""
    _write_noise(site)
    with site.client() as client:
        backup = b"".join(message.data for message in client.BackupMap(map=PREY))
    middle = len(backup) // 2
    damaged = backup[:middle] + bytes(4096) + backup[middle + 4096:]

    def requests(data, **header):
        yield catalog_service_pb2.RestoreMapRequest(
            header=catalog_service_pb2.RestoreHeader(**header)).SerializeToString()
        for i in range(0, len(data), _CHUNK_BYTES):
            yield catalog_service_pb2.RestoreMapRequest(
                data=data[i:i + _CHUNK_BYTES]).SerializeToString()

    def restore(channel):
        site.tell_result(client_stream(
            channel, _RESTORE, requests(backup, map=PREY, replace=True), 20))
        site.tell_result(client_stream(channel, _RESTORE, requests(damaged, map="damaged"), 20))

    def check(channel):
        request = catalog_service_pb2.CheckMapRequest(map=PREY).SerializeToString()
        if not site.tell_result(unary(channel, "CatalogService/CheckMap", request, 20)):
            time.sleep(0.01)  # it is being replaced

    def repeat(work):
        with site.channel() as channel:
            while site.attacking():
                work(channel)

    yield
    threads = [threading.Thread(target=repeat, args=(work,)) for work in (restore, check)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    yield
    assert site.told["OK"], "no backup was restored, and no map checked"
    assert not any(told.startswith("NOT_FOUND") for told in site.told), "a replaced map was gone"


def unread_backups(site):
    """B11: 60 backups of a map of 40 MB that nobody reads."""
    _write_noise(site)
    headers = http2.grpc_headers("CatalogService/BackupMap")
    body = http2.grpc_message(
        catalog_service_pb2.BackupMapRequest(map=PREY).SerializeToString())
    before = most = _disk_bytes(site)
    yield
    with http2.Connection(site.address, window=0) as connection:
        streams = []
        for _ in range(60):
            streams.append(connection.new_stream())
            connection.send(http2.frame(http2.HEADERS, http2.END_HEADERS, streams[-1], headers) +
                            http2.frame(http2.DATA, http2.END_STREAM, streams[-1], body))
        while site.attacking(10, 5):
            connection.receive(0)
            most = max(most, _disk_bytes(site))
            time.sleep(0.05)
        for stream in streams:
            if stream in connection.ended:
                site.tell_status(*connection.status(stream))
            else:
                site.tell("held until cancelled")
    site.tell(f"data folder {before // 1_000_000} MB, at most {most // 1_000_000} MB")
    yield
    assert most < 8 * before, f"the data folder grew to {most // 1_000_000} MB"
