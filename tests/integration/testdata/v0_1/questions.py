"""Draws questions about the map "golden" and asks them.

They are asked through the JSON of the command line alone, which does not change with the wire
contract. A question is a JSON object: `ask` has the words of the command; `input`, if present, its
standard input; `newest` is true when the answer depends on the newest revision. With its answer it
also has `answer`, the lines that were printed, or `error`, the status code of the failure.
"""

import concurrent.futures
import json
import os
import subprocess

MAP = "golden"
# Covers the map except for one object that lies far away.
EVERYWHERE = ["-60,-60", "60,-60", "60,60", "-60,60"]
VALUES = ["chair", "CHAIR", "seat", "mug", "green thing", " Dining   Table ", "椅子", "furniture",
          "armchair", "pallet", "lease of a century", "exploration goal", "tag:kitchen",
          "tag:Büro", "tag:furniture", "cup", "no such word", "a \"quoted\" word", "free",
          "occupied", "unknown", "explored", "unexplored", ">0.65", "<=0.02", "0.2..0.6", "=1",
          ">=20.5", "<-70", "=7.5"]


class Asker:
    """Asks a server through the command line, several questions at a time."""

    def __init__(self, hypermap, address, deadline_s=60):
        self._command = [hypermap, "--server", address, "--json"]
        self._deadline_s = deadline_s

    def ask(self, words, given=""):
        """Asks a question and returns its `answer` or `error`."""
        result = subprocess.run([*self._command, *map(str, words)], input=given, text=True,
                                capture_output=True, timeout=self._deadline_s, check=False)
        if result.returncode != 0:
            return {"error": result.stderr.split(": ")[1]}
        return {"answer": [json.loads(line) for line in result.stdout.splitlines()]}

    def answer(self, *words):
        """Asks a question and returns the lines of its answer. Raises if the command fails."""
        answered = self.ask(words)
        if "error" in answered:
            raise AssertionError(f"{words}: {answered['error']}")
        return answered["answer"]

    def ask_each(self, questions):
        """Returns the same questions with the answers of this server."""
        with concurrent.futures.ThreadPoolExecutor(2 * (os.cpu_count() or 1)) as pool:
            return list(pool.map(
                lambda q: {"ask": q["ask"], **self.ask(q["ask"], q.get("input", ""))}, questions))


def query(kind, *words, layers=(), frame=None, at=None):
    """Returns the command-line arguments of a query."""
    options = [word for layer in layers for word in ("--layer", layer)]
    options += ["--frame", frame] if frame else []
    options += ["--at", at] if at is not None else []
    return ["query", kind, MAP, *words[:1], *options, *words[1:]]


