#include "storage/interchange/semantic_yaml.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <istream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/yaml_document.h"
#include "storage/interchange/yaml_input.h"

namespace hypermap::storage {
namespace {

// Leaves the parser, which knows no other way out of an event.
struct Stop {
  absl::Status status;
};

// Puts the events of the document together to entries. Collections nest: the list (depth 1), an
// entry (2), the list of a key (3); what lies deeper, or under a key that is not known, is skipped.
class EntryBuilder : public YAML::EventHandler {
 public:
  EntryBuilder(YamlInput& input, absl::FunctionRef<absl::Status(const SemanticEntry&)> take)
      : input_(input), take_(take) {}

  void OnDocumentStart(const YAML::Mark& /*mark*/) override {}
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    if (depth_ == 1) Fail(mark, "is not a map of keys");
    if (depth_ == 2) {
      if (key_) {
        key_.reset();
      } else {
        key_.emplace();
      }
    }
    if (depth_ == 3 && (tags_ || confidence_)) {
      Fail(mark, absl::StrCat(*key_, " has an empty entry"));
    }
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    Fail(mark, "uses an alias");
  }

  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& value) override {
    if (depth_ == 0) Fail(mark, "the document is not a list");
    if (depth_ == 1) Fail(mark, "is not a map of keys");
    if (depth_ == 2) return TakeKeyOrValue(mark, value);
    if (depth_ > 3) return;
    if (tags_) tags_->push_back(value);
    if (confidence_) TakeConfidence(mark, value);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/,
                       YAML::anchor_t /*anchor*/, YAML::EmitterStyle::value /*style*/) override {
    if (depth_ == 1) Fail(mark, "is not a map of keys");
    Open(mark, /*is_list=*/true);
  }
  void OnSequenceEnd() override { Close(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {
    if (depth_ == 0) Fail(mark, "the document is not a list");
    if (depth_ == 1) {
      ++number_;
      input_.Release(mark.pos);  // The entries before this one are taken.
    }
    Open(mark, /*is_list=*/false);
  }
  void OnMapEnd() override { Close(); }

 private:
  [[noreturn]] void Fail(const YAML::Mark& mark, absl::string_view what) const {
    throw Stop{absl::InvalidArgumentError(
        absl::StrCat("line ", mark.line + 1, ": ",
                     number_ > 0 ? absl::StrCat("object ", number_, ": ") : "", what))};
  }

  void Open(const YAML::Mark& mark, bool is_list) {
    if (depth_ == 2) {
      if (!key_) Fail(mark, "has a key that is not a word");
      if (*key_ == "name" || *key_ == "shape") Fail(mark, absl::StrCat(*key_, " is not a string"));
      if (*key_ == "tags" || *key_ == "confidence") {
        if (!is_list) Fail(mark, absl::StrCat(*key_, " is not a list"));
        if (*key_ == "tags") tags_.emplace();
        if (*key_ == "confidence") confidence_.emplace();
      }
    }
    if (depth_ == 3 && (tags_ || confidence_)) {
      Fail(mark, absl::StrCat(*key_, " has an entry that is not a word"));
    }
    ++depth_;
  }

  void Close() {
    --depth_;
    if (depth_ == 2) {
      if (tags_) entry_.tags = std::exchange(tags_, std::nullopt);
      if (confidence_) entry_.confidence = std::exchange(confidence_, std::nullopt);
      key_.reset();
    }
    if (depth_ == 1) {
      absl::Status status = CheckCancelled();
      if (status.ok()) status = take_(std::exchange(entry_, {}));
      if (!status.ok()) throw Stop{status};
    }
  }

  void TakeKeyOrValue(const YAML::Mark& mark, const std::string& value) {
    if (!key_) {
      key_ = value;
      return;
    }
    if (*key_ == "tags" || *key_ == "confidence") Fail(mark, absl::StrCat(*key_, " is not a list"));
    if (*key_ == "name") entry_.name = value;
    if (*key_ == "shape") entry_.shape = value;
    key_.reset();
  }

  void TakeConfidence(const YAML::Mark& mark, const std::string& value) {
    const std::optional<double> number = ParseNumber(value);
    if (!number) {
      Fail(mark, absl::StrCat("confidence[", confidence_->size(), "] is not a finite number"));
    }
    confidence_->push_back(*number);
  }

  YamlInput& input_;
  absl::FunctionRef<absl::Status(const SemanticEntry&)> take_;
  int depth_ = 0;
  int64_t number_ = 0;              // of the entry being built
  std::optional<std::string> key_;  // the key whose value comes next
  std::optional<std::vector<std::string>> tags_;
  std::optional<std::vector<double>> confidence_;
  SemanticEntry entry_;
};

// Returns whether yaml-cpp would take the text for UTF-16 or UTF-32. No UTF-8 begins like this.
bool LooksLikeUtf16Or32(absl::string_view text) {
  constexpr absl::string_view kFirstBytes("\x00\xFE\xFF", 3);
  return (!text.empty() && kFirstBytes.find(text[0]) != absl::string_view::npos) ||
         (text.size() > 1 && text[1] == '\0');
}

}  // namespace

absl::Status ReadSemanticYaml(absl::string_view text,
                              absl::FunctionRef<absl::Status(const SemanticEntry&)> take) {
  if (LooksLikeUtf16Or32(text)) return absl::InvalidArgumentError("no YAML in UTF-8");
  YamlInput input(text);
  std::istream stream(&input);
  EntryBuilder builder(input, take);
  absl::Status status;
  try {
    YAML::Parser(stream).HandleNextDocument(builder);
  } catch (const Stop& stop) {
    status = stop.status;
  } catch (const YAML::Exception& e) {
    status = NoYaml(e);
  }
  // A text that ended early may look right or wrong.
  HYPERMAP_RETURN_IF_ERROR(input.status());
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return status;
}

void AppendSemanticEntry(const SemanticEntry& entry, std::string& text) {
  absl::StrAppend(&text, "- name: ", entry.name ? QuoteYaml(*entry.name) : "~",
                  "\n  shape: ", entry.shape.value_or("~"), "\n  tags: ");
  text += entry.tags ? QuoteYamlList(*entry.tags) : "~";
  text += "\n  confidence: ";
  if (entry.confidence) {
    const auto number = [](std::string* out, double value) { out->append(FormatNumber(value)); };
    absl::StrAppend(&text, "[", absl::StrJoin(*entry.confidence, ", ", number), "]");
  } else {
    text += "~";
  }
  text += "\n";
}

}  // namespace hypermap::storage
