"""Converts the answers of the command line (JSON) and of gRPC (messages) to one form.

An answer to an area or value query is {layer: cells, a set of object ids, or a status word}. Cells
are a dense array over all rows and columns of the layer, so that a comparison covers each cell.
"""

import numpy
from hypermap.v1 import query_service_pb2

NOT_SELECTED, UNKNOWN = -2.0, -1.0


def no_cells(shape):
    return numpy.full(shape, NOT_SELECTED)


def add_run(cells, row, begin, end, value):
    """Writes a run into a dense array. Fails if the run is empty, overlaps another one or is not
    inside of the array."""
    assert 0 <= row < cells.shape[0] and 0 <= begin < end <= cells.shape[1], (row, begin, end)
    assert (cells[row, begin:end] == NOT_SELECTED).all(), f"run {row} {begin} {end} is not disjoint"
    cells[row, begin:end] = UNKNOWN if value is None or numpy.isnan(value) else value


def from_json_lines(lines, shapes):
    """Converts an answer of `hypermap --json`. `shapes`: {grid layer: (rows, cols)}."""
    *lines, last = lines
    assert set(last) == {"revision"}, last
    answer = {}
    for line in lines:
        layer = line["layer"]
        if "status" in line:
            answer[layer] = line["status"]
        elif "entity" in line:
            ids = answer.setdefault(layer, set())
            assert line["entity"]["id"] not in ids, f"object {line['entity']['id']} is listed twice"
            ids.add(line["entity"]["id"])
        else:
            cells = answer.setdefault(layer, no_cells(shapes[layer]))
            for row, begin, end, value in line["runs"]:
                add_run(cells, row, begin, end, value)
    return answer


def from_messages(stream, shapes):
    """Converts a stream of QueryAreaResponse or QueryValueResponse; `shapes` as above."""
    answer = {}
    for message in stream:
        part = message.part
        if part.status != query_service_pb2.ANSWER_STATUS_VALUE:
            answer[part.layer] = status_word(part.status)
        elif part.layer in shapes:
            cells = answer.setdefault(part.layer, no_cells(shapes[part.layer]))
            runs = part.cells
            for run in zip(runs.rows, runs.col_begins, runs.col_ends, runs.values, strict=True):
                add_run(cells, *run)
        else:
            ids = answer.setdefault(part.layer, set())
            new = [o.id for o in part.objects]
            assert len(new) == len(set(new)) and not ids & set(new), "an object is listed twice"
            ids.update(new)
    return answer


def has_content(answer):
    """Whether the answer of a layer has objects or cells."""
    if isinstance(answer, numpy.ndarray):
        return bool((answer != NOT_SELECTED).any())
    return not isinstance(answer, str) and answer != set()


def status_word(status):
    """Returns the word that the command line prints for an AnswerStatus."""
    name = query_service_pb2.AnswerStatus.Name(status)
    return name.removeprefix("ANSWER_STATUS_").lower()


def differences(got, expected):
    """Returns a readable line for each difference, at most five for the cells of a layer."""
    found = []
    for layer in sorted(set(got) | set(expected)):
        a, b = got.get(layer, set()), expected.get(layer, set())
        if isinstance(a, numpy.ndarray) and isinstance(b, numpy.ndarray):
            wrong = numpy.argwhere(~(abs(a - b) <= 1e-9))
            found += [f"{layer}: cell {r} {c}: {a[r, c]}, expected {b[r, c]}" for r, c in wrong[:5]]
        elif isinstance(a, float) and isinstance(b, float):
            if abs(a - b) > 1e-9:
                found.append(f"{layer}: {a}, expected {b}")
        elif type(a) is not type(b) or a != b:
            found.append(f"{layer}: {a}, expected {b}")
    return found
