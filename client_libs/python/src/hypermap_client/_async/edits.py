"""Calls that change a map: its layers, their content and its frames."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from .. import _rpc as rpc
from .._proto import edit_service_pb2 as pb
from .._requests import new_request_id
from .._wire.edits import encode_edit
from ..edits import Edit, EditAnswer
from .connection import Connection


class Edits(Connection):
    """Calls that change a map: its layers, their content and its frames."""

    async def apply_edits(
        self,
        map_name: str,
        edits: Edit | Iterable[Edit],
        *,
        if_layers: Mapping[str, int] | None = None,
        incarnation: int = 0,
        request_id: str = "",
        timeout: float | None = None,
    ) -> EditAnswer:
        """Applies a batch of edits as one revision, or none of them.

        The change is on the server's disk when the call returns. Edits are applied in their order:
        one can create a layer, and the next ones write to it.

        if_layers: versions that layers must have, by layer name, else the batch fails with Aborted.
        incarnation: the incarnation that the map must be, else the batch fails with Aborted; 0 for
            any. Give it with versions and object ids: they mean something else in another
            incarnation.
        request_id: the server carries out a batch once per id, and repeats its answer. Empty for a
            new id, which all retries of this call share. Pass an id of your own (new_request_id)
            to be able to send the batch again after an error such as DeadlineExceeded.

        Raises InvalidArgument (names the edit and the field), NotFound (names the map, layer, frame
        or object), AlreadyExists (names the layer to create), Aborted (a version or the incarnation
        differs from the required one; nothing was changed) and ResourceExhausted (names the limit).
        Raises TypeError or ValueError for edits that cannot be encoded.
        """
        batch = [edits] if not isinstance(edits, Iterable) else edits
        request = pb.ApplyEditsRequest(
            map=map_name,
            request_id=request_id or new_request_id(),
            edits=map(encode_edit, batch),
            if_layers=[
                pb.LayerVersion(layer=layer, version=version)
                for layer, version in (if_layers or {}).items()
            ],
            incarnation=incarnation,
        )
        answer = await self._call(rpc.APPLY_EDITS, request, timeout)
        object_ids = tuple(answer.object_ids)
        return EditAnswer(answer.map, answer.revision, object_ids, answer.incarnation)
