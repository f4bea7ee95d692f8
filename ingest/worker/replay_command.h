// hypermap-ingest replay.
#ifndef HYPERMAP_INGEST_WORKER_REPLAY_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_REPLAY_COMMAND_H_

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <optional>
#include <string>

#include "ingest/worker/command.h"

namespace hypermap::ingest {

// `selected` must outlive the parser.
void AddReplayCommand(CLI::App& app, Command& selected);

// Of (x, y, yaw), from "X,Y,YAW" as standard deviations in metres and radians. Empty: by the name
// of the trajectory, exact to the noise of a motion capture for groundtruth.txt (5 mm, 0.002 rad),
// else what AMCL reaches in an office (7 cm, 0.016 rad). nullopt when it is no such text.
std::optional<Eigen::Matrix3d> PoseCovariance(const std::string& sigmas, const std::string& poses);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_REPLAY_COMMAND_H_
