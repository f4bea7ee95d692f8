"""A full disk: edits are refused, maps can be deleted, and then edits go on. What was acknowledged
is there, also if the server was killed while the disk was full.

The disk is a small file system in memory, which only root can mount.
"""

import errno
import os
import subprocess
import threading
import unittest

import grpc

import rpc
import sites
from processes import DEADLINE_S, SiteTest

RESERVE_BYTES = 8 << 20
BLOCK = 4096
# Edits of this size fill what is left of a disk without free blocks.
NOTE = "x" * 10_000
# More than enough to fill the space that SQLite has taken already.
MAX_EDITS = 2000


class Writer(threading.Thread):
    """Edits a map, one call after another, until the server is gone or stop() is called."""

    def __init__(self, address, name):
        super().__init__()
        self._address, self._name = address, name
        self._ends = threading.Event()
        # Released for each edit that was acknowledged, and for each that was refused.
        self.acknowledgements, self.refusals = threading.Semaphore(0), threading.Semaphore(0)
        self.acknowledged = {}  # id -> label
        self.in_flight = ""  # the label of the edit whose outcome the end of the server left open
        self.unexpected = None

    def run(self):
        with rpc.Client(self._address) as client:
            for number in range(1_000_000):
                if self._ends.wait(0.02):
                    return
                label = f"{self._name} {number}"
                try:
                    answer = client.ApplyEdits(map="site", edits=[
                        sites.put(label, 0, 0, attributes={"note": {"string_value": NOTE}})])
                except grpc.RpcError as error:
                    if error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED:
                        self.refusals.release()
                        continue
                    self.in_flight = label
                    if error.code() != grpc.StatusCode.UNAVAILABLE:
                        self.unexpected = error
                    return
                self.acknowledged[answer.object_ids[0]] = label
                self.acknowledgements.release()

    def stop(self):
        self._ends.set()
        self.join()


def await_next(outcomes):
    """Waits for another outcome than those before this call. Returns whether it came."""
    while outcomes.acquire(blocking=False):
        pass
    return outcomes.acquire(timeout=DEADLINE_S)


class DiskTest(SiteTest):
    """A test case whose data folder is on a small disk."""

    disk_mib = 24

    def setUp(self):
        super().setUp()
        disk = self.folder / "disk"
        disk.mkdir()
        mounted = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={self.disk_mib}m", "tmpfs", disk],
            capture_output=True, text=True, check=False)
        if mounted.returncode != 0:
            self.skipTest(f"can't mount a small file system: {mounted.stderr.strip()}")
        self.addCleanup(subprocess.run, ["umount", "--lazy", disk], check=True)
        self.disk = disk
        self.data_dir = disk / "data"
        self.data_dir.mkdir()

    def fill_disk(self, name):
        """Takes all free blocks with a file of its own."""
        with open(self.disk / name, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(b"x" * BLOCK)
            except OSError as error:
                self.assertEqual(error.errno, errno.ENOSPC)


class FullDisk(DiskTest):

    def setUp(self):
        super().setUp()
        self.acknowledged = {}  # id -> label

    def make_broken_map(self, name):
        """Makes a map that can't be opened, so that its deletion frees nothing before it writes."""
        (self.data_dir / f"{name}.gpkg").write_bytes(b"x" * 16 * BLOCK)

    def edit(self, client):
        label = f"thing {len(self.acknowledged)}"
        answer = client.ApplyEdits(map="site", edits=[
            sites.put(label, 0, 0, attributes={"note": {"string_value": NOTE}})])
        self.acknowledged[answer.object_ids[0]] = label

    def edit_until_full(self, client):
        for _ in range(MAX_EDITS):
            try:
                self.edit(client)
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.RESOURCE_EXHAUSTED, error)
                return
        self.fail(f"{MAX_EDITS} edits were taken by a full disk")

    def reserve_bytes(self):
        about = os.stat(self.data_dir / "reserve")
        return min(about.st_size, about.st_blocks * 512)

    def test_c8_maps_can_be_deleted_and_then_edits_go_on(self):
        for name in ("broken-1", "broken-2"):
            self.make_broken_map(name)
        site = self.server()
        self.assertEqual(self.reserve_bytes(), RESERVE_BYTES)
        with rpc.Client(site.address) as client:
            sites.make(client)
            sites.make(client, "other")
            # The second time only the part is left that is kept for deletions.
            for victims in (["broken-1", "other"], ["broken-2"]):
                self.fill_disk(f"before {victims[0]}")
                self.edit_until_full(client)
                self.assertEqual(sites.labels(client), self.acknowledged)
                for victim in victims:
                    client.DeleteMap(map=victim, request_id=victim)
                    client.DeleteMap(map=victim, request_id=victim)
                self.edit(client)
            self.assertEqual([entry.name for entry in client.ListMaps().maps], ["site"])
        self.assertEqual(site.stop(), 0)
        for ballast in self.disk.glob("before *"):
            ballast.unlink()
        with rpc.Client(self.server().address) as client:
            self.assertEqual(sites.labels(client), self.acknowledged)
            self.assertEqual(self.reserve_bytes(), RESERVE_BYTES)


class FullDiskUnderWriters(DiskTest):

    # The writers go on filling it while the test looks at them.
    disk_mib = 128
    WRITERS = 4
    TIMES_FULL = 3

    def start_writers(self, site, generation):
        writers = [Writer(site.address, f"{generation} {i}") for i in range(self.WRITERS)]
        for writer in writers:
            writer.start()
            self.addCleanup(writer.stop)
        return writers

    def test_full_on_and_off_and_a_kill_while_full(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
        writers = self.start_writers(site, "first")
        for _ in range(self.TIMES_FULL):
            for writer in writers:
                self.assertTrue(await_next(writer.acknowledgements), writer.unexpected)
            self.fill_disk("ballast")
            for writer in writers:
                self.assertTrue(await_next(writer.refusals), writer.unexpected)
            (self.disk / "ballast").unlink()
        for writer in writers:
            self.assertTrue(await_next(writer.acknowledgements), writer.unexpected)
        self.fill_disk("ballast")
        for writer in writers:
            self.assertTrue(await_next(writer.refusals), writer.unexpected)
        site.kill()
        acknowledged, in_flight = {}, set()
        for writer in writers:
            writer.stop()
            self.assertIsNone(writer.unexpected)
            acknowledged.update(writer.acknowledged)
            in_flight.add(writer.in_flight)
        (self.disk / "ballast").unlink()

        site = self.server()
        with rpc.Client(site.address) as client:
            seen = sites.labels(client)
            for object_id, label in acknowledged.items():
                self.assertEqual(seen.pop(object_id, None), label)
            self.assertLessEqual(set(seen.values()), in_flight)
            for writer in self.start_writers(site, "second"):
                self.assertTrue(await_next(writer.acknowledgements), writer.unexpected)
                writer.stop()
        self.assertEqual(site.stop(), 0)


if __name__ == "__main__":
    unittest.main()
