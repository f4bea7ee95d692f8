"""Tests of starting and stopping hypermapd: its ready line, signals, and errors at the start."""

import signal
import socket
import time
import unittest

import rpc
import sites
from processes import DEADLINE_S, SiteTest, start_and_fail
from test_all_at_once import threads_of

THREAD_NAMES = {
    "hm-listener", "hm-handover", "hm-timers", "hm-writer", "hm-questions", "hm-long-q",
    "hm-answers", "hm-watches", "hm-writes", "hm-long-writes", "hm-openings", "hm-files",
    "hm-uploads", "hm-explorations", "hm-estimates"}


class StartAndStop(SiteTest):

    def test_stdout_is_only_the_ready_line_with_the_real_port(self):
        site = self.server()
        self.assertEqual(site.stdout.decode(), f"hypermapd ready on 127.0.0.1:{site.port}\n")
        socket.create_connection(("127.0.0.1", int(site.port)), timeout=5).close()

    def test_only_the_main_thread_has_the_name_of_the_program(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
        deadline = time.monotonic() + DEADLINE_S
        # A thread has the name of the one that started it until it gives itself another.
        while True:
            threads = threads_of(site.pid)
            names = {name for name in threads if name.startswith("hm-")}
            if threads["hypermapd"] == 1 and names == THREAD_NAMES:
                break
            self.assertLess(time.monotonic(), deadline, threads)
            time.sleep(0.01)

    def test_a_missing_data_folder_is_made(self):
        site = self.server(data_dir=self.folder / "new" / "data")
        self.assertEqual(site.json("maps"), {"maps": []})

    def ends_cleanly_on(self, number):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 2)])
        site.signal(number)
        self.assertEqual(site.wait(), 0, site.log())
        with rpc.Client(self.server().address) as client:
            self.assertEqual(list(sites.labels(client).values()), ["chair"])

    def test_sigterm_exits_with_0_and_keeps_all_edits(self):
        self.ends_cleanly_on(signal.SIGTERM)

    def test_sigint_exits_with_0_and_keeps_all_edits(self):
        self.ends_cleanly_on(signal.SIGINT)

    def test_it_stops_with_connected_clients_and_open_streams(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            client.ApplyEdits(map="site", edits=[
                sites.write_cells([[(r + c) % 2 for c in range(1000)] for r in range(1000)])])
            stream = client.QueryArea(scope=rpc.scope("site"), area=sites.square(-1, -1, 1000))
            next(stream)
            self.assertEqual(site.stop(), 0, site.log())

    def test_it_does_not_wait_for_connections_that_their_clients_do_not_close(self):
        site = self.server("--grace=1h")
        with rpc.Client(site.address) as client:
            sites.make(client)
        with socket.create_connection(("127.0.0.1", int(site.port)), timeout=5) as silent:
            # The preface and an empty SETTINGS frame of HTTP/2.
            silent.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0]))
            silent.recv(1)
            site.signal(signal.SIGTERM)
            # gRPC alone would wait for 20 s.
            self.assertEqual(site.wait(15), 0, site.log())

    def test_a_clean_stop_leaves_one_file_per_map(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
        site.stop()
        maps = [p.name for p in self.data_dir.iterdir() if p.suffix == ".gpkg" or "-wal" in p.name]
        self.assertEqual(maps, ["site.gpkg"])

    def test_a_second_server_on_the_folder_is_refused_and_the_first_continues(self):
        site = self.server()
        with rpc.Client(site.address) as client:
            sites.make(client)
            code, log = start_and_fail(self.data_dir)
            self.assertNotEqual(code, 0)
            self.assertEqual(len(log.splitlines()), 1, log)
            self.assertIn(str(self.data_dir), log)
            client.ApplyEdits(map="site", edits=[sites.put("chair", 1, 2)])

    def test_a_folder_can_be_served_again_after_a_kill(self):
        site = self.server()
        site.kill()
        self.assertTrue(self.server().running())

    def test_a_port_in_use_is_reported_in_one_line(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            code, log = start_and_fail(self.data_dir, f"--listen=127.0.0.1:{port}")
        self.assertNotEqual(code, 0)
        self.assertIn(str(port), log)

    def test_a_data_folder_that_is_a_file_is_reported_in_one_line(self):
        file = self.folder / "file"
        file.write_text("not a folder")
        code, log = start_and_fail(file)
        self.assertNotEqual(code, 0)
        self.assertEqual(len(log.splitlines()), 1, log)
        self.assertIn(str(file), log)

    def test_an_unknown_flag_is_wrong_usage(self):
        code, log = start_and_fail(self.data_dir, "--no_such_flag=1")
        self.assertNotEqual(code, 0)
        self.assertIn("no_such_flag", log)


if __name__ == "__main__":
    unittest.main()
