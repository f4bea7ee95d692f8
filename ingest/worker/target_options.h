// Options that several commands share.
#ifndef HYPERMAP_INGEST_WORKER_TARGET_OPTIONS_H_
#define HYPERMAP_INGEST_WORKER_TARGET_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "ingest/perception/segmenter.h"
#include "ingest/worker/target_layer.h"

namespace hypermap::ingest {

// Adds the options of the connection, and --map, --layer, --exploration, --fusion and --parameters.
// `target` must outlive the parser.
void AddTargetOptions(CLI::App& command, TargetLayer& target);

// Accepts what ParsePoseSigma does.
CLI::Validator IsPoseSigma();

// Adds --segmenter, whose value is an argument of MakeSegmenter(). `segmenter` must outlive the
// parser.
void AddSegmenterOption(CLI::App& command, std::string& segmenter);
// Makes the segmenter "region_growing"; the default one, "organised", for any other name.
std::unique_ptr<Segmenter> MakeSegmenter(const std::string& name);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_TARGET_OPTIONS_H_
