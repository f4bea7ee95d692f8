"""The servers that share a store, and who owns its maps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class SharingServer:
    """A server that lives.

    id: its name among the servers that share the store.
    address: address at which the other servers reach it; may be empty.
    num_maps: number of the listed maps that it owns.
    draining: whether it gives its maps to the others and takes none.
    """

    id: str
    address: str
    num_maps: int
    draining: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedMap:
    """A map in the store.

    owner: id of the server that owns the map; empty if no server that lives owns it at the moment.
    stored_revision: the newest revision in the store.
    revision: the newest revision at the server that answered; None if it does not have the map
        open, or has another incarnation of it.
    incarnation: the incarnation of the map in the store.
    """

    name: str
    owner: str
    stored_revision: int
    revision: int | None
    incarnation: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerList:
    """The servers that share a store, by id, and its maps, by name.

    answered_by: id of the server that answered.
    """

    answered_by: str
    servers: tuple[SharingServer, ...]
    maps: tuple[SharedMap, ...]
