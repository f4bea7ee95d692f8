// Databases of tests of the store, in the cluster of the test's process.
#ifndef HYPERMAP_STORAGE_POSTGRES_TESTING_DATABASE_H_
#define HYPERMAP_STORAGE_POSTGRES_TESTING_DATABASE_H_

#include <memory>
#include <string>

#include "storage/libpq/connection.h"
#include "storage/map_store.h"
#include "storage/postgres/owned_map.h"

namespace hypermap::storage::postgres {

// All functions fail the test when they fail.

// Creates a database without maps. Returns its connection string.
std::string NewDatabase();

// Opens the store in a database, always as the same server. `readers_target` as in PostgresOptions.
std::unique_ptr<MapStore> OpenStore(const std::string& database,
                                    const std::string& readers_target = "");

std::unique_ptr<Connection> Connect(const std::string& database);

// Adds a map, which a server of that id owns.
OwnedMap::Row AddMap(Connection* connection, const std::string& name, const std::string& owner);

// Runs statements without parameters.
void Execute(const std::string& database, const std::string& sql);

// The number that a query gives; 0 for NULL.
int64_t QueryNumber(const std::string& database, const std::string& sql);

// Ends all sessions with the database, as a restarted server does.
void EndSessions(const std::string& database);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_TESTING_DATABASE_H_
