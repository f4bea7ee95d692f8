"""Credentials of a client (token, certificate) and the certificates that it trusts."""

from __future__ import annotations

import ipaddress
import os
import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

from .errors import Unauthenticated

# A bearer token, or a function that returns the current one. The client calls the function for
# every RPC, from any thread.
Token: TypeAlias = str | Callable[[], str]


@dataclass(frozen=True, slots=True)
class Tls:
    """Parameters of a TLS connection. Certificates and keys are PEM bytes.

    root_certificates: certificate authorities that may sign the server's certificate; None for
        the default roots of gRPC.
    certificate_chain, private_key: the client's certificate and its key, for servers that require
        client certificates. Both or none are given; ValueError otherwise.
    server_name: the name in the server's certificate, if it differs from the host of the target.
    """

    root_certificates: bytes | None = None
    certificate_chain: bytes | None = None
    private_key: bytes | None = field(default=None, repr=False)
    server_name: str = ""

    def __post_init__(self) -> None:
        if (self.certificate_chain is None) != (self.private_key is None):
            raise ValueError("certificate_chain and private_key must be given together")

    @classmethod
    def from_files(
        cls,
        ca: str | os.PathLike[str] | None = None,
        certificate: str | os.PathLike[str] | None = None,
        key: str | os.PathLike[str] | None = None,
        server_name: str = "",
    ) -> Tls:
        """Reads certificates and key from PEM files.

        ca: file of the root certificates.
        certificate, key: files of the client's certificate and private key.

        Raises OSError if a file cannot be read, and ValueError if only one of certificate and key
        is given.
        """

        def read(path: str | os.PathLike[str] | None) -> bytes | None:
            return None if path is None else pathlib.Path(path).read_bytes()

        return cls(read(ca), read(certificate), read(key), server_name)


def token_from_file(path: str | os.PathLike[str]) -> Callable[[], str]:
    """A function that reads the token from a file, without whitespace at its ends.

    It raises Unauthenticated, without the token, if the file cannot be read or cannot be sent.
    """

    def read() -> str:
        try:
            return pathlib.Path(path).read_bytes().decode("ascii").strip()
        except OSError as error:
            raise Unauthenticated(str(error)) from None
        except UnicodeDecodeError:
            raise Unauthenticated(f"the token in {path} is not ASCII") from None

    return read


def check_token_is_safe(target: str, tls: Tls | None, allow_insecure: bool) -> None:
    """Raises ValueError if a token would be sent unencrypted over a network."""
    if tls is None and not allow_insecure and not is_loopback(target):
        raise ValueError(
            f"the token for {target} would be sent unencrypted; pass tls=Tls(...), or "
            "allow_insecure_token=True in a trusted network"
        )


def is_loopback(target: str) -> bool:
    """Whether a gRPC target is on this machine: a loopback address or a Unix socket."""
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
