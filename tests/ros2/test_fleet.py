"""Many nodes at once, and how soon they learn of a change. Times are printed, not judged."""

import statistics
import time
import unittest

import dds_types as dds
import sites
from fleet import milliseconds_since, start_nodes
from nodes import RELIABLE, Node
from test_bridge import BridgeTest, at, cells_of

NODES, CALLS = 50, 20
CHANGES = 50
WIDTH = 20  # cells


class FleetTest(BridgeTest):
    def test_fifty_nodes_that_start_at_once_get_the_map_and_all_replies(self):
        self.bridge()
        Node().subscribe("/map", dds.OccupancyGrid).next()
        starts = start_nodes(NODES, "things", at(3.5, 4.5), CALLS)
        for start in starts:
            self.assertEqual(cells_of(start.grid), [[0, 100], [-1, -1]])
            self.assertEqual(start.names, ["desk"] * CALLS)
        print(f"{NODES} nodes at once: slowest map after {max(s.map_ms for s in starts):.0f} ms, "
              f"slowest of {CALLS * NODES} replies after "
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
