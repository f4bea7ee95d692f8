"""Computes the expected answers to queries of a recorded map with Shapely and NumPy only."""

import math
import random

import numpy
import shapely.affinity
import shapely.geometry
import shapely.vectorized

import answers
import hmap_reader

FREE_BELOW, OCCUPIED_ABOVE = 0.196, 0.65


class Oracle:
    """The expected answers for one map.

    polygons: {layer: [(id, label, shape)]}
    grids: {layer: hmap_reader.Grid}
    shapes: {grid layer: (rows, cols)}
    """

    def __init__(self, path, exported):
        """Reads a map from an .hmap file.

        exported: the GeoJSON export of the server, which has the ids of the objects. Fails if its
            objects differ from those of the file.
        """
        layers = hmap_reader.read(path)
        self.grids = {n: l for n, l in layers.items() if isinstance(l, hmap_reader.Grid)}
        self.polygons = {n: _match(l.objects, exported, n) for n, l in layers.items()
                         if isinstance(l, hmap_reader.Objects)}
        self.shapes = {name: grid.values.shape for name, grid in self.grids.items()}
        self._centres = {name: grid.centres() for name, grid in self.grids.items()}

    def at_point(self, x, y):
        """Returns {layer: set of ids, value of the cell, or status word}."""
        p = shapely.geometry.Point(x, y)
        answer = {name: {i for i, _, shape in objects if shape.covers(p)}
                  for name, objects in self.polygons.items()}
        for name, grid in self.grids.items():
            answer[name] = _cell_at(grid, x, y)
        return answer

    def in_area(self, area, matches_label=lambda _: True, matches_value=lambda v: v == v):
        """Returns {layer: set of ids or dense cells}. None for `area` selects everything.

        matches_value: predicate on an array of cell values, NaN for unknown cells.
        """
        answer = {name: {i for i, label, shape in objects
                         if matches_label(label) and (area is None or shape.intersects(area))}
                  for name, objects in self.polygons.items()}
        for name, grid in self.grids.items():
            chosen = matches_value(grid.values)
            if area is not None:
                chosen = chosen & covered(area, *self._centres[name])
            cells = answers.no_cells(grid.values.shape)
            cells[chosen] = numpy.where(numpy.isnan(grid.values), answers.UNKNOWN,
                                        grid.values)[chosen]
            answer[name] = cells
        return answer

    def content(self, area):
        return self.in_area(area, matches_value=lambda v: numpy.ones(v.shape, bool))

    def search(self, value, area):
        """Returns the same as in_area for a value string, or "unsupported_value" for a layer that
        does not support the value."""
        with numpy.errstate(invalid="ignore"):
            on_cells = _ON_CELLS.get(value.lower())
            answer = self.in_area(
                area, matches_label=lambda label: _fold(label) == _fold(value),
                matches_value=on_cells or (lambda v: numpy.zeros(v.shape, bool)))
        refusing = self.polygons if on_cells else self.grids
        return answer | {name: "unsupported_value" for name in refusing}

    def labels(self):
        return sorted({label for objects in self.polygons.values() for _, label, _ in objects})

    def bounds(self):
        """Returns (x_min, y_min, x_max, y_max) of all layers."""
        boxes = [shape.bounds for objects in self.polygons.values() for _, _, shape in objects]
        boxes += [(x.min(), y.min(), x.max(), y.max()) for x, y in self._centres.values()]
        low, high = numpy.min(boxes, axis=0), numpy.max(boxes, axis=0)
        return low[0], low[1], high[2], high[3]

    def vertices(self):
        """Returns points that test exactness: vertices of objects and centres of some cells."""
        points = [p for objects in self.polygons.values() for _, _, shape in objects
                  for p in shape.exterior.coords]
        for x, y in self._centres.values():
            points += list(zip(x.ravel()[::997], y.ravel()[::997]))
        return points


_ON_CELLS = {
    "free": lambda v: v < FREE_BELOW,
    "occupied": lambda v: v > OCCUPIED_ABOVE,
    "unknown": numpy.isnan,
    ">0.65": lambda v: v > 0.65,
    "<=0.2": lambda v: v <= 0.2,
    "=1": lambda v: v == 1,
    "0.2..1": lambda v: (v >= 0.2) & (v <= 1),
}
CELL_VALUES = sorted(_ON_CELLS)


def _fold(label):
    return " ".join(label.lower().split())


