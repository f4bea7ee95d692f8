"""Tests of TLS between hypermapd, with generated certificates, and the programs as its clients."""

import concurrent.futures
import os
import subprocess
import threading
import time
import unittest

import grpc

import rpc
from certificates import Certificates
from processes import BIN, DEADLINE_S, SiteTest, cli, start_and_fail


class Tls(SiteTest):

    def setUp(self):
        super().setUp()
        self.root = Certificates(self.folder)
        self.root.sign("server")
        self.server_flags = [f"--tls_cert={self.pem('server')}", f"--tls_key={self.key('server')}"]

    def pem(self, name):
        return self.folder / f"{name}.pem"

    def key(self, name):
        return self.folder / f"{name}.key"

    def test_only_clients_with_the_root_certificate_connect(self):
        site = self.server(*self.server_flags)
        trusting = site.cli("maps", "--tls_ca", self.pem("root"))
        self.assertEqual(trusting.returncode, 0, trusting.stderr)
        Certificates(self.folder, "other")
        self.assert_fails(site.cli("maps", "--tls_ca", self.pem("other")), "verify failed")
        self.assert_fails(site.cli("maps", "--tls"), site.address)
        self.assert_fails(site.cli("maps"), site.address)
        self.assertTrue(site.running())

    def test_many_short_commands_at_a_time_end_cleanly(self):
        # Under AddressSanitizer, one that ends before gRPC's threads have ended fails by a leak.
        site = self.server(*self.server_flags)
        with concurrent.futures.ThreadPoolExecutor(10) as commands:
            for done in commands.map(lambda _: site.cli("maps", "--tls_ca", self.pem("root")),
                                     range(40)):
                self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_clients_refuse_a_certificate_without_the_host_name(self):
        site = self.server(*self.server_flags)
        by_name = ["maps", "--tls_ca", self.pem("root"), "--tls_server_name"]
        self.assertEqual(site.cli(*by_name, "localhost").returncode, 0)
        self.assert_fails(site.cli(*by_name, "elsewhere.example"), "UNAVAILABLE")

    def test_clients_need_a_certificate_if_the_server_requires_one(self):
        site = self.server(*self.server_flags, f"--tls_client_ca={self.pem('root')}")
        self.root.sign("robot")
        Certificates(self.folder, "other").sign("stranger")

        def maps(name):
            return site.cli("maps", "--tls_ca", self.pem("root"),
                            "--tls_cert", self.pem(name), "--tls_key", self.key(name))

        self.assertEqual(maps("robot").returncode, 0, maps("robot").stderr)
        self.assert_fails(maps("stranger"), "UNAVAILABLE")
        self.assert_fails(site.cli("maps", "--tls_ca", self.pem("root")), "UNAVAILABLE")

    def test_a_renewed_certificate_is_used_without_a_restart(self):
        site = self.server(*self.server_flags)
        self.assertEqual(self.shown(site), self.pem("server").read_bytes())
        self.root.sign("renewed")
        self.replace_certificate("renewed")
        self.await_certificate(site)
        self.assertEqual(site.cli("maps", "--tls_ca", self.pem("root")).returncode, 0)

    def test_no_call_of_a_hundred_clients_fails_while_certificates_are_renewed(self):
        # Each client makes calls over its connection, and now and then over a new one.
        site = self.server(*self.server_flags)
        for i in range(3):
            self.root.sign(f"renewed-{i}")
        credentials = grpc.ssl_channel_credentials(self.pem("root").read_bytes())
        stop = threading.Event()

        def call_until_the_end(_):
            calls = 0
            while not stop.is_set():
                with rpc.Client(site.address, credentials=credentials) as client:
                    for _ in range(20):
                        client.ListMaps()
                        calls += 1
            return calls

        with concurrent.futures.ThreadPoolExecutor(100) as pool:
            clients = [pool.submit(call_until_the_end, i) for i in range(100)]
            try:
                for i in range(3):
                    self.replace_certificate(f"renewed-{i}")
                    self.await_certificate(site)
            finally:
                stop.set()
            calls = [client.result(DEADLINE_S) for client in clients]
        self.assertGreaterEqual(min(calls), 20)
        print(sum(calls), "calls, none failed")

    def replace_certificate(self, name):
        """A key and a certificate can't be replaced at once: for a moment they do not match."""
        os.replace(self.key(name), self.key("server"))
        os.replace(self.pem(name), self.pem("server"))

    def await_certificate(self, site):
        wanted, deadline = self.pem("server").read_bytes(), time.monotonic() + DEADLINE_S
        while self.shown(site) != wanted:
            self.assertLess(time.monotonic(), deadline)

    def shown(self, site):
        """Connects to the server and returns its certificate in PEM."""
        output = subprocess.run(
            ["openssl", "s_client", "-connect", site.address, "-alpn", "h2"],
            stdin=subprocess.DEVNULL, capture_output=True, timeout=DEADLINE_S, check=False).stdout
        end = b"-----END CERTIFICATE-----\n"
        return output[output.index(b"-----BEGIN"):output.index(end)] + end

    def test_other_grpc_clients_can_connect(self):
        site = self.server(*self.server_flags)
        credentials = grpc.ssl_channel_credentials(self.pem("root").read_bytes())
        with grpc.secure_channel(site.address, credentials) as channel:
            grpc.channel_ready_future(channel).result(timeout=DEADLINE_S)

    def test_the_server_does_not_start_with_files_that_do_not_match(self):
        self.root.sign("other")
        text = self.folder / "text.pem"
        text.write_text("no certificate")
        wrong = {
            "No such file": ["--tls_cert=/nowhere.pem", f"--tls_key={self.key('server')}"],
            "one is missing": [f"--tls_cert={self.pem('server')}"],
            "no certificate": [f"--tls_cert={text}", f"--tls_key={self.key('server')}"],
            "no private key": [f"--tls_cert={self.pem('server')}", f"--tls_key={text}"],
            "not the key of the certificate":
                [f"--tls_cert={self.pem('server')}", f"--tls_key={self.key('other')}"],
            "--tls_client_ca": [*self.server_flags, f"--tls_client_ca={text}"],
        }
        for words, flags in wrong.items():
            code, log = start_and_fail(self.data_dir, *flags)
            self.assertEqual(code, 1, log)
            self.assertEqual(len(log.splitlines()), 1, log)
            self.assertIn(words, log)

    def test_the_cli_names_the_file_that_it_cant_read(self):
        result = cli("maps", "--tls_ca", self.folder / "gone.pem")
        self.assert_fails(result, "gone.pem", "No such file")
        self.assert_fails(cli("maps", "--token_file", self.folder / "gone"), "gone")

    def test_a_token_is_sent_to_other_machines_by_tls_only(self):
        environment = {**os.environ, "HYPERMAP_TOKEN": "abc"}
        result = cli("--server", "192.0.2.1:1", "maps", env=environment)
        self.assert_fails(result, "UNAUTHENTICATED", "without TLS")
        site = self.server(*self.server_flags)
        served = site.cli("maps", "--tls_ca", self.pem("root"), env=environment)
        self.assertEqual(served.returncode, 0, served.stderr)

    @unittest.skipUnless((BIN / "hypermap-ingest").exists(), "built without the ingest worker")
    def test_the_ingest_worker_connects_by_tls(self):
        site = self.server(*self.server_flags)
        with subprocess.Popen(
                [BIN / "hypermap-ingest", "serve", "--server", site.address, "--map", "site",
                 "--listen", "127.0.0.1:0", "--tls_ca", self.pem("root")],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True) as worker:
            try:
                self.assertIn("ready", worker.stdout.readline())
            finally:
                worker.terminate()
        maps = site.cli("--json", "maps", "--tls_ca", self.pem("root"))
        self.assertIn('"site"', maps.stdout)


if __name__ == "__main__":
    unittest.main()
