"""Tests of the API reference: every link leads somewhere, and missing comments and old pages are found."""

import pathlib
import re
import tempfile
import textwrap
import unittest

import generate
import markdown
import protos

PROTO = """
    syntax = "proto3";
    package hypermap.v1;
    // Keeps things.
    service ThingService {
      // Finds a thing. NOT_FOUND if there is none.
      rpc FindThing(FindThingRequest) returns (stream FindThingResponse);
    }
    message FindThingRequest {
      reserved 1;
      reserved "old";
      // At most 1 <= n_max_ things, see FindThingResponse.kind.
      optional int32 n = 2;
      oneof place {
        // Where | near what:
        //   *: anywhere
        string name = 3;
      }
      // Sorts by name.
      map<string, Kind> kinds = 4;
    }
    message FindThingResponse {
      // Sort of the thing.
      Kind kind = 1;
    }
    // Sort of a thing.
    enum Kind {
      KIND_UNSPECIFIED = 0;
      // It is flat.
      KIND_FLAT = 1;
    }
"""
ROLES = """
    constexpr char kThingService[] = "hypermap.v1.ThingService";
    constexpr RpcInfo kRpcs[] = {
        {Rpc::kFindThing, kThingService, "FindThing", Role::kRobot, By::kOwner},
        {Rpc::kHealth, "grpc.health.v1.Health", "Health", std::nullopt, By::kAnyServer},
    };
"""
BUILD_HOOK = """
    BLOCKING = unasync.Rule("/_async/", "/_sync/", {
        "AsyncClient": "Client", "AsyncWatch": "Watch", "AsyncObserveStream": "ObserveStream"})
"""
PACKAGE = '''
    """The client."""

    from ._async.client import AsyncClient, AsyncObserveStream, AsyncWatch
    from ._sync.client import Client
    from .things import Kind, Thing

    __all__ = ["AsyncClient", "Client", "Kind", "Thing"]
'''
CLIENT = '''
    """The client of a server."""

    from collections.abc import AsyncIterator
    from .._io import aio
    from ..things import Name, Thing

    class Connection:
        """A connection."""

        def __init__(self, target: str, *, timeout: float = 60.0) -> None:
            self.target = target

        async def close(self) -> None:
            """Closes the connection."""

    class AsyncClient(Connection):
        """A client."""

        async def find_things(self, name: Name = "") -> AsyncIterator[Thing]:
            """Yields things. `close` ends it.

            name: a name, or a part
                of one.
            """

        def watch(self) -> AsyncWatch:
            """Watches."""

    class AsyncWatch:
        """A watch."""

        def __init__(self, channel: aio.Channel) -> None:
            pass

        def close(self) -> None:
            """Ends it."""

    class AsyncObserveStream:
        """A stream."""

        def close(self) -> None:
            """Ends it."""
'''
THINGS = '''
    """Things."""

    from dataclasses import dataclass, field
    from enum import IntEnum
    from typing import TypeAlias

    # The name of a thing.
    Name: TypeAlias = str

    class Kind(IntEnum):
        """Sort of a thing."""

        FLAT = 1
        """It is flat."""

    @dataclass(frozen=True, kw_only=True)
    class Thing:
        """A thing, see find_things.

        name: its name.
        """

        name: str
        tags: list[str] = field(default_factory=list)

        @property
        def size(self) -> int:
            """How big it is."""
'''
FILES = {
    "proto/hypermap/v1/thing_service.proto": PROTO,
    "server/auth/rpcs.cc": ROLES,
    "client_libs/python/hatch_build.py": BUILD_HOOK,
    "client_libs/python/src/hypermap_client/__init__.py": PACKAGE,
    "client_libs/python/src/hypermap_client/_async/client.py": CLIENT,
    "client_libs/python/src/hypermap_client/things.py": THINGS,
    "client_libs/python/src/hypermap_client/plotting.py": '"""Plots."""\n',
}
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def made_of(**changes):
    """Returns the pages and complaints for the files above, changed as in {name: (old, new)}.

    A name is that of a file without folder and suffix.
    """
    with tempfile.TemporaryDirectory() as folder:
        for name, text in FILES.items():
            path = pathlib.Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            changed = textwrap.dedent(text).replace(*changes.get(path.stem, ("", "", 0)))
            path.write_text(changed, encoding="utf-8")
        return generate.make_pages(pathlib.Path(folder))


