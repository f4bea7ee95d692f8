"""Tests of watches, differences between revisions and lists of revisions."""

from __future__ import annotations

import pathlib
import threading
import time
from itertools import takewhile

import numpy as np
import pytest
import shapely
from server import DEADLINE_S, Server

from hypermap_client import (
    ChangeKind,
    Client,
    DeleteObject,
    GridGeometry,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    OutOfRange,
    Pose,
    PutObject,
    Watch,
    WatchEvent,
    WriteCells,
)


def chair(x: float = 0.0, object_id: int = 0) -> PutObject:
    return PutObject("things", MapObject("chair", shapely.box(x, 0, x + 1, 1), id=object_id))


def make_layers(client: Client, name: str) -> None:
    client.create_layer(name, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    client.create_layer(name, LayerSpec(name="heat", kind=LayerKind.SCALAR, grid=GridGeometry(1.0)))


def next_change(watch: Watch) -> WatchEvent:
    """The next event that is not a progress event."""
    return next(event for event in watch if event.changes or event.snapshot)


def test_a_watch_reports_a_snapshot_and_then_each_revision(client: Client, site: str) -> None:
    make_layers(client, site)
    client.apply_edits(site, [chair(), WriteCells("heat", [[1.0, 2.0]])])
    with client.watch(site, timeout=60) as watch:
        snapshot = next(watch)
        assert snapshot.snapshot and not snapshot.reset and snapshot.time is None
        put = [c for c in snapshot.changes if c.kind == ChangeKind.PUT]
        cells = [c for c in snapshot.changes if c.kind == ChangeKind.CELLS]
        assert [c.object.label for c in put] == ["chair"]
        assert [c.cells.num_cells for c in cells] == [2]
        for i in range(3):
            answer = client.apply_edits(site, [chair(i), WriteCells("heat", [[3.0 + i]])])
            event = next_change(watch)
            assert event.revision == answer.revision == watch.revision
            assert event.time is not None and event.author
            by_kind = {c.kind: c for c in event.changes}
            assert by_kind[ChangeKind.PUT].object_id == answer.object_ids[0]
            np.testing.assert_array_equal(by_kind[ChangeKind.CELLS].cells.values, [3.0 + i])


def test_watches_and_differences_have_each_kind_of_shape(client: Client, site: str) -> None:
    make_layers(client, site)
    start = client.get_map(site).revision
    shapes = [shapely.box(0, 0, 1, 1), shapely.LineString([(0, 0), (4, 0)]), shapely.Point(3, 0)]
    with client.watch(site, area=shapely.box(2, -1, 9, 1), timeout=60) as watch:
        assert next(watch).snapshot
        client.apply_edits(site, [PutObject("things", MapObject("thing", s)) for s in shapes])
        event = next_change(watch)
    # The box is outside of the watched area.
    assert [c.object.shape for c in event.changes] == shapes[1:]
    difference = client.list_changes(site, start)
    assert [c.object.shape for c in difference.changes] == shapes
    with client.watch(site, timeout=60) as watch:
        put = [c for c in next(watch).changes if c.kind == ChangeKind.PUT]
    assert [c.object.shape for c in put] == shapes


def test_objects_that_enter_and_leave_an_area(client: Client, site: str) -> None:
    make_layers(client, site)
    first = client.apply_edits(site, chair(x=10))
    (object_id,) = first.object_ids
    kinds = []
    with client.watch(
        site, area=shapely.box(0, 0, 5, 5), start_revision=first.revision, timeout=60
    ) as watch:
        for edit in (chair(1, object_id), chair(2, object_id), chair(10, object_id)):
            client.apply_edits(site, edit)
            kinds.append(next_change(watch).changes[0].kind)
        client.apply_edits(site, chair(3, object_id))
        client.apply_edits(site, DeleteObject("things", object_id))
        kinds += [next_change(watch).changes[0].kind for _ in range(2)]
    K = ChangeKind  # noqa: N806
    assert kinds == [K.ENTER, K.PUT, K.LEAVE, K.ENTER, K.REMOVE]


def test_changes_of_layers_and_transforms(client: Client, site: str) -> None:
    with client.watch(site, timeout=60) as watch:
        next(watch)
        make_layers(client, site)
        client.set_transform(site, "map", "dock", Pose(1, 2, 0))
        client.delete_layer(site, "heat")
        changes = [next_change(watch).changes[0] for _ in range(4)]
    assert [c.kind for c in changes] == [
        ChangeKind.LAYER_CREATED,
        ChangeKind.LAYER_CREATED,
        ChangeKind.TRANSFORM,
        ChangeKind.LAYER_DELETED,
    ]
    assert changes[0].layer_now.kind == LayerKind.SEMANTIC
    assert changes[2].transform.child_frame_id == "dock"


def test_a_watch_resumes_after_server_restarts(data_dir: pathlib.Path) -> None:
    with Server(data_dir) as server, Client(server.address) as client:
        client.create_map("site")
        make_layers(client, "site")
        start = client.get_map("site").revision
        with client.watch("site", start_revision=start, timeout=60) as watch:
            client.apply_edits("site", chair())
            revisions = [next_change(watch).revision]
            server.kill()
            with Server(data_dir, listen=server.address) as again:
                for i in range(3):
                    client.apply_edits("site", chair(i))
                revisions += [next_change(watch).revision for _ in range(3)]
                assert again.stop() == 0
            with Server(data_dir, listen=server.address):
                client.apply_edits("site", chair())
                revisions.append(next_change(watch).revision)
    assert revisions == [start + i for i in range(1, 6)]


def test_a_snapshot_replaces_compacted_changes(data_dir: pathlib.Path) -> None:
    flag = "--history_revisions=2"
    with Server(data_dir, flag) as server, Client(server.address) as client:
        client.create_map("site")
        make_layers(client, "site")
        with client.watch("site", layers="things", timeout=60) as watch:
            assert not next(watch).reset
        for i in range(20):
            client.apply_edits("site", chair(i))
    # A restarted server no longer has the changes of this one in memory.
    with Server(data_dir, flag) as server, Client(server.address) as client:
        oldest = client.list_revisions("site").oldest
        assert oldest > watch.revision
        with client.watch(
            "site", layers="things", start_revision=watch.revision, timeout=60
        ) as resumed:
            event = next(resumed)
            assert event.snapshot and event.reset and len(event.changes) == 20
            client.apply_edits("site", chair())
            assert not next_change(resumed).snapshot
        strict = client.watch(
            "site", start_revision=watch.revision, snapshot_when_compacted=False, timeout=60
        )
        with strict, pytest.raises(OutOfRange, match="oldest"):
            next(strict)


def test_another_thread_closes_a_watch(client: Client, site: str) -> None:
    watch = client.watch(site)
    next(watch)
    reader_ended = threading.Event()

    def read() -> None:
        for _ in watch:
            pass
        reader_ended.set()

    threading.Thread(target=read, daemon=True).start()
    watch.close()
    assert reader_ended.wait(60)
    assert list(watch) == []


def test_closing_the_client_ends_a_watch(server: Server, site: str) -> None:
    client = Client(server.address)
    watch = client.watch(site)
    next(watch)
    events: list[WatchEvent] = []
    reader = threading.Thread(target=lambda: events.extend(watch))
    reader.start()
    client.close()
    reader.join(60)
    assert not reader.is_alive() and not any(event.changes for event in events)


def test_a_garbage_collected_watch_cancels_its_call(client: Client, site: str) -> None:
    watch = client.watch(site)
    next(watch)
    call, ended = watch._stream._call, watch._stream._ended
    del watch
    assert ended.wait(60) and call.cancelled()


def test_a_watch_reconnects_after_the_idle_timeout(client: Client, site: str) -> None:
    """While the map does not change, the watch reconnects without a snapshot or an error."""
    make_layers(client, site)
    with client.watch(site, idle_timeout=0.05, timeout=60) as watch:
        next(watch)
        first = watch._stream
        deadline = time.monotonic() + DEADLINE_S

        def edit_after_reconnection() -> None:
            while watch._stream is first and time.monotonic() < deadline:
                time.sleep(0.01)
            client.apply_edits(site, chair())

        editor = threading.Thread(target=edit_after_reconnection)
        editor.start()
        event = next_change(watch)
        editor.join()
        assert watch._stream is not first
    assert not event.snapshot and event.changes[0].object.label == "chair"


def test_a_watch_of_an_unknown_map_raises_not_found(client: Client) -> None:
    with client.watch("nowhere") as watch, pytest.raises(NotFound, match="nowhere"):
        next(watch)
    assert list(watch) == []


def test_differences_and_revisions(client: Client, site: str) -> None:
    make_layers(client, site)
    (object_id,) = client.apply_edits(site, [chair()]).object_ids
    before = client.apply_edits(site, WriteCells("heat", [[1.0]])).revision
    client.apply_edits(site, [chair(2, object_id), WriteCells("heat", [[2.0]])])
    after = client.apply_edits(site, WriteCells("heat", [[3.0]])).revision
    difference = client.list_changes(site, before)
    assert (difference.from_revision, difference.to_revision) == (before, after)
    cells, put = sorted(difference.changes, key=lambda change: change.layer)
    assert (put.object_before.polygon.bounds[0], put.object.polygon.bounds[0]) == (0, 2)
    assert (cells.cells_before.values, cells.cells.values) == ([1.0], [3.0])
    assert client.list_changes(site, before, before).changes == ()

    revisions = client.list_revisions(site, newest_first=True)
    assert (revisions.newest, revisions.revisions[0].revision) == (after, after)
    page = client.list_revisions(site, after_revision=before, page_size=1)
    assert [r.revision for r in page.revisions] == [before + 1]
    times = [r.time for r in revisions.revisions]
    assert times == sorted(times, reverse=True)
    recent = takewhile(lambda r: r.revision > before, revisions.revisions)
    assert [r.num_changes for r in recent] == [1, 2]
