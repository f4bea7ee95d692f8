// The command `hypermap-ingest replay`.
#ifndef HYPERMAP_INGEST_WORKER_REPLAY_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_REPLAY_COMMAND_H_

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <optional>
#include <string>

#include "ingest/worker/command.h"

namespace hypermap::ingest {

// Adds the command. Parsing sets `selected`, which must outlive the parser, if it is named.
void AddReplayCommand(CLI::App& app, Command& selected);

// Returns the covariance of (x, y, yaw) from "X,Y,YAW", standard deviations in metres and radians.
// If `sigmas` is empty, the name of the trajectory's file decides: the noise of motion capture for
// groundtruth.txt (5 mm, 0.002 rad), otherwise the error of AMCL in an office (6 cm on each axis,
// 0.016 rad). Returns nullopt for other texts, and for numbers outside [0, 1000].
std::optional<Eigen::Matrix3d> PoseCovariance(const std::string& sigmas, const std::string& poses);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_REPLAY_COMMAND_H_
