// Finds out who calls.
#ifndef HYPERMAP_SERVER_AUTH_ACCESS_CONTROL_H_
#define HYPERMAP_SERVER_AUTH_ACCESS_CONTROL_H_

#include <grpcpp/server_context.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/access/access_table.h"
#include "base/sync/mutex.h"
#include "base/time/server_clock.h"
#include "server/auth/caller.h"

namespace hypermap::server {

// Knows the identities of a file, which it reads again when the file has changed. Thread safe.
class AccessControl {
 public:
  // Knows no identities, and lets everybody do everything.
  AccessControl() = default;
  // No identity may have `own_name`, by which the server signs its own changes. Errors of
  // access::ReadAccessFile. `clock` must outlive this.
  static absl::StatusOr<std::unique_ptr<AccessControl>> OfFile(std::string path,
                                                               std::string own_name,
                                                               ServerClock* clock);

  // Returns whether everybody may do everything.
  bool is_open() const { return path_.empty(); }

  // Lets servers whose certificates have one of these names pass calls on for clients that they
  // have identified by certificates (kCallerCertificateKey). Before the first call.
  void TrustPeers(std::vector<std::string> certificate_names) {
    peers_ = std::move(certificate_names);
  }

  // Identifies the caller by the token in the call's metadata ("authorization: Bearer TOKEN"), or
  // else by the client certificate of its connection; that of the connection of another server,
  // which passes the call on, is never taken for the caller's. UNAUTHENTICATED if it shows neither,
  // or something that is not known or has expired.
  absl::StatusOr<Caller> Identify(const grpc::ServerContextBase& context) const;
  // The same for a caller that was identified before; cheap unless the file has changed since then.
  // UNAUTHENTICATED if it would not be identified any more; PERMISSION_DENIED if it is another
  // identity now, or may do less than then.
  absl::Status CheckStill(const Caller& caller) const;

  // Reads the file again if it has changed, and returns whether the identities are new. An invalid
  // file is logged, and the identities stay as they are. To be called every second, on one thread.
  bool Refresh();

 private:
  // Differs if a file was replaced or written.
  struct Stamp {
    int64_t inode = 0;
    int64_t size = 0;
    int64_t modified_ns = 0;
    bool operator==(const Stamp&) const = default;
  };
  struct Version {
    int64_t number;
    std::shared_ptr<const access::AccessTable> table;
  };

  static absl::StatusOr<std::shared_ptr<const access::AccessTable>> Read(
      const std::string& path, const std::string& own_name);
  static Stamp StampOf(const std::string& path);

  Version version() const;
  absl::StatusOr<access::Proof> Find(const access::AccessTable& table, const Caller& caller) const;
  // The names of the caller's certificate. UNAUTHENTICATED if it has none, or if a server that is
  // not trusted tells them.
  absl::StatusOr<std::vector<std::string>> CallerCertificateOf(
      const grpc::ServerContextBase& context) const;

  std::string path_;  // Empty: access is open.
  std::string own_name_;
  std::vector<std::string> peers_;
  ServerClock* clock_ = nullptr;
  Stamp stamp_;  // of the file that was read last; used by Refresh only
  std::atomic<int64_t> newest_ = 0;
  mutable Mutex mutex_;
  Version version_ ABSL_GUARDED_BY(mutex_) = {0, nullptr};
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_AUTH_ACCESS_CONTROL_H_
