#!/usr/bin/env python3
"""Makes the man page of a program, and completions for bash and zsh, from what the program tells of itself.

    make_documents.py FOLDER VERSION PROGRAM [TEXT]

PROGRAM is the path of a program. hypermap and hypermap-ingest print their commands as JSON
(--command_table), hypermapd and hypermap-gateway their flags (--help). TEXT is a file of roff with further
sections, such as FILES. Writes FOLDER/man/NAME.SECTION and, for programs with commands,
FOLDER/completions/NAME.bash and FOLDER/completions/_NAME.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import time

# Names of types for which shells complete paths of files or of folders.
FILE_TYPES = {"FILE", "PATH"}
FOLDER_TYPES = {"DIR", "FOLDER"}


def run(program, *arguments):
    """Returns what the program prints; the exit code of --help differs between libraries."""
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
    return done.stdout or done.stderr


def option(name, kind, description):
    return {"names": [name], "positional": "", "type": kind, "description": description,
            "takes_value": bool(kind), "is_required": False}


def flags_of_abseil(text):
    """Parses lines such as `--grace (Time for requests …); default: 10s;`, which are wrapped."""
    joined = " ".join(text.split())
    found = re.findall(r"--(\w+) \((.*?)\); default: (.*?);(?= --|  ?Flags from | Try | *$)", joined)
    return [option(f"--{name}", "VALUE", f"{words} (default: {default})")
            for name, words, default in sorted(found)]


def flags_of_go(text):
    """Parses pairs of lines: `  -listen HOST:PORT`, and the description after a tab."""
    found = re.findall(r"^  -(\w+)(?: (\S+))?\n((?:    \t.*\n?)+)", text, re.MULTILINE)
    return [option(f"--{name}", kind, " ".join(words.split())) for name, kind, words in found]


def table_of(program):
    """Returns the table of the program's commands (client_libs/flags/command_table.h)."""
    name = program.name
    if name == "hypermapd":
        return {"name": name, "description": "Serves the maps of a folder over gRPC.",
                "options": flags_of_abseil(run(program, "--help")), "commands": []}
    if name == "hypermap-gateway":
        return {"name": name, "description": "Connects browsers to a Hypermap server.",
                "options": flags_of_go(run(program, "--help")), "commands": []}
    return json.loads(run(program, "--command_table"))


def walk(table, path=()):
    """Yields each command with its path: () for the program, ("map", "create")."""
    yield path, table
    for command in table["commands"]:
        yield from walk(command, (*path, command["name"]))


# roff


def escape(text):
    escaped = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", escaped, flags=re.MULTILINE)


def roff_option(entry):
    names = ", ".join(f"\\fB{escape(name)}\\fR" for name in entry["names"])
    value = f" \\fI{escape(entry['type'])}\\fR" if entry["takes_value"] and entry["type"] else ""
    label = names or f"\\fI{escape(entry['positional'])}\\fR"
    return f".TP\n{label}{value if names else ''}\n{escape(entry['description']) or '.'}\n"


def synopsis(name, path, table):
    words = [f"\\fB{escape(' '.join((name, *path)))}\\fR"]
    if any(entry["names"] for entry in table["options"]):
        words.append("[\\fIOPTION\\fR]...")
    words += [f"\\fI{escape(entry['positional'])}\\fR" if entry["is_required"]
              else f"[\\fI{escape(entry['positional'])}\\fR]"
              for entry in table["options"] if not entry["names"]]
    if table["commands"]:
        words.append("\\fICOMMAND\\fR ...")
    return " ".join(words)


def man_page(table, section, version, text):
    name = table["name"]
    date = time.strftime("%Y-%m-%d", time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))))
    first, _, rest = table["description"].partition("\n")
    parts = [f'.TH {name.upper()} {section} "{date}" "Hypermap {version}"\n',
             f".SH NAME\n{escape(name)} \\- {escape(first[:1].lower() + first[1:].rstrip('.'))}\n",
             f".SH SYNOPSIS\n{synopsis(name, (), table)}\n"]
    if rest:
        parts.append(f".SH DESCRIPTION\n{escape(rest)}\n")
    parts.append(".SH OPTIONS\n" + "".join(map(roff_option, table["options"])))
    if table["commands"]:
        parts.append(".SH COMMANDS\n")
    for path, command in walk(table):
        if path and not command["commands"]:
            options = [entry for entry in command["options"] if "--help" not in entry["names"]]
            parts.append(f".SS {escape(' '.join(path))}\n{synopsis(name, path, command)}\n.PP\n"
                         f"{escape(command['description'])}\n" + "".join(map(roff_option, options)))
    return "".join(parts) + text


# Completion


def kind_of_value(entry):
    if entry["type"] in FILE_TYPES:
        return "file"
    return "folder" if entry["type"] in FOLDER_TYPES else "other"


