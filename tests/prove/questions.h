// Questions of the map, asked of a server, of a replica and of the model.
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

// One of the things and the floor.
struct Question {
  QuestionKind kind = QuestionKind::kPoint;
  Point point;        // kPoint, kNearest
  Box area;           // kArea, kValue
  std::string value;  // kValue, kNearest: a label
  int k = 0;          // kNearest
};

// Of each kind in turn.
Question RandomQuestion(int i, Rng& rng);

struct Answer {
  Revision revision = 0;
  // All that was answered, to the last digit.
  std::string text;
  // As the model can say it.
  State state;
  std::vector<double> distances_m;  // of kNearest
};

absl::StatusOr<Answer> Ask(client::Client& client, const Question& question);
absl::StatusOr<Answer> Ask(const client::Replica& replica, const Question& question);

// Whether it is the answer by `state`, which is looked through thing by thing.
bool IsRight(const Answer& answer, const Question& question, const State& state);

// All layers with all that they hold, to the last digit.
absl::StatusOr<std::string> TellAll(client::Client& client);
absl::StatusOr<std::string> TellAll(const client::Replica& replica);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_QUESTIONS_H_
