#include "storage/postgres/tables.h"

namespace hypermap::storage::postgres {

const char kTables[] = R"sql(
CREATE TABLE hypermap.servers (
  id text COLLATE "C" PRIMARY KEY,
  address text NOT NULL,
  session bigint NOT NULL,  -- of the process
  lease_until timestamptz NOT NULL,
  draining boolean NOT NULL DEFAULT false  -- gives its maps away
);
CREATE TABLE hypermap.maps (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  name text COLLATE "C" UNIQUE,  -- NULL once deleted, until its rows are removed
  frame_id text NOT NULL,
  created_at_ns bigint NOT NULL,
  request_id text NOT NULL,
  incarnation bigint NOT NULL,
  provisional boolean NOT NULL,
  revision bigint NOT NULL,
  oldest_revision bigint NOT NULL,
  next_object_id bigint NOT NULL,
  next_lineage bigint NOT NULL,
  epoch bigint NOT NULL,
  last_write bigint NOT NULL,
  owner text COLLATE "C",
  unfinished_copy boolean NOT NULL
) WITH (fillfactor = 50);
CREATE TABLE hypermap.deletions (
  request_id text COLLATE "C" PRIMARY KEY,
  map_name text COLLATE "C" NOT NULL
);
CREATE TABLE hypermap.lineages (
  map bigint NOT NULL,
  lineage bigint NOT NULL,
  name text COLLATE "C" NOT NULL,
  kind text NOT NULL,
  frame_id text NOT NULL,
  origin_x double precision,
  origin_y double precision,
  origin_yaw double precision,
  resolution_m double precision,
  first_revision bigint NOT NULL,
  end_revision bigint NOT NULL,
  PRIMARY KEY (map, lineage)
);
CREATE TABLE hypermap.layer_versions (
  map bigint NOT NULL,
  lineage bigint NOT NULL,
  first_revision bigint NOT NULL,
  row_begin bigint,
  row_end bigint,
  col_begin bigint,
  col_end bigint,
  parameters text NOT NULL,
  PRIMARY KEY (map, lineage, first_revision)
);
-- The revisions that changed a layer or its content.
CREATE TABLE hypermap.layer_revisions (
  map bigint NOT NULL,
  lineage bigint NOT NULL,
  revision bigint NOT NULL,
  PRIMARY KEY (map, lineage, revision)
);
CREATE TABLE hypermap.frame_versions (
  map bigint NOT NULL,
  child_frame_id text COLLATE "C" NOT NULL,
  first_revision bigint NOT NULL,
  parent_frame_id text COLLATE "C" NOT NULL,
  x double precision NOT NULL,
  y double precision NOT NULL,
  yaw double precision NOT NULL,
  PRIMARY KEY (map, child_frame_id, first_revision)
);
-- `shape` is the blob of a GeoPackage (map/geometry as WKB after a header with its bounds), and the
-- truth; a column of PostGIS is derived from it where there is PostGIS. Bounds are repeated for the
-- index of the history, which has the revisions besides: a place may have very many versions.
-- classes, tags and attributes are JSON.
CREATE TABLE hypermap.objects (
  map bigint NOT NULL,
  lineage bigint NOT NULL,
  object_id bigint NOT NULL,
  first_revision bigint NOT NULL,
  end_revision bigint NOT NULL,
  bounds box NOT NULL,
  shape bytea NOT NULL,
  label text NOT NULL,
  existence double precision NOT NULL,
  classes text NOT NULL,
  tags text NOT NULL,
  attributes text NOT NULL,
  height_min double precision,
  height_max double precision,
  expires_at_ns bigint,
  PRIMARY KEY (map, lineage, object_id, end_revision)
);
CREATE UNIQUE INDEX objects_current ON hypermap.objects (map, lineage, object_id)
  WHERE end_revision = 9223372036854775807;
-- The sums keep the planner, which knows nothing yet of a new table, from using this index to find
-- an object by its id.
CREATE INDEX objects_bounds ON hypermap.objects
  USING gist ((map + 0), (lineage + 0), bounds, int8range(first_revision, end_revision));
CREATE INDEX objects_ended ON hypermap.objects (map, end_revision)
  WHERE end_revision < 9223372036854775807;
CREATE TABLE hypermap.tiles (
  map bigint NOT NULL,
  lineage bigint NOT NULL,
  tile_row bigint NOT NULL,
  tile_col bigint NOT NULL,
  first_revision bigint NOT NULL,
  end_revision bigint NOT NULL,
  image bytea NOT NULL,
  PRIMARY KEY (map, lineage, tile_row, tile_col, end_revision)
);
CREATE UNIQUE INDEX tiles_current ON hypermap.tiles (map, lineage, tile_row, tile_col)
  WHERE end_revision = 9223372036854775807;
CREATE INDEX tiles_ended ON hypermap.tiles (map, end_revision)
  WHERE end_revision < 9223372036854775807;
CREATE TABLE hypermap.revisions (
  map bigint NOT NULL,
  revision bigint NOT NULL,
  time_ns bigint NOT NULL,
  author text NOT NULL,
  num_changes bigint NOT NULL,
  PRIMARY KEY (map, revision)
);
CREATE TABLE hypermap.changes (
  map bigint NOT NULL,
  revision bigint NOT NULL,
  number bigint NOT NULL,
  kind text NOT NULL,
  lineage bigint,
  object_id bigint,
  tile_row bigint,
  tile_col bigint,
  detail text,
  PRIMARY KEY (map, revision, number)
);
CREATE TABLE hypermap.receipts (
  map bigint NOT NULL,
  request_id text COLLATE "C" NOT NULL,
  revision bigint NOT NULL,
  time_ns bigint NOT NULL,
  object_ids bytea NOT NULL,
  digest bytea NOT NULL,
  PRIMARY KEY (map, request_id)
);
CREATE INDEX receipts_time ON hypermap.receipts (map, time_ns);
CREATE TABLE hypermap.time_marks (
  map bigint NOT NULL,
  number bigint NOT NULL,
  revision bigint NOT NULL,
  commit_time_ns bigint NOT NULL,
  passed_ns bigint NOT NULL,
  lived_ns bigint NOT NULL,
  server_time_ns bigint NOT NULL,
  boot_id text NOT NULL,
  since_boot_ns bigint NOT NULL,
  PRIMARY KEY (map, number)
);

-- The log of evidence of fused layers. A fact or observation is named by stamp, robot and sequence;
-- a fact has a number besides. Bodies and states are zlib streams whose original size stands beside
-- them.
CREATE TABLE hypermap.fusion (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  strategy text NOT NULL,
  parameters text NOT NULL,
  exploration_layer text NOT NULL,
  PRIMARY KEY (map, layer)
);
CREATE TABLE hypermap.observations (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  stamp_ns bigint NOT NULL,
  robot text COLLATE "C" NOT NULL,
  sequence bigint NOT NULL,
  content_hash bigint NOT NULL,
  retracted boolean NOT NULL,
  received_at_ns bigint NOT NULL,
  body_size bigint NOT NULL,
  body bytea NOT NULL,
  PRIMARY KEY (map, layer, robot, sequence)
);
CREATE INDEX observations_order ON hypermap.observations (map, layer, stamp_ns, robot, sequence);
CREATE INDEX observations_of_robot ON hypermap.observations (map, layer, robot, stamp_ns, sequence);
CREATE TABLE hypermap.operator_facts (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  stamp_ns bigint NOT NULL,
  robot text COLLATE "C" NOT NULL,
  sequence bigint NOT NULL,
  number bigint NOT NULL,
  kind text NOT NULL,
  track text NOT NULL,
  body bytea NOT NULL,
  PRIMARY KEY (map, layer, stamp_ns, robot, sequence, number)
);
CREATE TABLE hypermap.fusion_tracks (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  track text COLLATE "C" NOT NULL,
  object_id bigint NOT NULL,
  PRIMARY KEY (map, layer, track)
);
CREATE TABLE hypermap.fusion_checkpoints (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  stamp_ns bigint NOT NULL,
  robot text COLLATE "C" NOT NULL,
  sequence bigint NOT NULL,
  number bigint NOT NULL,
  state_size bigint NOT NULL,
  state bytea NOT NULL,
  stored_at_ns bigint NOT NULL,
  PRIMARY KEY (map, layer, stamp_ns, robot, sequence, number)
);
CREATE TABLE hypermap.fusion_bases (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  stamp_ns bigint NOT NULL,
  robot text COLLATE "C" NOT NULL,
  sequence bigint NOT NULL,
  number bigint NOT NULL,
  num_facts bigint NOT NULL,
  state_size bigint NOT NULL,
  state bytea NOT NULL,
  PRIMARY KEY (map, layer)
);
CREATE TABLE hypermap.forgotten_sequences (
  map bigint NOT NULL,
  layer text COLLATE "C" NOT NULL,
  robot text COLLATE "C" NOT NULL,
  first_sequence bigint NOT NULL,
  last_sequence bigint NOT NULL,
  PRIMARY KEY (map, layer, robot, first_sequence)
);
)sql";

// Where the database was written last (DatabaseGuard).
const char kPlaceTable[] = R"sql(
CREATE TABLE hypermap.place (
  id integer PRIMARY KEY CHECK (id = 1),
  tables text NOT NULL,
  timeline bigint NOT NULL
);
)sql";

}  // namespace hypermap::storage::postgres
