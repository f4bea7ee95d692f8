// An ordered map whose copies share their entries.
#ifndef HYPERMAP_BASE_CONTAINERS_SHARED_MAP_H_
#define HYPERMAP_BASE_CONTAINERS_SHARED_MAP_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <utility>

#include "absl/container/inlined_vector.h"

namespace hypermap {

// A balanced search tree (AVL) of immutable nodes. A copy costs O(1) and shares all nodes; a change
// costs O(log n) and makes only the nodes on the way from the root to its entry anew. Values that
// differ little can thus be kept for each of many revisions.
//
//   SharedMap<std::string, int> ages{{"ann", 41}};
//   const SharedMap<std::string, int> before = ages;
//   ages.insert_or_assign("bob", 7);  // `before` has still one entry.
//
// Names are those of std::map. Entries can't be modified in place, and each change of the map
// invalidates its iterators. A value; copies are safe to use from different threads.
template <typename Key, typename Value>
class SharedMap {
  struct Node;
  using NodePtr = std::shared_ptr<const Node>;

 public:
  using key_type = Key;
  using mapped_type = Value;
  using value_type = std::pair<const Key, Value>;
  using size_type = size_t;
  using difference_type = ptrdiff_t;
  using reference = const value_type&;
  using const_reference = const value_type&;

  // In the order of the keys. Named as in the containers of the standard library.
  class const_iterator {  // NOLINT(readability-identifier-naming)
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = SharedMap::value_type;
    using difference_type = SharedMap::difference_type;
    using reference = const value_type&;
    using pointer = const value_type*;

    const_iterator() = default;

    reference operator*() const { return *path_.back()->entry; }
    pointer operator->() const { return path_.back()->entry.get(); }
    const_iterator& operator++() {
      const Node* const node = path_.back();
      path_.pop_back();
      PushLeftmost(node->right.get());
      return *this;
    }
    const_iterator operator++(int) {
      const_iterator before = *this;
      ++*this;
      return before;
    }

    friend bool operator==(const const_iterator& a, const const_iterator& b) {
      return a.node() == b.node();
    }

   private:
    friend class SharedMap;

    const Node* node() const { return path_.empty() ? nullptr : path_.back(); }
    void PushLeftmost(const Node* node) {
      for (; node != nullptr; node = node->left.get()) path_.push_back(node);
    }

    // The current node, after those of its ancestors whose entries come later. Empty at the end.
    absl::InlinedVector<const Node*, 16> path_;
  };
  using iterator = const_iterator;

  // Bytes of a node without its entry, with the bookkeeping of two allocations.
  static constexpr int64_t kNodeBytes = 104;

