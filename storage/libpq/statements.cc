#include "storage/libpq/statements.h"

#include <algorithm>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"

namespace hypermap::storage::postgres {
namespace {

// The word with which the statement begins, in capitals.
std::string FirstWord(absl::string_view sql) {
  sql = absl::StripLeadingAsciiWhitespace(sql);
  const auto end = std::find_if_not(sql.begin(), sql.end(), absl::ascii_isalpha);
  return absl::AsciiStrToUpper(sql.substr(0, static_cast<size_t>(end - sql.begin())));
}

}  // namespace

bool IsBegin(absl::string_view sql) {
  const std::string word = FirstWord(sql);
  return word == "BEGIN" || word == "START";
}

bool IsCommit(absl::string_view sql) {
  const std::string word = FirstWord(sql);
  return word == "COMMIT" || word == "END";
}

bool MayCommit(absl::string_view sql, bool in_transaction) {
  if (IsCommit(sql)) return true;
  const std::string text = absl::AsciiStrToUpper(sql);
  if (absl::StrContains(text, "COMMIT")) return true;
  if (in_transaction) return false;
  const std::string word = FirstWord(sql);
  for (const absl::string_view reading : {"SELECT", "SHOW", "TABLE", "VALUES", "WITH"}) {
    if (word != reading) continue;
    // A WITH may write, and a script may do so after its first statement.
    return absl::StrContains(text, "INSERT") || absl::StrContains(text, "UPDATE") ||
           absl::StrContains(text, "DELETE") || absl::StrContains(text, "MERGE");
  }
  return true;
}

}  // namespace hypermap::storage::postgres
