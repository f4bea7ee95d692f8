"""Writes the page of the Python client."""

import ast
import copy
import re

import markdown
from python_source import (
    MODULES, PACKAGE, code_of, constructor, decorators, docstring, documented_attributes, fields_of,
    find_public, is_dataclass, is_enum, public_functions)

# A line that describes a parameter or field, or several.
ITEM = re.compile(r"^([a-z_]\w*(?:, [a-z_]\w*)*): ")
# A name of several words.
NAME = re.compile(r"\b(?:[A-Z]\w*[a-z0-9][A-Z]\w*|[a-z]+_\w+)\b")
LINE_LENGTH = 100
# The classes of the client, which come first and get a heading for each method.
CLIENTS = ("AsyncClient", "AsyncWatch", "AsyncObserveStream")
INTRODUCTION = """\
The package has a class for asyncio and a blocking one with the same methods: `AsyncClient` and `Client`,
`AsyncWatch` and `Watch`, `AsyncObserveStream` and `ObserveStream`. The signatures below are those of the blocking
classes. In the others, methods are coroutines (`await client.query_point(...)`), and iterators are asynchronous
(`async for`), except for {plain}.
[The client's README](../../client_libs/python/README.md) has examples.
"""


class Blocking(ast.NodeTransformer):
    """Turns code of the asyncio client into that of the blocking client."""

    def __init__(self, names):
        self.names = {**names, "AsyncIterator": "Iterator"}

    def visit_Name(self, node):
        return ast.Name(self.names.get(node.id, node.id), node.ctx)


def text_of(docs, link):
    """Returns the lines of a docstring as Markdown: descriptions of parameters become a list.

    link: makes links of the names in a line.
    """
    lines, in_items = [], False
    for line in docs.splitlines():
        item = ITEM.match(line)
        if item and (in_items or not lines or not lines[-1]):
            in_items = True
            lines.append(f"- **{markdown.escape(item[1])}**: {markdown.escape(line[item.end():], link)}")
        elif not line:
            in_items = False
            lines.append("")
        elif in_items:
            lines.append(f"  {markdown.escape(line.strip(), link)}")
        else:
            is_code = line.startswith("    ")
            lines.append(line if is_code else markdown.escape(line, link))
    return lines


def parameters_of(function):
    """Returns the parameters of a function as text, without `self` or `cls`; "*" is one of them."""
    arguments = function.args
    plain = arguments.posonlyargs + arguments.args
    defaults = [None] * (len(plain) - len(arguments.defaults)) + arguments.defaults
    texts = [parameter_text(*both) for both in zip(plain, defaults)]
    if plain and plain[0].arg in ("self", "cls"):
        del texts[0]
    if arguments.vararg:
        texts.append("*" + parameter_text(arguments.vararg, None))
    elif arguments.kwonlyargs:
        texts.append("*")
    texts += [parameter_text(*both) for both in zip(arguments.kwonlyargs, arguments.kw_defaults)]
    if arguments.kwarg:
        texts.append("**" + parameter_text(arguments.kwarg, None))
    return texts


def parameter_text(argument, default):
    text = argument.arg + (f": {code_of(argument.annotation)}" if argument.annotation else "")
    return text + (f" = {code_of(default)}" if default else "")


def field_texts(fields):
    texts, keyword_only = [], False
    for field in fields:
        if field.keyword_only and not keyword_only:
            keyword_only = True
            texts.append("*")
        default = f" = {field.default}" if field.default is not None else ""
        texts.append(f"{field.name}: {field.type}{default}")
    return texts


def call(begin, parameters, end=""):
    """Returns the lines of code of a signature, on one line if they fit."""
    line = f"{begin}({', '.join(parameters)}){end}"
    if len(line) <= LINE_LENGTH:
        return [line]
    return [f"{begin}(", *(f"    {parameter}," for parameter in parameters), f"){end}"]