class ProtoPagesTest(unittest.TestCase):
    """Pages of protos."""

    def test_page_of_a_service(self):
        pages, complaints = made_of()
        page = pages["thing_service.md"]
        self.assertEqual(complaints, [])
        for part in (
                "# ThingService\n\nKeeps things.\n",
                "| [FindThing](#findthing) | server stream | robot | Finds a thing. |",
                "Server stream, role robot: [FindThingRequest](#findthingrequest) → "
                "[FindThingResponse](#findthingresponse)\n",
                "| `n` | 2 | optional int32 | explicit | At most 1 <= n_max\\_ things, "
                "see [FindThingResponse.kind](#findthingresponse). |",
                "| `name` | 3 | string | oneof `place` | Where \\| near what: <br> \\*: anywhere |",
                "| `kinds` | 4 | map\\<string, [Kind](#kind)\\> | list | Sorts by name. |",
                "| `kind` | 1 | [Kind](#kind) | implicit | Sort of the thing. |",
                "| `KIND_FLAT` | 1 | It is flat. |"):
            self.assertIn(part, page)
        self.assertNotIn("old", page)
        self.assertIn("[FindThingRequest](thing_service.md#findthingrequest)", pages["README.md"])

    def test_missing_comments_are_found(self):
        for comment, name in (("// Keeps things.\n", "ThingService"),
                              ("  // Sort of the thing.\n", "FindThingResponse.kind"),
                              ("// Sort of a thing.\n", "Kind"),
                              ("  // It is flat.\n", "Kind.KIND_FLAT")):
            with self.subTest(name):
                _, complaints = made_of(thing_service=(comment, ""))
                self.assertEqual(complaints, [f"thing_service.proto: {name} has no comment"])

    def test_table_of_roles_must_have_each_rpc_and_no_other(self):
        with self.assertRaisesRegex(ValueError, "no proto has.*'LoseThing'"):
            made_of(rpcs=('"FindThing"', '"LoseThing"'))
        rpcs = [protos.Rpc(name, "", "", "", "unary") for name in ("Get", "Put")]
        found = [protos.Proto("a", [protos.Service("S", "", rpcs)], [], [])]
        with self.assertRaisesRegex(ValueError, "of hypermap.v1.S without a role: Put"):
            protos.set_roles(found, {("hypermap.v1.S", "Get"): "reader"})


class PythonPageTest(unittest.TestCase):
    """The page of the Python client."""

    def test_page_of_a_package(self):
        page = made_of()[0]["python.md"]
        for part in (
                "Client(target: str, *, timeout: float = 60.0)\n",
                "### Client.find_things\n\n```python\n"
                'def find_things(name: Name = "") -> Iterator[Thing]\n```\n',
                "- **name**: a name, or a part\n  of one.",
                "### Client.close\n",
                "for `AsyncClient.watch`, `AsyncWatch.close` and `AsyncObserveStream.close`",
                "| `FLAT` | 1 | It is flat. |",
                "Thing(*, name: str, tags: list[str] = list())",
                "A thing, see [find_things](#clientfind_things).",
                "size: int  # property",
                "| `Name` | `str` | The name of a thing. |"):
            self.assertIn(part, page)
        self.assertNotIn("channel", page)

    def test_missing_docstrings_are_found(self):
        for file, old, new, name in (
                ("client", '"""Yields things.', '0; """No docstring.', "AsyncClient.find_things"),
                ("client", '"""Closes the connection."""', "0", "AsyncClient.close"),
                ("things", '"""Sort of a thing."""\n', "", "Kind"),
                ("things", '"""It is flat."""', "", "Kind.FLAT"),
                ("things", '"""How big it is."""', "0", "Thing.size"),
                ("things", "# The name of a thing.", "", "Name")):
            with self.subTest(name):
                _, complaints = made_of(**{file: (old, new)})
                self.assertEqual([complaint.rpartition(": ")[2] for complaint in complaints],
                                 [f"{name} has no comment"])


class PagesTest(unittest.TestCase):
    """The pages in docs/api."""

    def test_every_link_leads_to_a_file_and_a_heading(self):
        folder = generate.ROOT / generate.FOLDER
        for name, text in generate.written_pages(folder).items():
            for target in set(LINK.findall(re.sub(r"```.*?```", "", text, flags=re.S))):
                if target.startswith("https:"):
                    continue
                file, _, anchor = target.partition("#")
                path = folder / (file or name)
                self.assertTrue(path.exists(), f"{name}: {target}")
                if anchor:
                    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.M)
                    self.assertIn(anchor, map(markdown.slug, headings), f"{name}: {target}")

    def test_pages_that_differ_are_found(self):
        complaints = list(generate.differences({"a.md": "a\n", "gone.md": "x\n"},
                                               {"a.md": "b\n", "new.md": "y\n"}))
        for name in ("a.md", "gone.md", "new.md"):
            self.assertIn(f"docs/api/{name} is not up to date: run `make api`", complaints)
        self.assertIn("+b", complaints)

    def test_two_headings_with_one_anchor_are_refused(self):
        page = markdown.Page("Thing", "thing.proto")
        with self.assertRaises(ValueError):
            page.heading(2, "thing")


if __name__ == "__main__":
    unittest.main()
