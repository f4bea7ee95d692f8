"""Tests of the caller's identity, and of tokens in files."""

from __future__ import annotations

import pathlib
from datetime import datetime, timezone
from typing import Any

import pytest
from scripted_server import list_maps, scripted_server

from hypermap_client import AsyncClient, Caller, Client, Role, Unauthenticated, _rpc
from hypermap_client._proto import access_service_pb2 as access
from hypermap_client._proto import catalog_service_pb2 as catalog


def test_the_caller_has_its_rights() -> None:
    response = access.GetCallerResponse(
        has_identities=True,
        identity="cart",
        role=access.ROLE_ROBOT,
        maps=["hall-*", "office"],
        robots=["cart-arm"],
        expires={"seconds": 5},
    )
    with (
        scripted_server({_rpc.GET_CALLER: lambda *_: response}) as address,
        Client(address) as client,
    ):
        assert client.whoami() == Caller(
            identity="cart",
            role=Role.ROBOT,
            maps=("hall-*", "office"),
            robots=("cart-arm",),
            expires=datetime.fromtimestamp(5, timezone.utc),
        )


async def test_a_server_without_identities_knows_nobody() -> None:
    with scripted_server({_rpc.GET_CALLER: lambda *_: access.GetCallerResponse()}) as address:
        async with AsyncClient(address) as client:
            assert await client.whoami() == Caller()


def test_the_tokens_file_is_read_for_each_call(tmp_path: pathlib.Path) -> None:
    seen = []

    def answer(_request: Any, metadata: dict[str, str]) -> Any:
        seen.append(metadata.get("authorization"))
        return catalog.ListMapsResponse()

    file = tmp_path / "token"
    with scripted_server(list_maps(answer)) as address, Client(address, token_file=file) as client:
        with pytest.raises(Unauthenticated, match="No such file"):
            client.list_maps()
        file.write_text("first\n")
        client.list_maps()
        file.write_text("second\n")
        client.list_maps()
        file.write_text("caf\u00e9", encoding="utf-8")
        with pytest.raises(Unauthenticated, match="not ASCII") as caught:
            client.list_maps()
    assert "caf" not in str(caught.value)
    assert seen == ["Bearer first", "Bearer second"]


def test_a_token_comes_from_one_place_and_is_not_sent_unencrypted(tmp_path: pathlib.Path) -> None:
    with pytest.raises(ValueError, match="together"):
        Client("127.0.0.1:1", token="secret", token_file=tmp_path / "token")
    with pytest.raises(ValueError, match="tls"):
        Client("robots.example:50051", token_file=tmp_path / "token")
