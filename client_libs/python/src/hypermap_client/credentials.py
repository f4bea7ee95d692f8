"""How a client shows the server who it is, and makes sure of the server."""

from __future__ import annotations

import ipaddress
import os
import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

# A bearer token, or what gives the one of the moment; called for every call, from any thread.
Token: TypeAlias = str | Callable[[], str]


@dataclass(frozen=True, slots=True)
class Tls:
    """An encrypted connection. All bytes are PEM.

    root_certificates: who may sign the server's certificate; None: those of gRPC.
    certificate_chain, private_key: the client's own, when the server asks for one.
    server_name: what the server's certificate is for, when that is not its address.
    """

    root_certificates: bytes | None = None
    certificate_chain: bytes | None = None
    private_key: bytes | None = field(default=None, repr=False)
    server_name: str = ""

    def __post_init__(self) -> None:
        if (self.certificate_chain is None) != (self.private_key is None):
            raise ValueError("a client's certificate and its key go together")

    @classmethod
    def from_files(
        cls,
        ca: str | os.PathLike[str] | None = None,
        certificate: str | os.PathLike[str] | None = None,
        key: str | os.PathLike[str] | None = None,
        server_name: str = "",
    ) -> Tls:
        """Of PEM files. OSError when one can't be read."""

        def read(path: str | os.PathLike[str] | None) -> bytes | None:
            return None if path is None else pathlib.Path(path).read_bytes()

        return cls(read(ca), read(certificate), read(key), server_name)


def check_token_is_safe(target: str, tls: Tls | None, allow_insecure: bool) -> None:
    """ValueError when a token would go over a network in the clear."""
    if tls is None and not allow_insecure and not is_loopback(target):
        raise ValueError(
            f"a token for {target} needs tls=Tls(...), or allow_insecure_token=True where the "
            "network is trusted"
        )


def is_loopback(target: str) -> bool:
    """Whether the gRPC target never leaves this machine."""
    if target.startswith(("unix:", "unix-abstract:")):
        return True
    address = target.rpartition("/")[2].removeprefix("dns:").removeprefix("ipv4:")
    host = address.removeprefix("ipv6:").rpartition(":")[0].strip("[]")
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
