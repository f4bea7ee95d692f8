"""The calls about the caller, and about servers that share a database."""

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
    """The calls about the caller, and about servers that share a database."""

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

    async def drain_server(
        self, server: str = "", *, undo: bool = False, timeout: float | None = None
    ) -> None:
        """Has a server give its maps to the others, and take none until it is started anew.

        `server` is its id; empty: the server that is asked. With `undo` it takes maps again.
        Returns before maps have moved: `list_servers` tells which ones the server still owns.

        Raises NotFound if no such server lives, and Unimplemented if the server that is asked has
        its maps for itself.
        """
        request = servers.DrainServerRequest(server=server, undo=undo)
        await self._call(rpc.DRAIN_SERVER, request, timeout)
