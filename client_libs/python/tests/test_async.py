"""Tests of the asyncio client, for code that the blocking client does not share."""

from __future__ import annotations

import asyncio
import inspect
import pathlib

import grpc
import numpy as np
import pytest
import shapely
from scripted_server import list_maps, scripted_server
from server import Server
from test_observations import make_layers, observation

from hypermap_client import (
    AsyncClient,
    Client,
    CreateLayer,
    DeadlineExceeded,
    LayerKind,
    LayerSpec,
    MapObject,
    NamedFile,
    NotFound,
    ObservationOutcome,
    Pose,
    PutObject,
    ResourceExhausted,
    SetTransform,
    Tls,
    Unavailable,
)
from hypermap_client._proto import catalog_service_pb2 as catalog

CHAIR = PutObject("things", MapObject("chair", shapely.box(0, 0, 1, 1)))


@pytest.fixture
async def things(async_client: AsyncClient, site: str) -> str:
    await async_client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    return site


def test_both_clients_have_the_same_methods() -> None:
    def methods(kind: type) -> dict[str, str]:
        return {
            name: str(inspect.signature(method)).replace("Async", "")
            for name, method in inspect.getmembers(kind, inspect.isfunction)
            if not name.startswith("_")
        }

    assert methods(AsyncClient) == methods(Client)
    assert len(methods(Client)) > 35


async def test_queries(async_client: AsyncClient, things: str) -> None:
    answer = await async_client.apply_edits(things, CHAIR)
    at = await async_client.query_point(things, (0.5, 0.5), min_revision=answer.revision)
    assert [o.id for o in at["things"].objects] == list(answer.object_ids)
    found = await async_client.query_value(things, "chair")
    assert len(found.objects) == 1
    with pytest.raises(NotFound, match="nowhere"):
        await async_client.query_area("nowhere", shapely.box(0, 0, 1, 1))


async def test_concurrent_queries(async_client: AsyncClient, things: str) -> None:
    """A query that waits for a revision does not block other calls of the client."""
    waiting = asyncio.create_task(async_client.query_value(things, "chair", min_revision=2))
    while (await async_client.get_map(things)).revision < 2:
        await async_client.apply_edits(things, CHAIR)
    assert (await waiting).revision >= 2


async def test_points(async_client: AsyncClient, things: str) -> None:
    await async_client.apply_edits(things, CHAIR)
    batch = await async_client.query_points(things, [(0.5, 0.5), (5, 5)])
    assert batch["things"].points.tolist() == [0]
    near = await async_client.query_points(things, [(0.5, 0.5), (1.2, 0.5)], tolerance_m=0.25)
    assert near["things"].points.tolist() == [0, 1]
    at = await async_client.query_point(things, (1.2, 0.5), tolerance_m=0.25)
    assert [o.label for o in at["things"].objects] == ["chair"]
    batches = [np.full((n, 2), 0.5) for n in (1, 3)]
    answers = [a async for a in async_client.stream_points(things, batches)]
    assert [len(a["things"].points) for a in answers] == [1, 3]
    assert answers[1]["things"].labels.tolist() == ["chair"] * 3
    with pytest.raises(ResourceExhausted, match="max_points"):
        await async_client.query_points(things, np.zeros((65_537, 2)))


async def test_files(async_client: AsyncClient, site: str, tmp_path: pathlib.Path) -> None:
    chair = (
        b'{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": '
        b'{"label": "chair"}, "geometry": {"type": "Polygon", "coordinates": '
        b"[[[0, 0], [1, 0], [1, 1], [0, 0]]]}}]}"
    )
    answer = await async_client.import_map(site, NamedFile("a.geojson", chair), layer="things")
    assert answer.layers == ("things",)
    path = tmp_path / "copy.gpkg"
    assert await async_client.backup_map(site, path) == path.stat().st_size > 0
    assert (await async_client.check_map(site)).is_intact
    restored = await async_client.restore_map(f"{site}-copy", path)
    assert restored.layer_count == 1
    # Opens, but cannot be read.
    with pytest.raises(OSError, match="Input/output error"):
        await async_client.restore_map("some", "/proc/self/mem")


async def test_a_watch(async_client: AsyncClient, things: str) -> None:
    async with async_client.watch(things, timeout=60) as watch:
        assert (await anext(watch)).snapshot
        answer = await async_client.apply_edits(things, CHAIR)
        async for event in watch:
            if event.changes:
                break
        assert event.revision == answer.revision


