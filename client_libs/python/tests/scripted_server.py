"""A gRPC server of the test's own, for what the real one does not do on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import grpc

from hypermap_client import _rpc
from hypermap_client._rpc import Rpc

# A request and the call's metadata to an answer, or to a status that the call ends with.
Answer = Callable[[Any, dict[str, str]], Any]


class ScriptedServer(grpc.GenericRpcHandler):
    """Answers calls with one request and one answer by `answers`."""

    def __init__(self, answers: dict[Rpc[Any, Any], Answer]) -> None:
        self._answers = {rpc.path: (rpc, answer) for rpc, answer in answers.items()}
        self.address = ""

    def service(self, details: grpc.HandlerCallDetails) -> grpc.RpcMethodHandler | None:
        if details.method not in self._answers:
            return None
        rpc, answer = self._answers[details.method]

        def handle(request: Any, context: grpc.ServicerContext) -> Any:
            result = answer(request, dict(context.invocation_metadata()))
            if isinstance(result, grpc.StatusCode):
                context.abort(result, f"scripted {result.name}")
            return result

        return grpc.unary_unary_rpc_method_handler(
            handle, rpc.request.FromString, rpc.answer.SerializeToString
        )


@contextmanager
def scripted_server(
    answers: dict[Rpc[Any, Any], Answer], credentials: grpc.ServerCredentials | None = None
) -> Iterator[str]:
    """Its address while it serves."""
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
    """A script for ListMaps alone."""
    return {_rpc.LIST_MAPS: answer}
