// The messages of hypermapd to systemd, if systemd has started it (Type=notify, sd_notify(3)).
#ifndef HYPERMAP_SERVER_SERVICE_MANAGER_H_
#define HYPERMAP_SERVER_SERVICE_MANAGER_H_

#include "absl/strings/string_view.h"

namespace hypermap::server {

// Sends `state`, such as "READY=1", to the socket in $NOTIFY_SOCKET. Without that variable it does
// nothing. Errors are ignored, as sd_notify(3) recommends.
void NotifyServiceManager(absl::string_view state);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICE_MANAGER_H_
