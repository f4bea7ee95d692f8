#include "tests/prove/questions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"

namespace hypermap::prove {
namespace {

const Scope kScope{{kThings, kFloor}, ""};
// Only for distances computed by the model. Answers are compared exactly.
constexpr double kTolerance_m = 1e-9;

// Appends the vertices of a shape.
struct VertexWriter {
  std::string* text;

  void operator()(const Point& p) const { absl::StrAppendFormat(text, " %.17g,%.17g", p.x, p.y); }
  void operator()(const LineString& line) const {
    for (const Point& p : line.vertices()) (*this)(p);
  }
  void operator()(const Polygon& polygon) const {
    for (const Ring& ring : polygon.rings()) {
      for (const Point& p : ring) (*this)(p);
    }
  }
};

std::string TextOf(const SemanticObject& object) {
  std::string text = absl::StrFormat("%d v%d %s %.17g %s", object.id, object.version, object.label,
                                     object.existence, ShapeKindName(object.shape.kind()));
  object.shape.Visit(VertexWriter{&text});
  return text + "\n";
}

std::string TextOf(const CellRun& run) {
  return absl::StrFormat("%d %d-%d %s\n", run.row, run.col_begin, run.col_end,
                         run.value ? absl::StrFormat("%.17g", *run.value) : "unknown");
}

Thing ThingOf(const SemanticObject& object) { return {object.label, object.shape.bounds()}; }

void Take(const SemanticObject& object, Answer& answer) {
  answer.text += TextOf(object);
  answer.state.things.emplace(object.id, ThingOf(object));
}

void Take(const CellRun& run, Answer& answer) {
  answer.text += TextOf(run);
  if (!run.value) return;
  for (int col = run.col_begin; col < run.col_end; ++col) {
    answer.state.cells[{run.row, col}] = *run.value;
  }
}

absl::StatusOr<Answer> Read(const absl::StatusOr<client::PointAnswer>& from,
                            const Question& question) {
  HYPERMAP_RETURN_IF_ERROR(from.status());
  Answer answer;
  answer.revision = from->revision;
  for (const client::LayerContent& layer : from->layers) {
    absl::StrAppend(&answer.text, layer.layer, " ", static_cast<int>(layer.status), "\n");
    for (const SemanticObject& object : layer.objects) Take(object, answer);
    if (!layer.value) continue;
    const CellIndex cell = *FloorGeometry().CellAt(question.point);
    Take(CellRun{cell.row, cell.col, cell.col + 1, layer.value}, answer);
  }
  return answer;
}

// Joins the parts of an answer, because their sizes do not matter.
absl::StatusOr<Answer> Read(client::AnswerReader reader) {
  Answer answer;
  std::string layer;
  while (const std::optional<client::LayerPart> part = reader.Next()) {
    if (part->layer != layer) {
      layer = part->layer;
      absl::StrAppend(&answer.text, layer, " ", static_cast<int>(part->status), "\n");
    }
    for (const SemanticObject& object : part->objects) Take(object, answer);
    for (const CellRun& run : part->runs) Take(run, answer);
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  answer.revision = reader.revision();
  return answer;
}

absl::StatusOr<Answer> Read(const absl::StatusOr<client::NearestAnswer>& from) {
  HYPERMAP_RETURN_IF_ERROR(from.status());
  Answer answer;
  answer.revision = from->revision;
  for (const client::NearestMatch& match : from->matches) {
    absl::StrAppendFormat(&answer.text, "%s %.17g\n", match.layer, match.distance_m);
    answer.distances_m.push_back(match.distance_m);
    if (match.object) Take(*match.object, answer);
  }
  for (const client::LayerRefusal& refusal : from->refusals) {
    absl::StrAppend(&answer.text, refusal.layer, " ", static_cast<int>(refusal.status), "\n");
  }
  return answer;
}

// `map` is the first argument of a client's functions. A replica has no such argument.
template <typename Asked, typename... Map>
absl::StatusOr<Answer> AskAny(Asked& asked, const Question& question, const Map&... map) {
  switch (question.kind) {
    case QuestionKind::kPoint:
      return Read(asked.QueryPoint(map..., question.point, kScope), question);
    case QuestionKind::kArea:
      return Read(asked.QueryArea(map..., Polygon::FromBox(question.area), kScope));
    case QuestionKind::kValue:
      return Read(
          asked.QueryValue(map..., question.value, Polygon::FromBox(question.area), kScope));
    case QuestionKind::kNearest:
      break;
  }
  return Read(asked.QueryNearest(map..., question.point, question.value, question.k, kScope));
}

template <typename Asked, typename... Map>
absl::StatusOr<std::string> TellAny(Asked& asked, const client::LayerList& layers,
                                    const Map&... map) {
  std::string all;
  for (const client::LayerEntry& layer : layers.layers) {
    absl::StrAppend(&all, layer.spec.name, " ", layer.size, " v", layer.version, "\n");
    constexpr double kFar = 1e4;
    absl::StatusOr<Answer> content = Read(asked.QueryArea(
        map..., Polygon::FromBox({{-kFar, -kFar}, {kFar, kFar}}), Scope{{layer.spec.name}, ""}));
    HYPERMAP_RETURN_IF_ERROR(content.status());
    all += content->text;
  }
  return all;
}

double DistanceTo(const Box& box, const Point& p) {
  return std::hypot(std::max({box.min.x - p.x, 0.0, p.x - box.max.x}),
                    std::max({box.min.y - p.y, 0.0, p.y - box.max.y}));
}

State Holding(const State& state, const Selection& selection) {
  State held = state;
  std::erase_if(held.things, [&](const auto& entry) { return !selection.Holds(entry.second); });
  std::erase_if(held.cells, [&](const auto& entry) { return !selection.Holds(entry.first); });
  return held;
}

State At(const State& state, const Point& p) {
  State here = Holding(state, {Box{p, p}, {}});
  here.cells.clear();
  const auto cell = state.cells.find(*FloorGeometry().CellAt(p));
  if (cell != state.cells.end()) here.cells.insert(*cell);
  return here;
}

bool AreNearest(const Answer& answer, const Question& question, const State& state) {
  std::vector<double> distances;
  for (const auto& [id, thing] : state.things) {
    if (thing.label == question.value) distances.push_back(DistanceTo(thing.box, question.point));
  }
  std::sort(distances.begin(), distances.end());
  if (distances.size() > static_cast<size_t>(question.k)) distances.resize(question.k);
  return std::equal(distances.begin(), distances.end(), answer.distances_m.begin(),
                    answer.distances_m.end(),
                    [](double a, double b) { return std::abs(a - b) <= kTolerance_m; });
}

}  // namespace

Question RandomQuestion(int i, Rng& rng) {
  Question question;
  question.kind = static_cast<QuestionKind>(i % 4);
  question.point = {Uniform(rng, 0.0, kSiteSize), Uniform(rng, 0.0, kSiteSize)};
  question.area = RandomArea(rng, 1.0, 15.0);
  question.value = Labels()[rng() % Labels().size()];
  question.k = 1 + static_cast<int>(rng() % 10);
  return question;
}

absl::StatusOr<Answer> Ask(client::Client& client, const Question& question) {
  return AskAny(client, question, std::string(kMap));
}

absl::StatusOr<Answer> Ask(const client::Replica& replica, const Question& question) {
  return AskAny(replica, question);
}

bool IsRight(const Answer& answer, const Question& question, const State& state) {
  switch (question.kind) {
    case QuestionKind::kPoint:
      return answer.state == At(state, question.point);
    case QuestionKind::kArea:
      return answer.state == Holding(state, {question.area, {}});
    case QuestionKind::kValue: {
      State labelled = Holding(state, {question.area, {question.value}});
      labelled.cells.clear();
      return answer.state == labelled;
    }
    case QuestionKind::kNearest:
      break;
  }
  return AreNearest(answer, question, state);
}

absl::StatusOr<std::string> TellAll(client::Client& client) {
  const absl::StatusOr<client::LayerList> layers = client.ListLayers(kMap);
  HYPERMAP_RETURN_IF_ERROR(layers.status());
  return TellAny(client, *layers, std::string(kMap));
}

absl::StatusOr<std::string> TellAll(const client::Replica& replica) {
  return TellAny(replica, replica.ListLayers());
}

}  // namespace hypermap::prove
