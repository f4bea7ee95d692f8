// The commands and options of a program as data, from which its man page and its completions for
// shells are made (packaging/make_documents.py).
#ifndef HYPERMAP_CLIENT_LIBS_FLAGS_COMMAND_TABLE_H_
#define HYPERMAP_CLIENT_LIBS_FLAGS_COMMAND_TABLE_H_

#include <CLI/CLI.hpp>
#include <string>

namespace hypermap::client {

// A command with its options and subcommands as JSON:
//
//   {"name": "map", "description": "…",
//    "options": [{"names": ["--frame"], "positional": "", "type": "FRAME", "description": "…",
//                 "takes_value": true, "is_required": false}],
//    "commands": [{"name": "create", …}]}
//
// Options without a name have a positional. Hidden options and commands are left out.
std::string CommandTable(const CLI::App& app);

// Adds the hidden option --command_table, with which a program prints the table and ends. Call it
// after all commands were added.
void AddCommandTableOption(CLI::App& app);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_FLAGS_COMMAND_TABLE_H_
