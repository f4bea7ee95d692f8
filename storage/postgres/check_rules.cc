#include "storage/postgres/check_rules.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "storage/postgres/row_names.h"

namespace hypermap::storage::postgres {
namespace {

struct Rule {
  const char* table;
  const char* problem;
  const char* sql;
};

constexpr Rule kHistoryRules[] = {
    {"hypermap.revisions", "the revision is missing",
     "WITH kept (revision) AS (SELECT greatest($2 - 1, 0) UNION SELECT revision FROM "
     "hypermap.revisions WHERE map = $1 AND revision >= $2 UNION SELECT $3 + 1) "
     "SELECT 'revision ' || (revision + 1) || CASE WHEN later > revision + 2 THEN ' to ' || "
     "(later - 1) ELSE '' END FROM (SELECT revision, lead(revision) OVER (ORDER BY revision) AS "
     "later FROM kept) AS k WHERE later > revision + 1"},
    {"hypermap.revisions", "the revision is newer than the map's",
     "SELECT 'revision ' || revision FROM hypermap.revisions WHERE map = $1 AND revision > $3"},
    {"hypermap.revisions", "the time is before that of the revision before",
     "SELECT 'revision ' || revision FROM (SELECT revision, time_ns, lag(time_ns) OVER (ORDER BY "
     "revision) AS earlier FROM hypermap.revisions WHERE map = $1) AS r WHERE time_ns < earlier"},
    {"hypermap.revisions", "hypermap.changes has another number of changes",
     "SELECT 'revision ' || r.revision FROM hypermap.revisions AS r LEFT JOIN (SELECT revision, "
     "count(*) AS found FROM hypermap.changes WHERE map = $1 GROUP BY revision) AS c "
     "USING (revision) WHERE r.map = $1 AND r.revision > $2 "
     "AND r.num_changes <> coalesce(c.found, 0)"},
    {"hypermap.changes", "there is no such revision",
     "SELECT DISTINCT 'revision ' || revision FROM hypermap.changes AS c WHERE map = $1 "
     "AND revision > $2 AND NOT EXISTS (SELECT 1 FROM hypermap.revisions AS r "
     "WHERE r.map = $1 AND r.revision = c.revision)"},
    {"hypermap.lineages", "the layer ends before it begins, or after the newest revision",
     "SELECT 'lineage ' || lineage FROM hypermap.lineages WHERE map = $1 "
     "AND (first_revision > end_revision OR first_revision > $3 "
     "OR end_revision > $3 AND end_revision < 9223372036854775807)"},
    {"hypermap.lineages", "another layer has the name at the same time",
     "SELECT 'lineage ' || lineage FROM (SELECT lineage, end_revision, lead(first_revision) OVER "
     "(PARTITION BY name ORDER BY first_revision, end_revision) AS later FROM hypermap.lineages "
     "WHERE map = $1) AS l WHERE later < end_revision"},
    {"hypermap.lineages", "hypermap.layer_versions has no version of the layer",
     "SELECT 'lineage ' || lineage FROM hypermap.lineages AS l WHERE map = $1 "
     "AND end_revision > $2 AND NOT EXISTS (SELECT 1 FROM hypermap.layer_versions AS v "
     "WHERE v.map = $1 AND v.lineage = l.lineage)"},
    {"hypermap.layer_versions", "there is no such layer",
     "SELECT 'lineage ' || lineage || ', version ' || first_revision FROM hypermap.layer_versions "
     "AS v WHERE map = $1 AND first_revision > $2 AND NOT EXISTS (SELECT 1 FROM hypermap.lineages "
     "AS l WHERE l.map = $1 AND l.lineage = v.lineage)"},
    {"hypermap.layer_revisions", "there is no such layer",
     "SELECT 'lineage ' || lineage || ', revision ' || revision FROM hypermap.layer_revisions AS v "
     "WHERE map = $1 AND revision > $2 AND NOT EXISTS (SELECT 1 FROM hypermap.lineages AS l "
     "WHERE l.map = $1 AND l.lineage = v.lineage)"},
    {"hypermap.objects", "the object's id was never assigned",
     "SELECT DISTINCT 'lineage ' || lineage || ', object ' || object_id FROM hypermap.objects "
     "WHERE map = $1 AND end_revision > $2 AND (object_id < 1 OR object_id >= "
     "(SELECT next_object_id FROM hypermap.maps WHERE id = $1))"},
    {"hypermap.receipts", "the revision is newer than the map's",
     "SELECT 'request_id ' || request_id FROM hypermap.receipts WHERE map = $1 AND revision > $3"},
};

// The rules of versions of objects and of tiles. $table stands for the table, $place for the
// columns of the object or tile in its layer, $name for an expression with the name of the row v,
// $same for the condition that a change c is of the object or tile, and $puts for the kind of
// change that begins a version.
constexpr Rule kVersionRules[] = {
    {"", "there is no such layer",
     "SELECT $name FROM $table AS v WHERE map = $1 AND end_revision > $2 AND NOT EXISTS "
     "(SELECT 1 FROM hypermap.lineages AS l WHERE l.map = $1 AND l.lineage = v.lineage)"},
    {"", "the version is kept although the layer was deleted",
     "SELECT $name FROM $table AS v JOIN hypermap.lineages AS l USING (map, lineage) "
     "WHERE map = $1 AND v.end_revision > $2 AND v.end_revision > l.end_revision"},
    {"", "the version ends before it begins, or after the newest revision",
     "SELECT $name FROM $table AS v WHERE map = $1 AND (first_revision >= end_revision "
     "OR first_revision > $3 OR end_revision > $3 AND end_revision < 9223372036854775807)"},
    {"", "the next version begins before this one ends",
     "SELECT $name FROM (SELECT *, lead(first_revision) OVER (PARTITION BY lineage, $place "
     "ORDER BY end_revision) AS later FROM $table WHERE map = $1 AND end_revision > $2) AS v "
     "WHERE later < end_revision"},
    {"", "no change has made the version",
     "SELECT $name FROM $table AS v WHERE map = $1 AND first_revision > $2 AND NOT EXISTS "
     "(SELECT 1 FROM hypermap.changes AS c WHERE c.map = $1 AND c.lineage = v.lineage AND $same "
     "AND c.kind = '$puts' AND c.revision BETWEEN v.first_revision AND v.end_revision)"},
    {"", "no change has ended the version",
     "SELECT $name FROM $table AS v WHERE map = $1 AND end_revision > $2 AND end_revision <= $3 "
     "AND NOT EXISTS (SELECT 1 FROM hypermap.changes AS c WHERE c.map = $1 "
     "AND c.lineage = v.lineage AND $same AND c.revision = v.end_revision) "
     "AND NOT EXISTS (SELECT 1 FROM hypermap.lineages AS l WHERE l.map = $1 "
     "AND l.lineage = v.lineage AND l.end_revision = v.end_revision)"},
};

constexpr Rule kEvidenceRules[] = {
    {"hypermap.fusion", "there is no such semantic layer",
     "SELECT 'layer ' || layer FROM hypermap.fusion AS f WHERE map = $1 AND NOT EXISTS "
     "(SELECT 1 FROM hypermap.lineages AS l WHERE l.map = $1 AND l.name = f.layer "
     "AND l.kind = 'semantic' AND l.end_revision > $3)"},
    {"hypermap.operator_facts", "the fact is of no known kind",
     "SELECT $fact FROM hypermap.operator_facts WHERE map = $1 AND kind NOT IN ('pin', 'remove')"},
    {"hypermap.operator_facts", "the fact is out of order",
     "SELECT $fact FROM (SELECT *, lag(number, 1, 0::bigint) OVER (PARTITION BY layer ORDER BY "
     "stamp_ns, robot, sequence, number) AS earlier FROM hypermap.operator_facts WHERE map = $1) "
     "AS f WHERE number <= earlier"},
    {"hypermap.forgotten_sequences", "the log of the layer has no base",
     "SELECT DISTINCT 'layer ' || layer FROM hypermap.forgotten_sequences WHERE map = $1 "
     "AND layer NOT IN (SELECT layer FROM hypermap.fusion_bases WHERE map = $1)"},
    {"hypermap.forgotten_sequences", "the sequences end before they begin",
     "SELECT $range FROM hypermap.forgotten_sequences AS f WHERE map = $1 "
     "AND last_sequence < first_sequence"},
    {"hypermap.forgotten_sequences", "the sequences are also in another row",
     "SELECT $range FROM (SELECT *, lag(last_sequence) OVER (PARTITION BY layer, robot "
     "ORDER BY first_sequence) AS earlier FROM hypermap.forgotten_sequences WHERE map = $1) AS f "
     "WHERE first_sequence <= earlier"},
    {"hypermap.forgotten_sequences", "an observation is forgotten and kept",
     "SELECT $range FROM hypermap.forgotten_sequences AS f WHERE map = $1 AND EXISTS "
     "(SELECT 1 FROM hypermap.observations AS o WHERE o.map = $1 AND o.layer = f.layer "
     "AND o.robot = f.robot AND o.sequence BETWEEN f.first_sequence AND f.last_sequence)"},
    {"hypermap.fusion_tracks", "the object's id was never assigned",
     "SELECT 'layer ' || layer || ', track ' || track FROM hypermap.fusion_tracks WHERE map = $1 "
     "AND (object_id < 0 OR object_id >= (SELECT next_object_id FROM hypermap.maps "
     "WHERE id = $1))"},
};
constexpr const char* kTablesOfFusedLayers[] = {
    "hypermap.observations", "hypermap.operator_facts", "hypermap.fusion_checkpoints",
    "hypermap.fusion_bases", "hypermap.fusion_tracks",
};

void AddVersionRules(const std::string& table,
                     std::vector<std::pair<std::string, std::string>> names,
                     std::vector<CheckRule>* rules) {
  names.emplace_back("$table", table);
  for (const Rule& rule : kVersionRules) {
    rules->push_back({{table, "", rule.problem}, absl::StrReplaceAll(rule.sql, names)});
  }
}

}  // namespace

std::vector<CheckRule> HistoryRules() {
  std::vector<CheckRule> rules;
  for (const Rule& rule : kHistoryRules) {
    rules.push_back({{rule.table, "", rule.problem}, rule.sql});
  }
  AddVersionRules("hypermap.objects",
                  {{"$name", kObjectName},
                   {"$place", "object_id"},
                   {"$same", "c.object_id = v.object_id"},
                   {"$puts", "put"}},
                  &rules);
  AddVersionRules("hypermap.tiles",
                  {{"$name", kTileName},
                   {"$place", "tile_row, tile_col"},
                   {"$same", "c.tile_row = v.tile_row AND c.tile_col = v.tile_col"},
                   {"$puts", "tile"}},
                  &rules);
  return rules;
}

std::vector<CheckRule> EvidenceRules() {
  std::vector<CheckRule> rules;
  for (const Rule& rule : kEvidenceRules) {
    rules.push_back(
        {{rule.table, "", rule.problem},
         absl::StrReplaceAll(rule.sql, {{"$fact", kEntryName}, {"$range", kRangeName}})});
  }
  for (const char* const table : kTablesOfFusedLayers) {
    rules.push_back({{table, "", "the layer is not fused"},
                     absl::StrCat("SELECT DISTINCT 'layer ' || layer FROM ", table,
                                  " WHERE map = $1 AND layer NOT IN "
                                  "(SELECT layer FROM hypermap.fusion WHERE map = $1)")});
  }
  return rules;
}

}  // namespace hypermap::storage::postgres
