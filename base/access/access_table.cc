#include "base/access/access_table.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/access/refusal.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "base/text/utf8.h"

namespace hypermap::access {
namespace {

constexpr size_t kDigestLength = 64;

absl::Status Invalid(const YAML::Node& node, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat("line ", node.Mark().line + 1, ": ", problem));
}

// INVALID_ARGUMENT if the node is no mapping, or has a key that is not among these.
absl::Status CheckKeys(const YAML::Node& node, std::initializer_list<absl::string_view> keys) {
  if (!node.IsMap()) {
    return Invalid(node, absl::StrCat("not a mapping of ", absl::StrJoin(keys, ", ")));
  }
  for (const auto& entry : node) {
    const std::string key = entry.first.Scalar();
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      return Invalid(entry.first,
                     absl::StrCat("\"", key, "\" is not one of ", absl::StrJoin(keys, ", ")));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> Text(const YAML::Node& parent, const char* key) {
  const YAML::Node node = parent[key];
  if (!node || !node.IsScalar() || node.Scalar().empty()) {
    return Invalid(node ? node : parent, absl::StrCat("\"", key, "\" is missing or no text"));
  }
  return node.Scalar();
}

absl::StatusOr<std::vector<std::string>> Texts(const YAML::Node& parent, const char* key,
                                               std::vector<std::string> absent) {
  const YAML::Node node = parent[key];
  if (!node) return absent;
  const auto is_scalar = [](const YAML::Node& item) { return item.IsScalar(); };
  if (!node.IsSequence() || !std::all_of(node.begin(), node.end(), is_scalar)) {
    return Invalid(node, absl::StrCat("\"", key, "\" is no list of texts"));
  }
  std::vector<std::string> texts;
  for (const YAML::Node& item : node) texts.push_back(item.Scalar());
  return texts;
}

absl::StatusOr<absl::Time> Time(const YAML::Node& parent, const char* key) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, Text(parent, key));
  absl::Time time;
  std::string error;
  if (!absl::ParseTime(absl::RFC3339_full, text, &time, &error)) {
    return Invalid(parent[key], absl::StrCat("\"", key,
                                             "\" is no time such as "
                                             "2026-11-27T09:00:00Z"));
  }
  return time;
}

absl::StatusOr<TokenRecord> ParseToken(const YAML::Node& node) {
  HYPERMAP_RETURN_IF_ERROR(CheckKeys(node, {"id", "sha256", "created", "expires"}));
  TokenRecord token;
  HYPERMAP_ASSIGN_OR_RETURN(token.id, Text(node, "id"));
  HYPERMAP_ASSIGN_OR_RETURN(token.digest, Text(node, "sha256"));
  absl::AsciiStrToLower(&token.digest);
  if (token.digest.size() != kDigestLength ||
      !std::all_of(token.digest.begin(), token.digest.end(), absl::ascii_isxdigit)) {
    return Invalid(node["sha256"], "\"sha256\" is not 64 hexadecimal digits");
  }
  HYPERMAP_ASSIGN_OR_RETURN(token.created, Time(node, "created"));
  if (node["expires"]) {
    HYPERMAP_ASSIGN_OR_RETURN(token.expires, Time(node, "expires"));
  }
  return token;
}

absl::StatusOr<IdentityRecord> ParseIdentity(const YAML::Node& node) {
  HYPERMAP_RETURN_IF_ERROR(
      CheckKeys(node, {"name", "role", "maps", "robots", "certificates", "tokens"}));
  IdentityRecord record;
  HYPERMAP_ASSIGN_OR_RETURN(record.identity.name, Text(node, "name"));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string role, Text(node, "role"));
  absl::StatusOr<Role> parsed = ParseRole(role);
  if (!parsed.ok()) return Invalid(node["role"], parsed.status().message());
  record.identity.role = *parsed;
  HYPERMAP_ASSIGN_OR_RETURN(record.identity.maps, Texts(node, "maps", {"*"}));
  HYPERMAP_ASSIGN_OR_RETURN(record.identity.robots, Texts(node, "robots", {}));
  HYPERMAP_ASSIGN_OR_RETURN(record.certificates, Texts(node, "certificates", {}));
  const YAML::Node tokens = node["tokens"];
  if (tokens && !tokens.IsSequence()) return Invalid(tokens, "\"tokens\" is no list");
  for (const YAML::Node& token : tokens) {
    HYPERMAP_ASSIGN_OR_RETURN(TokenRecord parsed_token, ParseToken(token));
    record.tokens.push_back(std::move(parsed_token));
  }
  return record;
}

