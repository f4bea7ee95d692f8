"""Many nodes at once, and how soon they learn of a change. Times are printed, not judged."""

import multiprocessing
import statistics
import threading
import time
import typing
import unittest
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import dds_types as dds
import sites
from nodes import DOMAIN, RELIABLE, Node, configured
from processes import DEADLINE_S
from test_bridge import BridgeTest, at, cells_of

PROCESSES, NODES_EACH, CALLS = 5, 10, 20
CHANGES = 50
WIDTH = 20  # cells
# Cyclone DDS for Python makes types at their first use, which is not thread safe.
MAKING = threading.Lock()


def milliseconds_since(begin):
    return 1000 * (time.monotonic() - begin)


class Start(typing.NamedTuple):
    """What a node got in its first moments, and after how many milliseconds."""
    right_map: bool
    map_ms: float
    right_replies: int
    slowest_reply_ms: float


def start_node(domain):
    begin = time.monotonic()
    with MAKING:
        node = Node(domain)
        maps = node.subscribe("/map", dds.OccupancyGrid)
    right_map = cells_of(maps.next()) == [[0, 100], [-1, -1]]
    map_ms = milliseconds_since(begin)
    with MAKING:
        names = node.client("/hypermap/get_string_at_point")
    names.await_service()
    replies_ms, right_replies = [], 0
    for _ in range(CALLS):
        begin = time.monotonic()
        right_replies += names.call("things", at(3.5, 4.5)).name == "desk"
        replies_ms.append(milliseconds_since(begin))
    return Start(right_map, map_ms, right_replies, max(replies_ms))


def start_nodes(domain, everybody):
    """Starts nodes in threads of this process, as soon as all processes are ready."""
    configured(domain)
    everybody.wait(DEADLINE_S)
    with ThreadPoolExecutor(NODES_EACH) as threads:
        return list(threads.map(start_node, [domain] * NODES_EACH))


class FleetTest(BridgeTest):
    def test_fifty_nodes_that_start_at_once_get_the_map_and_all_replies(self):
        self.bridge()
        Node().subscribe("/map", dds.OccupancyGrid).next()
        processes = multiprocessing.get_context("spawn")
        with processes.Manager() as manager, ProcessPoolExecutor(PROCESSES, processes) as pool:
            everybody = manager.Barrier(PROCESSES)
            parts = [pool.submit(start_nodes, DOMAIN, everybody) for _ in range(PROCESSES)]
            starts = [start for part in parts for start in part.result()]
        self.assertEqual(len(starts), PROCESSES * NODES_EACH)
        for start in starts:
            self.assertTrue(start.right_map)
            self.assertEqual(start.right_replies, CALLS)
        print(f"{len(starts)} nodes at once: slowest map after {max(s.map_ms for s in starts):.0f} ms, "
              f"slowest of {CALLS * len(starts)} replies after "
              f"{max(s.slowest_reply_ms for s in starts):.0f} ms")


class ChangesTest(BridgeTest):
    def setUp(self):
        super().setUp()
        self.edit(sites.write_cells([[0] * WIDTH for _ in range(WIDTH)]))
        self.bridge("--keep_out=tag:keep out", "--send_again_seconds=1000")
        self.node = Node()

    def measure(self, what, edit_of, arrival_of):
        """`edit_of(i)` is acknowledged, and then `arrival_of(i)` waits for it."""
        times_ms = []
        for i in range(CHANGES):
            self.edit(edit_of(i))
            begin = time.monotonic()
            arrival_of(i)
            times_ms.append(milliseconds_since(begin))
        print(f"{what}: {CHANGES} changes arrived, median {statistics.median(times_ms):.1f} ms "
              f"after the acknowledgement, worst {max(times_ms):.1f} ms")

    def test_changed_cells_arrive_as_updates(self):
        updates = self.node.subscribe("/map_updates", dds.OccupancyGridUpdate, RELIABLE)
        self.node.subscribe("/map", dds.OccupancyGrid).next()

        def await_update(i):
            update = updates.next()
            self.assertEqual((update.x, update.y), (i % WIDTH, i // WIDTH))

        self.measure("/map_updates",
                     lambda i: sites.write_cells([[1]], row=i // WIDTH, col=i % WIDTH), await_update)

    def test_changed_zones_arrive_as_masks(self):
        masks = self.node.subscribe("/keepout_filter_mask", dds.OccupancyGrid)
        masks.next()

        def zone(i):
            cell = sites.square(i % WIDTH * 0.5, i // WIDTH * 0.5, 0.5)
            return sites.put_shape({"polygon": cell}, "no entry", tags=["keep out"])

        def await_mask(i):
            masks.next(lambda mask: sum(mask.data) == 100 * (i + 1))

        self.measure("/keepout_filter_mask", zone, await_mask)


if __name__ == "__main__":
    unittest.main()
