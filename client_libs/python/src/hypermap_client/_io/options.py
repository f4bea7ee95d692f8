"""Options, credentials and metadata of gRPC channels."""

from __future__ import annotations

import grpc

from ..credentials import Tls, Token

CHANNEL_OPTIONS: tuple[tuple[str, str | int], ...] = (
    # The server limits the size of messages.
    ("grpc.max_receive_message_length", -1),
    ("grpc.max_send_message_length", -1),
    # gRPC tries to reconnect every second, so that a restarted server is found soon. The backoff of
    # retried calls is separate.
    ("grpc.initial_reconnect_backoff_ms", 50),
    ("grpc.max_reconnect_backoff_ms", 1000),
    # The time that an attempt to connect may take, handshakes included: long enough for a slow
    # link, and shorter than the default of 20 s, because TCP repeats what was lost after 1, 3, 7
    # and 15 s: a robot that is back in range would wait.
    ("grpc.min_reconnect_backoff_ms", 10_000),
    ("grpc.enable_http_proxy", 0),
)


# Let calls fail soon if nothing comes back from the other machine, since another server may answer
# them.
LEAVE_DEAD_MACHINES: tuple[tuple[str, str | int], ...] = (
    # Longer than TCP waits to repeat a lost packet for the second time.
    ("grpc.min_reconnect_backoff_ms", 5_000),
    # While there are calls, pings that the server takes every 5 s.
    ("grpc.keepalive_time_ms", 10_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.http2.max_pings_without_data", 0),
)


def channel_options(tls: Tls | None, *, is_only: bool) -> tuple[tuple[str, str | int], ...]:
    """The options of a channel.

    is_only: whether the client has no other server.
    """
    options = dict(CHANNEL_OPTIONS)
    if not is_only:
        options.update(LEAVE_DEAD_MACHINES)
    if tls is not None and tls.server_name:
        options["grpc.ssl_target_name_override"] = tls.server_name
    return tuple(options.items())


def channel_credentials(tls: Tls) -> grpc.ChannelCredentials:
    """The TLS credentials of a channel."""
    return grpc.ssl_channel_credentials(
        tls.root_certificates, tls.private_key, tls.certificate_chain
    )


def call_metadata(token: Token | None) -> tuple[tuple[str, str], ...]:
    """The metadata of a call: the token, if there is one, as `authorization: Bearer …`."""
    if token is None:
        return ()
    return (("authorization", f"Bearer {token() if callable(token) else token}"),)
