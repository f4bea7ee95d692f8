"""An independent reader of .hmap files, which shares no code with the server.

Tests compare the answers of the server with its results.
"""

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
    """A grid layer. values[0, 0] is the lower left cell; NaN is an unknown cell."""
    name: str
    resolution: float
    origin: tuple
    values: numpy.ndarray

    def centres(self):
        """Returns the x and the y coordinates of the centres of the cells, as two arrays."""
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
    """Returns (label, polygon) for each object. Duplicates are left out, and an object of several
    polygons becomes several entries."""
    found = []
    for o in objects:
        for part in getattr(o.shape, "geoms", [o.shape]):
            if not any(label == o.label and same_shape(shape, part) for label, shape in found):
                found.append((o.label, part))
    return found


def same_shape(a, b):
    """Whether two polygons are equal except for rounding errors."""
    return a.symmetric_difference(b).area < 1e-9 * max(a.area, b.area)


def read(path):
    """Returns {layer name: Grid or Objects}. All layers must be in the map's own frame."""
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
    """Decodes an 8-bit PNG without colours to (grey, alpha), two arrays of floats."""
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
    image = numpy.zeros((height, width, channels), numpy.int64)
    above = image[0]
    for y, line in enumerate(lines):
        above = image[y] = _unfilter(line[0], line[1:].reshape(width, channels).astype(int), above)
    image = image.astype(float)
    if channels > 2:
        assert (image[..., 0] == image[..., 1]).all() and (image[..., 0] == image[..., 2]).all()
    alpha = image[..., -1] if channels in (2, 4) else numpy.full((height, width), 255.0)
    return image[..., 0], alpha


def _unfilter(kind, line, above):
    """Undoes one of PNG's five filters of a line. `line` and `above`, the decoded line above it,
    are arrays (width, channels) of integers."""
    if kind == 0:
        return line
    if kind == 1:
        return numpy.cumsum(line, axis=0) % 256
    if kind == 2:
        return (line + above) % 256
    # In plain integers, which are faster than NumPy's, because each value depends on the last one.
    channels = []
    for c in range(line.shape[1]):
        values, left, corner = [], 0, 0
        for value, up in zip(line[:, c].tolist(), above[:, c].tolist()):
            if kind == 3:
                guess = (left + up) // 2
            else:  # Paeth's: of left, up and corner, the first nearest to left + up - corner.
                to_left, to_up, to_corner = (abs(up - corner), abs(left - corner),
                                             abs(left + up - 2 * corner))
                guess = (left if to_left <= to_up and to_left <= to_corner
                         else up if to_up <= to_corner else corner)
            left, corner = (value + guess) % 256, up
            values.append(left)
        channels.append(values)
    return numpy.array(channels).T


def read_shape(wkt):
    """Parses the ring of a WKT polygon. Returns the region in which its winding number is not zero.

    Missing commas are tolerated, because the numbers are read in pairs.
    """
    numbers = [float(n) for n in re.findall(r"[-+0-9.eE]+", wkt.split("(", 1)[1])]
    points = list(zip(numbers[::2], numbers[1::2]))
    shape = shapely.geometry.Polygon(points)
    return shape if shape.is_valid else fill_non_zero(points)


def fill_non_zero(points):
    """Fills a ring that intersects itself by the non-zero rule."""
    ring = shapely.geometry.LinearRing(points)
    faces = shapely.ops.polygonize(shapely.ops.unary_union(ring))
    return shapely.ops.unary_union([
        face for face in faces if winding(points, face.representative_point())])


def winding(points, p):
    """Returns the winding number of the ring around the point `p`."""
    turns = 0
    for (x1, y1), (x2, y2) in zip(points, points[1:] + points[:1]):
        side = (x2 - x1) * (p.y - y1) - (p.x - x1) * (y2 - y1)
        if y1 <= p.y < y2 and side > 0:
            turns += 1
        elif y2 <= p.y < y1 and side < 0:
            turns -= 1
    return turns
