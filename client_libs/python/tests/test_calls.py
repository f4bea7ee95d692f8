"""Tests of the behaviour that all calls share: retries, deadlines, errors, credentials."""

from __future__ import annotations

import pathlib
import signal
import threading
from typing import Any

import grpc
import pytest
import shapely
from scripted_server import list_maps, scripted_server
from server import Server

import hypermap_client
from hypermap_client import (
    Client,
    DeadlineExceeded,
    HypermapError,
    Internal,
    LayerKind,
    LayerSpec,
    MapObject,
    NotFound,
    PutObject,
    ResourceExhausted,
    Tls,
    Unavailable,
    _rpc,
)
from hypermap_client._proto import catalog_service_pb2 as catalog
from hypermap_client._proto import edit_service_pb2 as edit_service
from hypermap_client._proto import query_service_pb2 as query_service
from hypermap_client.credentials import is_loopback

CHAIR = PutObject("things", MapObject("chair", shapely.box(0, 0, 1, 1)))
MAPS = catalog.ListMapsResponse(maps=[catalog.Map(name="office")])


def test_each_status_code_raises_its_error_with_the_servers_message() -> None:
    codes = [code for code in grpc.StatusCode if code != grpc.StatusCode.OK]
    for code in codes:
        with (
            scripted_server(list_maps(lambda *_, code=code: code)) as address,
            Client(address, retry_for=0) as client,
            pytest.raises(HypermapError, match=f"scripted {code.name}") as caught,
        ):
            client.list_maps()
        error = caught.value
        assert error.message == str(error)
        assert error.code == code
        if code != grpc.StatusCode.UNKNOWN:
            assert type(error) is not HypermapError
            assert type(error).__name__.upper() == code.name.replace("_", "")


def test_a_call_is_retried_until_the_server_is_available() -> None:
    tries = []

    def answer(_request: Any, _metadata: dict[str, str]) -> Any:
        tries.append(1)
        return MAPS if len(tries) == 4 else grpc.StatusCode.UNAVAILABLE

    with scripted_server(list_maps(answer)) as address, Client(address) as client:
        assert [m.name for m in client.list_maps()] == ["office"]
    assert len(tries) == 4


def test_retries_of_a_mutation_share_its_request_id() -> None:
    ids = []

    def answer(request: Any, _metadata: dict[str, str]) -> Any:
        ids.append(request.request_id)
        if len(ids) % 3:
            return grpc.StatusCode.UNAVAILABLE
        return edit_service.ApplyEditsResponse(map="m", revision=7, object_ids=[1])

    with scripted_server({_rpc.APPLY_EDITS: answer}) as address, Client(address) as client:
        assert client.apply_edits("m", CHAIR).revision == 7
        client.apply_edits("m", CHAIR)
    first, second = ids[:3], ids[3:]
    assert len(first) == len(second) == 3
    assert len(set(first)) == len(set(second)) == 1 and len(first[0]) == 32
    assert first[0] != second[0]


def test_errors_other_than_unavailable_are_not_retried() -> None:
    tries = []

    def answer(_request: Any, _metadata: dict[str, str]) -> Any:
        tries.append(1)
        return grpc.StatusCode.NOT_FOUND

    with (
        scripted_server(list_maps(answer)) as address,
        Client(address) as client,
        pytest.raises(NotFound),
    ):
        client.list_maps()
    assert len(tries) == 1


def test_a_call_is_retried_when_the_server_asks_for_a_later_try() -> None:
    tries = []
    later = (grpc.StatusCode.RESOURCE_EXHAUSTED, (("grpc-retry-pushback-ms", "20"),))

    def answer(_request: Any, _metadata: dict[str, str]) -> Any:
        tries.append(1)
        return MAPS if len(tries) % 3 == 0 else later

    with scripted_server(list_maps(answer)) as address:
        with Client(address) as client:
            assert [m.name for m in client.list_maps()] == ["office"]
        assert len(tries) == 3
        with Client(address, retry_for=0) as client, pytest.raises(ResourceExhausted) as caught:
            client.list_maps()
    assert caught.value.retry_after_s == 0.02
    assert len(tries) == 4


@pytest.mark.parametrize("metadata", [(), (("grpc-retry-pushback-ms", "soon"),)])
def test_an_exceeded_limit_is_not_retried(metadata: tuple[tuple[str, str], ...]) -> None:
    tries = []

    def answer(_request: Any, _metadata: dict[str, str]) -> Any:
        tries.append(1)
        return (grpc.StatusCode.RESOURCE_EXHAUSTED, metadata)

    with (
        scripted_server(list_maps(answer)) as address,
        Client(address) as client,
        pytest.raises(ResourceExhausted) as caught,
    ):
        client.list_maps()
    assert caught.value.retry_after_s is None
    assert len(tries) == 1


@pytest.mark.parametrize(("metadata", "name"), [((), None), ((("x-request-id", "a1"),), "a1")])
def test_an_error_tells_the_name_of_the_call(
    metadata: tuple[tuple[str, str], ...], name: str | None
) -> None:
    with (
        scripted_server(list_maps(lambda *_: (grpc.StatusCode.INTERNAL, metadata))) as address,
        Client(address) as client,
        pytest.raises(Internal) as caught,
    ):
        client.list_maps()
    assert caught.value.request_id == name


def test_retries_end_if_there_is_no_server() -> None:
    with scripted_server({}) as address:
        pass  # The server has stopped, so no process listens on its port.
    with Client(address, retry_for=0.2) as client, pytest.raises(Unavailable):
        client.list_maps()
    with Client(address, timeout=0.2) as client, pytest.raises(HypermapError) as caught:
        client.list_maps()
    assert isinstance(caught.value, (Unavailable, DeadlineExceeded))


