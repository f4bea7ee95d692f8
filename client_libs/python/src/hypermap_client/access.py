"""Who the caller is to the server, and what it may do."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum


class Role(IntEnum):
    """What an identity may do. Each role may do what the roles before it may."""

    READER = 1
    """Asks, watches, replicates and exports."""
    ROBOT = 2
    """Sends observations and claims goals, in the names of its own robots."""
    EDITOR = 3
    """Edits content, and creates and changes layers."""
    ADMIN = 4
    """Creates, imports, replaces and deletes maps, and takes backups."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Caller:
    """The identity of the caller.

    identity: the author of the changes that the caller makes.
    role: None if the server knows no identities. Everybody may do everything then, and the other
        fields are empty.
    maps: patterns of the maps for which the caller has the role, as of a shell: "*" stands for any
        text, "?" for any character, "[a-c]" for one of these.
    robots: patterns of the names of robots, besides its own name, in which the caller may act.
    expires: time in UTC at which the caller's token expires; None if it does not.
    """

    identity: str = ""
    role: Role | None = None
    maps: tuple[str, ...] = ()
    robots: tuple[str, ...] = ()
    expires: datetime | None = None