def covered(area, x, y):
    """Tells for each point whether it is in the polygon or on its boundary."""
    low_x, low_y, high_x, high_y = area.bounds
    near = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
    chosen = numpy.zeros(x.shape, bool)
    if near.any():
        chosen[near] = shapely.vectorized.contains(area, x[near], y[near])
    # shapely is slow to tell which points are on the boundary, so only those next to it are asked.
    edge = near & ~chosen
    edge[edge] = _next_to_boundary(area, x[edge], y[edge])
    if edge.any():
        chosen[edge] = shapely.vectorized.touches(area, x[edge], y[edge])
    return chosen


def _next_to_boundary(area, x, y, within=1e-6):
    """Tells for each point whether it is within a distance of the line through an edge of the
    polygon."""
    close = numpy.zeros(x.shape, bool)
    for ring in (area.exterior, *area.interiors):
        corners = numpy.array(ring.coords)
        for (x1, y1), (x2, y2) in zip(corners, corners[1:]):
            length = math.hypot(x2 - x1, y2 - y1)
            close |= abs((x - x1) * (y2 - y1) - (y - y1) * (x2 - x1)) <= within * length
    return close


def _cell_at(grid, x, y):
    dx, dy = x - grid.origin[0], y - grid.origin[1]
    cos, sin = math.cos(grid.origin[2]), math.sin(grid.origin[2])
    col = math.floor((cos * dx + sin * dy) / grid.resolution)
    row = math.floor((cos * dy - sin * dx) / grid.resolution)
    rows, cols = grid.values.shape
    if not (0 <= row < rows and 0 <= col < cols):
        return "outside"
    value = grid.values[row, col]
    return "unknown" if math.isnan(value) else float(value)


def _match(objects, exported, layer):
    """Returns (id, label, shape) for each object: the server's id, the file's label and shape."""
    found = [(f["id"], f["properties"]["label"], shapely.geometry.shape(f["geometry"]))
             for f in exported["features"] if f["properties"].get("layer", layer) == layer]
    matched = []
    for label, shape in hmap_reader.distinct_parts(objects):
        same = next((f for f in found
                     if f[1] == label and hmap_reader.same_shape(f[2], shape)), None)
        assert same, f"{layer}: the server has no object {label} {shape.wkt}"
        found.remove(same)
        matched.append((same[0], label, shape))
    assert not found, f"{layer}: objects that the file does not have: {found}"
    return matched


class Questions:
    """Draws random points and areas of a map. Many of them are at vertices of its objects."""

    def __init__(self, oracle, seed):
        self._random = random.Random(seed)
        self._box = oracle.bounds()
        self._special = oracle.vertices()

    def choice(self, among):
        return self._random.choice(among)

    def point(self):
        if self._random.random() < 0.3:
            return self._random.choice(self._special)
        low_x, low_y, high_x, high_y = self._box
        margin = 0.05 * (high_x - low_x)
        return (self._random.uniform(low_x - margin, high_x + margin),
                self._random.uniform(low_y - margin, high_y + margin))

    def area(self, holes=True):
        """Draws a star, a box or a strip of 10 cm to 10 m. Some have a corner at a vertex of the
        map, and some have a hole."""
        while True:
            shape = self._random.choice([self._star, self._box_of_cells, self._strip])()
            if holes and self._random.random() < 0.2:
                hole = shapely.affinity.scale(shape, 0.4, 0.4, origin=shape.representative_point())
                if shape.contains(hole):
                    shape = shapely.geometry.Polygon(shape.exterior, [hole.exterior])
            if shape.is_valid and shape.area > 0:
                return shape

    def _size(self):
        return math.exp(self._random.uniform(math.log(0.1), math.log(10)))

    def _star(self):
        (x, y), size, n = self.point(), self._size(), self._random.randint(3, 16)
        corners = []
        for i in range(n):
            angle = 2 * math.pi * (i + 0.8 * self._random.random()) / n
            r = size * self._random.uniform(0.2, 1)
            corners.append((x + r * math.cos(angle), y + r * math.sin(angle)))
        if self._random.random() < 0.3:  # Moves a corner to a vertex of the map.
            corners[0] = min(self._special, key=lambda p: math.dist(p, corners[0]))
        return shapely.geometry.Polygon(corners)

    def _box_of_cells(self):
        (x1, y1), (x2, y2) = self._random.choice(self._special), self._random.choice(self._special)
        width, height = self._size(), self._size()
        return shapely.geometry.box(x1, y1, x2 if 0 < x2 - x1 < 10 else x1 + width,
                                    y2 if 0 < y2 - y1 < 10 else y1 + height)

    def _strip(self):
        line = shapely.geometry.LineString([(0, 0), (self._size(), 0)])
        x, y = self.point()
        strip = line.buffer(0.3 * self._size() / 10, cap_style=2)
        return shapely.affinity.translate(
            shapely.affinity.rotate(strip, self._random.uniform(0, 360)), x, y)
