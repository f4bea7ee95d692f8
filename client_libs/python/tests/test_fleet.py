"""Tests with several servers that share a PostgreSQL database; skipped if that is missing."""

from __future__ import annotations

import asyncio
import os
import pathlib
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import pytest
import shapely
from server import DEADLINE_S, ROOT, Server

from hypermap_client import (
    AsyncClient,
    Client,
    CreateLayer,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    PutObject,
    Unavailable,
    Unimplemented,
    Watch,
)


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The URI of a PostgreSQL cluster."""
    if uri := os.environ.get("HYPERMAP_TEST_POSTGRES"):
        yield uri
        return
    script = ROOT / "tests" / "postgres" / "with_cluster.sh"
    # The script ends the cluster when `cat` sees the end of its input.
    with subprocess.Popen(
        [script, "bash", "-c", "echo $HYPERMAP_TEST_POSTGRES; cat"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        uri = process.stdout.readline().strip()
        if not uri:
            pytest.skip("PostgreSQL is missing")
        yield uri


@pytest.fixture
def servers(cluster: str, tmp_path: pathlib.Path) -> Iterator[list[Server]]:
    """Two servers on a new database."""
    database = f"python_{os.getpid()}_{tmp_path.name}"
    create = f'CREATE DATABASE "{database}" STRATEGY FILE_COPY'
    subprocess.run(["psql", "-qAtX", "-d", f"{cluster}/postgres", "-c", create], check=True)
    with ExitStack() as stack:
        servers = []
        for name in ("a", "b"):
            (tmp_path / name).mkdir()
            flags = f"--store={cluster}/{database}", f"--server_id={name}"
            servers.append(stack.enter_context(Server(tmp_path / name, *flags)))
        yield servers


def put(label: str) -> PutObject:
    return PutObject("things", MapObject(label, shapely.Point(0, 0)))


def make_map(client: Client) -> str:
    client.create_map("site")
    client.apply_edits("site", [CreateLayer(LayerSpec(name="things", kind=LayerKind.SEMANTIC))])
    return "site"


def await_map(client: Client, name: str) -> None:
    """Waits until a server that follows the others has a map."""
    deadline = time.monotonic() + DEADLINE_S
    while True:
        try:
            client.get_map(name)
            return
        except (NotFound, Unavailable):
            assert time.monotonic() < deadline
            time.sleep(0.01)


def changes(watch: Watch, last: int) -> list[int]:
    """The revisions with changes that a watch reports, up to the last one."""
    told = []
    for event in watch:
        if event.changes:
            told.append(event.revision)
        if event.revision >= last:
            break
    return told


def test_edits_and_a_watch_go_on_when_their_server_is_killed(servers: list[Server]) -> None:
    first, second = servers
    labels = [f"cup {i}" for i in range(60)]
    last = len(labels) + 1  # the first revision makes the layer
    with Client(f"{first.address},{second.address}") as client, ThreadPoolExecutor() as threads:
        site = make_map(client)
        watch = client.watch(site, start_revision=0, timeout=DEADLINE_S)
        told = threads.submit(changes, watch, last)
        revisions = []
        for i, label in enumerate(labels):
            if i == 20:
                killed = threads.submit(first.kill)  # while edits are under way
            revisions.append(client.apply_edits(site, put(label)).revision)
        killed.result()
        objects = client.query_area(site, shapely.box(-1, -1, 1, 1))["things"].objects
        assert told.result() == list(range(1, last + 1))
    assert revisions == list(range(2, last + 1))
    assert sorted(o.label for o in objects) == sorted(labels)


def test_a_client_sees_its_own_changes_at_a_server_that_follows(servers: list[Server]) -> None:
    owner, follower = servers
    with Client(owner.address) as client:
        site = make_map(client)
    with Client(f"{follower.address},{owner.address}") as client:
        await_map(client, site)
        for i in range(50):
            client.apply_edits(site, put(f"cup {i}"))
            assert client.query_value(site, f"cup {i}")["things"].objects


def test_servers_and_owners_are_listed(servers: list[Server]) -> None:
    with Client(servers[0].address) as client:
        site = make_map(client)
        listed = client.list_servers()
    assert listed.answered_by == "a"
    assert [(s.id, s.address, s.num_maps) for s in listed.servers] == [
        ("a", servers[0].address, 1),
        ("b", servers[1].address, 0),
    ]
    (shared,) = listed.maps
    assert (shared.name, shared.owner) == (site, "a")
    assert shared.stored_revision == shared.revision == 1


def await_owner(client: Client, owner: str) -> None:
    deadline = time.monotonic() + DEADLINE_S
    while [shared.owner for shared in client.list_servers().maps] != [owner]:
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_server_is_drained(servers: list[Server]) -> None:
    with Client(servers[0].address) as client:
        site = make_map(client)
        client.drain_server()
        await_owner(client, "b")
        assert [s.draining for s in client.list_servers().servers] == [True, False]
        assert client.apply_edits(site, put("cup")).revision == 2
        client.drain_server("a", undo=True)
        client.drain_server("b")
        await_owner(client, "a")
        with pytest.raises(NotFound, match="no server"):
            client.drain_server("c")


def test_a_server_that_shares_nothing_says_so(client: Client) -> None:
    with pytest.raises(Unimplemented, match="shares its maps with no others"):
        client.list_servers()


async def test_an_async_client_goes_on_when_its_server_is_killed(servers: list[Server]) -> None:
    first, second = servers
    async with AsyncClient(f"{first.address},{second.address}") as client:
        await client.create_map("site")
        things = CreateLayer(LayerSpec(name="things", kind=LayerKind.SEMANTIC))
        await client.apply_edits("site", things)
        with Client(second.address) as other:
            await asyncio.to_thread(await_map, other, "site")
        killed = asyncio.create_task(asyncio.to_thread(first.kill))
        for i in range(20):
            assert (await client.apply_edits("site", put(f"cup {i}"))).revision == i + 2
        await killed
