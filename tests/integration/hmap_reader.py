"""Reads .hmap files with nothing of ours: the second opinion that answers are compared with."""

import dataclasses
import io
import re
import struct
import zipfile
import zlib

import numpy
import shapely.geometry
import shapely.ops
import yaml


@dataclasses.dataclass
class Grid:
    """`values[row, col]` counts from the lower left corner; NaN is unknown."""
    name: str
    resolution: float
    origin: tuple
    values: numpy.ndarray

    def centres(self):
        """(x, y) arrays of the cells' centres, as the grid's definition has them."""
        rows, cols = self.values.shape
        x = (numpy.arange(cols) + 0.5) * self.resolution
        y = (numpy.arange(rows) + 0.5) * self.resolution
        x, y = numpy.meshgrid(x, y)
        if self.origin[2] == 0:
            return self.origin[0] + x, self.origin[1] + y
        cos, sin = numpy.cos(self.origin[2]), numpy.sin(self.origin[2])
        return self.origin[0] + cos * x - sin * y, self.origin[1] + sin * x + cos * y


@dataclasses.dataclass
class Object:
    label: str
    shape: shapely.geometry.base.BaseGeometry


@dataclasses.dataclass
class Objects:
    name: str
    objects: list


def distinct_parts(objects):
    """(label, polygon) of each object, once where the file repeats it, part by part where it falls
    apart."""
    found = []
    for o in objects:
        for part in getattr(o.shape, "geoms", [o.shape]):
            if not any(label == o.label and same_shape(shape, part) for label, shape in found):
                found.append((o.label, part))
    return found


def same_shape(a, b):
    """Whether two polygons are one but for rounding."""
    return a.symmetric_difference(b).area < 1e-9 * max(a.area, b.area)


def read(path):
    """{layer name: Grid or Objects}; all layers are in the map's own frame in the files we have."""
    archive = zipfile.ZipFile(path)
    config = yaml.safe_load(archive.read("hmap_config.yaml"))
    layers = {}
    for layer in config["layers"]:
        if layer["class"] == "OccupancyGridLayer":
            layers[layer["name"]] = _read_grid(archive, layer)
        else:
            objects = yaml.safe_load(archive.read(layer["file"])) or []
            layers[layer["name"]] = Objects(layer["name"], [
                Object(str(o["name"]), read_shape(o["shape"])) for o in objects])
    return layers


def _read_grid(archive, layer):
    about = yaml.safe_load(archive.read(layer["file"] + ".yaml"))
    grey, alpha = read_png(archive.read(about["image"]))
    occupied = grey / 255.0 if about.get("negate") else (255.0 - grey) / 255.0
    high, low = about["occupied_thresh"], about["free_thresh"]
    mode = about.get("mode", "trinary")
    if mode == "raw":
        values = numpy.where(grey <= 100, grey / 100.0, numpy.nan)
    else:
        between = numpy.round(100 * (occupied - low) / (high - low)) / 100 if mode == "scale" \
            else numpy.full(grey.shape, numpy.nan)
        values = numpy.where(occupied > high, 1.0, numpy.where(occupied < low, 0.0, between))
    values = numpy.where(alpha < 255, numpy.nan, values)
    return Grid(layer["name"], about["resolution"], tuple(about["origin"]), values[::-1])


def read_png(data):
    """(grey, alpha) of an 8-bit PNG that shows greys, as arrays of floats."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    stream, packed = io.BytesIO(data[8:]), b""
    while head := stream.read(8):
        length, kind = struct.unpack(">I4s", head)
        body = stream.read(length)
        stream.read(4)
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", body)
            assert depth == 8 and colour in (0, 2, 4, 6) and not interlace, (depth, colour)
        if kind == b"IDAT":
            packed += body
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    lines = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).reshape(height, -1)
    image = numpy.zeros((height + 1, width + 1, channels), numpy.int64)  # with a border of 0
    for y in range(height):
        _unfilter(int(lines[y, 0]), lines[y, 1:].reshape(width, channels), image, y + 1)
    image = image[1:, 1:].astype(float)
    if channels > 2:
        assert (image[..., 0] == image[..., 1]).all() and (image[..., 0] == image[..., 2]).all()
    alpha = image[..., -1] if channels in (2, 4) else numpy.full((height, width), 255.0)
    return image[..., 0], alpha


def _unfilter(kind, line, image, y):
    """Undoes one of PNG's five filters; image[y - 1] is the line above, column 0 the border."""
    if kind == 0:
        image[y, 1:] = line
    elif kind == 2:
        image[y, 1:] = (line + image[y - 1, 1:]) % 256
    else:
        for x in range(1, image.shape[1]):
            for c in range(image.shape[2]):
                left, up, corner = (int(image[y, x - 1, c]), int(image[y - 1, x, c]),
                                    int(image[y - 1, x - 1, c]))
                if kind == 1:
                    guess = left
                elif kind == 3:
                    guess = (left + up) // 2
                else:
                    guess = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
                image[y, x, c] = (int(line[x - 1, c]) + guess) % 256


def read_shape(wkt):
    """The region that the ring winds round, however often. A missing comma is of no consequence:
    the numbers come in pairs."""
    numbers = [float(n) for n in re.findall(r"[-+0-9.eE]+", wkt.split("(", 1)[1])]
    points = list(zip(numbers[::2], numbers[1::2]))
    shape = shapely.geometry.Polygon(points)
    return shape if shape.is_valid else fill_non_zero(points)


def fill_non_zero(points):
    """Cuts the plane along the ring and keeps the faces with a winding number."""
    ring = shapely.geometry.LinearRing(points)
    faces = shapely.ops.polygonize(shapely.ops.unary_union(ring))
    return shapely.ops.unary_union([
        face for face in faces if winding(points, face.representative_point())])


def winding(points, p):
    """How often the ring goes round `p`."""
    turns = 0
    for (x1, y1), (x2, y2) in zip(points, points[1:] + points[:1]):
        side = (x2 - x1) * (p.y - y1) - (p.x - x1) * (y2 - y1)
        if y1 <= p.y < y2 and side > 0:
            turns += 1
        elif y2 <= p.y < y1 and side < 0:
            turns -= 1
    return turns
