#!/usr/bin/python3
"""Draws an answer of the hypermap command as an SVG picture.

    hypermap --json query area office -1,-1 21,-1 21,13 -1,13 | tools/draw_map.py > docs/office.svg

Occupancy lies at the bottom, explored (green) and unexplored (orange) area on it, objects with
their labels on top; rasters of other numbers are left out. y points up, as on the map.
"""

import colorsys
import hashlib
import json
import math
import sys

PIXELS_PER_METRE = 48
MARGIN_M = 0.3
UNKNOWN = "#eceff1"


def is_exploration(line):
    """Whether a grid is an exploration layer, whose values are printed as integers."""
    return all(isinstance(value, int) for *_, value in line["runs"] if value is not None)


def is_probability(line):
    """Whether all values are in [0, 1], as in occupancy and exploration layers."""
    return all(0 <= value <= 1 for *_, value in line["runs"] if value is not None)


def tint(exploration, value):
    """Returns the colour of a cell, or None to leave it out. Exploration is painted translucent."""
    if exploration:
        return {1: "#4caf5030", 0: "#ff980058"}.get(value)
    if value is None:
        return UNKNOWN
    grey = round(250 - 210 * value)
    return f"#{grey:02x}{grey:02x}{grey:02x}"


def colour(label):
    """Returns the colour of a label, which is the same in all pictures."""
    hue = hashlib.md5(label.encode()).digest()[0] / 256
    return "#" + "".join(f"{round(255 * c):02x}" for c in colorsys.hls_to_rgb(hue, 0.6, 0.6))


def tall_boxes(runs):
    """Joins equal runs of consecutive rows to (row_begin, row_end, col_begin, col_end, value)."""
    growing, done = {}, []
    for row, begin, end, value in sorted(runs, key=lambda run: run[0]):
        box = growing.get((begin, end, value))
        if box and box[1] == row:
            box[1] = row + 1
        else:
            growing[begin, end, value] = box = [row, row + 1, begin, end, value]
            done.append(box)
    return done


class Picture:
    """The SVG elements of a picture, and the points that determine its extent, in metres."""

    def __init__(self):
        self.elements = []
        self.points = []

    def polygon(self, rings, style):
        self.points += [p for ring in rings for p in ring]
        path = "".join("M" + "L".join(f"{x:.3f} {y:.3f}" for x, y in ring) + "Z" for ring in rings)
        self.elements.append(f'<path d="{path}" {style}/>')

    def cells(self, line):
        (x, y, yaw), side = line["grid"]["origin"], line["grid"]["resolution_m"]
        cos, sin = math.cos(yaw) * side, math.sin(yaw) * side
        exploration = is_exploration(line)
        for top, bottom, left, right, value in tall_boxes(map(tuple, line["runs"])):
            if fill := tint(exploration, value):
                corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
                self.polygon([[(x + cos * c - sin * r, y + sin * c + cos * r) for c, r in corners]],
                             f'fill="{fill}" shape-rendering="crispEdges"')

    def entity(self, entity):
        fill = colour(entity["label"])
        self.polygon(entity["polygon"], f'fill="{fill}" fill-opacity="0.75" fill-rule="evenodd" '
                     f'stroke="#37474f" stroke-width="0.02"')

    def label(self, entity):
        xs = [x for x, _ in entity["polygon"][0]]
        x, y = entity["centroid"]
        size = min(0.24, 1.6 * (max(xs) - min(xs)) / len(entity["label"]))
        if size >= 0.1:
            self.elements.append(f'<text transform="translate({x:.3f} {y:.3f}) scale(1 -1)" '
                                 f'font-size="{size:.2f}" dy="0.35em">{entity["label"]}</text>')

    def svg(self):
        left, right = min(x for x, _ in self.points), max(x for x, _ in self.points)
        low, high = min(y for _, y in self.points), max(y for _, y in self.points)
        left, low, right, high = (left - MARGIN_M, low - MARGIN_M, right + MARGIN_M,
                                  high + MARGIN_M)
        width, height = right - left, high - low
        return "\n".join([
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * PIXELS_PER_METRE:.0f}" '
            f'height="{height * PIXELS_PER_METRE:.0f}" '
            f'viewBox="{left:.3f} {-high:.3f} {width:.3f} {height:.3f}">',
            f'<rect x="{left:.3f}" y="{-high:.3f}" width="{width:.3f}" height="{height:.3f}" '
            'fill="white"/>',
            '<g transform="scale(1 -1)" font-family="sans-serif" text-anchor="middle">',
            *self.elements, "</g>", "</svg>", ""])


def main():
    lines = [json.loads(line) for line in sys.stdin]
    grids = [line for line in lines if "runs" in line and is_probability(line)]
    entities = [line["entity"] for line in lines if "entity" in line]
    picture = Picture()
    for line in sorted(grids, key=is_exploration):
        picture.cells(line)
    for entity in entities:
        picture.entity(entity)
    for entity in entities:
        picture.label(entity)
    sys.stdout.write(picture.svg())


if __name__ == "__main__":
    main()
