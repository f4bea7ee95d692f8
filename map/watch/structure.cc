#include "map/watch/structure.h"

#include <memory>
#include <utility>

namespace hypermap {
namespace {

// Applies changes of the structure to a copy, which it makes at the first such change. Most commits
// change content only and need no copy.
class StructureEditor {
 public:
  StructureEditor(const StructurePtr& before, Revision revision)
      : before_(before), revision_(revision) {}

  template <typename ContentChange>
  void operator()(const ContentChange& /*change*/) {}
  void operator()(const LayerCreated& change) {
    Next().layers.insert_or_assign(change.spec.name, LayerStructure{change.spec, {}, revision_});
  }
  void operator()(const LayerDeleted& change) { Next().layers.erase(change.spec.name); }
  void operator()(const TransformSet& change) {
    // Cannot fail: the commit was accepted with this transform.
    Next().frames.Set(change.transform).IgnoreError();
  }
  void operator()(const ExtentGrown& change) {
    if (LayerStructure* layer = Find(change.layer)) layer->extent = change.extent;
  }
  void operator()(const AliasesSet& change) {
    if (LayerStructure* layer = Find(change.layer)) layer->spec.aliases = change.after;
  }

  StructurePtr Finish() && {
    if (!next_) return before_;
    return std::move(next_);
  }

 private:
  MapStructure& Next() {
    if (!next_) {
      next_ = std::make_shared<MapStructure>(*before_);
      next_->revision = revision_;
    }
    return *next_;
  }

  // Returns the layer in the copy, with `revision_` as its version; null if there is no such layer.
  LayerStructure* Find(const std::string& name) {
    const auto layer = Next().layers.find(name);
    if (layer == next_->layers.end()) return nullptr;
    layer->second.version = revision_;
    return &layer->second;
  }

  const StructurePtr& before_;
  const Revision revision_;
  std::shared_ptr<MapStructure> next_;
};

}  // namespace

StructurePtr StructureAfter(const StructurePtr& before, Revision revision,
                            const std::vector<Change>& changes) {
  StructureEditor editor(before, revision);
  for (const Change& change : changes) std::visit(editor, change);
  return std::move(editor).Finish();
}

}  // namespace hypermap
