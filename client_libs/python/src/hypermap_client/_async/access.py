"""The call that tells who the caller is."""

from __future__ import annotations

from .. import _rpc as rpc
from .._proto import access_service_pb2 as pb
from .._wire.access import decode_caller
from ..access import Caller
from .connection import Connection


class Access(Connection):
    """The call that tells who the caller is."""

    async def whoami(self, *, timeout: float | None = None) -> Caller:
        """Returns who the caller is to the server, and what it may do.

        Raises Unauthenticated if the server knows identities and the caller is none of them.
        """
        return decode_caller(await self._call(rpc.GET_CALLER, pb.GetCallerRequest(), timeout))
