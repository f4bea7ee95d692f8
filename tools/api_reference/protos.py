"""Reads the protos with protoc ($PROTOC): their services, messages and enums, with comments and roles."""

import dataclasses
import os
import pathlib
import re
import subprocess
import tempfile

from google.protobuf import descriptor_pb2

PACKAGE = "hypermap.v1"
Field = descriptor_pb2.FieldDescriptorProto
# A row of the table of rpcs, and the constants with the names of services that it uses.
ROLE_ROW = re.compile(r'\{Rpc::k\w+,\s*(\w+),\s*"(\w+)",\s*Role::k(\w+),\s*By::k\w+\}')
SERVICE_NAME = re.compile(r'constexpr char (\w+)\[\] = "([\w.]+)";')
# Numbers of descriptor.proto, of which the paths to comments consist.
FILE_MESSAGE, FILE_ENUM, FILE_SERVICE = 4, 5, 6
MESSAGE_FIELD, MESSAGE_NESTED, MESSAGE_ENUM, MESSAGE_ONEOF = 2, 3, 4, 8
ENUM_VALUE, SERVICE_METHOD = 2, 2


@dataclasses.dataclass
class Described:
    """A named part of a proto with its comment, which may be empty."""

    name: str
    comment: str


@dataclasses.dataclass
class FieldOf(Described):
    """A field of a message. `type` is a scalar's name, or a full name with a leading dot."""

    number: int
    type: str
    label: str  # "", "repeated", "optional", or "map" with the type of its keys in key_type
    presence: str
    key_type: str = ""


@dataclasses.dataclass
class Message(Described):
    """A message with its fields, in the order of the proto."""

    fields: list
    oneofs: list


@dataclasses.dataclass
class Value(Described):
    """A value of an enum."""

    number: int


@dataclasses.dataclass
class Enum(Described):
    """An enum with its values."""

    values: list


@dataclasses.dataclass
class Rpc(Described):
    """An rpc. `role` is the least role that may call it; empty if its server has no roles."""

    request: str
    response: str
    kind: str
    role: str = ""


@dataclasses.dataclass
class Service(Described):
    """A service with its rpcs."""

    rpcs: list


@dataclasses.dataclass
class Proto:
    """A proto file. `name` is its base name without the suffix."""

    name: str
    services: list
    messages: list
    enums: list


def read_descriptors(folder):
    """Returns the descriptors of all protos of the package below `folder`."""
    files = sorted(pathlib.Path(folder).glob("hypermap/v1/*.proto"))
    with tempfile.NamedTemporaryFile(suffix=".pb") as output:
        protoc = os.environ.get("PROTOC", "protoc")
        subprocess.run([protoc, f"-I{folder}", "--include_imports", "--include_source_info",
                        f"--descriptor_set_out={output.name}", *map(str, files)], check=True)
        found = descriptor_pb2.FileDescriptorSet.FromString(pathlib.Path(output.name).read_bytes())
    return [file for file in found.file if file.package == PACKAGE]


def comments_of(file):
    """Returns the comments before the parts of a file, by the path of the part."""
    comments = {}
    for location in file.source_code_info.location:
        text = location.leading_comments or location.trailing_comments
        lines = [line[1:] if line.startswith(" ") else line for line in text.splitlines()]
        comments[tuple(location.path)] = "\n".join(line.rstrip() for line in lines).strip()
    return comments


def scalar_name(field):
    return Field.Type.Name(field.type).removeprefix("TYPE_").lower()


def type_of(field):
    return field.type_name or scalar_name(field)


def presence_of(field, oneof):
    if oneof:
        return f"oneof `{oneof}`"
    has_presence = field.proto3_optional or field.type == Field.TYPE_MESSAGE
    return "explicit" if has_presence else "implicit"


def make_field(field, message, comment):
    entries = {entry.name: entry for entry in message.nested_type if entry.options.map_entry}
    entry = entries.get(field.type_name.rpartition(".")[2])
    if entry and field.label == Field.LABEL_REPEATED:
        key, value = entry.field
        return FieldOf(field.name, comment, field.number, type_of(value), "map", "list", type_of(key))
    if field.label == Field.LABEL_REPEATED:
        return FieldOf(field.name, comment, field.number, type_of(field), "repeated", "list")
    oneof = ""
    if field.HasField("oneof_index") and not field.proto3_optional:
        oneof = message.oneof_decl[field.oneof_index].name
    label = "optional" if field.proto3_optional else ""
    return FieldOf(field.name, comment, field.number, type_of(field), label, presence_of(field, oneof))


