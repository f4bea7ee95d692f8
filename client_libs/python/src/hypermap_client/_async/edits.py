"""Changes of the content of layers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from .. import _rpc as rpc
from .._proto import edit_service_pb2 as pb
from .._requests import new_request_id
from .._wire.edits import encode_edit
from ..edits import Edit, EditAnswer
from .connection import Connection


class Edits(Connection):
    """Changes of the content of layers."""

    async def apply_edits(
        self,
        map_name: str,
        edits: Edit | Iterable[Edit],
        *,
        if_layers: Mapping[str, int] | None = None,
        request_id: str = "",
        timeout: float | None = None,
    ) -> EditAnswer:
        """Carries out all edits as one revision, or none; on disk when answered.

        if_layers: versions that layers must have, or all of the batch is Aborted.
        request_id: the server carries out each id once and repeats its answer. Empty: a new one,
            which the tries of this call share. Keep one of your own (new_request_id) to send a
            batch again whose answer was lost.

        InvalidArgument names the edit and the field; NotFound the map, layer, frame or object;
        Aborted what has another version than the edits want.
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
        )
        answer = await self._call(rpc.APPLY_EDITS, request, timeout)
        return EditAnswer(answer.map, answer.revision, tuple(answer.object_ids))
