"""Who may do what: identities by token and by client certificate, roles, and maps."""

import collections
import contextlib
import re
import threading
import time

import grpc

import rpc
import sites
from certificates import Certificates
from processes import DEADLINE_S, SiteTest, cli, start_and_fail

READER, ROBOT, EDITOR, ADMIN = ROLES = ("reader", "robot", "editor", "admin")

# The role that each rpc needs. An rpc that is missing here fails the test.
NEEDED = {
    "GetCaller": READER,
    "BackupMap": ADMIN, "CheckMap": ADMIN, "DigestMap": READER, "RestoreMap": ADMIN, "CreateLayer": EDITOR,
    "CreateMap": ADMIN, "DeleteLayer": EDITOR,
    "DeleteMap": ADMIN, "ExportMap": READER, "GetLayer": READER, "GetMap": READER,
    "ImportMap": ADMIN, "ListLayers": READER, "ListMaps": READER,
    "DrainServer": ADMIN, "ListServers": READER, "ListTransforms": READER,
    "SetTransform": EDITOR, "ApplyEdits": EDITOR, "ClaimGoal": ROBOT, "GetExploration": READER,
    "ListExplorations": READER, "ListFrontiers": READER, "ReleaseGoal": ROBOT, "RenewGoal": ROBOT,
    "StartExploration": EDITOR, "StopExploration": EDITOR, "ExplainObject": READER,
    "Observe": ROBOT, "RebuildLayer": EDITOR, "RetractSource": ROBOT, "CorrectPoses": ROBOT,
    "SmoothPoses": ROBOT,
    "QueryArea": READER, "QueryNearest": READER, "QueryPoint": READER, "QueryPoints": READER, "QueryValue": READER,
    "EstimateTransform": READER,
    "ListChanges": READER, "ListRevisions": READER, "Replicate": READER, "Watch": READER,
    "ListRobots": READER, "Report": ROBOT, "WatchRobots": READER,
}
# Rpcs for which the role for some maps is not enough.
OF_ALL_MAPS = {"DrainServer"}
# The worker serves it, not hypermapd.
OTHER_SERVICES = {"FrameService"}

UNKNOWN, DENIED = grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED
TOKEN = re.compile(r"hm_[0-9a-f]{12}_[0-9a-f]{64}")


def served_methods():
    """Returns all rpcs, the one that deletes the map last."""
    served = [row for row in rpc.methods() if row[0] not in OTHER_SERVICES]
    return sorted(served, key=lambda row: row[2].name == "DeleteMap")


def request_about(method, map_name, robot):
    """Returns a request, as JSON, about a map and in the name of a robot, where it has such fields.
    """
    request = {}
    fields = method.input_type.fields_by_name
    for name in ("header", "opening", "report", "source", "target"):
        if name in fields and fields[name].message_type:
            request[name] = request_about_type(fields[name].message_type, map_name, robot)
    request.update(request_about_type(method.input_type, map_name, robot))
    return request


def request_about_type(message_type, map_name, robot):
    request = {}
    fields = message_type.fields_by_name
    if "scope" in fields:
        request["scope"] = {"map": map_name}
    if "map" in fields:
        request["map"] = map_name
    if "robot" in fields:
        request["robot"] = robot
    return request


class Site(SiteTest):

    def setUp(self):
        super().setUp()
        self.access_file = self.folder / "access.yaml"

    def create(self, name, *options):
        """Makes a token of an identity and returns it."""
        result = cli("token", "create", name, "--file", self.access_file, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, TOKEN)
        return result.stdout.strip()

    def revoke(self, token):
        result = cli("token", "revoke", token.split("_")[1], "--file", self.access_file)
        self.assertEqual(result.returncode, 0, result.stderr)

    def access_server(self, *flags):
        return self.server(f"--access_file={self.access_file}", *flags)

    def client(self, site, token=None, **options):
        return self.enterContext(rpc.Client(site.address, token=token, **options))

    def outcome(self, call):
        """Makes a call and returns its status code; a stream is read to its first answer."""
        try:
            answer = call()
            if hasattr(answer, "cancel"):
                with contextlib.suppress(StopIteration):
                    next(answer)
                answer.cancel()
        except grpc.RpcError as error:
            return error.code()
        return grpc.StatusCode.OK


