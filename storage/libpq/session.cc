#include "storage/libpq/session.h"

#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "storage/libpq/errors.h"

namespace hypermap::storage::postgres {
namespace {

std::string FieldOf(const PGresult* result, int field) {
  const char* const text = PQresultErrorField(result, field);
  return text == nullptr ? "" : absl::StrReplaceAll(text, {{"\n", " "}});
}

// The first line of libpq's message, which says what happened first.
std::string MessageOf(const PGconn* handle) {
  const absl::string_view message = PQerrorMessage(handle);
  return std::string(absl::StripAsciiWhitespace(message.substr(0, message.find('\n'))));
}

// Parameters as libpq takes them.
struct Arguments {
  explicit Arguments(const Parameters& parameters) {
    for (const Parameters::Value& value : parameters.values()) {
      types.push_back(value.type);
      values.push_back(value.is_null ? nullptr : value.bytes.data());
      lengths.push_back(static_cast<int>(value.bytes.size()));
      formats.push_back(1);  // binary
    }
  }
  int size() const { return static_cast<int>(types.size()); }

  std::vector<::Oid> types;
  std::vector<const char*> values;
  std::vector<int> lengths, formats;
};

}  // namespace

std::string PreparedStatements::Find(const std::string& sql,
                                     const std::vector<::Oid>& types) const {
  const auto found = statements_.find(sql);
  const bool fits = found != statements_.end() && found->second.types == types;
  return fits ? found->second.name : "";
}

std::string PreparedStatements::Add(const std::string& sql, const std::vector<::Oid>& types) {
  std::string name = absl::StrCat("s", ++num_names_);
  statements_[sql] = {name, types};
  return name;
}

void PreparedStatements::Confirm(const std::string& sql) { statements_[sql].is_confirmed = true; }

void PreparedStatements::ForgetUnconfirmed() {
  std::erase_if(statements_, [](const auto& entry) { return !entry.second.is_confirmed; });
}

Session::Session(Handle handle, const ConnectOptions& options)
    : handle_(std::move(handle)),
      response_timeout_(options.response_timeout),
      prepares_(options.prepares) {}

bool Session::is_in_transaction() const {
  const PGTransactionStatusType state = PQtransactionStatus(handle());
  return state == PQTRANS_INTRANS || state == PQTRANS_INERROR;
}

absl::Status Session::Break(const absl::Status& reason) {
  if (is_broken()) return status_;
  status_ =
      absl::IsUnavailable(reason)
          ? reason
          : absl::UnavailableError(absl::StrCat("the connection was given up: ", reason.message()));
  handle_.reset();
  return reason;
}

absl::Status Session::Lost() {
  return is_broken() ? status_ : Break(absl::UnavailableError(MessageOf(handle())));
}

absl::Status Session::CallError() {
  if (is_broken() || PQstatus(handle()) == CONNECTION_BAD) return Lost();
  return absl::InternalError(MessageOf(handle()));
}

bool Session::IsEndedBy(const PGresult* result) const {
  switch (PQresultStatus(result)) {
    case PGRES_COPY_IN:
    case PGRES_COPY_OUT:
    case PGRES_COPY_BOTH:
      return true;
    case PGRES_FATAL_ERROR: {
      const std::string severity = FieldOf(result, PG_DIAG_SEVERITY_NONLOCALIZED);
      return severity == "FATAL" || severity == "PANIC" || PQstatus(handle()) == CONNECTION_BAD;
    }
    default:
      return false;
  }
}

absl::Status Session::SendPrepare(const std::string& sql, const Parameters& parameters) {
  const Arguments arguments(parameters);
  const std::string name = prepared_.Add(sql, arguments.types);
  const int sent =
      PQsendPrepare(handle(), name.c_str(), sql.c_str(), arguments.size(), arguments.types.data());
  return sent == 1 ? absl::OkStatus() : CallError();
}

absl::Status Session::SendStatement(const std::string& sql, const Parameters& parameters) {
  const Arguments arguments(parameters);
  const std::string name = prepared_.Find(sql, arguments.types);
  const int sent =
      name.empty()
          ? PQsendQueryParams(handle(), sql.c_str(), arguments.size(), arguments.types.data(),
                              arguments.values.data(), arguments.lengths.data(),
                              arguments.formats.data(), /*resultFormat=*/1)
          : PQsendQueryPrepared(handle(), name.c_str(), arguments.size(), arguments.values.data(),
                                arguments.lengths.data(), arguments.formats.data(),
                                /*resultFormat=*/1);
  return sent == 1 ? absl::OkStatus() : CallError();
}

absl::Status StatusOf(const PGresult* result, bool is_commit) {
  switch (PQresultStatus(result)) {
    case PGRES_COMMAND_OK:
      // The COMMIT of a transaction that has failed succeeds, and rolls back.
      if (is_commit &&
          absl::string_view(PQcmdStatus(const_cast<PGresult*>(result))) == "ROLLBACK") {
        return absl::InternalError("COMMIT of a transaction that had failed");
      }
      return absl::OkStatus();
    case PGRES_TUPLES_OK:
    case PGRES_EMPTY_QUERY:
    case PGRES_PIPELINE_SYNC:
      return absl::OkStatus();
    case PGRES_COPY_IN:
    case PGRES_COPY_OUT:
    case PGRES_COPY_BOTH:
      return absl::InternalError("COPY is not run this way");
    default:
      break;
  }
  const std::string sqlstate = FieldOf(result, PG_DIAG_SQLSTATE);
  std::string message = FieldOf(result, PG_DIAG_MESSAGE_PRIMARY);
  const std::string detail = FieldOf(result, PG_DIAG_MESSAGE_DETAIL);
  if (!detail.empty()) absl::StrAppend(&message, ": ", detail);
  if (!sqlstate.empty()) return DatabaseError(sqlstate, message);
  // libpq's own error: it lost the connection, or can't read the answer.
  const std::string text = PQresultErrorMessage(result);
  return absl::UnavailableError(text.substr(0, text.find('\n')));
}

}  // namespace hypermap::storage::postgres