// A name that can be the author of changes and stand in a line of a log.
absl::Status CheckName(absl::string_view name) {
  const auto invalid = [&](absl::string_view problem) {
    return absl::InvalidArgumentError(
        absl::StrCat("the name of an identity ", problem, ": \"", name, "\""));
  };
  if (name.empty()) return invalid("is empty");
  if (name.size() > FixedLimits::kMaxAuthorLength) {
    return invalid(absl::StrCat("is longer than ", FixedLimits::kMaxAuthorLength, " bytes"));
  }
  if (!IsUtf8(name)) return absl::InvalidArgumentError("the name of an identity is not UTF-8");
  if (HasNoncharacter(name)) {
    return absl::InvalidArgumentError("the name of an identity has a noncharacter of Unicode");
  }
  if (std::any_of(name.begin(), name.end(), absl::ascii_iscntrl)) {
    return absl::InvalidArgumentError("the name of an identity has control characters");
  }
  return absl::OkStatus();
}

// Other texts would be different ones after the file was written anew.
absl::Status CheckTexts(const IdentityRecord& record) {
  const auto check = [&](const std::string& text) {
    if (IsUtf8(text) && !HasNoncharacter(text)) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("identity \"", record.identity.name,
                     "\" has a text that is not UTF-8, or has a noncharacter of Unicode"));
  };
  for (const auto* texts : {&record.identity.maps, &record.identity.robots, &record.certificates}) {
    for (const std::string& text : *texts) HYPERMAP_RETURN_IF_ERROR(check(text));
  }
  for (const TokenRecord& token : record.tokens) HYPERMAP_RETURN_IF_ERROR(check(token.id));
  return absl::OkStatus();
}

absl::Status Twice(absl::string_view what, absl::string_view name) {
  return absl::InvalidArgumentError(absl::StrCat(what, " \"", name, "\" occurs twice"));
}

absl::StatusOr<std::vector<IdentityRecord>> ParseRecords(const std::string& yaml) {
  std::vector<IdentityRecord> records;
  const YAML::Node root = YAML::Load(yaml);
  if (root.IsNull()) return records;
  HYPERMAP_RETURN_IF_ERROR(CheckKeys(root, {"identities"}));
  const YAML::Node identities = root["identities"];
  if (!identities.IsSequence() && !identities.IsNull()) {
    return Invalid(identities, "\"identities\" is no list");
  }
  for (const YAML::Node& node : identities) {
    HYPERMAP_ASSIGN_OR_RETURN(IdentityRecord record, ParseIdentity(node));
    records.push_back(std::move(record));
  }
  return records;
}

std::string FormatUtc(absl::Time time) {
  return absl::FormatTime(absl::RFC3339_sec, time, absl::UTCTimeZone());
}

void EmitList(YAML::Emitter& out, const char* key, const std::vector<std::string>& texts) {
  if (texts.empty()) return;
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& text : texts) out << YAML::DoubleQuoted << text;
  out << YAML::EndSeq;
}

void Emit(YAML::Emitter& out, const TokenRecord& token) {
  out << YAML::BeginMap << YAML::Key << "id" << YAML::Value << YAML::DoubleQuoted << token.id
      << YAML::Key << "sha256" << YAML::Value << YAML::DoubleQuoted << token.digest << YAML::Key
      << "created" << YAML::Value << FormatUtc(token.created);
  if (token.expires != absl::InfiniteFuture()) {
    out << YAML::Key << "expires" << YAML::Value << FormatUtc(token.expires);
  }
  out << YAML::EndMap;
}

void Emit(YAML::Emitter& out, const IdentityRecord& record) {
  out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted
      << record.identity.name << YAML::Key << "role" << YAML::Value
      << std::string(RoleName(record.identity.role));
  // An empty list is written, because its absence means all maps.
  out << YAML::Key << "maps" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& map : record.identity.maps) out << YAML::DoubleQuoted << map;
  out << YAML::EndSeq;
  EmitList(out, "robots", record.identity.robots);
  EmitList(out, "certificates", record.certificates);
  if (!record.tokens.empty()) {
    out << YAML::Key << "tokens" << YAML::Value << YAML::BeginSeq;
    for (const TokenRecord& token : record.tokens) Emit(out, token);
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
}

}  // namespace

absl::StatusOr<AccessTable> AccessTable::Parse(const std::string& yaml) {
  AccessTable table;
  try {
    HYPERMAP_ASSIGN_OR_RETURN(table.records_, ParseRecords(yaml));
  } catch (const YAML::Exception& error) {
    return absl::InvalidArgumentError(error.what());
  }
  HYPERMAP_RETURN_IF_ERROR(table.Index());
  return table;
}

