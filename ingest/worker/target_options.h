// The options that commands have in common.
#ifndef HYPERMAP_INGEST_WORKER_TARGET_OPTIONS_H_
#define HYPERMAP_INGEST_WORKER_TARGET_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "ingest/perception/segmenter.h"
#include "ingest/worker/target_layer.h"

namespace hypermap::ingest {

// Those of the connection, --map, --layer, --exploration, --fusion, --parameters. `target` must
// outlive the parser.
void AddTargetOptions(CLI::App& command, TargetLayer& target);

// --segmenter, a name for MakeSegmenter.
void AddSegmenterOption(CLI::App& command, std::string& segmenter);
std::unique_ptr<Segmenter> MakeSegmenter(const std::string& name);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_TARGET_OPTIONS_H_
