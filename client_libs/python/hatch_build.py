"""Generates the parts of the wheel that are not in the sources.

- `_proto/`: the messages of ../../proto, or of proto/ in a source distribution. They are in a
  descriptor pool of their own, so that a program can load other versions of the same files.
- `_sync/`: the blocking client, generated from `_async/` by removing `async` and `await`.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import unasync
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGE = "hypermap_client"
POOL = '''"""A descriptor pool for the messages of this package only."""

from google.protobuf import descriptor_pool, duration_pb2, timestamp_pb2

POOL = descriptor_pool.DescriptorPool()
for _file in (duration_pb2, timestamp_pb2):
    POOL.AddSerializedFile(_file.DESCRIPTOR.serialized_pb)
'''
# Replacements in the output of protoc that make its imports relative and use the private pool.
PRIVATE = [
    (re.compile(r"^from hypermap\.v1 import ", re.M), "from . import "),
    (
        re.compile(r"^from google\.protobuf import descriptor_pool as _descriptor_pool$", re.M),
        "from ._pool import POOL as _POOL",
    ),
    (re.compile(r"\b_descriptor_pool\.Default\(\)"), "_POOL"),
]
BLOCKING = unasync.Rule(
    "/_async/",
    "/_sync/",
    {
        "AsyncClient": "Client",
        "AsyncObserveStream": "ObserveStream",
        "AsyncWatch": "Watch",
        "aio": "blocking",
    },
)


def compile_protos(protos: pathlib.Path, package: pathlib.Path) -> None:
    """Compiles the proto files in folder `protos` to `_proto` in folder `package`."""
    folder = package / "_proto"
    with tempfile.TemporaryDirectory() as plain:
        subprocess.run(
            [
                sys.executable,
                "-m",
                "grpc_tools.protoc",
                f"-I{protos}",
                f"--python_out={plain}",
                f"--pyi_out={plain}",
                *sorted(map(str, protos.glob("hypermap/v1/*.proto"))),
            ],
            check=True,
        )
        folder.mkdir()
        for source in sorted(pathlib.Path(plain, "hypermap", "v1").iterdir()):
            text = source.read_text(encoding="utf-8")
            for pattern, replacement in PRIVATE:
                text = pattern.sub(replacement, text)
            (folder / source.name).write_text(text, encoding="utf-8")
    (folder / "__init__.py").write_text('"""Messages of hypermap.v1."""\n', encoding="utf-8")
    (folder / "_pool.py").write_text(POOL, encoding="utf-8")


def make_blocking(sources: pathlib.Path, package: pathlib.Path) -> None:
    """Generates `_sync` in folder `package` from `_async` in folder `sources`."""
    copy = package / "_async"
    shutil.copytree(sources / "_async", copy, ignore=shutil.ignore_patterns("__pycache__"))
    unasync.unasync_files(sorted(map(str, copy.glob("*.py"))), [BLOCKING])
    shutil.rmtree(copy)


class GeneratedCode(BuildHookInterface):
    """The hatchling build hook that adds the generated packages to the wheel."""

    def initialize(self, _version, build_data):
        """Generates the packages in a temporary folder and includes it in the wheel."""
        root = pathlib.Path(self.root)
        protos = next(
            path for path in (root / "proto", root / ".." / ".." / "proto") if path.is_dir()
        ).resolve()
        self._folder = pathlib.Path(tempfile.mkdtemp(prefix="hypermap-client-"))
        compile_protos(protos, self._folder)
        make_blocking(root / "src" / PACKAGE, self._folder)
        for made in sorted(self._folder.iterdir()):
            build_data["force_include"][str(made)] = f"{PACKAGE}/{made.name}"

    def finalize(self, _version, _build_data, _artifact_path):
        """Removes the temporary folder."""
        shutil.rmtree(self._folder)
