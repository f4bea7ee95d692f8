"""A gRPC server with scripted responses, for faults that the real server cannot be made to show."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import grpc

from hypermap_client import _rpc
from hypermap_client._proto._pool import POOL
from hypermap_client._rpc import Rpc

# A function from a request (or a list of all requests, for an RPC that streams them) and the
# metadata of the call to a response, to a list of responses for an RPC that streams them, or to a
# status code with which the call fails: alone, or with trailing metadata.
Answer = Callable[[Any, dict[str, str]], Any]


class ScriptedServer(grpc.GenericRpcHandler):
    """Answers calls with the functions in `answers`."""

    def __init__(self, answers: dict[Rpc[Any, Any], Answer]) -> None:
        self._answers = {rpc.path: (rpc, answer) for rpc, answer in answers.items()}
        self.address = ""

    def service(self, details: grpc.HandlerCallDetails) -> grpc.RpcMethodHandler | None:
        if details.method not in self._answers:
            return None
        rpc, answer = self._answers[details.method]

        def handle(request: Any, context: grpc.ServicerContext) -> Any:
            result = answer(request, dict(context.invocation_metadata()))
            if isinstance(result, tuple):
                result, metadata = result
                context.set_trailing_metadata(metadata)
            if isinstance(result, grpc.StatusCode):
                context.abort(result, f"scripted {result.name}")
            return iter(result) if method.server_streaming else result

        method = POOL.FindMethodByName(rpc.path.removeprefix("/").replace("/", "."))
        if method.client_streaming:
            return grpc.stream_unary_rpc_method_handler(
                lambda requests, context: handle(list(requests), context),
                rpc.request.FromString,
                rpc.response.SerializeToString,
            )
        make_handler = (
            grpc.unary_stream_rpc_method_handler
            if method.server_streaming
            else grpc.unary_unary_rpc_method_handler
        )
        return make_handler(handle, rpc.request.FromString, rpc.response.SerializeToString)


@contextmanager
def scripted_server(
    answers: dict[Rpc[Any, Any], Answer], credentials: grpc.ServerCredentials | None = None
) -> Iterator[str]:
    """Runs a scripted server for the duration of the block, and yields its address."""
    server = grpc.server(ThreadPoolExecutor(4), handlers=[ScriptedServer(answers)])
    if credentials is None:
        port = server.add_insecure_port("127.0.0.1:0")
    else:
        port = server.add_secure_port("127.0.0.1:0", credentials)
    server.start()
    try:
        yield f"127.0.0.1:{port}"
    finally:
        server.stop(None).wait()


def list_maps(answer: Answer) -> dict[Rpc[Any, Any], Answer]:
    """A script that answers ListMaps only."""
    return {_rpc.LIST_MAPS: answer}
