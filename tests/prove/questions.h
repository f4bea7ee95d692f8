// Queries of the map for a server, a replica and the model.
#ifndef HYPERMAP_TESTS_PROVE_QUESTIONS_H_
#define HYPERMAP_TESTS_PROVE_QUESTIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/replica.h"
#include "map/geometry/polygon.h"
#include "tests/prove/model.h"
#include "tests/prove/writer.h"

namespace hypermap::prove {

enum class QuestionKind { kPoint, kArea, kValue, kNearest };

// A query of the layers "things" and "floor".
struct Question {
  QuestionKind kind = QuestionKind::kPoint;
  Point point;        // kPoint, kNearest
  Box area;           // kArea, kValue
  std::string value;  // kValue, kNearest: a label
  int k = 0;          // kNearest
};

// Cycles through the kinds with `i`.
Question RandomQuestion(int i, Rng& rng);

struct Answer {
  Revision revision = 0;
  // The whole answer, with all digits.
  std::string text;
  // The answer in the model's types.
  State state;
  std::vector<double> distances_m;  // for kNearest
};

absl::StatusOr<Answer> Ask(client::Client& client, const Question& question);
absl::StatusOr<Answer> Ask(const client::Replica& replica, const Question& question);

// Returns whether it is the right answer in `state`, by a test of each thing.
bool IsRight(const Answer& answer, const Question& question, const State& state);

// All layers with all their content, with all digits.
absl::StatusOr<std::string> TellAll(client::Client& client);
absl::StatusOr<std::string> TellAll(const client::Replica& replica);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_QUESTIONS_H_