std::string AccessTable::Format() const {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "identities" << YAML::Value << YAML::BeginSeq;
  for (const IdentityRecord& record : records_) Emit(out, record);
  out << YAML::EndSeq << YAML::EndMap;
  return absl::StrCat(
      "# Who may do what (docs/security.md). `hypermap token` writes this file anew, without any\n"
      "# other comments.\n",
      out.c_str(), "\n");
}

absl::StatusOr<Proof> AccessTable::FindDigest(absl::string_view id, absl::string_view digest,
                                              absl::Time now) const {
  const auto it = by_token_id_.find(id);
  if (it == by_token_id_.end() || !EqualDigests(digest, it->second.token.digest)) {
    return Refusal(Reason::kUnknownToken, "the token is not known");
  }
  const TokenRecord& token = it->second.token;
  if (token.expires <= now) {
    return Refusal(Reason::kExpiredToken,
                   absl::StrCat("token ", token.id, " has expired at ", FormatUtc(token.expires)));
  }
  return Proof{it->second.identity, token.expires};
}

absl::StatusOr<Proof> AccessTable::FindCertificate(absl::Span<const std::string> names) const {
  for (const std::string& name : names) {
    if (const auto it = by_certificate_.find(name); it != by_certificate_.end()) {
      return Proof{it->second};
    }
  }
  return Refusal(Reason::kUnknownCertificate, "the client certificate belongs to no identity");
}

absl::Status AccessTable::Add(IdentityRecord record) {
  const auto has_name = [&](const IdentityRecord& other) {
    return other.identity.name == record.identity.name;
  };
  if (std::any_of(records_.begin(), records_.end(), has_name)) {
    return absl::AlreadyExistsError(
        absl::StrCat("identity \"", record.identity.name, "\" already exists"));
  }
  AccessTable changed = *this;
  changed.records_.push_back(std::move(record));
  HYPERMAP_RETURN_IF_ERROR(changed.Index());
  *this = std::move(changed);
  return absl::OkStatus();
}

absl::Status AccessTable::Remove(absl::string_view name) {
  const auto end =
      std::remove_if(records_.begin(), records_.end(),
                     [&](const IdentityRecord& record) { return record.identity.name == name; });
  if (end == records_.end()) {
    return absl::NotFoundError(absl::StrCat("identity \"", name, "\" does not exist"));
  }
  records_.erase(end, records_.end());
  return Index();
}

absl::Status AccessTable::AddToken(absl::string_view name, TokenRecord token) {
  AccessTable changed = *this;
  const auto it =
      std::find_if(changed.records_.begin(), changed.records_.end(),
                   [&](const IdentityRecord& record) { return record.identity.name == name; });
  if (it == changed.records_.end()) {
    return absl::NotFoundError(absl::StrCat("identity \"", name, "\" does not exist"));
  }
  it->tokens.push_back(std::move(token));
  HYPERMAP_RETURN_IF_ERROR(changed.Index());
  *this = std::move(changed);
  return absl::OkStatus();
}

absl::Status AccessTable::Revoke(absl::string_view id) {
  for (IdentityRecord& record : records_) {
    const auto it = std::find_if(record.tokens.begin(), record.tokens.end(),
                                 [&](const TokenRecord& token) { return token.id == id; });
    if (it == record.tokens.end()) continue;
    record.tokens.erase(it);
    return Index();
  }
  return absl::NotFoundError(absl::StrCat("token ", id, " does not exist"));
}

absl::Status AccessTable::Index() {
  by_token_id_.clear();
  by_certificate_.clear();
  absl::flat_hash_set<absl::string_view> names;
  for (const IdentityRecord& record : records_) {
    HYPERMAP_RETURN_IF_ERROR(CheckName(record.identity.name));
    HYPERMAP_RETURN_IF_ERROR(CheckTexts(record));
    if (!names.insert(record.identity.name).second) return Twice("identity", record.identity.name);
    const auto identity = std::make_shared<const Identity>(record.identity);
    for (const TokenRecord& token : record.tokens) {
      if (!by_token_id_.try_emplace(token.id, Holder{identity, token}).second) {
        return Twice("token", token.id);
      }
    }
    for (const std::string& certificate : record.certificates) {
      if (!by_certificate_.try_emplace(certificate, identity).second) {
        return Twice("certificate", certificate);
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace hypermap::access
