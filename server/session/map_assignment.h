// How the maps of a shared store are divided among its servers.
#ifndef HYPERMAP_SERVER_SESSION_MAP_ASSIGNMENT_H_
#define HYPERMAP_SERVER_SESSION_MAP_ASSIGNMENT_H_

#include <string>
#include <vector>

#include "absl/types/span.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Returns the server that each map is to belong to, in the order of the maps; "" if there are no
// servers. All servers compute the same from the same survey. O(maps · (servers + log(maps))).
//
// This is rendezvous hashing (Thaler and Ravishankar, 1998) with bounded loads (Mirrokni, Thorup
// and Zadimoghaddam, "Consistent Hashing with Bounded Loads", 2018). The load of a server is the
// number of its maps, and its bound is 1.25 times the mean, rounded up.
//
// - A map stays with its owner while that one is among the servers and within its bound.
// - Otherwise it goes to the server with the greatest hash of map and server, of those that are
//   below their bound.
// - It returns from another server to the one with the greatest hash of all once that one has less
//   than the mean. So a server that comes gets its share, and a load that wobbles between mean and
//   bound moves nothing.
std::vector<std::string> AssignMaps(absl::Span<const storage::Survey::Map> maps,
                                    absl::Span<const std::string> servers);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_MAP_ASSIGNMENT_H_
