"""Maps and the lists of their layers and frames."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from .geometry import Transform
from .layers import Layer


@dataclass(frozen=True, slots=True, kw_only=True)
class MapEntry:
    """A map apart from its content.

    frame_id: the map's own frame, what an empty frame id means.
    problem: not empty when the server can't open the map: why. Only the name is set then.
    """

    name: str
    frame_id: str = ""
    revision: int = 0
    create_time: datetime | None = None
    layer_count: int = 0
    problem: str = ""


@dataclass(frozen=True, slots=True)
class LayerList:
    """The layers of a map by name, at a revision."""

    map: str
    revision: int
    layers: tuple[Layer, ...]

    def __getitem__(self, name: str) -> Layer:
        for layer in self.layers:
            if layer.name == name:
                return layer
        raise KeyError(name)


@dataclass(frozen=True, slots=True)
class TransformList:
    """The frames of a map by child, at a revision; `frame_id` is the map's own."""

    map: str
    revision: int
    frame_id: str
    transforms: tuple[Transform, ...]
