"""A gRPC client generated from the protos, for requests that the command line can't make or for
which it is too slow."""

import grpc
import shapely.geometry
from google.protobuf import descriptor_pb2, json_format, message_factory
from hypermap.v1 import (access_service_pb2, catalog_service_pb2, edit_service_pb2, exploration_service_pb2,
                         frame_service_pb2, ingest_service_pb2, query_service_pb2,
                         robot_service_pb2, server_service_pb2, watch_service_pb2)

from processes import DEADLINE_S

_KINDS = {(False, False): "unary_unary", (False, True): "unary_stream",
          (True, False): "stream_unary", (True, True): "stream_stream"}


def methods():
    for module in (access_service_pb2, catalog_service_pb2, edit_service_pb2, exploration_service_pb2,
                   frame_service_pb2, ingest_service_pb2, query_service_pb2, robot_service_pb2,
                   server_service_pb2, watch_service_pb2):
        file = descriptor_pb2.FileDescriptorProto()
        module.DESCRIPTOR.CopyToProto(file)
        for service in file.service:
            described = module.DESCRIPTOR.services_by_name[service.name]
            for method in service.method:
                kind = _KINDS[method.client_streaming, method.server_streaming]
                yield service.name, kind, described.methods_by_name[method.name]


class Client:
    """A client with one method per rpc: `client.GetMap(map="office")`.

    Arguments are the request's fields as in protobuf's JSON, or the request as a message (where the
    client streams, one iterable of requests as in JSON); the answer is the message, or an iterator
    of messages. Errors are grpc.RpcError. `client.GetMap.begin(map="office")` does not wait for the
    answer, and returns the grpc.Call, which can be cancelled. A call may take `deadline_s`, or what
    its argument `timeout` says. `token` and `metadata` are sent with each call, and `credentials` are
    those of a TLS channel.
    """

    def __init__(self, address, deadline_s=DEADLINE_S, token=None, credentials=None, metadata=()):
        self._deadline_s = deadline_s
        self.metadata = [*metadata, *([("authorization", f"Bearer {token}")] if token else [])]
        options = [("grpc.max_send_message_length", -1), ("grpc.max_receive_message_length", -1)]
        self._channel = (grpc.secure_channel(address, credentials, options) if credentials
                         else grpc.insecure_channel(address, options))
        messages = message_factory.MessageFactory()
        for service, kind, method in methods():
            setattr(self, method.name, self._function(
                f"/hypermap.v1.{service}/{method.name}", kind,
                messages.GetPrototype(method.input_type),
                messages.GetPrototype(method.output_type)))

    def _function(self, path, kind, request_type, response_type):
        call = getattr(self._channel, kind)(
            path, request_serializer=request_type.SerializeToString,
            response_deserializer=response_type.FromString)

        def message(requests, fields):
            return requests[0] if requests else json_format.ParseDict(fields, request_type())

        def invoke(*requests, timeout=self._deadline_s, **fields):
            if kind.startswith("stream"):
                sent = (json_format.ParseDict(r, request_type()) for r in requests[0])
            else:
                sent = message(requests, fields)
            return call(sent, timeout=timeout, metadata=self.metadata, wait_for_ready=False)

        def begin(*requests, timeout=self._deadline_s, **fields):
            if kind.startswith("stream"):
                sent = iter([json_format.ParseDict(r, request_type()) for r in requests[0]])
            else:
                sent = message(requests, fields)
            start = call if kind.endswith("stream") else call.future
            return start(sent, timeout=timeout, metadata=self.metadata)

        invoke.begin = begin
        return invoke

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._channel.close()


# grpc.health.v1.HealthCheckResponse
SERVING, NOT_SERVING = 1, 2


def health(address, service):
    """Returns what the standard health service tells of a service: SERVING, NOT_SERVING, or None if
    it does not know the service (yet: it looks at maps about every second)."""
    name = service.encode()
    with grpc.insecure_channel(address) as channel:
        try:
            answer = channel.unary_unary("/grpc.health.v1.Health/Check")(
                b"\n" + bytes([len(name)]) + name, timeout=DEADLINE_S)
        except grpc.RpcError as error:
            if error.code() == grpc.StatusCode.NOT_FOUND:
                return None
            raise
    return answer[1]


def scope(map_name, *layers, frame_id=""):
    """Returns a Scope: a map, some of its layers (all if none is named) and a frame."""
    return {"map": map_name, "layers": list(layers), "frame_id": frame_id}


def at(revision):
    """Returns an AsOf, which makes a query read this revision."""
    return {"at_revision": revision}


def point(x, y):
    return {"x": x, "y": y}


def columns(vertices):
    """Returns the members xs and ys of a Ring or LineString with these vertices."""
    return {"xs": [x for x, _ in vertices], "ys": [y for _, y in vertices]}


def polygon(shape):
    """Returns the Polygon message of a Shapely polygon."""
    return {"outer": columns(shape.exterior.coords[:-1]),
            "holes": [columns(hole.coords[:-1]) for hole in shape.interiors]}


def shape_of(geometry):
    """Returns the Shape message of a Shapely polygon, line string or point."""
    if geometry.geom_type == "Polygon":
        return {"polygon": polygon(geometry)}
    if geometry.geom_type == "LineString":
        return {"line_string": columns(geometry.coords)}
    return {"point": point(geometry.x, geometry.y)}


def geometry_of(message):
    """Returns the Shapely geometry of a Shape message, with exactly its vertices."""
    kind = message.WhichOneof("shape")
    if kind == "point":
        return shapely.geometry.Point(message.point.x, message.point.y)
    if kind == "line_string":
        return shapely.geometry.LineString(zip(message.line_string.xs, message.line_string.ys))
    outer, *holes = (list(zip(ring.xs, ring.ys))
                     for ring in (message.polygon.outer, *message.polygon.holes))
    return shapely.geometry.Polygon(outer, holes)
