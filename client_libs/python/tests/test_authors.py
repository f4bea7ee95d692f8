"""A3: the log of a map of version 0.1 that has authors which are no UTF-8 is read."""

from __future__ import annotations

import lzma
import pathlib
from collections.abc import Iterator, Sequence

import pytest
from server import ROOT, Server

from hypermap_client import AsyncClient, Client

FILE = ROOT / "tests" / "integration" / "testdata" / "v0_1" / "authors.gpkg.xz"
MAP = "authors"
# The map is old, and all of its history is to be read.
KEEP_HISTORY = ("--history_age=876000h", "--history_revisions=1000000000")


@pytest.fixture
def old_server(data_dir: pathlib.Path) -> Iterator[Server]:
    """A server of the map of version 0.1."""
    (data_dir / f"{MAP}.gpkg").write_bytes(lzma.decompress(FILE.read_bytes()))
    with Server(data_dir, *KEEP_HISTORY) as server:
        yield server


def check(authors: Sequence[str]) -> None:
    """Checks the authors of the last three revisions in order: two bytes that are no UTF-8, a name
    that version 0.1 cut to 128 bytes, and an honest one."""
    assert list(authors[-3:]) == ["\N{REPLACEMENT CHARACTER}" * 2, "é" * 64, "an honest name"]


def test_a3_the_list_of_revisions_and_a_watch_have_the_authors(old_server: Server) -> None:
    with Client(old_server.address) as client:
        log = client.list_revisions(MAP)
        authors = [r.author for r in log.revisions]
        check(authors)
        newest_first = client.list_revisions(MAP, newest_first=True, page_size=3)
        check([r.author for r in reversed(newest_first.revisions)])
        with client.watch(MAP, start_revision=0, timeout=60) as watch:
            watched = [next(watch).author for _ in authors]
    assert watched == authors


async def test_a3_an_async_client_reads_the_authors(old_server: Server) -> None:
    async with AsyncClient(old_server.address) as client:
        authors = [r.author for r in (await client.list_revisions(MAP)).revisions]
        check(authors)
        async with client.watch(MAP, start_revision=0, timeout=60) as watch:
            assert [(await anext(watch)).author for _ in authors] == authors
