// A stream of observations to a layer.
//
//   absl::StatusOr<std::unique_ptr<ObserveStream>> stream =
//       client.Observe("office", "semantic", {.exploration_layer = "explored", .robot = "cart"});
//   ...
//   (*stream)->Write(observation);          // one thread
//   (*stream)->WritesDone();
//   while (std::optional<Acknowledgement> a = (*stream)->Read()) Note(*a);   // another
//   absl::Status status = (*stream)->status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OBSERVE_STREAM_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OBSERVE_STREAM_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "client_libs/cpp/ingest_answers.h"
#include "map/observations/observation.h"

namespace hypermap::client {

struct ObserveOptions {
  // Exploration layer in which observed free space is marked as explored. Empty: the one that the
  // layer already has, if any.
  std::string exploration_layer;
  // "evidence" or "paper". Empty: the layer's strategy; "evidence" if it was not fused before.
  std::string strategy;
  // A JSON object of numbers. Empty: the layer's parameters; the defaults if it was not fused
  // before.
  std::string parameters;
  // The robot whose known sequences opened() lists. May be empty.
  std::string robot;
};

// A call of Observe. One thread may write while another reads; any thread may cancel. A caller that
// writes many observations must read meanwhile, because the server stops reading while many
// acknowledgements wait. Observations whose acknowledgement was lost may be sent again.
class ObserveStream {
 public:
  // The call itself. Only for the sources of this folder.
  class Call;

  explicit ObserveStream(std::unique_ptr<Call> call);
  // Cancels the call if it has not finished.
  ~ObserveStream();
  ObserveStream(const ObserveStream&) = delete;
  ObserveStream& operator=(const ObserveStream&) = delete;

  // The server's answer to the opening.
  const OpenedLayer& opened() const;

  // Writer: sends observations. Blocks while the server accepts no more. Returns false if the
  // stream broke; Read then returns nullopt, and status() tells why.
  bool Write(const Observation& observation);
  bool Write(absl::Span<const Observation> observations);
  // Writer: ends the observations. The server acknowledges those it has, then ends the stream.
  void WritesDone();

  // Reader: returns the next acknowledgement, in no particular order; nullopt at the end and on an
  // error. Blocks until there is one.
  std::optional<Acknowledgement> Read();
  // Reader: after the end, OK if every observation was acknowledged, otherwise the error.
  const absl::Status& status() const;

  // Ends the stream as soon as possible. Unacknowledged observations may have been accepted or not.
  void Cancel();

 private:
  std::unique_ptr<Call> call_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OBSERVE_STREAM_H_
