// How a session with PostgreSQL is opened.
#ifndef HYPERMAP_STORAGE_LIBPQ_CONNECT_OPTIONS_H_
#define HYPERMAP_STORAGE_LIBPQ_CONNECT_OPTIONS_H_

#include <string>

#include "absl/time/time.h"

namespace hypermap::storage::postgres {

struct ConnectOptions {
  // A connection string or URI of libpq. It may name several hosts, and may set what follows
  // itself: application_name, the keepalives and tcp_user_timeout.
  std::string target;
  std::string application_name = "hypermap";
  // For each of the target's hosts. Their names are resolved before, within the timeouts of the
  // system's resolver (resolv.conf), because libpq can't do that without blocking.
  absl::Duration connect_timeout = absl::Seconds(5);
  // If the database sends and takes nothing for this long while it is waited for, the connection is
  // broken: UNAVAILABLE.
  absl::Duration response_timeout = absl::Seconds(30);
  // Whether the session is one's own. Then statements are prepared once for each session, and the
  // session is started with settings by which the database ends it, and frees its locks, soon after
  // this process or its machine is gone. A pooler that shares sessions, such as pgbouncer in
  // transaction mode, supports neither: the settings would be refused.
  bool prepares = true;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_CONNECT_OPTIONS_H_