def make_messages(messages, path, comments, prefix=""):
    """Returns messages with the ones that they contain, whose names begin with the outer name."""
    for i, message in enumerate(messages):
        if message.options.map_entry:
            continue
        here = (*path, i)
        real = {field.oneof_index for field in message.field
                if field.HasField("oneof_index") and not field.proto3_optional}
        yield Message(
            prefix + message.name, comments.get(here, ""),
            [make_field(field, message, comments.get((*here, MESSAGE_FIELD, f), ""))
             for f, field in enumerate(message.field)],
            [Described(message.oneof_decl[o].name, comments.get((*here, MESSAGE_ONEOF, o), ""))
             for o in sorted(real)])
        yield from make_messages(message.nested_type, (*here, MESSAGE_NESTED), comments,
                                 f"{prefix}{message.name}.")


def make_enums(enums, path, comments, prefix=""):
    for i, enum in enumerate(enums):
        yield Enum(prefix + enum.name, comments.get((*path, i), ""),
                   [Value(value.name, comments.get((*path, i, ENUM_VALUE, v), ""), value.number)
                    for v, value in enumerate(enum.value)])


def make_nested_enums(messages, path, comments, prefix=""):
    for i, message in enumerate(messages):
        name, here = f"{prefix}{message.name}.", (*path, i)
        yield from make_enums(message.enum_type, (*here, MESSAGE_ENUM), comments, name)
        yield from make_nested_enums(message.nested_type, (*here, MESSAGE_NESTED), comments, name)


def kind_of(method):
    return {(False, False): "unary", (True, False): "client stream", (False, True): "server stream",
            (True, True): "bidirectional stream"}[method.client_streaming, method.server_streaming]


def make_services(file, comments):
    for i, service in enumerate(file.service):
        here = (FILE_SERVICE, i)
        yield Service(service.name, comments.get(here, ""), [
            Rpc(method.name, comments.get((*here, SERVICE_METHOD, m), ""), method.input_type,
                method.output_type, kind_of(method))
            for m, method in enumerate(service.method)])


def make_proto(file):
    comments = comments_of(file)
    return Proto(pathlib.PurePath(file.name).stem, list(make_services(file, comments)),
                 list(make_messages(file.message_type, (FILE_MESSAGE,), comments)),
                 [*make_enums(file.enum_type, (FILE_ENUM,), comments),
                  *make_nested_enums(file.message_type, (FILE_MESSAGE,), comments)])


def roles_in(source):
    """Returns the role of each rpc by the table of the server, as {(full service, rpc): role}."""
    services = dict(SERVICE_NAME.findall(source))
    return {(services[constant], rpc): role.lower()
            for constant, rpc, role in ROLE_ROW.findall(source)}


def set_roles(protos, roles):
    """Sets the roles of all rpcs. Raises ValueError if the table and the protos differ.

    A service with no row in the table belongs to a server without roles.
    """
    left = dict(roles)
    for service in (service for proto in protos for service in proto.services):
        name = f"{PACKAGE}.{service.name}"
        for rpc in service.rpcs:
            rpc.role = left.pop((name, rpc.name), "")
        if len({rpc.role == "" for rpc in service.rpcs}) > 1:
            missing = [rpc.name for rpc in service.rpcs if not rpc.role]
            raise ValueError(f"rpcs of {name} without a role: {', '.join(missing)}")
    if left:
        raise ValueError(f"roles of rpcs that no proto has: {sorted(left)}")


def read_protos(root):
    """Returns all protos of the repository at `root`, with the roles of the server's table."""
    protos = [make_proto(file) for file in read_descriptors(root / "proto")]
    set_roles(protos, roles_in((root / "server/auth/rpcs.cc").read_text(encoding="utf-8")))
    return sorted(protos, key=lambda proto: proto.name)


def without_comment(protos):
    """Returns the names of all parts that need a comment and have none.

    A request or response needs none, because its rpc has one, and neither does the zero of an enum,
    which means that the field is not set.
    """
    rpcs = [rpc for proto in protos for service in proto.services for rpc in service.rpcs]
    of_rpcs = {name for rpc in rpcs for name in (rpc.request, rpc.response)}
    for proto in protos:
        parts = [*proto.enums, *proto.services]
        parts += [m for m in proto.messages if f".{PACKAGE}.{m.name}" not in of_rpcs]
        members = [(s, rpc) for s in proto.services for rpc in s.rpcs]
        members += [(m, field) for m in proto.messages for field in m.fields]
        members += [(e, value) for e in proto.enums for value in e.values if value.number]
        yield from (f"{proto.name}.proto: {part.name}" for part in parts if not part.comment)
        yield from (f"{proto.name}.proto: {part.name}.{member.name}"
                    for part, member in members if not member.comment)
