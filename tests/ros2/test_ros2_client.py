"""hypermap-ros2 and a node of ros2-client, whose DDS is RustDDS, in both conventions of services."""

import time
import unittest

from nodes import DOMAIN, Bridge
from processes import real_maps
from questions import RecordedMap, ask_all_services, grid_of
from rust_peer import RustPeer, build


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class Ros2ClientTest(unittest.TestCase):
    def setUp(self):
        if build() is None:
            self.skipTest("no suitable Rust here")
        self.recorded = RecordedMap(self)
        self.enterContext(Bridge(self.recorded.server.address, f"--map={self.recorded.name}"))
        # The next subscriber is late.
        with RustPeer(DOMAIN, "cyclone") as first:
            first.latched_map("/map")

    def check_everything(self, mapping):
        title = f"ros2-client, {mapping}"
        begin = time.monotonic()
        peer = self.enterContext(RustPeer(DOMAIN, mapping))
        self.assertEqual(grid_of(peer.latched_map("/map")), self.recorded.grid)
        print(f"{title}: /map after {1000 * (time.monotonic() - begin):.0f} ms")
        peer.await_node("/hypermap")
        print(f"{title}: /hypermap is in the graph after {1000 * (time.monotonic() - begin):.0f} ms")
        ask_all_services(self, self.recorded, peer.client, title)

    def test_as_rmw_cyclonedds(self):
        self.check_everything("cyclone")

    def test_as_rmw_fastrtps(self):
        self.check_everything("enhanced")


if __name__ == "__main__":
    unittest.main()
