#include "server/auth/access_control.h"

#include <grpc/grpc_security_constants.h>
#include <sys/stat.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/access/access_file.h"
#include "base/access/refusal.h"
#include "base/access/token.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "server/auth/metadata.h"

namespace hypermap::server {
namespace {

constexpr absl::string_view kScheme = "bearer ";

// The token of a call; empty if it has none.
absl::string_view TokenOf(const grpc::ServerContextBase& context) {
  absl::string_view value = MetadataOf(context, kTokenKey);
  // The name of the scheme has no case (RFC 9110, 11.1).
  if (!absl::StartsWithIgnoreCase(value, kScheme)) return {};
  value.remove_prefix(kScheme.size());
  return value;
}

// Subject alternative names of the client's certificate, which the TLS handshake has verified.
std::vector<std::string> CertificateNamesOf(const grpc::ServerContextBase& context) {
  std::vector<std::string> names;
  const std::shared_ptr<const grpc::AuthContext> auth = context.auth_context();
  if (auth == nullptr || !auth->IsPeerAuthenticated()) return names;
  for (const grpc::string_ref& name : auth->FindPropertyValues(GRPC_X509_SAN_PROPERTY_NAME)) {
    names.emplace_back(name.data(), name.size());
  }
  return names;
}

// The names of the caller's certificate, as the server tells that passes the call on.
std::vector<std::string> ForwardedNamesOf(const grpc::ServerContextBase& context) {
  std::vector<std::string> names;
  const auto [begin, end] = context.client_metadata().equal_range(kCallerCertificateKey);
  for (auto it = begin; it != end; ++it) names.emplace_back(it->second.data(), it->second.size());
  return names;
}

}  // namespace

absl::StatusOr<std::unique_ptr<AccessControl>> AccessControl::OfFile(std::string path,
                                                                     std::string own_name,
                                                                     ServerClock* clock) {
  auto control = std::make_unique<AccessControl>();
  control->path_ = std::move(path);
  control->own_name_ = std::move(own_name);
  control->clock_ = clock;
  // Before the file is read, so that a change in between is noticed.
  control->stamp_ = StampOf(control->path_);
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const access::AccessTable> table,
                            Read(control->path_, control->own_name_));
  const MutexLock lock(&control->mutex_);
  control->version_.table = std::move(table);
  return control;
}

absl::StatusOr<Caller> AccessControl::Identify(const grpc::ServerContextBase& context) const {
  Caller caller;
  if (is_open()) return caller;
  if (const absl::string_view token = TokenOf(context); !token.empty()) {
    caller.token_id = std::string(access::IdOfToken(token));
    caller.token_digest = access::DigestOfToken(token);
  } else {
    HYPERMAP_ASSIGN_OR_RETURN(caller.certificate_names, CallerCertificateOf(context));
  }
  const Version version = this->version();
  HYPERMAP_ASSIGN_OR_RETURN(access::Proof proof, Find(*version.table, caller));
  caller.identity = std::move(proof.identity);
  caller.expires = proof.expires;
  caller.table_version = version.number;
  return caller;
}

absl::StatusOr<std::vector<std::string>> AccessControl::CallerCertificateOf(
    const grpc::ServerContextBase& context) const {
  std::vector<std::string> names = CertificateNamesOf(context);
  if (IsForwarded(context)) {
    const bool is_peer =
        std::find_first_of(names.begin(), names.end(), peers_.begin(), peers_.end()) != names.end();
    names = ForwardedNamesOf(context);
    if (!names.empty() && !is_peer) {
      return access::Refusal(access::Reason::kUnknownCertificate,
                             "the call of a client with a certificate is passed on by a server "
                             "that --peer_certificates does not name");
    }
  }
  if (!names.empty()) return names;
  return access::Refusal(access::Reason::kNoCredentials,
                         "the call has no token and no client certificate");
}

absl::Status AccessControl::CheckStill(const Caller& caller) const {
  if (!caller.identity) return absl::OkStatus();
  const bool is_new = newest_.load(std::memory_order_relaxed) != caller.table_version;
  if (!is_new && caller.expires == absl::InfiniteFuture()) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const access::Proof proof, Find(*version().table, caller));
  const access::Identity& now = *proof.identity;
  const access::Identity& then = *caller.identity;
  if (now.name == then.name && now.role >= then.role && now.maps == then.maps &&
      now.robots == then.robots) {
    return absl::OkStatus();
  }
  return access::Refusal(
      access::Reason::kChanged,
      absl::StrCat("what \"", then.name, "\" may do has changed since the call began"));
}

bool AccessControl::Refresh() {
  if (is_open()) return false;
  const Stamp stamp = StampOf(path_);
  if (stamp == std::exchange(stamp_, stamp)) return false;
  absl::StatusOr<std::shared_ptr<const access::AccessTable>> table = Read(path_, own_name_);
  if (!table.ok()) {
    logging::Log(logging::Level::kError,
                 "the identities stay as they were, because their file is invalid",
                 {{"problem", table.status().message()}});
    return false;
  }
  logging::Log(logging::Level::kInfo, "the identities have changed",
               {{"file", path_}, {"identities", (*table)->records().size()}});
  const MutexLock lock(&mutex_);
  version_ = {version_.number + 1, *std::move(table)};
  newest_ = version_.number;
  return true;
}

absl::StatusOr<std::shared_ptr<const access::AccessTable>> AccessControl::Read(
    const std::string& path, const std::string& own_name) {
  HYPERMAP_ASSIGN_OR_RETURN(access::AccessTable table, access::ReadAccessFile(path));
  for (const access::IdentityRecord& record : table.records()) {
    if (record.identity.name == own_name) {
      return absl::InvalidArgumentError(absl::StrCat(
          path, ": \"", own_name, "\" is the name by which the server signs its own changes"));
    }
  }
  return std::make_shared<const access::AccessTable>(std::move(table));
}

AccessControl::Stamp AccessControl::StampOf(const std::string& path) {
  struct stat status;
  if (stat(path.c_str(), &status) != 0) return {};
  return {static_cast<int64_t>(status.st_ino), static_cast<int64_t>(status.st_size),
          status.st_mtim.tv_sec * int64_t{1'000'000'000} + status.st_mtim.tv_nsec};
}

AccessControl::Version AccessControl::version() const {
  const MutexLock lock(&mutex_);
  return version_;
}

absl::StatusOr<access::Proof> AccessControl::Find(const access::AccessTable& table,
                                                  const Caller& caller) const {
  return caller.token_digest.empty()
             ? table.FindCertificate(caller.certificate_names)
             : table.FindDigest(caller.token_id, caller.token_digest, clock_->Now());
}

}  // namespace hypermap::server
