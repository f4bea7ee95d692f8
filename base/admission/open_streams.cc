#include "base/admission/open_streams.h"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <algorithm>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/admission/client_host.h"

namespace hypermap::admission {
namespace {

constexpr intptr_t kPageSize = 500;

struct Free {
  void operator()(char* text) const { gpr_free(text); }
};
// JSON of channelz, written by gRPC without blanks; none if there is no such object.
using Json = std::unique_ptr<char, Free>;

absl::string_view View(const Json& json) { return json ? absl::string_view(json.get()) : ""; }

// Cuts `text` behind the next value of the string field, which it returns; "" if there is none.
absl::string_view NextField(absl::string_view name, absl::string_view* text) {
  const std::string key = absl::StrCat("\"", name, "\":\"");
  const size_t at = text->find(key);
  if (at == text->npos) return "";
  const absl::string_view rest = text->substr(at + key.size());
  const absl::string_view value = rest.substr(0, rest.find('"'));
  *text = rest.substr(value.size());
  return value;
}

// Returns 0 for a field that is not there, as JSON of protocol buffers leaves out zeros.
int64_t NumberIn(absl::string_view text, absl::string_view name) {
  int64_t number = 0;
  return absl::SimpleAtoi(NextField(name, &text), &number) ? number : 0;
}

int64_t OpenStreamsOf(intptr_t socket) {
  const Json json(grpc_channelz_get_socket(socket));
  const absl::string_view text = View(json);
  return std::max<int64_t>(NumberIn(text, "streamsStarted") - NumberIn(text, "streamsSucceeded") -
                               NumberIn(text, "streamsFailed"),
                           0);
}

void CountOfServer(intptr_t server, absl::flat_hash_map<std::string, int64_t>* num_of_peer) {
  intptr_t last = 0;
  for (bool is_end = false; !is_end;) {
    const Json json(grpc_channelz_get_server_sockets(server, last + 1, kPageSize));
    absl::string_view text = View(json);
    is_end = true;
    // Each is {"name":"chttp2 ipv4:127.0.0.1:4711","socketId":"5"}.
    for (absl::string_view name = NextField("name", &text); !name.empty();
         name = NextField("name", &text)) {
      int64_t socket = 0;
      if (!absl::SimpleAtoi(NextField("socketId", &text), &socket) || socket <= last) return;
      last = static_cast<intptr_t>(socket);
      is_end = false;
      (*num_of_peer)[NormalizedPeer(name.substr(name.rfind(' ') + 1))] += OpenStreamsOf(last);
    }
  }
}

}  // namespace

absl::flat_hash_map<std::string, int64_t> CountOpenStreams() {
  absl::flat_hash_map<std::string, int64_t> num_of_peer;
  const Json json(grpc_channelz_get_servers(0));
  absl::string_view text = View(json);
  for (absl::string_view id = NextField("serverId", &text); !id.empty();
       id = NextField("serverId", &text)) {
    int64_t server = 0;
    if (!absl::SimpleAtoi(id, &server)) break;
    CountOfServer(static_cast<intptr_t>(server), &num_of_peer);
  }
  return num_of_peer;
}

}  // namespace hypermap::admission