def bash_completion(table):
    """The words of each command are in one associative array, by the path of the command."""
    name = table["name"]
    function = "_" + name.replace("-", "_")
    own = [word for entry in table["options"] for word in entry["names"]]
    words, files, folders, values = [], set(), set(), set()
    for path, command in walk(table):
        offered = [child["name"] for child in command["commands"]]
        offered += [word for entry in command["options"] for word in entry["names"]]
        if path:
            offered += own
        words.append(f"  [{' '.join(path) or '.'}]={json.dumps(' '.join(dict.fromkeys(offered)))}")
        for entry in command["options"]:
            if entry["takes_value"]:
                values.update(entry["names"])
            if kind_of_value(entry) == "file":
                files.update(entry["names"])
            if kind_of_value(entry) == "folder":
                folders.update(entry["names"])
    words = "\n".join(words)

    def pattern(names):
        return "|".join(sorted(names)) or "--"

    return f"""# Completion of {name} for bash, made from its table of commands.
declare -gA {function}_words=(
{words}
)

{function}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} path=. word next i
  COMPREPLY=()
  case $previous in
    {pattern(files)}) compopt -o filenames; mapfile -t COMPREPLY < <(compgen -f -- "$current"); return ;;
    {pattern(folders)}) compopt -o filenames; mapfile -t COMPREPLY < <(compgen -d -- "$current"); return ;;
    {pattern(values)}) return ;;
  esac
  for ((i = 1; i < COMP_CWORD; ++i)); do
    word=${{COMP_WORDS[i]}}
    next=$word
    [[ $path == . ]] || next="$path $word"
    [[ -n $word && -v "{function}_words[$next]" ]] && path=$next
  done
  mapfile -t COMPREPLY < <(compgen -W "${{{function}_words[$path]}}" -- "$current")
  # Commands that read or write a file take it as a plain argument.
  if [[ $current != -* && ${{#COMPREPLY[@]}} -eq 0 ]]; then
    compopt -o filenames
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}}
complete -F {function} {name}
"""


def zsh_quote(text):
    return text.replace("'", "'\\''").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")


def zsh_options(entries):
    lines = []
    for entry in entries:
        action = {"file": "_files", "folder": "_files -/", "other": " "}[kind_of_value(entry)]
        value = f":{zsh_quote(entry['type'] or 'value')}:{action}" if entry["takes_value"] else ""
        summary = zsh_quote(entry["description"].split("\n")[0])
        lines += [f"    '*{word}[{summary}]{value}'" for word in entry["names"]]
    return lines


def zsh_function(name, path):
    return "_" + "_".join((name.replace("-", "_"), *(word.replace("-", "_") for word in path)))


def zsh_completion(table):
    """One function for each command."""
    name = table["name"]
    parts = [f"#compdef {name}\n# Completion of {name} for zsh, made from its table of commands.\n"]
    for path, command in walk(table):
        own = [] if not path else table["options"]
        seen, entries = set(), []
        for entry in [*command["options"], *own]:
            if entry["names"] and not seen.intersection(entry["names"]):
                seen.update(entry["names"])
                entries.append(entry)
        lines = zsh_options(entries)
        function = zsh_function(name, path)
        if not command["commands"]:
            lines.append("    '*:argument:_files'")
            parts.append(f"{function}() {{\n  _arguments -s \\\n" + " \\\n".join(lines) + "\n}\n")
            continue
        lines += ["    '1: :->command'", "    '*:: :->arguments'"]
        children = "\n".join(
            f"    '{zsh_quote(child['name'])}:{zsh_quote(child['description'].splitlines()[0])}'"
            for child in command["commands"])
        cases = "\n".join(f"        {child['name']}) {zsh_function(name, (*path, child['name']))} ;;"
                          for child in command["commands"])
        parts.append(
            f"{function}() {{\n  local line state\n  local -a commands=(\n{children}\n  )\n"
            "  _arguments -C \\\n" + " \\\n".join(lines) + "\n"
            "  case $state in\n    command) _describe command commands ;;\n"
            f"    arguments)\n      case $line[1] in\n{cases}\n      esac ;;\n  esac\n}}\n")
    return "\n".join(parts) + f'\n{zsh_function(name, ())} "$@"\n'


def main(folder, version, program, text=None):
    folder, program = pathlib.Path(folder), pathlib.Path(program)
    table = table_of(program)
    if not table["options"]:
        sys.exit(f"make_documents.py: {program} tells no options")
    section = 1 if table["commands"] else 8
    (folder / "man").mkdir(parents=True, exist_ok=True)
    page = man_page(table, section, version, pathlib.Path(text).read_text() if text else "")
    (folder / "man" / f"{table['name']}.{section}").write_text(page)
    if not table["commands"]:
        return
    (folder / "completions").mkdir(exist_ok=True)
    (folder / "completions" / f"{table['name']}.bash").write_text(bash_completion(table))
    (folder / "completions" / f"_{table['name']}").write_text(zsh_completion(table))


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    main(*sys.argv[1:])
