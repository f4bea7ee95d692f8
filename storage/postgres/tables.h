// The tables of the newest schema version.
//
// All rows of a map begin with its number. A layer has a number of its own for its whole life, its
// lineage, which no later layer of the same name gets. What changes is kept in versions: a version
// is valid from first_revision on and before end_revision, which is kForever while it is the
// current one. The row of a map is advanced inside each transaction that writes the map (OwnedMap),
// by a statement that also compares the epoch: an owner whose epoch is over can write nothing.
#ifndef HYPERMAP_STORAGE_POSTGRES_TABLES_H_
#define HYPERMAP_STORAGE_POSTGRES_TABLES_H_

namespace hypermap::storage::postgres {

// A script that creates the tables in the schema "hypermap", which must exist.
extern const char kTables[];

// The part of the script that version 1 did not have.
extern const char kPlaceTable[];

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_TABLES_H_
