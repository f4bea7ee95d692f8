#include "client_libs/cli/transform_tables.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_libs/cli/describe.h"
#include "client_libs/cli/text_table.h"

namespace hypermap::cli {
namespace {

using registration::Ambiguity;
using registration::Mode;

void AddMode(const std::string& name, const Mode& mode, TextTable* table) {
  const PlanarTransform& pose = mode.target_from_source;
  table->AddRow({name, FormatNumber(pose.x(), 4), FormatNumber(pose.y(), 4),
                 FormatNumber(pose.yaw(), 5), FormatNumber(mode.score)});
}

void PrintModes(const registration::TransformEstimate& estimate, std::ostream& out) {
  TextTable table({"TRANSFORM", "X [m]", "Y [m]", "YAW [rad]", "SCORE"});
  AddMode("best", estimate.best, &table);
  if (estimate.covariance.allFinite()) {
    const auto sigma = [&](int i) { return std::sqrt(estimate.covariance(i, i)); };
    table.AddRow({"standard deviation", FormatNumber(sigma(0), 4), FormatNumber(sigma(1), 4),
                  FormatNumber(sigma(2), 5), ""});
  }
  if (estimate.runner_up) AddMode("runner-up", *estimate.runner_up, &table);
  table.Print(out);
}

void PrintPairs(const TransformReport& report, std::ostream& out) {
  const registration::TransformEstimate& estimate = report.answer.estimate;
  TextTable table({"PAIR", "RESIDUAL [m]", "AGREES"});
  for (size_t i = 0; i < report.pairs.size(); ++i) {
    const client::NamedPair& pair = report.pairs[i];
    const Point laid = estimate.best.target_from_source * pair.pair.source;
    const bool agrees = std::any_of(
        estimate.agreeing.begin(), estimate.agreeing.end(),
        [&](const auto& agreeing) { return agreeing.source == static_cast<int64_t>(i); });
    table.AddRow(
        {pair.name.empty() ? absl::StrCat(i + 1) : pair.name,
         FormatNumber(std::hypot(laid.x - pair.pair.target.x, laid.y - pair.pair.target.y)),
         agrees ? "yes" : "no"});
  }
  table.Print(out);
}

}  // namespace

std::string DescribeAmbiguity(Ambiguity ambiguity) {
  switch (ambiguity) {
    case Ambiguity::kNone:
      return "not ambiguous";
    case Ambiguity::kLittleAgreement:
      return "ambiguous: too little agrees, or too much contradicts";
    case Ambiguity::kRunnerUp:
      return "ambiguous: the runner-up is about as good";
    case Ambiguity::kFreeDirection:
      return "ambiguous: nothing holds the transform in some direction";
  }
  return "ambiguous";
}

std::string DescribeSide(const registration::ReadSide& side) {
  return absl::StrCat(side.map, side.layer.empty() ? "" : "/", side.layer, " in ", side.frame_id,
                      ", revision ", side.revision);
}

void PrintTransform(const TransformReport& report, std::ostream& out) {
  const registration::TransformEstimate& estimate = report.answer.estimate;
  PrintModes(estimate, out);
  out << '\n';
  if (!report.pairs.empty()) {
    PrintPairs(report, out);
    out << '\n';
  }
  out << absl::StrFormat("%.0f %% of what can be compared agrees", 100.0 * estimate.inlier_share);
  if (report.pairs.empty() && !estimate.agreeing.empty()) {
    out << ", " << Counted(static_cast<int64_t>(estimate.agreeing.size()), "object");
  }
  out << "; " << DescribeAmbiguity(estimate.ambiguity) << '\n';
  if (!report.image.empty()) out << "wrote " << report.image << '\n';
  if (report.applied) {
    out << report.answer.target.map << " frame " << report.applied->child_frame_id << " set in "
        << report.applied->parent_frame_id << ", revision " << report.applied_revision << '\n';
  }
  out << DescribeSide(report.answer.source) << " over " << DescribeSide(report.answer.target)
      << '\n';
}

}  // namespace hypermap::cli
