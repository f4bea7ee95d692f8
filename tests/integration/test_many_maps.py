"""The number of maps is limited: clients that create maps can't take the files of connections,
backups and questions, and a server with more maps than it can open serves those that it can."""

import base64
import concurrent.futures
import json
import os
import resource
import socket
import unittest

import grpc

import rpc
import sites
from processes import DEADLINE_S, IS_SANITIZED, Server, SiteTest

CHAIR = {"type": "FeatureCollection", "features": [{
    "type": "Feature", "properties": {"label": "chair"},
    "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}}]}


def upload(name):
    """Returns the requests of an ImportMap that creates a map."""
    data = base64.b64encode(json.dumps(CHAIR).encode()).decode()
    header = {"map": name, "format": "FILE_FORMAT_GEOJSON", "layer": "things", "create_map": True}
    return [{"header": header}, {"chunk": {"file_name": "file", "data": data}}]


class ManyMaps(SiteTest):

    def server_with_files(self, max_files, *flags):
        """Starts a server that may have this many files open."""
        return self.enterContext(
            Server(self.data_dir, *flags, limits={resource.RLIMIT_NOFILE: max_files}))

    def client(self, site):
        return self.enterContext(rpc.Client(site.address))

    def assert_too_many(self, call):
        with self.assertRaises(grpc.RpcError) as refused:
            call()
        self.assertEqual(refused.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
        self.assertIn("--max_maps", refused.exception.details())

    def files(self):
        """Returns the names of the maps that have a file."""
        return sorted(path.stem for path in self.data_dir.glob("[!.]*.gpkg"))

    def names(self, client):
        return [entry.name for entry in client.ListMaps().maps]

    def open_maps(self, client):
        return [entry.name for entry in client.ListMaps().maps if not entry.problem]

    def create_until_refused(self, client):
        """Returns the number of maps that could be created."""
        for number in range(1000):
            try:
                client.CreateMap(map=f"map{number:03}")
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.RESOURCE_EXHAUSTED, error.details())
                self.assertIn("--max_maps", error.details())
                return number
        self.fail("there is no limit")

    def make_maps(self, count):
        site = self.server()
        with rpc.Client(site.address) as client:
            for number in range(count):
                client.CreateMap(map=f"map{number:03}")
        self.assertEqual(site.stop(), 0)

    def test_a_map_beyond_the_limit_is_refused_and_not_written(self):
        client = self.client(self.server("--max_maps=2"))
        client.CreateMap(map="office", request_id="r1")
        client.ImportMap(upload("lab"))
        self.assert_too_many(lambda: client.CreateMap(map="attic"))
        self.assert_too_many(lambda: client.ImportMap(upload("attic")))
        self.assertEqual(self.files(), ["lab", "office"])
        self.assertEqual(self.names(client), ["lab", "office"])
        self.assertFalse(list(self.data_dir.glob("*attic*")) + list(self.data_dir.glob(".*attic*")))
        # Calls that need no new map go on.
        client.CreateMap(map="office", request_id="r1")
        client.ImportMap(upload("lab"))
        client.DeleteMap(map="lab")
        client.ImportMap(upload("attic"))

    def test_maps_made_at_once_are_not_more_than_the_limit(self):
        client = self.client(self.server("--max_maps=5"))

        def create(number):
            try:
                client.CreateMap(map=f"map{number:03}")
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.RESOURCE_EXHAUSTED, error.details())
                return 0
            return 1

        with concurrent.futures.ThreadPoolExecutor(8) as threads:
            created = sum(threads.map(create, range(24)))
        self.assertEqual(created, 5)
        self.assertEqual(len(self.files()), 5)

    def test_maps_leave_files_for_connections_backups_and_questions(self):
        site = self.server_with_files(256)
        client = self.client(site)
        sites.make(client)
        client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 2)])
        created = self.create_until_refused(client)
        self.assertGreaterEqual(created, 5)
        self.assertEqual(len(self.files()), created + 1)
        self.assertEqual(self.names(client), self.files())

        host, port = site.address.split(":")
        for _ in range(40):
            self.enterContext(socket.create_connection((host, int(port)), timeout=DEADLINE_S))
        with rpc.Client(site.address) as another:
            self.assertEqual(len(another.ListMaps().maps), created + 1)
        newest = client.ApplyEdits(map="site", edits=[sites.put("table", 3, 2)]).revision
        for revision in range(1, newest):
            client.QueryPoint(scope=rpc.scope("site"), point=rpc.point(1, 2),
                              as_of=rpc.at(revision))
        next(client.Watch(scope=rpc.scope("site"), start_revision=1))
        self.assertGreater(sum(len(part.data) for part in client.BackupMap(map="site")), 0)
        self.assert_too_many(lambda: client.CreateMap(map="attic"))

        # All of them are there after a restart with as many files.
        self.assertEqual(site.stop(), 0)
        client = self.client(self.server_with_files(256))
        self.assertEqual(self.open_maps(client), self.files())
        self.assertEqual(sorted(sites.labels(client).values()), ["chair", "table"])
        self.assert_too_many(lambda: client.CreateMap(map="attic"))

    def test_more_maps_than_can_be_open_are_listed_and_can_be_deleted(self):
        self.make_maps(12)
        site = self.server_with_files(128)
        client = self.client(site)
        all_maps = self.files()
        self.assertEqual(self.names(client), all_maps)
        opened = self.open_maps(client)
        self.assertEqual(opened, all_maps[:len(opened)])
        self.assertTrue(0 < len(opened) < 10, opened)
        for entry in client.ListMaps().maps:
            if entry.name not in opened:
                self.assertIn("--max_maps", entry.problem)
        self.assertIn("not all maps are open", site.log())
        client.CreateLayer(map=opened[0], layer={"name": "things", "kind": "LAYER_KIND_SEMANTIC"})
        self.assert_too_many(lambda: client.GetMap(map=all_maps[-1]))
        self.assert_too_many(lambda: client.CreateMap(map="another"))

        # Maps that are not open can be deleted, and take the place of open ones.
        client.DeleteMap(map=all_maps[-1])
        self.assertEqual(self.names(client), all_maps[:-1])
        client.DeleteMap(map=opened[0])
        self.assertEqual(self.open_maps(client), all_maps[1:len(opened) + 1])
        self.assertEqual(self.files(), all_maps[1:-1])
        self.assertEqual(site.stop(), 0)
        with rpc.Client(self.server().address) as client:
            self.assertEqual(self.open_maps(client), all_maps[1:-1])

    def test_a_lower_limit_opens_the_first_maps_by_name(self):
        self.make_maps(5)
        client = self.client(self.server("--max_maps=3"))
        self.assertEqual(self.open_maps(client), ["map000", "map001", "map002"])
        self.assert_too_many(lambda: client.GetMap(map="map003"))
        self.assert_too_many(lambda: client.CreateMap(map="another"))

    def test_a_limit_that_the_files_do_not_allow_is_refused_at_the_start(self):
        with self.assertRaises(AssertionError) as failed:
            self.server_with_files(256, "--max_maps=1000")
        self.assertIn("--max_maps=1000 is more than the", str(failed.exception))
        self.assertIn("ulimit -n", str(failed.exception))

    @unittest.skipIf(IS_SANITIZED, "sanitizers reserve more address space than there is memory")
    def test_too_little_address_space_is_said_at_the_start(self):
        with self.assertRaises(AssertionError) as failed:
            Server(self.data_dir, limits={resource.RLIMIT_AS: 512 << 20})
        self.assertIn("ulimit -v", str(failed.exception))
        # The stacks of 48 threads, and of 8 for each processor, and room for the rest.
        enough = ((48 + 8 * os.cpu_count()) * 8 + 512) << 20
        site = self.enterContext(Server(self.data_dir, limits={resource.RLIMIT_AS: enough}))
        with rpc.Client(site.address) as client:
            client.CreateMap(map="site")
            self.assertEqual(self.names(client), ["site"])


if __name__ == "__main__":
    unittest.main()