async def test_edits_of_layers_and_shapes(async_client: AsyncClient, site: str) -> None:
    lane = MapObject("lane", shapely.LineString([(0, 0), (2, 0)]))
    answer = await async_client.apply_edits(
        site,
        [
            SetTransform("map", "hall", Pose(0, 1, 0)),
            CreateLayer(LayerSpec(name="lanes", kind=LayerKind.SEMANTIC, frame_id="hall")),
            PutObject("lanes", lane),
        ],
    )
    (found,) = (await async_client.query_value(site, "lane")).objects
    assert found.id == answer.object_ids[2]
    assert found.shape.equals(shapely.LineString([(0, 1), (2, 1)]))


async def test_a_watch_resumes_after_a_server_restart(data_dir: pathlib.Path) -> None:
    with Server(data_dir) as server:
        async with AsyncClient(server.address) as client:
            await client.create_map("site")
            await client.create_layer("site", LayerSpec(name="things", kind=LayerKind.SEMANTIC))
            start = (await client.get_map("site")).revision
            async with client.watch("site", start_revision=start, timeout=60) as watch:
                server.kill()
                with Server(data_dir, listen=server.address):
                    await client.apply_edits("site", CHAIR)
                    events = [event async for event in watch_until(watch, start + 1)]
    assert [e.revision for e in events if e.changes] == [start + 1]


async def watch_until(watch, revision):
    """Yields the events of a watch up to a revision."""
    async for event in watch:
        yield event
        if event.revision >= revision:
            return


async def test_closing_or_cancelling_a_watch_ends_its_reads(
    async_client: AsyncClient, things: str
) -> None:
    watch = async_client.watch(things)
    await anext(watch)
    reading = asyncio.create_task(anext(watch, None))
    await asyncio.sleep(0)
    watch.close()
    assert await asyncio.wait_for(reading, 60) is None

    async with async_client.watch(things) as watch:
        await anext(watch)
        reading = asyncio.create_task(anext(watch))
        await asyncio.sleep(0)
        reading.cancel()
        with pytest.raises(asyncio.CancelledError):
            await reading


async def test_closing_the_client_ends_its_watches(server: Server, things: str) -> None:
    client = AsyncClient(server.address)
    watch = client.watch(things)
    await anext(watch)
    reading = asyncio.create_task(anext(watch, None))
    await asyncio.sleep(0)
    await client.close()
    assert await asyncio.wait_for(reading, 60) is None


async def test_a_watch_reconnects_after_the_idle_timeout(
    async_client: AsyncClient, things: str
) -> None:
    async with async_client.watch(things, idle_timeout=0.05, timeout=60) as watch:
        await anext(watch)
        first = watch._stream
        reading = asyncio.create_task(anext(watch))
        while watch._stream is first:
            await asyncio.sleep(0.01)
        await async_client.apply_edits(things, CHAIR)
        event = await reading
        while not event.changes:
            event = await anext(watch)
        assert not event.snapshot and event.changes[0].object.label == "chair"


async def test_a_stream_of_observations_resumes_after_a_server_restart(
    data_dir: pathlib.Path,
) -> None:
    with Server(data_dir) as server:
        with Client(server.address) as blocking:
            blocking.create_map("site")
            make_layers(blocking, "site")
        async with AsyncClient(server.address) as client:
            async with client.observe("site", "found", robot="rob", timeout=60) as stream:
                await stream.submit(observation(i) for i in range(20))
                server.kill()
                with Server(data_dir, listen=server.address):
                    answers = await stream.submit([observation(19), observation(20)])
    assert [a.outcome for a in answers] == [
        ObservationOutcome.DUPLICATE,
        ObservationOutcome.ACCEPTED,
    ]


async def test_errors(async_client: AsyncClient, things: str) -> None:
    with pytest.raises(DeadlineExceeded):
        await async_client.query_point(things, (0, 0), min_revision=10**6, timeout=0.05)
    async with AsyncClient("127.0.0.1:1", retry_for=0) as nobody:
        with pytest.raises(Unavailable):
            await nobody.list_maps()


async def test_tls_and_token(certificates: pathlib.Path) -> None:
    seen = []

    def answer(_request: object, metadata: dict[str, str]) -> object:
        seen.append(metadata.get("authorization"))
        return catalog.ListMapsResponse(maps=[catalog.Map(name="office")])

    pair = tuple((certificates / name).read_bytes() for name in ("server.key", "server.pem"))
    tls = Tls.from_files(ca=certificates / "ca.pem", server_name="map.example")
    with scripted_server(list_maps(answer), grpc.ssl_server_credentials([pair])) as address:
        async with AsyncClient(address, tls=tls, token="secret") as client:
            assert [m.name for m in await client.list_maps()] == ["office"]
        async with AsyncClient(address, retry_for=0) as client:
            with pytest.raises(Unavailable):
                await client.list_maps()
    assert seen == ["Bearer secret"]
