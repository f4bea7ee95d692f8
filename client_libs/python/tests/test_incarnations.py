"""Tests of incarnations: a map that another one of the same name replaces is never continued."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import grpc
import pytest
import shapely
from scripted_server import scripted_server
from server import Server

from hypermap_client import (
    Aborted,
    AsyncClient,
    Client,
    CreateLayer,
    FileFormat,
    GridGeometry,
    LayerKind,
    LayerSpec,
    MapObject,
    NamedFile,
    Pose,
    PutObject,
    TransformSide,
    WatchEvent,
    WriteCells,
    _rpc,
)
from hypermap_client._proto import edit_service_pb2 as edit_service
from hypermap_client._proto import query_service_pb2 as query_service
from hypermap_client._proto import scope_pb2 as scope
from hypermap_client._proto import watch_service_pb2 as pb

# Incarnations use all 64 bits.
OLD, NEW = 2**64 - 1, 2**63 + 1
THINGS = CreateLayer(LayerSpec(name="things", kind=LayerKind.SEMANTIC))
CHAIR = PutObject("things", MapObject("chair", shapely.box(0, 0, 1, 1)))


def snapshot(revision: int, incarnation: int, **fields: Any) -> pb.WatchResponse:
    return pb.WatchResponse(revision=revision, incarnation=incarnation, snapshot=True, **fields)


def commit(revision: int, incarnation: int) -> pb.WatchResponse:
    change = pb.Change(kind=pb.CHANGE_KIND_REMOVE, layer="things", object_id=1)
    return pb.WatchResponse(revision=revision, incarnation=incarnation, changes=[change])


class WatchScript:
    """Answers the watches of a client one after the other, and records their requests."""

    def __init__(self, *answers: list[pb.WatchResponse] | grpc.StatusCode) -> None:
        self._answers = list(answers)
        self.requests: list[pb.WatchRequest] = []

    def __call__(self, request: pb.WatchRequest, _metadata: dict[str, str]) -> Any:
        self.requests.append(request)
        return self._answers.pop(0) if self._answers else grpc.StatusCode.NOT_FOUND

    @property
    def starts(self) -> list[tuple[int | None, int]]:
        """The start revision and the incarnation of each request."""
        return [
            (r.start_revision if r.HasField("start_revision") else None, r.scope.incarnation)
            for r in self.requests
        ]


def seen(events: list[WatchEvent]) -> list[tuple[int, int, bool]]:
    return [(event.revision, event.incarnation, event.reset) for event in events]


def test_c5_a_watch_resumes_only_in_the_incarnation_that_it_saw() -> None:
    script = WatchScript([snapshot(5, OLD), commit(6, OLD)], [commit(7, OLD)])
    with (
        scripted_server({_rpc.WATCH: script}) as address,
        Client(address) as client,
        client.watch("m", timeout=60) as watch,
    ):
        assert watch.incarnation == 0
        events = [next(watch) for _ in range(3)]
        assert watch.incarnation == OLD
    assert seen(events) == [(5, OLD, False), (6, OLD, False), (7, OLD, False)]
    assert script.starts[:2] == [(None, 0), (6, OLD)]


RETURNED = [
    [snapshot(5, OLD)],
    grpc.StatusCode.ABORTED,
    [snapshot(2, NEW), commit(3, NEW)],
    [commit(4, NEW)],
]
SEEN = [(5, OLD, False), (2, NEW, True), (3, NEW, False), (4, NEW, False)]
STARTS = [(None, 0), (5, OLD), (None, 0), (3, NEW)]


def test_c5_a_watch_of_a_map_that_came_back_begins_anew() -> None:
    script = WatchScript(*RETURNED)
    with (
        scripted_server({_rpc.WATCH: script}) as address,
        Client(address) as client,
        client.watch("m", timeout=60) as watch,
    ):
        events = [next(watch) for _ in range(4)]
    assert seen(events) == SEEN
    assert script.starts[:4] == STARTS


async def test_c5_an_async_watch_of_a_map_that_came_back_begins_anew() -> None:
    script = WatchScript(*RETURNED)
    with scripted_server({_rpc.WATCH: script}) as address:
        async with AsyncClient(address) as client, client.watch("m", timeout=60) as watch:
            events = [await anext(watch) for _ in range(4)]
    assert seen(events) == SEEN
    assert script.starts[:4] == STARTS


@pytest.mark.parametrize("first", [[commit(6, NEW)], [snapshot(6, NEW)]])
def test_c5_a_message_of_another_incarnation_begins_a_watch_anew(
    first: list[pb.WatchResponse],
) -> None:
    """The server ought to have refused to resume; the client notices it in the message."""
    script = WatchScript([snapshot(5, OLD)], first, [snapshot(6, NEW)])
    with (
        scripted_server({_rpc.WATCH: script}) as address,
        Client(address) as client,
        client.watch("m", timeout=60) as watch,
    ):
        events = [next(watch) for _ in range(2)]
    assert seen(events) == [(5, OLD, False), (6, NEW, True)]
    assert script.starts[:3] == [(None, 0), (5, OLD), (None, 0)]


def test_c5_a_replacement_without_a_broken_connection_is_passed_on() -> None:
    script = WatchScript([snapshot(5, OLD), snapshot(1, NEW, reset=True), commit(2, NEW)])
    with (
        scripted_server({_rpc.WATCH: script}) as address,
        Client(address) as client,
        client.watch("m", timeout=60) as watch,
    ):
        events = [next(watch) for _ in range(3)]
    assert seen(events) == [(5, OLD, False), (1, NEW, True), (2, NEW, False)]
    assert len(script.starts) == 1


@pytest.mark.parametrize("options", [{"start_revision": 5}, {}])
def test_c5_a_strict_watch_raises_aborted(options: dict[str, int]) -> None:
    script = WatchScript(grpc.StatusCode.ABORTED)
    with (
        scripted_server({_rpc.WATCH: script}) as address,
        Client(address) as client,
        client.watch("m", incarnation=OLD, snapshot_when_compacted=False, **options) as watch,
        pytest.raises(Aborted),
    ):
        next(watch)
    assert script.starts == [(options.get("start_revision"), OLD)]


def test_c5_a_snapshot_of_a_given_incarnation_is_not_replaced_by_another() -> None:
    script = WatchScript(grpc.StatusCode.ABORTED)
    with (
        scripted_server({_rpc.WATCH: script}) as address,
        Client(address) as client,
        client.watch("m", incarnation=OLD) as watch,
        pytest.raises(Aborted),
    ):
        next(watch)


def test_c5_requests_carry_and_answers_return_all_bits_of_an_incarnation() -> None:
    asked: list[int] = []

    def point(request: query_service.QueryPointRequest, _: dict[str, str]) -> Any:
        asked.append(request.scope.incarnation)
        return query_service.QueryPointResponse(revision=3, incarnation=OLD)

    def edit(request: edit_service.ApplyEditsRequest, _: dict[str, str]) -> Any:
        asked.append(request.incarnation)
        return edit_service.ApplyEditsResponse(revision=4, incarnation=NEW)

    with (
        scripted_server({_rpc.QUERY_POINT: point, _rpc.APPLY_EDITS: edit}) as address,
        Client(address) as client,
    ):
        assert client.query_point("m", (0, 0)).incarnation == OLD
        assert client.query_point("m", (0, 0), incarnation=OLD).incarnation == OLD
        assert client.apply_edits("m", CHAIR, incarnation=NEW).incarnation == NEW
    assert asked == [0, OLD, NEW]
    assert scope.Scope(incarnation=OLD).ByteSize() == 9


def replace(client: Client, name: str) -> tuple[int, int]:
    """Replaces a map by another of the same name; returns the two incarnations."""
    old = client.get_map(name).incarnation
    client.delete_map(name, incarnation=old)
    new = client.create_map(name).incarnation
    assert 0 not in (old, new) and old != new
    return old, new


def test_c5_a_map_that_is_made_again_begins_a_watch_anew(client: Client, site: str) -> None:
    client.apply_edits(site, [THINGS, CHAIR])
    with client.watch(site, timeout=60) as watch:
        first = next(watch)
    replace(client, site)
    edit = client.apply_edits(site, THINGS)
    assert edit.revision == first.revision  # The number alone would let the watch continue.
    with client.watch(
        site, start_revision=watch.revision, incarnation=watch.incarnation, timeout=60
    ) as resumed:
        event = next(resumed)
        assert event.snapshot and event.reset and event.changes == ()
        assert event.incarnation == edit.incarnation == resumed.incarnation
        put = client.apply_edits(site, CHAIR)
        change = next(event for event in resumed if event.changes)
        assert change.revision == put.revision and not change.reset


def test_c5_calls_that_name_another_incarnation_change_nothing(client: Client, site: str) -> None:
    old, new = replace(client, site)
    client.apply_edits(site, THINGS, incarnation=new)
    spec = LayerSpec(name="more", kind=LayerKind.SEMANTIC)
    file = NamedFile("things.geojson", b'{"type": "FeatureCollection", "features": []}')
    calls: list[Callable[[], Any]] = [
        lambda: client.apply_edits(site, CHAIR, incarnation=old),
        lambda: client.create_layer(site, spec, incarnation=old),
        lambda: client.delete_layer(site, "things", incarnation=old),
        lambda: client.set_transform(site, "map", "dock", Pose(1, 2, 0), incarnation=old),
        lambda: client.import_map(site, file, layer="things", incarnation=old),
        lambda: client.delete_map(site, incarnation=old),
        lambda: client.query_point(site, (0, 0), incarnation=old),
        lambda: client.query_points(site, [(0, 0)], incarnation=old),
        lambda: client.query_area(site, shapely.box(0, 0, 1, 1), incarnation=old),
        lambda: client.query_value(site, "chair", incarnation=old),
        lambda: client.query_nearest(site, (0, 0), "chair", incarnation=old),
        lambda: client.estimate_transform(
            TransformSide(site, "things", incarnation=old), TransformSide(site, "things")
        ),
        lambda: client.estimate_transform(
            TransformSide(site, "things"), TransformSide(site, "things", incarnation=old)
        ),
        lambda: client.list_changes(site, 0, incarnation=old),
        lambda: client.list_revisions(site, incarnation=old),
    ]
    for call in calls:
        with pytest.raises(Aborted, match="another incarnation"):
            call()
    assert client.get_map(site).revision == 1
    assert [layer.name for layer in client.list_layers(site).layers] == ["things"]


def test_c5_each_answer_with_a_revision_has_the_incarnation(client: Client, site: str) -> None:
    heat = CreateLayer(LayerSpec(name="heat", kind=LayerKind.SCALAR, grid=GridGeometry(1.0)))
    edits = [THINGS, heat, CHAIR, WriteCells("heat", [[1.0]])]
    edit = client.apply_edits(site, edits)
    wanted = client.get_map(site).incarnation
    box = shapely.box(0, 0, 1, 1)
    answers = [
        edit,
        client.query_point(site, (0, 0)),
        client.query_points(site, [(0, 0)]),
        client.query_area(site, box),
        client.query_value(site, "chair"),
        client.query_nearest(site, (0, 0), "chair"),
        client.list_layers(site),
        client.list_transforms(site),
        client.list_changes(site, 0),
        client.list_revisions(site),
        client.list_explorations(site),
        client.export_map(site, FileFormat.HMAP),
    ]
    for answer in answers:
        assert answer.incarnation == wanted, type(answer)
    assert next(m.incarnation for m in client.list_maps() if m.name == site) == wanted
    assert client.read_grid(site, "heat", incarnation=wanted).values.tolist() == [[1.0]]


def test_c5_an_incarnation_outlives_a_restart(data_dir: Any) -> None:
    with Server(data_dir) as server, Client(server.address) as client:
        before = client.create_map("site").incarnation
        with client.watch("site", timeout=60) as watch:
            next(watch)
            assert server.stop() == 0
            with Server(data_dir, listen=server.address):
                answer = client.apply_edits("site", THINGS)
                event = next(e for e in watch if e.changes or e.snapshot)
    assert (event.revision, event.incarnation) == (answer.revision, before)
    assert not event.snapshot and not event.reset
