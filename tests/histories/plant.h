// Bugs that a simulation plants on purpose, to show that it finds them.
#ifndef HYPERMAP_TESTS_HISTORIES_PLANT_H_
#define HYPERMAP_TESTS_HISTORIES_PLANT_H_

namespace hypermap::histories {

enum class Plant {
  kNone,
  // Some writes return before they are synced: a crash takes them away.
  kSkipSync,
  // Some commits are reported as written, and so published, before they are written.
  kPublishEarly,
  // Some calls of a replica that resume ask for the changes after the revision that follows the one
  // it has.
  kResumeLate,
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_PLANT_H_
