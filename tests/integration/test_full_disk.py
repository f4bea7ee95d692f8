"""A full disk: edits are refused, maps can be deleted, and then edits go on.

The disk is a small file system in memory, which only root can mount.
"""

import errno
import os
import subprocess
import unittest

import grpc

import rpc
import sites
from processes import SiteTest

DISK_MIB = 24
RESERVE_BYTES = 8 << 20
BLOCK = 4096
# Edits of this size fill what is left of a disk without free blocks.
NOTE = "x" * 10_000
# More than enough to fill the space that SQLite has taken already.
MAX_EDITS = 2000


class FullDisk(SiteTest):

    def setUp(self):
        super().setUp()
        disk = self.folder / "disk"
        disk.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", disk],
                                 capture_output=True, text=True, check=False)
        if mounted.returncode != 0:
            self.skipTest(f"can't mount a small file system: {mounted.stderr.strip()}")
        self.addCleanup(subprocess.run, ["umount", "--lazy", disk], check=True)
        self.disk = disk
        self.data_dir = disk / "data"
        self.data_dir.mkdir()
        self.acknowledged = {}  # id -> label

    def make_broken_map(self, name):
        """Makes a map that can't be opened, so that its deletion frees nothing before it writes."""
        (self.data_dir / f"{name}.gpkg").write_bytes(b"x" * 16 * BLOCK)

    def fill_disk(self, name):
        """Takes all free blocks with a file of its own."""
        with open(self.disk / name, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(b"x" * BLOCK)
            except OSError as error:
                self.assertEqual(error.errno, errno.ENOSPC)

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


if __name__ == "__main__":
    unittest.main()
