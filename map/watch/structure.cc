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
    Update(change.layer, [&](LayerStructure& layer) { layer.extent = change.extent; });
  }
  void operator()(const AliasesSet& change) {
    Update(change.layer, [&](LayerStructure& layer) { CarryOut(change, &layer.spec.aliases); });
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

  // Replaces the layer by what `update` makes of it, with `revision_` as its version. Does nothing
  // if there is no such layer.
  template <typename UpdateFunction>
  void Update(const std::string& name, const UpdateFunction& update) {
    const LayerStructure* const before = Next().FindLayer(name);
    if (before == nullptr) return;
    LayerStructure layer = *before;
    layer.version = revision_;
    update(layer);
    next_->layers.insert_or_assign(name, std::move(layer));
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
