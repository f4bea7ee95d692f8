"""The calls that tell who the caller is, and which servers there are."""

from __future__ import annotations

from .. import _rpc as rpc
from .._proto import access_service_pb2 as pb
from .._proto import server_service_pb2 as servers
from .._wire.access import decode_caller
from .._wire.servers import decode_servers
from ..access import Caller
from ..servers import ServerList
from .connection import Connection


class Access(Connection):
    """The calls that tell who the caller is, and which servers there are."""

    async def whoami(self, *, timeout: float | None = None) -> Caller:
        """Returns who the caller is to the server, and what it may do.

        Raises Unauthenticated if the server knows identities and the caller is none of them.
        """
        return decode_caller(await self._call(rpc.GET_CALLER, pb.GetCallerRequest(), timeout))

    async def list_servers(self, *, timeout: float | None = None) -> ServerList:
        """Returns the servers that share a database, and who owns each map.

        Raises Unimplemented if the server has its maps for itself.
        """
        request = servers.ListServersRequest()
        return decode_servers(await self._call(rpc.LIST_SERVERS, request, timeout))