class Draw:
    """Draws questions about the content of the map."""

    def __init__(self, asker, draw):
        self._asker, self._draw = asker, draw
        self.layers = {layer["name"]: layer
                       for layer in asker.answer("layers", MAP)[0]["layers"]}
        self.log = asker.answer("log", MAP, "--limit", 100000)[0]
        self.newest = self.log["newest_revision"]
        self._entities = [line["entity"] for line in asker.answer(
            *query("area", *EVERYWHERE)) if "entity" in line]
        self._vertices = [vertex for entity in self._entities for ring in entity["polygon"]
                          for vertex in ring]

    def semantic(self):
        return [name for name, layer in self.layers.items() if layer["kind"] == "semantic"]

    def grids(self):
        return [name for name in self.layers if name not in self.semantic()]

    def revisions(self, count):
        return sorted(self._draw.sample(range(self.newest), count))

    def point(self):
        """Draws a vertex or centroid of an object, a corner of cells or any place, in "map"."""
        kind = self._draw.randrange(4)
        if kind == 0:
            return self._draw.choice(self._vertices)
        if kind == 1:
            return self._draw.choice(self._entities)["centroid"]
        x, y = self._draw.uniform(-18, 24), self._draw.uniform(-8, 16)
        return [round(x, 1), round(y, 1)] if kind == 2 else [x, y]

    def frame(self):
        return self._draw.choice([None, None, "dock", "annex"])

    def area(self):
        (x, y), side = self.point(), self._draw.choice([0.0011, 0.3, 1.0, 3.7, 9.0])
        corners = [(x, y), (x + side, y + 0.1 * side), (x + 0.8 * side, y + side), (x, y + side)]
        return [f"{a!r},{b!r}" for a, b in corners]

    def points(self, count):
        return "".join(f"{x!r} {y!r}\n" for x, y in (self.point() for _ in range(count)))

    def about_the_map(self):
        yield ["maps"]
        yield ["layers", MAP]
        yield ["transforms", MAP]
        yield ["log", MAP, "--limit", 100000]
        yield ["explore", "list", MAP]
        yield ["explore", "list", MAP, "--frame", "dock"]
        for exploration in self._asker.answer("explore", "list", MAP)[0]["explorations"]:
            yield ["explore", "status", MAP, exploration["id"]]
            yield ["explore", "frontiers", MAP, exploration["id"], "--cells"]
        for layer in self.semantic():
            for line in self._asker.answer(*query("area", *EVERYWHERE, layers=[layer])):
                if layer in ("found", "found_paper", "corner") and "entity" in line:
                    yield ["explain", MAP, line["entity"]["id"], "--layer", layer]

    def about_now(self):
        """Draws questions about the present. Each layer is queried in its own frame, "floor" in the
        frame "dock"."""
        for layer in self.layers:
            yield query("area", *EVERYWHERE, layers=[layer],
                        frame=self.layers[layer]["frame_id"] if layer != "floor" else "dock")
        yield query("area", "999999,-2000001", "1000002,-2000001", "1000002,-1999998")
        for _ in range(60):
            x, y = self.point()
            yield query("point", repr(x), repr(y), frame=self.frame())
        for _ in range(30):
            yield query("area", *self.area(), frame=self.frame())
        for value in VALUES:
            yield query("value", value)
        for value in self._draw.sample(VALUES, 15):
            yield [*query("value", value, frame="dock"), "--area", *self.area()]
        for _ in range(40):
            x, y = self.point()
            yield [*query("nearest", repr(x), repr(y), frame=self.frame()), "--value",
                   self._draw.choice(VALUES), "-k", self._draw.choice([1, 2, 7, 25])]

    def about_the_past(self):
        for revision in [0, 1, *self.revisions(20), self.newest]:
            x, y = self.point()
            yield query("point", repr(x), repr(y), at=revision)
            yield query("area", *self.area(), frame=self.frame(), at=revision)
            yield query("value", self._draw.choice(VALUES), at=revision)
            yield [*query("nearest", repr(x), repr(y), at=revision), "--value",
                   self._draw.choice(VALUES), "-k", 3]
        for revision in self.revisions(8):
            for layer in self.layers:  # NOT_FOUND before it was created
                yield query("area", *EVERYWHERE, layers=[layer], at=revision)
        for revision in self._draw.sample(self.log["revisions"], 5):
            yield query("value", "chair", at=revision["time"])

    def about_changes(self, moved):
        """Draws questions about differences and watches. `moved` has the revisions that moved
        frames; a watch that passes one of them is reset to the newest revision."""
        before, after = moved[0] - 1, moved[-1]
        for begin, end in ((0, before), (after, self.newest)):
            yield ["watch", MAP, "--from", begin, "--until", end]
            # The first revisions do not have the frame.
            yield ["watch", MAP, "--from", max(begin, 10), "--until", end, "--frame", "dock",
                   "--area", "-3,-8", "14,-8", "14,6", "-3,6"]
            # This layer has no aliases: a change of aliases resets a watch for classes.
            yield ["watch", MAP, "--from", begin, "--until", end, "--layer", "dock_things",
                   "--class", "chair", "--class", "cup"]
        yield ["changes", MAP, "--from", 0, "--to", self.newest]
        for _ in range(12):
            a, b = sorted(self._draw.sample(range(self.newest + 1), 2))
            yield ["changes", MAP, "--from", a, "--to", b,
                   *self._draw.choice([[], ["--frame", "dock"], ["--layer", "things"]])]

    def many_points(self, revisions):
        """Draws queries of many points, as pairs of arguments and standard input."""
        for frame in (None, "dock"):
            for revision in revisions:
                yield (query("points", "--stdin", frame=frame, at=revision),
                       self.points(400 if revision is None else 60))


def ask_all(asker, draw, moved):
    """Returns the newest revision of the map, and questions about it with their answers.

    moved: the revisions that moved frames.
    """
    draw = Draw(asker, draw)

    def each(questions, newest):
        for words in questions:
            words, given = words if isinstance(words, tuple) else (words, "")
            yield {"ask": [str(word) for word in words], "newest": newest,
                   **({"input": given} if given else {})}

    asked = [*each(draw.about_the_map(), True), *each(draw.about_now(), True),
             *each(draw.many_points([None]), True),
             # This watch is reset to the newest revision.
             *each([["watch", MAP, "--from", moved[0], "--until", draw.newest]], True),
             *each(draw.about_the_past(), False), *each(draw.about_changes(moved), False),
             *each(draw.many_points(draw.revisions(12)), False)]
    return {"newest": draw.newest,
            "questions": [q | a for q, a in zip(asked, asker.ask_each(asked), strict=True)]}