  SharedMap() = default;
  SharedMap(std::initializer_list<value_type> entries) {
    for (const value_type& entry : entries) insert_or_assign(entry.first, entry.second);
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  const_iterator begin() const {
    const_iterator first;
    first.PushLeftmost(root_.get());
    return first;
  }
  const_iterator end() const { return const_iterator(); }

  // `K` is a type that can be compared with keys.
  template <typename K>
  const_iterator find(const K& key) const {
    const_iterator found;
    for (const Node* node = root_.get(); node != nullptr;) {
      if (node->entry->first < key) {
        node = node->right.get();
        continue;
      }
      found.path_.push_back(node);
      if (!(key < node->entry->first)) return found;
      node = node->left.get();
    }
    return end();
  }
  template <typename K>
  bool contains(const K& key) const {
    return FindNode(key) != nullptr;
  }

  void insert_or_assign(Key key, Value value) {
    bool is_new = true;
    auto entry = std::make_shared<const value_type>(std::move(key), std::move(value));
    root_ = With(root_, std::move(entry), &is_new);
    if (is_new) ++size_;
  }

  // Adds the entry if there is none for its key. Ignores the hint, which std::inserter passes.
  const_iterator insert(const const_iterator& /*hint*/, const value_type& entry) {
    if (!contains(entry.first)) insert_or_assign(entry.first, entry.second);
    return find(entry.first);
  }

  // Returns the number of entries removed: 0 or 1.
  template <typename K>
  size_t erase(const K& key) {
    if (!contains(key)) return 0;
    root_ = Without(root_, key);
    --size_;
    return 1;
  }

  void clear() { *this = SharedMap(); }

  // Calls `visit(entry, older_entry)` for the entry of each node that this map does not share with
  // `older`; `older_entry` is a pointer to the entry that `older` has for the key, or null. An
  // entry may be shared although its node is not: then `older_entry` points to `entry`. Entries
  // that are not visited are the same in both maps. If this was made from `older` by d changes,
  // this visits O(d log n) nodes, in O(log n) each.
  template <typename Visit>
  void VisitUnshared(const SharedMap& older, const Visit& visit) const {
    VisitUnshared(root_.get(), older, visit);
  }

  friend bool operator==(const SharedMap& a, const SharedMap& b) {
    if (a.root_ == b.root_) return true;
    if (a.size_ != b.size_) return false;
    return std::equal(a.begin(), a.end(), b.begin(),
                      [](const value_type& x, const value_type& y) { return &x == &y || x == y; });
  }

 private:
  using EntryPtr = std::shared_ptr<const value_type>;

  // The heights of both subtrees differ by at most one.
  struct Node {
    EntryPtr entry;
    NodePtr left;
    NodePtr right;
    int height;
  };
  static_assert(sizeof(Node) + 3 * sizeof(void*) + 3 * sizeof(void*) <= kNodeBytes);

  static int Height(const NodePtr& node) { return node ? node->height : 0; }

  static NodePtr Make(EntryPtr entry, NodePtr left, NodePtr right) {
    const int height = 1 + std::max(Height(left), Height(right));
    return std::make_shared<const Node>(
        Node{std::move(entry), std::move(left), std::move(right), height});
  }

  // Makes a balanced node of subtrees whose heights differ by at most two.
  static NodePtr Balance(EntryPtr entry, NodePtr left, NodePtr right) {
    if (Height(left) > Height(right) + 1) {
      const Node& l = *left;
      if (Height(l.left) >= Height(l.right)) {
        return Make(l.entry, l.left, Make(std::move(entry), l.right, std::move(right)));
      }
      const Node& middle = *l.right;
      return Make(middle.entry, Make(l.entry, l.left, middle.left),
                  Make(std::move(entry), middle.right, std::move(right)));
    }
    if (Height(right) > Height(left) + 1) {
      const Node& r = *right;
      if (Height(r.right) >= Height(r.left)) {
        return Make(r.entry, Make(std::move(entry), std::move(left), r.left), r.right);
      }
      const Node& middle = *r.left;
      return Make(middle.entry, Make(std::move(entry), std::move(left), middle.left),
                  Make(r.entry, middle.right, r.right));
    }
    return Make(std::move(entry), std::move(left), std::move(right));
  }

  static NodePtr With(const NodePtr& node, EntryPtr entry, bool* is_new) {
    if (!node) return Make(std::move(entry), nullptr, nullptr);
    if (entry->first < node->entry->first) {
      return Balance(node->entry, With(node->left, std::move(entry), is_new), node->right);
    }
    if (node->entry->first < entry->first) {
      return Balance(node->entry, node->left, With(node->right, std::move(entry), is_new));
    }
    *is_new = false;
    return Make(std::move(entry), node->left, node->right);
  }

  // REQUIRES: the subtree has the key.
  template <typename K>
  static NodePtr Without(const NodePtr& node, const K& key) {
    if (key < node->entry->first) {
      return Balance(node->entry, Without(node->left, key), node->right);
    }
    if (node->entry->first < key) {
      return Balance(node->entry, node->left, Without(node->right, key));
    }
    if (!node->left) return node->right;
    if (!node->right) return node->left;
    EntryPtr next;
    NodePtr right = WithoutFirst(node->right, &next);
    return Balance(std::move(next), node->left, std::move(right));
  }

  static NodePtr WithoutFirst(const NodePtr& node, EntryPtr* first) {
    if (!node->left) {
      *first = node->entry;
      return node->right;
    }
    return Balance(node->entry, WithoutFirst(node->left, first), node->right);
  }

  template <typename K>
  const Node* FindNode(const K& key) const {
    const Node* node = root_.get();
    while (node != nullptr) {
      if (key < node->entry->first) {
        node = node->left.get();
      } else if (node->entry->first < key) {
        node = node->right.get();
      } else {
        break;
      }
    }
    return node;
  }

  template <typename Visit>
  static void VisitUnshared(const Node* node, const SharedMap& older, const Visit& visit) {
    if (node == nullptr) return;
    const Node* const other = older.FindNode(node->entry->first);
    if (other == node) return;  // With all nodes below it.
    VisitUnshared(node->left.get(), older, visit);
    visit(*node->entry, other ? other->entry.get() : nullptr);
    VisitUnshared(node->right.get(), older, visit);
  }

  NodePtr root_;
  size_t size_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_CONTAINERS_SHARED_MAP_H_