class Table(Site):
    """Every rpc, with every kind of caller."""

    def setUp(self):
        super().setUp()
        root = Certificates(self.folder)
        root.sign("server")
        root.sign("robot", names="DNS:r1.example")
        root.sign("stranger", names="DNS:stranger.example")
        self.tokens = {role: self.create(f"a {role}", "--role", role, "--map", "site*")
                       for role in ROLES}
        self.tokens["admin of all maps"] = self.create("admin of all", "--role", ADMIN)
        self.tokens["wrong map"] = self.create("admin of others", "--role", ADMIN,
                                               "--map", "other-*")
        self.tokens["expired"] = self.create("late", "--role", ADMIN, "--expires_in", "1s")
        self.access_file.write_text(self.access_file.read_text() + """
  - name: r1
    role: robot
    maps: ["site"]
    certificates: [r1.example]
""")
        self.site = self.access_server(
            f"--tls_cert={self.folder / 'server.pem'}", f"--tls_key={self.folder / 'server.key'}",
            f"--tls_client_ca={self.folder / 'root.pem'}", "--tls_client_certificates=optional")

    def caller(self, token=None, certificate=None):
        read = lambda name: (self.folder / name).read_bytes()
        own = ((read(f"{certificate}.key"), read(f"{certificate}.pem")) if certificate
               else (None, None))
        return self.client(self.site, token=token,
                           credentials=grpc.ssl_channel_credentials(read("root.pem"), *own))

    def state(self):
        """Returns what would show that something has changed."""
        admin = self.caller(self.tokens[ADMIN])
        return (admin.ListMaps(), list(admin.ListRevisions(map="site").revisions),
                admin.ListLayers(map="site"))

    def call(self, client, method, kind, robot="r1"):
        request = request_about(method, "site", robot)
        invoke = getattr(client, method.name)
        if kind.startswith("stream"):
            return self.outcome(lambda: invoke([request]))
        return self.outcome(lambda: invoke(**request))

    def test_every_rpc_and_caller(self):
        sites.make(self.caller(self.tokens[ADMIN]))
        time.sleep(1.0)  # until the token has expired
        callers = {
            "no identity": (self.caller(), None),
            "unknown token": (self.caller(self.tokens[ADMIN][:-1] + "x"), None),
            "expired": (self.caller(self.tokens["expired"]), None),
            "strange certificate": (self.caller(certificate="stranger"), None),
            "wrong map": (self.caller(self.tokens["wrong map"]), ADMIN),
            "admin of all maps": (self.caller(self.tokens["admin of all maps"]), ADMIN),
            **{role: (self.caller(self.tokens[role]), role) for role in ROLES},
            "certificate": (self.caller(certificate="robot"), ROBOT),
        }
        wanted, refused, rows = {}, 0, served_methods()
        for _, _, method in rows:
            self.assertIn(method.name, NEEDED, "which role does it need?")
            for name, (_, role) in callers.items():
                allowed = role and ROLES.index(role) >= ROLES.index(NEEDED[method.name])
                if name == "wrong map":
                    allowed = method.name in ("GetCaller", "ListMaps", "ListServers")
                elif method.name in OF_ALL_MAPS:
                    allowed = name == "admin of all maps"
                wanted[method.name, name] = None if allowed else DENIED if role else UNKNOWN

        before = self.state()
        found = collections.defaultdict(dict)
        # The refused ones first, so that the state shows whether one had an effect.
        for is_allowed in (False, True):
            for _, kind, method in rows:
                for name, (client, _) in callers.items():
                    if (wanted[method.name, name] is None) == is_allowed:
                        # A robot may act in its own name only.
                        robot = "r1" if name == "certificate" else f"a {name}"
                        found[method.name][name] = self.call(client, method, kind, robot)
                        refused += not is_allowed
            if not is_allowed:
                self.assertEqual(self.state(), before)
                self.check_log(refused)
        self.print_table(callers, found)
        for (method, name), code in wanted.items():
            with self.subTest(rpc=method, caller=name):
                got = found[method][name]
                if code is None:
                    self.assertNotIn(got, (UNKNOWN, DENIED))
                else:
                    self.assertEqual(got, code)

    def check_log(self, refused):
        log = self.site.log()
        lines = [line for line in log.splitlines() if "call refused" in line]
        self.assertEqual(len(lines), refused)
        self.assertNotRegex(log, TOKEN)

    def print_table(self, callers, found):
        for method, codes in sorted(found.items()):
            print(f"{method:18}", *(f"{name}={codes[name].name}" for name in callers))


