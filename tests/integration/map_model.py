"""A model of a map in memory: its objects as Shapely geometries and its grids as arrays, and random
batches of edits that lead from one state of the map to the next."""

import numpy
import shapely.geometry

import oracle
import rpc
import sites
from test_shapes import LABELS, intersecting

# The model of a grid is an array of SIDE x SIDE cells; the cell (row 0, column 0) is in the middle.
SIDE = 160
# Resolution of each grid in metres. The corners and centres of all cells are exact numbers.
GRIDS = {"grid": 0.5, "signal": 0.25}
CELL_VALUES = [0.0, 0.25, 0.5, 0.75, 1.0]
# The cells of an array that each word selects; the words are those of occupancy or of all grids.
WORDS = {
    "grid": {"free": lambda v: v < oracle.FREE_BELOW,
             "occupied": lambda v: v > oracle.OCCUPIED_ABOVE, "=0.5": lambda v: v == 0.5},
    "signal": {">0.25": lambda v: v > 0.25, "0.25..0.75": lambda v: (v >= 0.25) & (v <= 0.75)},
}
ALIASES = ("furniture", "traffic")


def centres(layer):
    """Returns the x and y of the centres of all cells."""
    steps = (numpy.arange(SIDE) - SIDE // 2 + 0.5) * GRIDS[layer]
    return numpy.meshgrid(steps, steps)


CENTRES = {layer: centres(layer) for layer in GRIDS}


def selected_cells(layer, area, rule="CELL_RULE_CENTRE"):
    """Returns an array that tells of each cell whether the area selects it."""
    if rule == "CELL_RULE_CENTRE":
        return oracle.covered(area, *CENTRES[layer])
    cells, half = numpy.zeros((SIDE, SIDE), bool), GRIDS[layer] / 2
    low_x, low_y, high_x, high_y = area.bounds
    x, y = CENTRES[layer]
    near = ((x >= low_x - half) & (x <= high_x + half) & (y >= low_y - half) & (y <= high_y + half))
    for row, col in numpy.argwhere(near):
        square = shapely.geometry.box(x[row, col] - half, y[row, col] - half,
                                      x[row, col] + half, y[row, col] + half)
        cells[row, col] = (area.covers(square) if rule == "CELL_RULE_COVERED" else
                           area.intersects(square))
    return cells


def known_cells(values, chosen):
    """Returns {(row, col): value} of the chosen cells that are known."""
    return {(int(row) - SIDE // 2, int(col) - SIDE // 2): float(values[row, col])
            for row, col in numpy.argwhere(chosen & (values == values))}


class State:
    """The content of the map at a revision. A copy shares the arrays, which are replaced and not
    changed."""

    def __init__(self):
        self.things = {"things": {}}  # layer -> id -> Thing; the layer "draft" comes and goes
        self.cells = {layer: numpy.full((SIDE, SIDE), numpy.nan) for layer in GRIDS}
        self.aliases = {}  # alias of a label of "things" -> set of labels

    def copy(self):
        copied = State.__new__(State)
        copied.things = {layer: dict(things) for layer, things in self.things.items()}
        copied.cells, copied.aliases = dict(self.cells), dict(self.aliases)
        return copied

    def set_cells(self, layer, chosen, values):
        self.cells[layer] = numpy.where(chosen, values, self.cells[layer])

    def layers(self):
        return {*self.things, *self.cells}

    def cells_in(self, layer, area):
        return known_cells(self.cells[layer], selected_cells(layer, area))

    def labels_for(self, layer, word):
        return {word} | (self.aliases.get(word, set()) if layer == "things" else set())

    def with_value(self, layer, word, area):
        """Returns the ids of the objects with a label or alias."""
        return set().union(*(intersecting(self.things[layer], area, label)
                             for label in self.labels_for(layer, word)))

    def distances(self, word, p):
        """Returns the distances of all objects and cells with a value, by layer and id or cell."""
        found = {(layer, i): things[i].geometry.distance(p)
                 for layer, things in self.things.items()
                 for i in self.with_value(layer, word, None)}
        for layer, values in self.cells.items():
            matches = WORDS[layer].get(word)
            if matches:
                x, y = CENTRES[layer]
                chosen = matches(values)
                distances = numpy.hypot(x - p.x, y - p.y)
                found |= {(layer, cell): distance for cell, distance in
                          known_cells(distances, chosen).items()}
        return found


class Batch:
    """Random edits, and the state that they make of another one."""

    def __init__(self, draw, before):
        self._draw, self._random = draw, draw.random
        self.edits = []
        self.state = before.copy()
        self._added = {}  # number of the edit -> (layer, thing)
        kinds = ([self._add] * 4 + [self._replace] * 3 + [self._delete] * 2 + [self._write] * 2 +
                 [self._fill] * 2 + [self._set_alias, self._toggle_draft])
        for _ in range(self._random.randint(1, 6)):
            self._random.choice(kinds)()

    def acknowledged(self, object_ids):
        """Gives the added things the ids of the answer, and returns the state."""
        for edit, (layer, thing) in self._added.items():
            if layer in self.state.things and edit >= self._draft_since(layer):
                self.state.things[layer][object_ids[edit]] = thing
        return self.state

    def _draft_since(self, layer):
        """Returns the number of the last edit that created the layer anew."""
        return max((i for i, edit in enumerate(self.edits)
                    if edit.get("create_layer", {}).get("layer", {}).get("name") == layer),
                   default=0)

    def _put(self, layer, thing, **fields):
        self.edits.append(sites.put_shape(rpc.shape_of(thing.geometry), thing.label, layer,
                                          **fields))

    def _add(self):
        layer, thing = self._random.choice(sorted(self.state.things)), self._draw.thing()
        self._added[len(self.edits)] = (layer, thing)
        self._put(layer, thing)

    def _any_object(self):
        among = [(layer, i) for layer, things in self.state.things.items() for i in things]
        return self._random.choice(among) if among else None

    def _replace(self):
        if found := self._any_object():
            layer, i = found
            self.state.things[layer][i] = thing = self._draw.thing()
            self._put(layer, thing, id=i)

    def _delete(self):
        if found := self._any_object():
            layer, i = found
            del self.state.things[layer][i]
            self.edits.append({"delete_object": {"layer": layer, "id": i}})

    def _write(self):
        layer = self._random.choice(sorted(GRIDS))
        rows, cols = self._random.randint(1, 9), self._random.randint(1, 9)
        row, col = (self._random.randint(-SIDE // 2, SIDE // 2 - n) for n in (rows, cols))
        values = [[self._random.choice([*CELL_VALUES, "NaN"]) for _ in range(cols)]
                  for _ in range(rows)]
        self.edits.append(sites.write_cells(values, row, col, layer))
        written = self.state.cells[layer].copy()
        written[row + SIDE // 2:row + SIDE // 2 + rows,
                col + SIDE // 2:col + SIDE // 2 + cols] = numpy.array(values, float)
        self.state.cells[layer] = written

    def _fill(self):
        layer, area = self._random.choice(sorted(GRIDS)), self._draw.polygon()
        rule = "CELL_RULE_" + self._random.choice(["CENTRE", "COVERED", "TOUCHED"])
        value = self._random.choice([*CELL_VALUES, None])
        self.edits.append({"fill_polygon": {"layer": layer, "area": rpc.polygon(area), "rule": rule,
                                            **({} if value is None else {"value": value})}})
        self.state.set_cells(layer, selected_cells(layer, area, rule),
                             numpy.nan if value is None else value)

    def _set_alias(self):
        alias = self._random.choice(ALIASES)
        labels = self._random.sample(LABELS, self._random.randint(0, 3))
        self.edits.append({"set_aliases": {"layer": "things", "aliases": [
            {"alias": alias, "labels": labels}]}})
        self.state.aliases.pop(alias, None)
        if labels:
            self.state.aliases[alias] = set(labels)

    def _toggle_draft(self):
        if self.state.things.pop("draft", None) is not None:
            self.edits.append({"delete_layer": {"layer": "draft"}})
        else:
            self.state.things["draft"] = {}
            self.edits.append({"create_layer": {"layer": {
                "name": "draft", "kind": "LAYER_KIND_SEMANTIC"}}})
