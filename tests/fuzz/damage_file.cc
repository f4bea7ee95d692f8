#include "tests/fuzz/damage_file.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "storage/sqlite/page_checksums.h"
#include "tests/fuzz/require.h"

namespace hypermap::fuzz {
namespace {

constexpr int kMaxChanges = 4;
constexpr size_t kMaxPatch = 16;

using Connection = std::unique_ptr<sqlite3, decltype(&sqlite3_close)>;
using Prepared = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

Prepared Prepare(sqlite3* database, const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);
  return Prepared(statement, &sqlite3_finalize);
}

std::vector<std::string> FirstColumn(sqlite3* database, const std::string& sql) {
  std::vector<std::string> values;
  const Prepared rows = Prepare(database, sql);
  while (rows && sqlite3_step(rows.get()) == SQLITE_ROW) {
    values.emplace_back(reinterpret_cast<const char*>(sqlite3_column_text(rows.get(), 0)));
  }
  return values;
}

std::string Quoted(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string Patched(std::string bytes, FuzzedDataProvider& choices) {
  const size_t at = choices.ConsumeIntegralInRange<size_t>(0, bytes.size());
  const std::string patch =
      choices.ConsumeBytesAsString(choices.ConsumeIntegralInRange<size_t>(0, kMaxPatch));
  // An empty patch cuts.
  if (patch.empty()) return bytes.substr(0, at);
  bytes.replace(at, std::min(patch.size(), bytes.size() - at), patch);
  return bytes;
}

// The bytes of a value, and whether they are a blob.
std::pair<std::string, bool> ValueAt(sqlite3* database, const std::string& sql) {
  const Prepared row = Prepare(database, sql);
  if (!row || sqlite3_step(row.get()) != SQLITE_ROW) return {};
  const bool is_blob = sqlite3_column_type(row.get(), 0) == SQLITE_BLOB;
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(row.get(), 0));
  const int size = sqlite3_column_bytes(row.get(), 0);
  return {bytes == nullptr ? std::string() : std::string(bytes, static_cast<size_t>(size)),
          is_blob};
}

void BindText(sqlite3_stmt* statement, const std::string& text, bool is_blob) {
  const int size = static_cast<int>(text.size());
  if (is_blob) {
    sqlite3_bind_blob(statement, 1, text.data(), size, SQLITE_TRANSIENT);
  } else {
    sqlite3_bind_text(statement, 1, text.data(), size, SQLITE_TRANSIENT);
  }
}

void ChangeValue(sqlite3* database, const std::string& table, const std::string& column,
                 const std::string& row, FuzzedDataProvider& choices) {
  const Prepared update =
      Prepare(database, "UPDATE " + table + " SET " + column + " = ? WHERE " + row);
  if (!update) return;
  switch (choices.ConsumeIntegralInRange(0, 5)) {
    case 0:
      break;
    case 1:
      sqlite3_bind_int64(update.get(), 1, choices.ConsumeIntegralInRange<int64_t>(-3, 300));
      break;
    case 2:
      sqlite3_bind_int64(update.get(), 1, choices.ConsumeIntegral<int64_t>());
      break;
    case 3:
      sqlite3_bind_double(update.get(), 1, choices.ConsumeFloatingPoint<double>());
      break;
    case 4:
      BindText(update.get(), choices.ConsumeRandomLengthString(kMaxPatch), choices.ConsumeBool());
      break;
    default: {
      const auto [bytes, is_blob] =
          ValueAt(database, "SELECT " + column + " FROM " + table + " WHERE " + row);
      BindText(update.get(), Patched(bytes, choices), is_blob);
    }
  }
  sqlite3_step(update.get());
}

// Gives each page the checksum of its content, so that the damage is found by other means.
void SetChecksums(std::string* file) {
  constexpr size_t kPageBytes = 4096;
  for (size_t at = 0; at + kPageBytes <= file->size(); at += kPageBytes) {
    storage::SetPageChecksum({reinterpret_cast<unsigned char*>(&(*file)[at]), kPageBytes});
  }
}

}  // namespace

std::string PatchBytes(std::string file, FuzzedDataProvider& choices) {
  for (int n = choices.ConsumeIntegralInRange(1, kMaxChanges); n > 0; --n) {
    file = Patched(std::move(file), choices);
  }
  if (choices.ConsumeBool()) SetChecksums(&file);
  return file;
}

void ChangeRows(const std::string& path, FuzzedDataProvider& choices) {
  sqlite3* opened = nullptr;
  const int code =
      sqlite3_open_v2(path.c_str(), &opened, SQLITE_OPEN_READWRITE, storage::ChecksumVfs());
  const Connection database(opened, &sqlite3_close);
  REQUIRE(code == SQLITE_OK);
  // Triggers would keep indexes right.
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_exec(opened,
               "PRAGMA ignore_check_constraints = ON; PRAGMA foreign_keys = OFF;"
               "PRAGMA synchronous = OFF",
               nullptr, nullptr, nullptr);
  const std::vector<std::string> tables = FirstColumn(
      opened,
      "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%' "
      "AND sql NOT LIKE 'CREATE VIRTUAL%' ORDER BY name");
  REQUIRE(!tables.empty());
  for (int n = choices.ConsumeIntegralInRange(1, kMaxChanges); n > 0; --n) {
    const std::string table =
        Quoted(tables[choices.ConsumeIntegralInRange<size_t>(0, tables.size() - 1)]);
    const std::vector<std::string> columns =
        FirstColumn(opened, "SELECT name FROM pragma_table_info(" + table + ")");
    const int64_t offset = choices.ConsumeIntegralInRange(0, 30);
    const std::string row = "rowid = (SELECT rowid FROM " + table + " LIMIT 1 OFFSET " +
                            std::to_string(offset) + " % max(1, (SELECT count(*) FROM " + table +
                            ")))";
    const size_t column = choices.ConsumeIntegralInRange<size_t>(0, columns.size());
    if (column == columns.size()) {
      sqlite3_exec(opened, ("DELETE FROM " + table + " WHERE " + row).c_str(), nullptr, nullptr,
                   nullptr);
    } else {
      ChangeValue(opened, table, Quoted(columns[column]), row, choices);
    }
  }
}

}  // namespace hypermap::fuzz