class Names(Site):

    def setUp(self):
        super().setUp()
        self.admin_token = self.create("anna", "--role", ADMIN)

    def test_the_identity_is_the_author(self):
        site = self.access_server()
        sites.make(self.client(site, self.admin_token))
        log = self.client(site, self.admin_token).ListRevisions(map="site")
        self.assertEqual({revision.author for revision in log.revisions}, {"anna"})

    def test_robots_observe_and_claim_in_their_own_names_only(self):
        token = self.create("r1", "--role", ROBOT, "--robot", "r1-*")
        site = self.access_server()
        sites.make(self.client(site, self.admin_token))
        robot = self.client(site, token)
        for name, code in (("r2", DENIED), ("r1", None), ("r1-arm", None)):
            opening = {"opening": {"map": "site", "layer": "seen", "robot": name}}
            for got in (self.outcome(lambda: robot.Observe([opening])),
                        self.outcome(lambda: robot.ClaimGoal(map="site", robot=name)),
                        self.outcome(lambda: robot.Report(map="site", report={"robot": name}))):
                self.assertEqual(got == DENIED, code == DENIED, (name, got))

    def test_maps_that_one_may_not_see_are_not_listed(self):
        site = self.access_server()
        admin = self.client(site, self.admin_token)
        for name in ("hall-1", "hall-2", "office"):
            admin.CreateMap(map=name)
        reader = self.client(site, self.create("rita", "--role", READER, "--map", "hall-*"))
        deadline = time.monotonic() + DEADLINE_S
        while self.outcome(reader.ListMaps) == UNKNOWN:
            self.assertLess(time.monotonic(), deadline)
        self.assertEqual([m.name for m in reader.ListMaps().maps], ["hall-1", "hall-2"])
        # Whether a map exists is no answer, either.
        self.assertEqual(self.outcome(lambda: reader.GetMap(map="office")), DENIED)
        self.assertEqual(self.outcome(lambda: reader.GetMap(map="attic")), DENIED)
        rita = reader.metadata
        for name, metadata, code in ((b"map/hall-1", rita, None), (b"map/office", rita, DENIED),
                                     (b"map/attic", rita, DENIED), (b"map/hall-1", [], UNKNOWN),
                                     (b"", [], None)):
            got = self.outcome(lambda: self.check_health(site, name, metadata))
            # The health of a new map is not told at once.
            self.assertEqual(got if got in (UNKNOWN, DENIED) else None, code, name)

    def check_health(self, site, name, metadata):
        with grpc.insecure_channel(site.address) as channel:
            return channel.unary_unary("/grpc.health.v1.Health/Check")(
                b"\n" + bytes([len(name)]) + name, metadata=metadata, timeout=DEADLINE_S)

    def test_a_revoked_token_is_refused_and_its_watches_end(self):
        token = self.create("rita", "--role", READER)
        site = self.access_server()
        sites.make(self.client(site, self.admin_token))
        reader = self.client(site, token)
        ends, watches = [], [reader.Watch(scope=rpc.scope("site")),
                             reader.Replicate(scope=rpc.scope("site"))]

        def follow(watch):
            try:
                for _ in watch:
                    pass
            except grpc.RpcError as error:
                ends.append((error.code(), error.details()))

        threads = [threading.Thread(target=follow, args=[watch]) for watch in watches]
        for thread in threads:
            thread.start()
        self.assertEqual(self.outcome(lambda: reader.GetMap(map="site")), grpc.StatusCode.OK)
        self.revoke(token)
        for thread in threads:
            thread.join(DEADLINE_S)
        self.assertEqual(ends, [(UNKNOWN, "the token is not known")] * 2)
        self.assertEqual(self.outcome(lambda: reader.GetMap(map="site")), UNKNOWN)
        # The others go on.
        self.client(site, self.admin_token).GetMap(map="site")

    def test_an_invalid_file_changes_nothing(self):
        site = self.access_server()
        self.access_file.write_text("identities: [")
        deadline = time.monotonic() + DEADLINE_S
        while "identities stay" not in site.log():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.05)
        self.client(site, self.admin_token).ListMaps()

    def test_the_server_does_not_start_with_an_invalid_file(self):
        for text, words in {"identities: 3": "line 1", "people: []": '"people"',
                            "identities: [{name: expiry, role: reader}]": "expiry"}.items():
            self.access_file.write_text(text)
            code, log = start_and_fail(self.data_dir, f"--access_file={self.access_file}")
            self.assertEqual(code, 1)
            self.assertIn(words, log)

    def test_other_machines_need_tls_and_identities(self):
        for flags, words in {(): "--tls_cert", ("--tls_cert=x", "--tls_key=x"): "--access_file"
                             }.items():
            code, log = start_and_fail(self.data_dir, "--listen=0.0.0.0:0", *flags)
            self.assertEqual(code, 1)
            self.assertIn(words, log)
            self.assertIn("--insecure", log)


class TokenCommand(Site):

    def test_the_file_has_no_secret_and_lists_have_none(self):
        token = self.create("anna", "--role", ADMIN)
        secret = token.split("_")[2]
        self.assertNotIn(secret, self.access_file.read_text())
        listed = cli("token", "list", "--file", self.access_file)
        self.assertIn("anna", listed.stdout)
        self.assertNotIn(secret, listed.stdout)
        self.assertEqual(self.access_file.stat().st_mode & 0o007, 0)

    def test_errors(self):
        self.create("anna", "--role", ADMIN)

        def fails(*arguments, words, code=1):
            self.assert_fails(cli("token", *arguments, "--file", self.access_file), *words, code=code)

        fails("create", "bert", words=["--role"])
        fails("create", "bert", "--role", "king", words=["reader", "admin"])
        fails("create", "anna", "--role", "reader", words=["exists"])
        fails("revoke", "0123456789ab", words=["does not exist"])
        self.assert_fails(cli("token", "list", "--file", self.folder / "gone"), "gone")
