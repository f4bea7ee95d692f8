"""Conversion of lists of servers."""

from __future__ import annotations

from .._proto import server_service_pb2 as pb
from ..servers import ServerList, SharedMap, SharingServer


def decode_servers(message: pb.ListServersResponse) -> ServerList:
    return ServerList(
        answered_by=message.answered_by,
        servers=tuple(
            SharingServer(id=s.id, address=s.address, num_maps=s.map_count, draining=s.draining)
            for s in message.servers
        ),
        maps=tuple(
            SharedMap(
                name=m.name,
                owner=m.owner,
                stored_revision=m.stored_revision,
                revision=m.revision if m.HasField("revision") else None,
                incarnation=m.incarnation,
            )
            for m in message.maps
        ),
    )
