"""The services' answers on recorded maps equal those of the server's own API."""

import unittest

from nodes import Bridge, Node
from processes import real_maps
from questions import RecordedMap, ask_all_services


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class QuestionsTest(unittest.TestCase):
    def test_answers_are_those_of_the_server(self):
        recorded = RecordedMap(self)
        self.enterContext(Bridge(recorded.server.address, f"--map={recorded.name}"))
        node = Node()

        def client_of(service):
            client = node.client(service)
            client.await_service()
            return client

        ask_all_services(self, recorded, client_of, "Cyclone DDS")


if __name__ == "__main__":
    unittest.main()
