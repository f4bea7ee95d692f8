// token create, token list, token revoke: they change the file that hypermapd --access_file reads.
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/access/access_file.h"
#include "base/access/access_table.h"
#include "base/access/token.h"
#include "base/identity/role.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/validators.h"

namespace hypermap::cli {
namespace {

using access::AccessTable;
using access::IdentityRecord;
using access::TokenRecord;

constexpr char kDefaultFile[] = "/etc/hypermap/access.yaml";

struct TokenOptions {
  std::string file = kDefaultFile;
  std::string identity;
  std::string role;
  std::vector<std::string> maps;
  std::vector<std::string> robots;
  std::string expires_in = "0";
  std::string token_id;
};

bool Has(const AccessTable& table, const std::string& identity) {
  for (const IdentityRecord& record : table.records()) {
    if (record.identity.name == identity) return true;
  }
  return false;
}

// Makes the identity if there is none of this name. INVALID_ARGUMENT if there is, but with other
// rights than the options say, or if it has to be made and they do not say its role.
absl::Status EnsureIdentity(const TokenOptions& options, AccessTable& table) {
  const bool has_rights = !options.role.empty() || !options.maps.empty() || !options.robots.empty();
  if (Has(table, options.identity)) {
    if (!has_rights) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(
        "identity \"", options.identity, "\" exists; its rights are changed in ", options.file));
  }
  if (options.role.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("identity \"", options.identity, "\" is new: give its --role"));
  }
  IdentityRecord record;
  record.identity.name = options.identity;
  HYPERMAP_ASSIGN_OR_RETURN(record.identity.role, access::ParseRole(options.role));
  if (!options.maps.empty()) record.identity.maps = options.maps;
  record.identity.robots = options.robots;
  return table.Add(std::move(record));
}

absl::Status Create(const TokenOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const access::NewToken token, access::MakeToken());
  // The file has whole seconds.
  TokenRecord record{token.id, token.digest,
                     absl::FromUnixSeconds(absl::ToUnixSeconds(absl::Now()))};
  absl::Duration life;
  if (absl::ParseDuration(options.expires_in, &life) && life > absl::ZeroDuration()) {
    record.expires = record.created + life;
  }
  const auto add = [&](AccessTable& table) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(EnsureIdentity(options, table));
    return table.AddToken(options.identity, record);
  };
  HYPERMAP_RETURN_IF_ERROR(access::ChangeAccessFile(options.file, add));
  s.output.Show(CreatedToken{options.identity, token.id, token.text, record.expires});
  return absl::OkStatus();
}

absl::Status List(const TokenOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const AccessTable table, access::ReadAccessFile(options.file));
  s.output.Show(table.records());
  return absl::OkStatus();
}

absl::Status Revoke(const TokenOptions& options, Session& s) {
  const auto revoke = [&](AccessTable& table) { return table.Revoke(options.token_id); };
  HYPERMAP_RETURN_IF_ERROR(access::ChangeAccessFile(options.file, revoke));
  s.output.Show(RevokedToken{options.token_id});
  return absl::OkStatus();
}

void AddFile(CLI::App& command, TokenOptions& options) {
  command.add_option("--file", options.file, "File of the identities, as hypermapd --access_file")
      ->type_name("FILE")
      ->envname("HYPERMAP_ACCESS_FILE")
      ->capture_default_str();
}

}  // namespace

void AddTokenCommands(CLI::App& app, Command& selected) {
  auto options = std::make_shared<TokenOptions>();
  CLI::App* token = app.add_subcommand("token", "Make, list and revoke tokens");
  token->require_subcommand(1);

  CLI::App* create = token->add_subcommand("create", "Make a token, and print it");
  create->add_option("identity", options->identity, "Who gets it: a person, robot or program")
      ->required()
      ->type_name("NAME");
  create
      ->add_option("--role", options->role,
                   "Role of a new identity: reader, robot, editor or admin")
      ->type_name("ROLE");
  create
      ->add_option("--map", options->maps,
                   "Pattern of the maps for which a new identity has its role (default: all); may "
                   "be repeated")
      ->type_name("PATTERN");
  create
      ->add_option("--robot", options->robots,
                   "Pattern of the robots in whose names a new identity may act (default: its own "
                   "name); may be repeated")
      ->type_name("PATTERN");
  create->add_option("--expires_in", options->expires_in, "Life of the token (720h); 0: no end")
      ->type_name("DURATION")
      ->check(IsTimeout())
      ->capture_default_str();
  AddFile(*create, *options);
  create->callback(
      [&selected, options] { selected = [options](Session& s) { return Create(*options, s); }; });

  CLI::App* list = token->add_subcommand("list", "List the identities and their tokens");
  AddFile(*list, *options);
  list->callback(
      [&selected, options] { selected = [options](Session& s) { return List(*options, s); }; });

  CLI::App* revoke = token->add_subcommand("revoke", "Make a token worthless");
  revoke->add_option("id", options->token_id, "Id of the token, as listed")
      ->required()
      ->type_name("ID");
  AddFile(*revoke, *options);
  revoke->callback(
      [&selected, options] { selected = [options](Session& s) { return Revoke(*options, s); }; });
}

}  // namespace hypermap::cli
