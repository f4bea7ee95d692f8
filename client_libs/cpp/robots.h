// Where the robots of a map are.
//
//    RobotReader reader = client.WatchRobots("office");
//    std::map<std::string, RobotPresence> robots;
//    while (std::optional<RobotChanges> changes = reader.Next()) CarryOut(*changes, &robots);
//    return reader.status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_ROBOTS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_ROBOTS_H_

#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "client_libs/cpp/readers.h"
#include "map/robots/robot_presence.h"
#include "map/robots/robot_report.h"

namespace hypermap::client {

using hypermap::ReportAnswer;
using hypermap::RobotChanges;
using hypermap::RobotList;
using hypermap::RobotPresence;
using hypermap::RobotReport;

// A watch of the robots of a map. It ends when the server stops or the map is deleted; then open
// another one, which begins with all robots. Destroying it ends the watch. Movable; used by one
// thread at a time.
class RobotReader {
 public:
  explicit RobotReader(std::unique_ptr<PartStream<RobotChanges>> source)
      : source_(std::move(source)) {}

  // Returns what has changed since; nullopt at the end. Blocks until there is something, or the
  // server tells that nothing has changed.
  std::optional<RobotChanges> Next() { return source_->Next(); }
  auto begin() { return ReaderIterator<RobotReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: the reason.
  const absl::Status& status() const { return source_->status(); }

 private:
  std::unique_ptr<PartStream<RobotChanges>> source_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_ROBOTS_H_
