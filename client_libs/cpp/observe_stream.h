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
  // Where explored floor is marked. Empty: the layer that it has, if any.
  std::string exploration_layer;
  // "evidence", "paper". Empty: the one that the layer has, "evidence" for a new one.
  std::string strategy;
  // A JSON object of numbers. Empty: those that the layer has, the defaults for a new one.
  std::string parameters;
  // Whose known sequences the opening tells. May be empty.
  std::string robot;
};

// One thread may write while another reads; Cancel may be called from any. Who writes much must
// read meanwhile: the server takes no more while many acknowledgements wait. Observations whose
// acknowledgement was lost may be sent again.
class ObserveStream {
 public:
  // The call itself. Only for the sources of this folder.
  class Call;

  explicit ObserveStream(std::unique_ptr<Call> call);
  // Cancels what is not finished.
  ~ObserveStream();
  ObserveStream(const ObserveStream&) = delete;
  ObserveStream& operator=(const ObserveStream&) = delete;

  // What the server said to the opening.
  const OpenedLayer& opened() const;

  // Writer: sends observations; blocks while the server takes no more. False when the stream broke:
  // Read then ends, and status() tells why.
  bool Write(const Observation& observation);
  bool Write(absl::Span<const Observation> observations);
  // Writer: nothing more comes. The server acknowledges what it has, then ends the stream.
  void WritesDone();

  // Reader: the next acknowledgement, in no particular order; nullopt at the end and on an error.
  // Blocks until there is one.
  std::optional<Acknowledgement> Read();
  // Reader: after the end, OK when all that was written is acknowledged, else why not.
  const absl::Status& status() const;

  // Ends the stream as soon as can be. What was not acknowledged may have been taken or not.
  void Cancel();

 private:
  std::unique_ptr<Call> call_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OBSERVE_STREAM_H_
