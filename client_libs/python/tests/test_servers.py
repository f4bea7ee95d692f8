"""Tests of clients that know several servers: which one they ask, and what they tell it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import grpc
import pytest
from scripted_server import list_maps, scripted_server
from server import lasting_port

from hypermap_client import AsyncClient, Client, NotFound, Unavailable, _rpc
from hypermap_client._proto import catalog_service_pb2 as catalog
from hypermap_client._proto import edit_service_pb2 as edit_service
from hypermap_client._proto import query_service_pb2 as query_service
from hypermap_client._proto import watch_service_pb2 as watch_service


class Script:
    """Answers the calls of a server one after the other, the last for ever, and keeps requests."""

    def __init__(self, *answers: Any) -> None:
        self._answers = list(answers)
        self.requests: list[Any] = []

    def __call__(self, request: Any, _metadata: dict[str, str]) -> Any:
        self.requests.append(request)
        return self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]

    def __len__(self) -> int:
        return len(self.requests)


MAPS = catalog.ListMapsResponse()
DOWN = grpc.StatusCode.UNAVAILABLE


@contextmanager
def servers(rpc: Any, *scripts: Script) -> Iterator[str]:
    """Runs a server for each script, and yields their addresses as a client takes them."""
    with ExitStack() as stack:
        yield ", ".join(stack.enter_context(scripted_server({rpc: script})) for script in scripts)


def test_the_first_server_is_asked_as_long_as_it_answers() -> None:
    first, second = Script(MAPS), Script(MAPS)
    with servers(_rpc.LIST_MAPS, first, second) as addresses, Client(addresses) as client:
        for _ in range(3):
            client.list_maps()
    assert (len(first), len(second)) == (3, 0)


def test_the_next_server_is_asked_when_one_is_unavailable_and_stays() -> None:
    first, second = Script(DOWN), Script(MAPS)
    with servers(_rpc.LIST_MAPS, first, second) as addresses, Client(addresses) as client:
        for _ in range(3):
            client.list_maps()
    assert (len(first), len(second)) == (1, 3)


def test_servers_are_asked_in_a_circle() -> None:
    first, second = Script(DOWN, DOWN, MAPS), Script(DOWN)
    with servers(_rpc.LIST_MAPS, first, second) as addresses, Client(addresses) as client:
        client.list_maps()
    assert (len(first), len(second)) == (3, 2)


def test_a_server_that_cannot_be_reached_is_passed_over() -> None:
    nobody = f"127.0.0.1:{lasting_port()}"
    with (
        scripted_server(list_maps(lambda *_: MAPS)) as address,
        Client(f"{nobody},{address}", retry_for=0) as client,
    ):
        client.list_maps()


def test_without_time_for_retries_each_server_is_tried_once() -> None:
    first, second = Script(DOWN), Script(DOWN)
    with (
        servers(_rpc.LIST_MAPS, first, second) as addresses,
        Client(addresses, retry_for=0) as client,
        pytest.raises(Unavailable),
    ):
        client.list_maps()
    assert (len(first), len(second)) == (1, 1)


def test_other_errors_are_the_answer() -> None:
    first, second = Script(grpc.StatusCode.NOT_FOUND), Script(MAPS)
    with (
        servers(_rpc.LIST_MAPS, first, second) as addresses,
        Client(addresses) as client,
        pytest.raises(NotFound),
    ):
        client.list_maps()
    assert len(second) == 0


async def test_an_async_client_goes_on_too() -> None:
    first, second = Script(DOWN), Script(MAPS)
    with servers(_rpc.LIST_MAPS, first, second) as addresses:
        async with AsyncClient(addresses) as client:
            await client.list_maps()
    assert (len(first), len(second)) == (1, 1)


def test_a_mutation_has_the_same_id_at_the_next_server() -> None:
    first, second = Script(DOWN), Script(edit_service.ApplyEditsResponse(revision=1))
    with servers(_rpc.APPLY_EDITS, first, second) as addresses, Client(addresses) as client:
        client.apply_edits("m", [])
    assert first.requests[0].request_id == second.requests[0].request_id != ""


def test_a_watch_goes_on_at_the_next_server() -> None:
    def commit(revision: int) -> watch_service.WatchResponse:
        change = watch_service.Change(kind=watch_service.CHANGE_KIND_REMOVE, object_id=1)
        return watch_service.WatchResponse(revision=revision, incarnation=7, changes=[change])

    first = Script([watch_service.WatchResponse(revision=4, incarnation=7, snapshot=True)], DOWN)
    # A server that follows the map, and is a moment behind.
    second = Script(DOWN, [commit(5)])
    with (
        servers(_rpc.WATCH, first, second) as addresses,
        Client(addresses) as client,
        client.watch("m", timeout=60) as watch,
    ):
        assert [next(watch).revision for _ in range(2)] == [4, 5]
    starts = [(r.start_revision, r.scope.incarnation) for r in second.requests[:2]]
    assert starts == [(4, 7), (4, 7)]


def test_a_query_names_the_newest_revision_of_its_map_that_was_seen() -> None:
    def answer(revision: int, incarnation: int = 7) -> query_service.QueryPointResponse:
        return query_service.QueryPointResponse(revision=revision, incarnation=incarnation)

    points = Script(answer(9), answer(8), answer(2, 6), answer(3, 6))
    edits = Script(edit_service.ApplyEditsResponse(revision=8, incarnation=7))
    with (
        scripted_server({_rpc.QUERY_POINT: points, _rpc.APPLY_EDITS: edits}) as address,
        Client(address) as client,
    ):
        client.apply_edits("m", [])
        for _ in range(4):
            client.query_point("m", (0, 0))
        client.query_point("other", (0, 0))
    seen = [(r.as_of.seen_revision, r.as_of.seen_incarnation) for r in points.requests]
    assert seen == [(8, 7), (9, 7), (9, 7), (2, 6), (0, 0)]


def test_an_older_answer_than_was_seen_is_asked_for_again() -> None:
    def revisions(newest: int) -> Script:
        return Script(watch_service.ListRevisionsResponse(newest_revision=newest, incarnation=7))

    behind, other = revisions(7), revisions(8)
    edits = Script(edit_service.ApplyEditsResponse(revision=8, incarnation=7))
    with (
        scripted_server({_rpc.LIST_REVISIONS: behind, _rpc.APPLY_EDITS: edits}) as first,
        scripted_server({_rpc.LIST_REVISIONS: other}) as second,
        Client(f"{first},{second}") as client,
    ):
        assert client.list_revisions("m").newest == 7
        client.apply_edits("m", [])
        assert client.list_revisions("m").newest == 8
    assert (len(behind), len(other)) == (2, 1)


def test_each_address_is_checked_before_a_token_is_sent() -> None:
    with pytest.raises(ValueError, match=r"robots\.example"):
        Client("127.0.0.1:1,robots.example:50051", token="secret")
