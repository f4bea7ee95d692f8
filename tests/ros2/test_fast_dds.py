"""hypermap-ros2 and clients made of Fast DDS, in the convention of rmw_fastrtps_cpp. rosbags encodes their
requests and decodes the replies."""

import dataclasses
import os
import subprocess
import unittest

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import dds_types as dds
from nodes import DOMAIN, Bridge
from processes import real_maps
from questions import RecordedMap, ask_all_services
from test_messages import as_message, definitions


def store_of_services():
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in definitions():
        types = get_types_from_msg(text, as_message(name))
        store.register({k: v for k, v in types.items() if k not in store.fielddefs})
    return store


class FastClient:
    """A client of a service, with the method of nodes.Client."""

    def __init__(self, test, store, service):
        self._store = store
        self._request, _ = dds.SERVICES[service.rsplit("/", 1)[1]]
        # hypermap_msgs::srv::dds_::GetIntAtPoint_Request_
        on_wire = self._request.__idl_typename__.removesuffix("Request_")
        self._name = as_message(on_wire.replace("::dds_::", "/").replace("::", "/"))
        self._process = test.enterContext(subprocess.Popen(
            [os.environ["ROS2_FAST_DDS_CLIENT"], str(DOMAIN), service, on_wire],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        test.addCleanup(self._process.kill)

    def call(self, *fields):
        request = self._message(self._name + "Request", dataclasses.asdict(self._request(0, 0, *fields)))
        encoded = bytes(self._store.serialize_cdr(request, self._name + "Request"))
        print(encoded.hex(), file=self._process.stdin, flush=True)
        reply = self._process.stdout.readline()
        if not reply:
            raise AssertionError("the client ended")
        return self._store.deserialize_cdr(bytes.fromhex(reply), self._name + "Response")

    def _message(self, name, fields):
        """Makes a message of rosbags from the fields of one of Cyclone DDS."""
        made = {}
        for field, (kind, what) in self._store.fielddefs[name][1]:
            value = fields[field]
            if kind == Nodetype.NAME:
                value = self._message(what, value)
            elif kind == Nodetype.SEQUENCE and what[0][0] == Nodetype.NAME:
                value = [self._message(what[0][1], element) for element in value]
            made[field] = value
        return self._store.types[name](**made)


@unittest.skipUnless(real_maps(), "the recorded maps are missing")
class FastDdsTest(unittest.TestCase):
    def test_answers_are_those_of_the_server(self):
        recorded = RecordedMap(self)
        self.enterContext(Bridge(recorded.server.address, f"--map={recorded.name}"))
        store = store_of_services()
        ask_all_services(self, recorded, lambda service: FastClient(self, store, service), "Fast DDS")


if __name__ == "__main__":
    unittest.main()
