"""A map's history as an MCAP file: what two independent readers find in it at each revision equals the
server's own answers as of that revision."""

import io
import resource
import subprocess
import time
import unittest

from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import rpc
import sites
from processes import BIN, DEADLINE_S, SiteTest, real_maps

NS = 1_000_000_000
EVERYWHERE = sites.square(-500, -500, 1000)
TRANSIENT_LOCAL, VOLATILE = 1, 2  # rmw_qos_durability_policy_t
KEPT = 10  # revisions of the maps whose history is not kept


def read_by_mcap(path):
    """(topic, time in nanoseconds, message) of all messages, by the format's own reader."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for _, channel, message, decoded in reader.iter_decoded_messages():
            yield channel.topic, message.log_time, decoded


def read_by_rosbags(path):
    """The same by rosbags, with the definitions that the file carries."""
    with Reader(path) as reader:
        store = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            store.register({k: v for k, v in types.items() if k not in store.fielddefs})
        for connection, stamp, data in reader.messages():
            yield connection.topic, stamp, store.deserialize_cdr(data, connection.msgtype)


class Shown:
    """What a subscriber knows who has taken all messages so far."""

    def __init__(self):
        self.latest = {}  # topic -> message
        self.cells = {}  # topic of a grid -> rows of bytes

    def take(self, topic, message):
        self.latest[topic] = message
        if topic.endswith("_updates"):
            rows = self.cells[topic.removesuffix("_updates")]
            for row in range(message.height):
                begin = row * message.width
                rows[message.y + row][message.x:message.x + message.width] = (
                    int(v) for v in message.data[begin:begin + message.width])
        elif hasattr(message, "info"):
            width = message.info.width
            self.cells[topic] = [[int(v) for v in message.data[begin:begin + width]]
                                 for begin in range(0, len(message.data), width or 1)]

    def grid(self, layer):
        """{(row, col) in the map: byte} of the known cells of a grid layer that is not turned."""
        topic = f"/hypermap/grids/{layer}"
        if topic not in self.latest:
            return {}
        info = self.latest[topic].info
        row = round(info.origin.position.y / info.resolution)
        col = round(info.origin.position.x / info.resolution)
        return {(row + i, col + k): byte for i, bytes_ in enumerate(self.cells[topic])
                for k, byte in enumerate(bytes_) if byte != -1}

    def objects(self, layer):
        topic = f"/hypermap/{layer}_semmap"
        if topic not in self.latest:
            return {}
        return {o.id: (o.name, [(p.x, p.y) for p in o.shape.points])
                for o in self.latest[topic].objects}

    def frames(self):
        return {t.child_frame_id: (t.header.frame_id, t.transform.translation.x,
                                   t.transform.translation.y)
                for t in self.latest["/tf_static"].transforms}


class Questions:
    """The same, as the server answers it at a revision."""

    def __init__(self, client, name):
        self.client = client
        self.name = name
        layers = client.ListLayers(map=name).layers
        self.grids = {layer.name: layer for layer in layers if layer.HasField("grid")}

    def parts(self, layer, revision, **scope):
        for answer in self.client.QueryArea(scope=rpc.scope(self.name, layer, **scope),
                                            area=EVERYWHERE, as_of=rpc.at(revision)):
            yield answer.part

    def grid(self, layer, revision):
        spec = self.grids[layer]
        origin = spec.grid.origin
        row = round(origin.y / spec.grid.resolution_m)
        col = round(origin.x / spec.grid.resolution_m)
        limits, found = spec.thresholds, {}
        for part in self.parts(layer, revision, frame_id=spec.frame_id):
            runs = part.cells
            for at, begin, end, value in zip(runs.rows, runs.col_begins, runs.col_ends,
                                             runs.values):
                is_known = value < limits.free_below or value > limits.occupied_above
                for k in range(begin, end) if is_known else ():
                    found[row + at, col + k] = 100 if value > limits.occupied_above else 0
        return found

    def objects(self, layer, revision):
        def vertices(shape):
            if shape.HasField("point"):
                return [(shape.point.x, shape.point.y)]
            line = (shape.polygon.outer if shape.HasField("polygon") else shape.line_string)
            return list(zip(line.xs, line.ys))
        return {o.id: (o.label, vertices(o.shape))
                for part in self.parts(layer, revision) for o in part.objects}


class HistoryTest(SiteTest):

    def export(self, server, name, *flags):
        path = self.folder / "history.mcap"
        result = server.cli("export", name, "-o", path, *flags)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if p.is_file()], ["history.mcap"])
        return path

    def times(self, client, name):
        """{revision: time of its commit in nanoseconds}."""
        revisions = client.ListRevisions(map=name).revisions
        return {r.revision: r.time.ToNanoseconds() for r in revisions}

    def states(self, messages, times):
        """Yields (revision, what is shown then). Each message must be of one of these revisions."""
        shown, revisions = Shown(), {time: revision for revision, time in times.items()}
        self.assertEqual(len(revisions), len(times), "two commits at the same time")
        messages = list(messages)
        self.assertEqual([m[1] for m in messages], sorted(m[1] for m in messages))
        self.assertLessEqual({m[1] for m in messages}, set(revisions))
        for at, revision in revisions.items():
            for topic, stamp, message in messages:
                if stamp == at:
                    shown.take(topic, message)
            yield revision, shown

    def assert_shapes_equal(self, shown, told):
        self.assertEqual({i: label for i, (label, _) in shown.items()},
                         {i: label for i, (label, _) in told.items()})
        for i, (_, vertices) in told.items():
            self.assertEqual(len(shown[i][1]), len(vertices))
            for (x, y), (other_x, other_y) in zip(shown[i][1], vertices):
                self.assertAlmostEqual(x, other_x, places=4)  # 32 bits
                self.assertAlmostEqual(y, other_y, places=4)

    def check(self, path, client, name, times, frames, layers):
        """`frames` are the children of each revision, `layers` the (grids, others) to compare."""
        questions = Questions(client, name)
        for read in (read_by_mcap, read_by_rosbags):
            for revision, shown in self.states(read(path), times):
                with self.subTest(read=read.__name__, revision=revision):
                    for grid in layers[0]:
                        self.assertEqual(shown.grid(grid), questions.grid(grid, revision))
                    for layer in layers[1]:
                        self.assert_shapes_equal(shown.objects(layer),
                                                 questions.objects(layer, revision))
                    self.assertEqual(shown.frames(), frames[revision])
                    stamp = shown.latest["/hypermap/markers"].markers[0].header.stamp
                    self.assertLessEqual(stamp.sec * NS + stamp.nanosec, times[revision])


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class RecordedMapTest(HistoryTest):
    """A recorded map of a grid and of objects, which is edited."""

    def setUp(self):
        super().setUp()
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        self.grid, self.things = self.load()

    def load(self):
        """Imports the recorded map with the most cells that has objects, too."""
        for name, path in real_maps().items():
            self.site.json("import", path, "--map", name)
        def layers(name):
            return list(self.client.ListLayers(map=name).layers)
        def kinds(name):
            return {layer.HasField("grid") for layer in layers(name)}
        self.name = max((n for n in real_maps() if kinds(n) == {True, False}),
                        key=lambda n: sum(l.size for l in layers(n) if l.HasField("grid")))
        grid = next(l for l in layers(self.name) if l.HasField("grid"))
        return grid, next(l for l in layers(self.name) if not l.HasField("grid"))

    def edit_it(self):
        """Makes some revisions, and returns the frames at each revision."""
        frames = {r: {} for r in self.times(self.client, self.name)}
        def edit(*edits, then=None):
            revision = self.client.ApplyEdits(map=self.name, edits=list(edits)).revision
            frames[revision] = dict(frames[revision - 1], **(then or {}))
        box, grid, things = self.grid.extent, self.grid.name, self.things.name
        edit(sites.write_cells([[1, 0], [0.5, "NaN"]], box.row_begin, box.col_begin, grid))
        edit(sites.put("crate", 1, 2, things), sites.put("crate", 4, 2, things))
        edit(sites.write_cells([[0] * 3], box.row_end + 2, box.col_end, grid))
        edit({"set_transform": {"transform": {
            "parent_frame_id": "map", "child_frame_id": "dock",
            "parent_from_child": {"x": 1, "y": 2, "yaw": 0}}}}, then={"dock": ("map", 1, 2)})
        crate = max(i for i, (label, _) in Questions(self.client, self.name).objects(
            things, max(frames)).items() if label == "crate")
        edit({"delete_object": {"layer": things, "id": crate}},
             sites.write_cells([[1]], box.row_begin + 3, box.col_begin + 3, grid))
        edit({"set_transform": {"transform": {
            "parent_frame_id": "map", "child_frame_id": "dock",
            "parent_from_child": {"x": 3, "y": 2, "yaw": 0}}}}, then={"dock": ("map", 3, 2)})
        return frames

    def test_each_revision_is_as_the_server_tells_it(self):
        frames = self.edit_it()
        times = self.times(self.client, self.name)
        layers = ([self.grid.name], [self.things.name])
        for flags in ((), ("--whole_grid_cells=0",)):
            path = self.export(self.site, self.name, *flags)
            self.check(path, self.client, self.name, times, frames, layers)

    def test_a_stretch_begins_with_the_whole_state(self):
        frames = self.edit_it()
        times = self.times(self.client, self.name)
        begin, end = max(times) - 3, max(times) - 1
        path = self.export(self.site, self.name, f"--from={begin}", f"--to={end}",
                           "--whole_grid_cells=0")
        times = {r: t for r, t in times.items() if begin <= r <= end}
        self.check(path, self.client, self.name, times, frames,
                   ([self.grid.name], [self.things.name]))

    def test_latched_topics_are_played_as_such(self):
        self.edit_it()
        path = self.export(self.site, self.name, "--whole_grid_cells=0")
        with Reader(path) as reader:
            durability = {c.topic: c.ext.offered_qos_profiles[0].durability.value
                          for c in reader.connections}
            reliability = {c.ext.offered_qos_profiles[0].reliability.value
                           for c in reader.connections}
        self.assertEqual(reliability, {1})
        for topic, value in durability.items():
            self.assertEqual(value, VOLATILE if topic.endswith("_updates") else TRANSIENT_LOCAL,
                             topic)
        self.assertLessEqual({"/map", "/map_updates", "/tf_static", "/hypermap/markers"},
                             set(durability))

    def test_layers_can_be_chosen(self):
        self.edit_it()
        path = self.export(self.site, self.name, "--layer", self.things.name)
        topics = {topic for topic, *_ in read_by_mcap(path)}
        self.assertEqual(topics, {"/tf_static", "/hypermap/markers",
                                  f"/hypermap/{self.things.name}_semmap"})

    def test_a_stretch_may_begin_when_a_chosen_layer_does_not_change(self):
        self.edit_it()
        # The third revision adds objects.
        path = self.export(self.site, self.name, "--layer", self.grid.name, "--from=3")
        times = self.times(self.client, self.name)
        stamps = [stamp for _, stamp, _ in read_by_mcap(path)]
        self.assertEqual(min(stamps), times[3])
        shown = Shown()
        for topic, stamp, message in read_by_mcap(path):
            if stamp == times[3]:
                shown.take(topic, message)
        questions = Questions(self.client, self.name)
        self.assertEqual(shown.grid(self.grid.name), questions.grid(self.grid.name, 3))


class CountingFile(io.FileIO):
    """A file that counts the bytes that are read."""

    count = 0

    def readinto(self, buffer):
        count = super().readinto(buffer)
        self.count += count
        return count


class IndexTest(HistoryTest):
    """A file of many chunks."""

    def setUp(self):
        super().setUp()
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            for value in range(20):
                cells = [[value % 2] * 300 for _ in range(300)]
                client.ApplyEdits(map="site", edits=[sites.write_cells(cells)])
            self.stamps = list(self.times(client, "site").values())
        self.path = self.export(site, "site")

    def test_crcs_are_right(self):
        with open(self.path, "rb") as file:
            self.assertGreater(len(list(StreamReader(file, validate_crcs=True).records)), 20)

    def test_a_reader_that_seeks_reads_a_part_only(self):
        size = self.path.stat().st_size
        counted = CountingFile(self.path, "rb")
        with io.BufferedReader(counted) as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            self.assertLess(counted.count, size / 10)
            last = self.stamps[-1]
            newest = [(channel.topic, message.log_time)
                      for _, channel, message in reader.iter_messages(start_time=last)]
            self.assertLess(counted.count, size / 2)
        self.assertEqual(newest, [("/hypermap/grids/grid", last), ("/map", last)])
        statistics = summary.statistics
        self.assertEqual(statistics.message_start_time, self.stamps[0])
        self.assertEqual(statistics.message_end_time, last)
        self.assertEqual(statistics.message_count, len(list(read_by_mcap(self.path))))
        self.assertEqual(statistics.chunk_count, len(summary.chunk_indexes))
        self.assertEqual({s.encoding for s in summary.schemas.values()}, {"ros2msg"})


class ForgottenHistoryTest(HistoryTest):
    """A map whose oldest revisions are not kept."""

    def forget(self, client, beyond):
        """Edits the map until its revisions up to `beyond` are forgotten."""
        deadline = time.monotonic() + DEADLINE_S
        while True:
            oldest = client.ListRevisions(map="site").oldest_revision
            if oldest > beyond:
                return
            self.assertLess(time.monotonic(), deadline)
            client.ApplyEdits(map="site", edits=[sites.put("sign", oldest % 7, 1),
                                                 sites.write_cells([[1, 0]], oldest % 5)])
            time.sleep(0.1)

    def await_oldest(self, client):
        """Returns the oldest revision once nothing more is forgotten."""
        deadline = time.monotonic() + DEADLINE_S
        while True:
            list_ = client.ListRevisions(map="site")
            if list_.newest_revision - list_.oldest_revision <= KEPT:
                return list_.oldest_revision
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)

    def test_it_begins_with_the_oldest_state_that_is_kept(self):
        server = self.server(f"--history_revisions={KEPT}")
        client = self.enterContext(rpc.Client(server.address))
        sites.make(client)
        client.ApplyEdits(map="site", edits=[sites.write_cells([[0, 1, 0], [1, 1, "NaN"]])])
        self.forget(client, beyond=4)
        client.CreateLayer(map="site", layer={"name": "late", "kind": "LAYER_KIND_SEMANTIC"})
        client.ApplyEdits(map="site", edits=[sites.put("desk", 3, 3, "late")])
        oldest = self.await_oldest(client)
        path = self.export(server, "site")
        times = self.times(client, "site")
        # The oldest state has a time, too, but its commit is not kept.
        stamps = [stamp for _, stamp, _ in read_by_mcap(path)]
        times = {oldest: min(stamps), **times}
        self.check(path, client, "site", times, {r: {} for r in times}, (["grid"], ["things"]))
        result = server.cli("export", "site", "-o", self.folder / "other.mcap", "--from=1")
        self.assert_fails(result, "OUT_OF_RANGE", f"the oldest one is {oldest}")

    def test_it_begins_after_a_change_that_hides_what_was_before(self):
        server = self.server(f"--history_revisions={KEPT}")
        client = self.enterContext(rpc.Client(server.address))
        sites.make(client)
        self.forget(client, beyond=4)
        moved = client.SetTransform(map="site", transform={
            "parent_frame_id": "map", "child_frame_id": "raft",
            "parent_from_child": {"x": 1, "y": 2, "yaw": 0}}).revision
        oldest = self.await_oldest(client)
        path = self.folder / "history.mcap"
        written = server.json("export", "site", "-o", path)
        self.assertRegex(written["omissions"][0], f"revisions {oldest} to {moved - 1}")
        times = self.times(client, "site")
        self.check(path, client, "site", {moved: times[moved]},
                   {moved: {"raft": ("map", 1, 2)}}, (["grid"], ["things"]))
        result = server.cli("export", "site", "-o", self.folder / "other.mcap", f"--from={oldest}")
        self.assert_fails(result, "OUT_OF_RANGE", f"revision {moved} moved a frame")


class RefusalTest(HistoryTest):

    def setUp(self):
        super().setUp()
        self.site = self.server()
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)

    def refused(self, *words, name="site", flags=(), **options):
        path = self.folder / "history.mcap"
        result = self.site.cli("export", name, "-o", path, *flags, **options)
        self.assert_fails(result, *words)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["data"])

    def test_wrong_stretches(self):
        newest = sites.revision(self.client)
        self.refused("NOT_FOUND", "nowhere", name="nowhere")
        self.refused("INVALID_ARGUMENT", "revision 2 is after revision 1",
                     flags=["--from=2", "--to=1"])
        self.refused("OUT_OF_RANGE", f"the newest one is {newest}", flags=[f"--to={newest + 1}"])
        self.refused("NOT_FOUND", "nothing", flags=["--layer=nothing"])
        self.refused("NOT_FOUND", "nothing", flags=["--occupancy=nothing"])
        result = self.site.cli("export", "site", "-o", self.folder / "x.hmap", "--from=1")
        self.assert_fails(result, "--from", "mcap", code=2)

    def test_a_file_that_can_t_be_written_whole_is_not_left_behind(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
        values = [[i % 2 for i in range(200)] for _ in range(200)]
        self.client.ApplyEdits(map="site", edits=[sites.write_cells(values)])
        # Python ignores SIGXFSZ; the command does, too, so that its writes fail instead.
        self.refused("file", "history.mcap", preexec_fn=limit, restore_signals=False)

    def test_nothing_is_left_behind_when_the_map_is_deleted_meanwhile(self):
        # The command waits to hear that the last revision, of another layer, changes nothing.
        (self.folder / "other").mkdir()
        site = self.server("--watch_progress=300s", data_dir=self.folder / "other")
        with rpc.Client(site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.put("desk", 3, 3)])
            client.ApplyEdits(map="site", edits=[sites.write_cells([[1]])])
            command = subprocess.Popen(
                [BIN / "hypermap", "--server", site.address, "export", "site", "--layer=things",
                 "-o", self.folder / "history.mcap"], stderr=subprocess.PIPE, text=True)
            deadline = time.monotonic() + DEADLINE_S
            # The definitions of messages are written with the first state.
            while not any(p.stat().st_size > 1000 for p in self.folder.glob("*.part-*")):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.01)
            client.DeleteMap(map="site")
            self.assertIn("the map is closing", command.communicate(timeout=DEADLINE_S)[1])
        self.assertEqual(command.returncode, 1)
        self.assertEqual(list(self.folder.glob("history*")), [])

    def test_an_empty_map_has_one_state(self):
        self.client.CreateMap(map="empty")
        path = self.export(self.site, "empty")
        messages = list(read_by_mcap(path))
        self.assertEqual([topic for topic, *_ in messages], ["/tf_static", "/hypermap/markers"])
        created = self.client.GetMap(map="empty").map.create_time.ToNanoseconds()
        self.assertEqual({stamp for _, stamp, _ in messages}, {created})


if __name__ == "__main__":
    unittest.main()