class PythonPage:
    """The page while it is written."""

    def __init__(self, package):
        self.package = package
        self.blocking = Blocking(package.blocking_names())
        self.page = markdown.Page("Python client", f"the docstrings in {PACKAGE}")
        self.code_shown = []
        methods = package.methods(*find_public(package, "AsyncClient"))
        self.targets = {function.name: f"Client.{function.name}" for function in methods}
        self.targets.update({name: name for name in package.exported()})
        for name in CLIENTS:
            heading = f"{self.blocking.names[name]} and {name}"
            self.targets.update({name: heading, self.blocking.names[name]: heading})

    def link(self, text):
        """Makes links of the names of classes and methods that consist of several words."""
        def replacement(match):
            target = self.targets.get(match.group())
            return f"[{match.group()}](#{markdown.slug(target)})" if target else match.group()
        return NAME.sub(replacement, text)

    def code(self, lines):
        self.code_shown += lines
        self.page.block("```python", *lines, "```")

    def text(self, docs):
        self.page.block(*text_of(docs, self.link))

    def signature(self, function, begin):
        blocking = self.blocking.visit(copy.deepcopy(function))
        returns = f" -> {code_of(blocking.returns)}" if blocking.returns else ""
        return call(begin, parameters_of(blocking), returns)

    def method(self, function):
        marks = decorators(function)
        if "property" in marks:
            kind = code_of(self.blocking.visit(copy.deepcopy(function.returns)))
            self.code([f"{function.name}: {kind}  # property"])
        else:
            self.code([*(f"@{mark}" for mark in sorted(marks)),
                       *self.signature(function, f"def {function.name}")])
        self.text(docstring(function))

    def enum(self, node):
        self.text(docstring(node))
        self.page.block(*markdown.table(("value", "no.", "meaning"), [
            (f"`{name}`", code_of(part.value), markdown.escape(text, self.link))
            for name, part, text in documented_attributes(node)]))

    def members(self, module, node, heading=""):
        """Adds constructor, docstring, attributes and methods of a class."""
        if own := constructor(self.package, module, node):
            name = self.blocking.names.get(node.name, node.name)
            self.code(call(name, parameters_of(self.blocking.visit(copy.deepcopy(own)))))
        elif is_dataclass(node):
            self.code(call(node.name, field_texts(fields_of(self.package, module, node))))
        self.text(docstring(node))
        if not is_dataclass(node):
            self.attributes(node)
        for function in self.package.methods(module, node):
            if heading:
                self.page.heading(3, f"{heading}.{function.name}")
            self.method(function)

    def attributes(self, node):
        for name, part, text in documented_attributes(node):
            kind = f": {code_of(part.annotation)}" if isinstance(part, ast.AnnAssign) else ""
            value = f" = {code_of(part.value)}" if part.value else ""
            self.code([f"{name}{kind}{value}"])
            self.text(text)

    def clients(self):
        for name in CLIENTS:
            module, node = find_public(self.package, name)
            blocking = self.blocking.names[name]
            self.page.heading(2, f"{blocking} and {name}")
            self.members(module, node, blocking)

    def definition(self, name):
        module, node = find_public(self.package, name)
        self.page.heading(3, name)
        if isinstance(node, ast.FunctionDef):
            self.method(node)
            return
        bases = [f"[{base.name}](#{markdown.slug(base.name)})"
                 for _, base in self.package.bases(module, node)]
        if bases:
            self.page.block(f"A subclass of {', '.join(bases)}.")
        if is_enum(node):
            self.enum(node)
        else:
            self.members(module, node)

    def modules(self):
        """Adds the other exported names by their modules, in the order of the modules' names."""
        by_module = {}
        clients = {*CLIENTS, *(self.blocking.names[name] for name in CLIENTS)}
        for name in self.package.exported():
            if name not in clients:
                module, _ = find_public(self.package, name)
                by_module.setdefault(module.name, []).append(name)
        for module_name in sorted(by_module, key=lambda name: name.lstrip("_")):
            module = self.package.module(module_name)
            title = module_name.lstrip("_").capitalize()
            self.page.heading(2, "Request ids" if title == "Requests" else title)
            if module_name[0] != "_":
                self.text(docstring(module.tree))
            order = [node.name for node in module.tree.body if hasattr(node, "name")]
            for name in sorted(by_module[module_name], key=order.index):
                self.definition(name)
        for module_name in MODULES:
            module = self.package.module(module_name)
            self.page.heading(2, f"hypermap_client.{module_name}")
            self.text(docstring(module.tree))
            for function in public_functions(module):
                self.page.heading(3, function.name)
                self.method(function)

    def aliases(self):
        self.page.heading(2, "Types in signatures")
        self.page.block(*markdown.table(("name", "type", "meaning"), [
            (f"`{name}`", f"`{value}`", markdown.escape(text))
            for name, (value, text) in sorted(shown_aliases(self.package, self.code_shown).items())]))

    def contents(self):
        """Returns the lines of a table of the methods of the client."""
        return markdown.table(("method", "content"), [
            (f"[{function.name}](#{markdown.slug(f'Client.{function.name}')})",
             markdown.escape(markdown.first_sentence(docstring(function))))
            for function in self.package.methods(*find_public(self.package, "AsyncClient"))])


def shown_aliases(package, lines):
    """Returns the aliases of types that occur in lines of code, and those that they consist of."""
    aliases, shown = package.aliases(), {}
    words = set(re.findall(r"\w+", " ".join(lines)))
    while found := {name for name in aliases if name in words and name not in shown}:
        shown.update({name: aliases[name] for name in found})
        words |= set(re.findall(r"\w+", " ".join(aliases[name][0] for name in found)))
    return shown


def plain_methods(package):
    """Returns the names of methods of the asyncio classes that are not asynchronous."""
    for name in CLIENTS:
        yield from (f"`{name}.{function.name}`"
                    for function in package.methods(*find_public(package, name))
                    if isinstance(function, ast.FunctionDef)
                    and "property" not in decorators(function))


def write(package):
    writer = PythonPage(package)
    writer.text(docstring(package.module("").tree))
    *others, last = plain_methods(package)
    plain = f"{', '.join(others)} and {last}"
    writer.page.block(*INTRODUCTION.format(plain=plain).splitlines())
    writer.page.block(*writer.contents())
    writer.clients()
    writer.modules()
    writer.aliases()
    return writer


def python_page(package):
    """Returns the page as text."""
    return write(package).page.text()


def aliases_without_comment(package):
    """Returns the names of aliases that the page shows and that have no comment above them."""
    return [name for name, (_, text) in shown_aliases(package, write(package).code_shown).items()
            if not text]
