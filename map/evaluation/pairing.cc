#include "map/evaluation/pairing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "map/matching/assignment.h"

namespace hypermap::evaluation {
namespace {

int64_t InBillionths(double v) { return std::llround(v * 1e9); }

// Returns the indexes of one side in increasing order, mapped to their position in that order.
std::map<int, size_t> PlacesOf(const std::vector<Candidate>& candidates, int Candidate::*which) {
  std::map<int, size_t> places;
  for (const Candidate& c : candidates) places[c.*which];
  size_t next = 0;
  for (auto& [index, place] : places) place = next++;
  return places;
}

// Each left row also has a column of its own, which stands for "no partner" and costs nothing.
std::vector<Candidate> PairOneGroup(const std::vector<Candidate>& candidates) {
  if (candidates.size() == 1) return candidates;
  const auto rows = PlacesOf(candidates, &Candidate::left);
  const auto right = PlacesOf(candidates, &Candidate::right);
  const size_t columns = right.size() + rows.size();
  constexpr size_t kForbidden = static_cast<size_t>(-1);
  std::vector<Cost> costs(rows.size() * columns, Cost{1, 0, 0});
  std::vector<size_t> candidate_at(costs.size(), kForbidden);
  for (size_t row = 0; row < rows.size(); ++row) {
    for (size_t column = right.size(); column < columns; ++column)
      costs[row * columns + column] = {};
  }
  for (size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    const size_t at = rows.at(c.left) * columns + right.at(c.right);
    costs[at] = {-1, -InBillionths(c.gain), InBillionths(c.cost)};
    candidate_at[at] = i;
  }
  std::vector<Candidate> pairs;
  const std::vector<size_t> column_of = CheapestAssignment(rows.size(), columns, costs);
  for (size_t row = 0; row < rows.size(); ++row) {
    const size_t i = candidate_at[row * columns + column_of[row]];
    if (i != kForbidden) pairs.push_back(candidates[i]);
  }
  return pairs;
}

// Disjoint sets of numbers (union-find). The least number of a set identifies it.
class DisjointSets {
 public:
  explicit DisjointSets(size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), size_t{0});
  }
  size_t Find(size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(size_t a, size_t b) {
    a = Find(a);
    b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<size_t> parent_;
};

}  // namespace

// Solves each group of candidates that share indexes separately. The method is cubic, and in a
// large map groups are small.
std::vector<Candidate> BestPairing(const std::vector<Candidate>& candidates) {
  DisjointSets sets(candidates.size());
  std::map<int, size_t> first_with_left, first_with_right;
  for (size_t i = 0; i < candidates.size(); ++i) {
    sets.Join(i, first_with_left.try_emplace(candidates[i].left, i).first->second);
    sets.Join(i, first_with_right.try_emplace(candidates[i].right, i).first->second);
  }
  std::map<size_t, std::vector<Candidate>> groups;
  for (size_t i = 0; i < candidates.size(); ++i) groups[sets.Find(i)].push_back(candidates[i]);
  std::vector<Candidate> pairs;
  for (const auto& [name, group] : groups) {
    const std::vector<Candidate> of_group = PairOneGroup(group);
    pairs.insert(pairs.end(), of_group.begin(), of_group.end());
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Candidate& a, const Candidate& b) { return a.left < b.left; });
  return pairs;
}

}  // namespace hypermap::evaluation
