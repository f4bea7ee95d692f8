"""Writes a page for each proto file, and the index of all pages."""

import re

import markdown
from protos import PACKAGE

PREFIX = f".{PACKAGE}."
WELL_KNOWN = "https://protobuf.dev/reference/protobuf/google.protobuf/#"
# A name in a comment: of several words, or of one with its member.
NAME = re.compile(r"\b[A-Z]\w*[a-z0-9]\w*(?:\.\w+)?\b")
SEVERAL_WORDS = re.compile(r"[a-z0-9][A-Z]")


def page_of(proto):
    return f"{proto.name}.md"


class Links:
    """Where services, rpcs, messages and enums are described."""

    def __init__(self, protos):
        self.types = {}
        self.named = {}
        for proto in protos:
            for part in (*proto.messages, *proto.enums):
                self.types[part.name] = f"{page_of(proto)}#{markdown.slug(part.name)}"
        self.named.update(self.types)
        for proto in protos:
            for message in proto.messages:
                self.named.update({f"{message.name}.{field.name}": self.types[message.name]
                                   for field in message.fields})
            for service in proto.services:
                self.named[service.name] = page_of(proto)
                for rpc in service.rpcs:
                    target = f"{page_of(proto)}#{markdown.slug(rpc.name)}"
                    self.named[f"{service.name}.{rpc.name}"] = target
                    # Some messages are named like an rpc. A comment may then mean either.
                    self.named[rpc.name] = None if rpc.name in self.types else target

    def type(self, name, page=""):
        """Returns the name of a type, with a link to its description if it has one."""
        if name.startswith(PREFIX):
            target = self.types[name.removeprefix(PREFIX)].removeprefix(page)
            return f"[{name.removeprefix(PREFIX)}]({target})"
        if name.startswith(".google.protobuf."):
            base = name.rpartition(".")[2]
            return f"[{name[1:]}]({WELL_KNOWN}{base.lower()})"
        return name

    def comment(self, comment, page):
        """Returns a comment as Markdown, in which known names are links."""
        def link(match):
            name = match.group()
            target = self.named.get(name)
            if target is None or ("." not in name and not SEVERAL_WORDS.search(name)):
                return name
            return f"[{name}]({target.removeprefix(page) or page})"
        return markdown.escape(comment, lambda text: NAME.sub(link, text))


def type_of(field, links, page):
    name = links.type(field.type, page)
    if field.label == "map":
        return f"map\\<{field.key_type}, {name}\\>"
    return f"{field.label} {name}".strip()


def add_message(page, message, level, links, name):
    page.heading(level, message.name)
    page.block(*links.comment(message.comment, name).splitlines())
    for oneof in message.oneofs:
        if oneof.comment:
            page.block(f"Oneof `{oneof.name}`: {links.comment(oneof.comment, name)}")
    if not message.fields:
        page.block("No fields.")
        return
    page.block(*markdown.table(("field", "no.", "type", "presence", "comment"), [
        (f"`{field.name}`", str(field.number), type_of(field, links, name), field.presence,
         markdown.in_a_cell(links.comment(field.comment, name)))
        for field in message.fields]))


def add_enum(page, enum, level, links, name):
    page.heading(level, enum.name)
    page.block(*links.comment(enum.comment, name).splitlines())
    page.block(*markdown.table(("value", "no.", "comment"), [
        (f"`{value.name}`", str(value.number),
         markdown.in_a_cell(links.comment(value.comment or "Not set.", name)))
        for value in enum.values]))


def add_rpc(page, rpc, messages, links, name):
    """Adds an rpc with its own request and response."""
    page.heading(3, rpc.name)
    page.block(f"{rpc.kind[0].upper()}{rpc.kind[1:]}, role {rpc.role or 'none'}: "
               f"{links.type(rpc.request, name)} → {links.type(rpc.response, name)}")
    page.block(*links.comment(rpc.comment, name).splitlines())
    for type_name in (rpc.request, rpc.response):
        own = messages.pop(type_name.removeprefix(PREFIX), None)
        if own:
            add_message(page, own, 4, links, name)


def proto_page(proto, links):
    """Returns the page of a proto file as text."""
    name = page_of(proto)
    title = proto.services[0].name if proto.services else f"{proto.name}.proto"
    page = markdown.Page(title, f"proto/hypermap/v1/{proto.name}.proto")
    messages = {message.name: message for message in proto.messages}
    for service in proto.services:
        page.block(*links.comment(service.comment, name).splitlines())
        page.block(*rpc_table(service, links, name))
        page.heading(2, "Rpcs")
        for rpc in service.rpcs:
            add_rpc(page, rpc, messages, links, name)
    for heading, parts, add in (("Messages", list(messages.values()), add_message),
                                ("Enums", proto.enums, add_enum)):
        if parts:
            page.heading(2, heading)
        for part in parts:
            add(page, part, 3, links, name)
    return page.text()


def rpc_table(service, links, page=""):
    """Returns the lines of a table of the rpcs of a service."""
    return markdown.table(("rpc", "kind", "role", "content"), [
        (f"[{rpc.name}]({links.named[f'{service.name}.{rpc.name}'].removeprefix(page)})", rpc.kind,
         rpc.role or "none", markdown.escape(markdown.first_sentence(rpc.comment)))
        for rpc in service.rpcs])


INTRODUCTION = """\
The services of `hypermap.v1` by their protos, and the [Python client](python.md) by its docstrings.
[Protocol](../protocol.md) has the promises that no single rpc makes, and [limits](../limits.md) the limits
of each.

**Roles.** An rpc may be called by the role in its row and by the greater ones: reader, robot, editor, admin
([Role](access_service.md#role), [security](../security.md)). A server that knows no identities lets everybody
call everything. `FrameService` is a service of `hypermap-ingest serve`, which has no roles.

**Presence of fields.** *Explicit*: an unset field differs from one with a default value, and its comment says
what "absent" means. *Implicit*: an unset field is 0, false or empty. *oneof `name`*: at most one of the fields
with this oneof is set. *list*: any number of values, in order; the keys of a map are in no order.
"""


def index_page(protos, links):
    """Returns the index of all pages as text."""
    page = markdown.Page("API reference", "proto/hypermap/v1, server/auth/rpcs.cc")
    page.block(*INTRODUCTION.splitlines())
    page.heading(2, "Services")
    for proto in protos:
        for service in proto.services:
            page.heading(3, service.name)
            page.block(f"[{service.name}]({page_of(proto)}): "
                       + links.comment(markdown.first_sentence(service.comment), ""))
            page.block(*rpc_table(service, links))
    for heading, parts in (("Messages", "messages"), ("Enums", "enums")):
        page.heading(2, heading)
        page.block(*markdown.table(("page", heading.lower()), [
            (f"[{proto.name}]({page_of(proto)})",
             ", ".join(links.type(PREFIX + part.name) for part in getattr(proto, parts)))
            for proto in protos if getattr(proto, parts)]))
    return page.text()


def proto_pages(protos):
    """Returns the pages of all protos and the index, by file name."""
    links = Links(protos)
    pages = {page_of(proto): proto_page(proto, links) for proto in protos}
    return {**pages, "README.md": index_page(protos, links)}