def test_a_connection_may_take_seconds(data_dir: pathlib.Path) -> None:
    """As handshakes do over a slow link; here the server is stopped meanwhile."""
    with Server(data_dir) as server:
        server.send_signal(signal.SIGSTOP)
        goes_on = threading.Timer(3.0, server.send_signal, [signal.SIGCONT])
        goes_on.start()
        with Client(server.address, retry_for=0) as client:
            assert not client.list_maps()
        goes_on.join()


def test_a_call_waits_for_a_server_that_starts_late(data_dir: pathlib.Path) -> None:
    with Server(data_dir) as server:
        address = server.address
    with Client(address) as client:
        answers: list[Any] = []
        asking = threading.Thread(target=lambda: answers.append(client.create_map("late")))
        asking.start()
        with Server(data_dir, listen=address):
            asking.join(60)
        assert [answer.name for answer in answers] == ["late"]


def test_a_call_fails_after_its_timeout(client: Client, site: str) -> None:
    with pytest.raises(DeadlineExceeded):
        client.query_point(site, (0, 0), min_revision=10**6, timeout=0.05)


def test_an_unknown_enumerator_in_a_response_is_an_internal_error() -> None:
    content = query_service.LayerContent(layer="x", kind=1, status=99)
    strange = query_service.QueryPointResponse(layers=[content])
    with (
        scripted_server({_rpc.QUERY_POINT: lambda *_: strange}) as address,
        Client(address) as client,
        pytest.raises(Internal, match="unknown AnswerStatus: 99"),
    ):
        client.query_point("m", (0, 0))


def test_threads_share_a_client(client: Client, site: str) -> None:
    client.create_layer(site, LayerSpec(name="things", kind=LayerKind.SEMANTIC))
    threads = [
        threading.Thread(target=lambda: [client.apply_edits(site, CHAIR) for _ in range(10)])
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert client.get_layer(site, "things").size == 40


def test_a_token_is_sent_with_every_call() -> None:
    seen = []

    def answer(_request: Any, metadata: dict[str, str]) -> Any:
        seen.append(metadata.get("authorization"))
        return MAPS

    tokens = iter(["one", "two"])
    with scripted_server(list_maps(answer)) as address:
        for token in (None, "secret", lambda: next(tokens)):
            with Client(address, token=token) as client:
                client.list_maps()
                client.list_maps()
    assert seen == [None, None, "Bearer secret", "Bearer secret", "Bearer one", "Bearer two"]


def test_a_token_is_not_sent_unencrypted_over_a_network() -> None:
    with pytest.raises(ValueError, match="tls"):
        Client("robots.example:50051", token="secret")
    Client("robots.example:50051", token="secret", allow_insecure_token=True).close()
    Client("robots.example:50051", token="secret", tls=Tls()).close()
    for here in ("127.0.0.1:1", "localhost:1", "[::1]:1", "dns:///localhost:1", "unix:/run/x"):
        assert is_loopback(here), here
    for there in ("10.0.0.1:1", "localhost.example:1", "[fe80::1]:1", "dns:///a:1"):
        assert not is_loopback(there), there


def test_mutual_tls(certificates: pathlib.Path) -> None:
    def read(name: str) -> bytes:
        return (certificates / name).read_bytes()

    pair = (read("server.key"), read("server.pem"))
    mutual = grpc.ssl_server_credentials([pair], read("ca.pem"), require_client_auth=True)
    files = {"ca": certificates / "ca.pem", "server_name": "map.example"}
    own = {"certificate": certificates / "client.pem", "key": certificates / "client.key"}
    with scripted_server(list_maps(lambda *_: MAPS), mutual) as address:
        with Client(address, tls=Tls.from_files(**files, **own), token="secret") as client:
            assert [m.name for m in client.list_maps()] == ["office"]
        refused = [
            Tls.from_files(**files),
            Tls.from_files(server_name="map.example", **own),
            Tls.from_files(ca=certificates / "ca.pem", server_name="other.example", **own),
            None,
        ]
        for tls in refused:
            with Client(address, tls=tls, retry_for=0) as client, pytest.raises(Unavailable):
                client.list_maps()
    with pytest.raises(ValueError, match="together"):
        Tls(private_key=b"x")
    assert "PRIVATE" not in repr(Tls.from_files(**files, **own))


def test_tls_of_the_real_server(certificates: pathlib.Path, data_dir: pathlib.Path) -> None:
    flags = {"cert": "server.pem", "key": "server.key", "client_ca": "ca.pem"}
    arguments = [f"--tls_{flag}={certificates / name}" for flag, name in flags.items()]
    files = {"ca": certificates / "ca.pem", "server_name": "map.example"}
    own = {"certificate": certificates / "client.pem", "key": certificates / "client.key"}
    with Server(data_dir, *arguments) as server:
        with Client(server.address, tls=Tls.from_files(**files, **own)) as client:
            assert client.create_map("site").name == "site"
            with client.watch("site", timeout=60) as watch:
                assert next(watch).snapshot
        for tls in (Tls.from_files(**files), None):
            with Client(server.address, tls=tls, retry_for=0) as client, pytest.raises(Unavailable):
                client.list_maps()


def test_errors_are_exported() -> None:
    for error in HypermapError.__subclasses__():
        assert getattr(hypermap_client, error.__name__) is error
