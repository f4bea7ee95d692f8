-- A map of schema version 8 as Hypermap wrote it: every program from here on must read it.
-- Loaded by schema_test; see docs/geopackage_format.md for what the columns mean.
PRAGMA application_id = 1196444487;
PRAGMA user_version = 10300;
BEGIN;
CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL PRIMARY KEY,
  organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL,
  definition TEXT NOT NULL,
  description TEXT
);
CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY,
  data_type TEXT NOT NULL,
  identifier TEXT UNIQUE,
  description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE,
  min_y DOUBLE,
  max_x DOUBLE,
  max_y DOUBLE,
  srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
);
CREATE TABLE gpkg_extensions (
  table_name TEXT,
  column_name TEXT,
  extension_name TEXT NOT NULL,
  definition TEXT NOT NULL,
  scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name)
);
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL,
  column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL,
  z TINYINT NOT NULL,
  m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
);
CREATE TABLE gpkg_tile_matrix_set (
  table_name TEXT NOT NULL PRIMARY KEY,
  srs_id INTEGER NOT NULL,
  min_x DOUBLE NOT NULL,
  min_y DOUBLE NOT NULL,
  max_x DOUBLE NOT NULL,
  max_y DOUBLE NOT NULL,
  CONSTRAINT fk_gtms_table_name FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gtms_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
);
CREATE TABLE gpkg_tile_matrix (
  table_name TEXT NOT NULL,
  zoom_level INTEGER NOT NULL,
  matrix_width INTEGER NOT NULL,
  matrix_height INTEGER NOT NULL,
  tile_width INTEGER NOT NULL,
  tile_height INTEGER NOT NULL,
  pixel_x_size DOUBLE NOT NULL,
  pixel_y_size DOUBLE NOT NULL,
  CONSTRAINT pk_ttm PRIMARY KEY (table_name, zoom_level),
  CONSTRAINT fk_tmm_table_name FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name)
);
CREATE TABLE gpkg_2d_gridded_coverage_ancillary (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  tile_matrix_set_name TEXT NOT NULL UNIQUE,
  datatype TEXT NOT NULL DEFAULT 'integer',
  scale REAL NOT NULL DEFAULT 1.0,
  offset REAL NOT NULL DEFAULT 0.0,
  precision REAL DEFAULT 1.0,
  data_null REAL,
  grid_cell_encoding TEXT DEFAULT 'grid-value-is-center',
  uom TEXT,
  field_name TEXT DEFAULT 'Height',
  quantity_definition TEXT DEFAULT 'Height',
  CONSTRAINT fk_g2dgtct_name FOREIGN KEY (tile_matrix_set_name)
    REFERENCES gpkg_tile_matrix_set(table_name)
  CHECK (datatype IN ('integer','float'))
);
CREATE TABLE gpkg_2d_gridded_tile_ancillary (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  tpudt_name TEXT NOT NULL,
  tpudt_id INTEGER NOT NULL,
  scale REAL NOT NULL DEFAULT 1.0,
  offset REAL NOT NULL DEFAULT 0.0,
  min REAL DEFAULT NULL,
  max REAL DEFAULT NULL,
  mean REAL DEFAULT NULL,
  std_dev REAL DEFAULT NULL,
  CONSTRAINT fk_g2dgtat_name FOREIGN KEY (tpudt_name) REFERENCES gpkg_contents(table_name),
  UNIQUE (tpudt_name, tpudt_id)
);
CREATE TABLE hypermap_metadata (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  schema_version INTEGER NOT NULL,
  map_name TEXT NOT NULL,
  frame_id TEXT NOT NULL,
  created_at_ns INTEGER NOT NULL,
  request_id TEXT NOT NULL,
  revision INTEGER NOT NULL,
  next_object_id INTEGER NOT NULL,
  oldest_revision INTEGER NOT NULL DEFAULT 0,
  incarnation INTEGER NOT NULL DEFAULT 0,
  provisional INTEGER NOT NULL DEFAULT 0,
  writing INTEGER NOT NULL DEFAULT 0,
  foreign_writes INTEGER NOT NULL DEFAULT 0,
  schema_cookie INTEGER NOT NULL DEFAULT 0,
  write_ahead INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE hypermap_layers (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL,
  table_name TEXT NOT NULL UNIQUE COLLATE NOCASE,
  frame_id TEXT NOT NULL,
  origin_x DOUBLE,
  origin_y DOUBLE,
  origin_yaw DOUBLE,
  resolution_m DOUBLE,
  row_begin INTEGER,
  row_end INTEGER,
  col_begin INTEGER,
  col_end INTEGER,
  parameters TEXT NOT NULL,
  lineage INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE hypermap_frames (
  id INTEGER PRIMARY KEY,
  child_frame_id TEXT NOT NULL UNIQUE,
  parent_frame_id TEXT NOT NULL,
  x DOUBLE NOT NULL,
  y DOUBLE NOT NULL,
  yaw DOUBLE NOT NULL
);
CREATE TABLE hypermap_revisions (
  revision INTEGER PRIMARY KEY,
  time_ns INTEGER NOT NULL,
  author TEXT NOT NULL,
  num_changes INTEGER NOT NULL
);
CREATE TABLE hypermap_receipts (
  id INTEGER PRIMARY KEY,
  request_id TEXT NOT NULL UNIQUE,
  revision INTEGER NOT NULL,
  time_ns INTEGER NOT NULL,
  object_ids BLOB NOT NULL,
  digest BLOB
);
CREATE TABLE hypermap_fusion (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL UNIQUE,
  strategy TEXT NOT NULL,
  parameters TEXT NOT NULL,
  exploration_layer TEXT NOT NULL
);
CREATE TABLE hypermap_observations (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  content_hash INTEGER NOT NULL,
  retracted INTEGER NOT NULL,
  received_at_ns INTEGER NOT NULL,
  body_size INTEGER NOT NULL,
  body BLOB NOT NULL,
  UNIQUE (layer, robot, sequence)
);
CREATE TABLE hypermap_operator_facts (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  number INTEGER NOT NULL,
  kind TEXT NOT NULL,
  track TEXT NOT NULL,
  body BLOB NOT NULL,
  UNIQUE (layer, stamp_ns, robot, sequence, number)
);
CREATE TABLE hypermap_fusion_tracks (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  track TEXT NOT NULL,
  object_id INTEGER NOT NULL,
  UNIQUE (layer, track)
);
CREATE TABLE hypermap_fusion_checkpoints (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  number INTEGER NOT NULL,
  state_size INTEGER NOT NULL,
  state BLOB NOT NULL,
  stored_at_ns INTEGER NOT NULL DEFAULT 0,
  UNIQUE (layer, stamp_ns, robot, sequence, number)
);
CREATE TABLE hypermap_fusion_bases (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL UNIQUE,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  number INTEGER NOT NULL,
  num_facts INTEGER NOT NULL,
  state_size INTEGER NOT NULL,
  state BLOB NOT NULL
);
CREATE TABLE hypermap_forgotten_sequences (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  robot TEXT NOT NULL,
  first_sequence INTEGER NOT NULL,
  last_sequence INTEGER NOT NULL,
  UNIQUE (layer, robot, first_sequence)
);
CREATE TABLE hypermap_lineages (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  name TEXT NOT NULL,
  kind TEXT NOT NULL,
  table_name TEXT NOT NULL,
  frame_id TEXT NOT NULL,
  origin_x DOUBLE,
  origin_y DOUBLE,
  origin_yaw DOUBLE,
  resolution_m DOUBLE,
  first_revision INTEGER NOT NULL,
  end_revision INTEGER
);
CREATE TABLE hypermap_layer_history (
  lineage INTEGER NOT NULL,
  first_revision INTEGER NOT NULL,
  row_begin INTEGER,
  row_end INTEGER,
  col_begin INTEGER,
  col_end INTEGER,
  parameters TEXT NOT NULL,
  PRIMARY KEY (lineage, first_revision)
) WITHOUT ROWID;
CREATE TABLE hypermap_layer_revisions (
  lineage INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  PRIMARY KEY (lineage, revision)
) WITHOUT ROWID;
CREATE TABLE hypermap_frame_history (
  child_frame_id TEXT NOT NULL,
  first_revision INTEGER NOT NULL,
  parent_frame_id TEXT NOT NULL,
  x DOUBLE NOT NULL,
  y DOUBLE NOT NULL,
  yaw DOUBLE NOT NULL,
  PRIMARY KEY (child_frame_id, first_revision)
) WITHOUT ROWID;
CREATE TABLE hypermap_object_history (
  id INTEGER PRIMARY KEY,
  lineage INTEGER NOT NULL,
  object_id INTEGER NOT NULL,
  first_revision INTEGER NOT NULL,
  end_revision INTEGER NOT NULL,
  geom BLOB NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL,
  classes TEXT NOT NULL,
  tags TEXT NOT NULL,
  attributes TEXT NOT NULL,
  height_min DOUBLE,
  height_max DOUBLE,
  expires_at_ns INTEGER,
  UNIQUE (lineage, object_id, end_revision)
);
CREATE VIRTUAL TABLE hypermap_object_boxes USING rtree_i32(
  id, min_x, max_x, min_y, max_y, first_revision, last_revision, min_lineage, max_lineage);
CREATE TABLE hypermap_tile_history (
  id INTEGER PRIMARY KEY,
  lineage INTEGER NOT NULL,
  tile_column INTEGER NOT NULL,
  tile_row INTEGER NOT NULL,
  end_revision INTEGER NOT NULL,
  tile_data BLOB,
  UNIQUE (lineage, tile_column, tile_row, end_revision)
);
CREATE TABLE hypermap_changes (
  revision INTEGER NOT NULL,
  number INTEGER NOT NULL,
  kind TEXT NOT NULL,
  lineage INTEGER,
  object_id INTEGER,
  tile_column INTEGER,
  tile_row INTEGER,
  detail TEXT,
  PRIMARY KEY (revision, number)
) WITHOUT ROWID;
CREATE TABLE "objects" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom GEOMETRY NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL DEFAULT 1.0,
  classes TEXT NOT NULL DEFAULT '{}',
  tags TEXT NOT NULL DEFAULT '[]',
  attributes TEXT NOT NULL DEFAULT '{}',
  height_min DOUBLE,
  height_max DOUBLE,
  version INTEGER NOT NULL DEFAULT 0,
  expires_at_ns INTEGER
);
CREATE TABLE hypermap_time_marks (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL,
  commit_time_ns INTEGER NOT NULL,
  passed_ns INTEGER NOT NULL,
  lived_ns INTEGER NOT NULL,
  server_time_ns INTEGER NOT NULL,
  boot_id TEXT NOT NULL,
  since_boot_ns INTEGER NOT NULL
);
CREATE VIRTUAL TABLE "rtree_objects_geom" USING rtree(id, minx, maxx, miny, maxy);
CREATE TABLE "occupancy" (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  zoom_level INTEGER NOT NULL,
  tile_column INTEGER NOT NULL,
  tile_row INTEGER NOT NULL,
  tile_data BLOB NOT NULL,
  UNIQUE (zoom_level, tile_column, tile_row)
);
CREATE TABLE "seen" (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  zoom_level INTEGER NOT NULL,
  tile_column INTEGER NOT NULL,
  tile_row INTEGER NOT NULL,
  tile_data BLOB NOT NULL,
  UNIQUE (zoom_level, tile_column, tile_row)
);
CREATE TABLE "wifi" (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  zoom_level INTEGER NOT NULL,
  tile_column INTEGER NOT NULL,
  tile_row INTEGER NOT NULL,
  tile_data BLOB NOT NULL,
  UNIQUE (zoom_level, tile_column, tile_row)
);
CREATE TABLE "lanes" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom LINESTRING NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL DEFAULT 1.0,
  classes TEXT NOT NULL DEFAULT '{}',
  tags TEXT NOT NULL DEFAULT '[]',
  attributes TEXT NOT NULL DEFAULT '{}',
  height_min DOUBLE,
  height_max DOUBLE,
  version INTEGER NOT NULL DEFAULT 0,
  expires_at_ns INTEGER
);
CREATE VIRTUAL TABLE "rtree_lanes_geom" USING rtree(id, minx, maxx, miny, maxy);
CREATE TABLE "docks" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom POINT NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL DEFAULT 1.0,
  classes TEXT NOT NULL DEFAULT '{}',
  tags TEXT NOT NULL DEFAULT '[]',
  attributes TEXT NOT NULL DEFAULT '{}',
  height_min DOUBLE,
  height_max DOUBLE,
  version INTEGER NOT NULL DEFAULT 0,
  expires_at_ns INTEGER
);
CREATE VIRTUAL TABLE "rtree_docks_geom" USING rtree(id, minx, maxx, miny, maxy);
CREATE TABLE "doors" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom GEOMETRY NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL DEFAULT 1.0,
  classes TEXT NOT NULL DEFAULT '{}',
  tags TEXT NOT NULL DEFAULT '[]',
  attributes TEXT NOT NULL DEFAULT '{}',
  height_min DOUBLE,
  height_max DOUBLE,
  version INTEGER NOT NULL DEFAULT 0,
  expires_at_ns INTEGER
);
CREATE VIRTUAL TABLE "rtree_doors_geom" USING rtree(id, minx, maxx, miny, maxy);
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined', 'undefined Cartesian coordinate reference system');
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', 'undefined geographic coordinate reference system');
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('WGS 84 geodetic', 4326, 'EPSG', 4326, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AXIS["Latitude",NORTH],AXIS["Longitude",EAST],AUTHORITY["EPSG","4326"]]', 'longitude/latitude coordinates in decimal degrees on the WGS 84 spheroid');
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('WGS 84 3D', 4979, 'EPSG', 4979, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AXIS["Latitude",NORTH],AXIS["Longitude",EAST],AXIS["Ellipsoidal height",UP],AUTHORITY["EPSG","4979"]]', 'longitude/latitude/height coordinates on the WGS 84 spheroid');
INSERT INTO "gpkg_contents" VALUES ('hypermap_layers', 'attributes', 'layers of the map', 'kind, frame and origin of each layer', '2023-11-14T22:13:23.000Z', NULL, NULL, NULL, NULL, NULL);
INSERT INTO "gpkg_contents" VALUES ('objects', 'features', 'objects', 'semantic layer, metres in frame map', '2023-11-14T22:13:24.000Z', -1.5, 0.0, 4.0, 4.0, -1);
INSERT INTO "gpkg_contents" VALUES ('occupancy', '2d-gridded-coverage', 'occupancy', 'occupancy layer, metres in frame map', '2023-11-14T22:13:21.000Z', -15.3, -12.25, -15.15, -12.1, -1);
INSERT INTO "gpkg_contents" VALUES ('seen', '2d-gridded-coverage', 'seen', 'exploration layer, metres in frame robot/base', '2023-11-14T22:13:20.000Z', 1.0, 2.0, 1.75, 2.25, -1);
INSERT INTO "gpkg_contents" VALUES ('wifi', '2d-gridded-coverage', 'wifi', 'scalar layer, metres in frame robot/base', '2023-11-14T22:13:20.000Z', 0.5, 2.0, 1.25, 2.25, -1);
INSERT INTO "gpkg_contents" VALUES ('lanes', 'features', 'lanes', 'semantic layer, metres in frame map', '2023-11-14T22:13:23.000Z', 0.0, -2.5, 8.0, 1.0, -1);
INSERT INTO "gpkg_contents" VALUES ('docks', 'features', 'docks', 'semantic layer, metres in frame map', '2023-11-14T22:13:24.000Z', -0.0625, 1.5, 2.5, 1000000.0, -1);
INSERT INTO "gpkg_contents" VALUES ('doors', 'features', 'doors', 'semantic layer, metres in frame map', '2023-11-14T22:13:23.000Z', NULL, NULL, NULL, NULL, -1);
INSERT INTO "gpkg_extensions" VALUES ('gpkg_2d_gridded_coverage_ancillary', NULL, 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('gpkg_2d_gridded_tile_ancillary', NULL, 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_metadata', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_layers', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_frames', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_revisions', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_receipts', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_fusion', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_observations', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_operator_facts', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_fusion_tracks', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_fusion_checkpoints', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_fusion_bases', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_forgotten_sequences', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_lineages', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_layer_history', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_layer_revisions', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_frame_history', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_object_history', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_object_boxes', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_object_boxes_rowid', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_object_boxes_node', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_object_boxes_parent', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_tile_history', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_changes', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('hypermap_time_marks', NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('objects', 'geom', 'gpkg_rtree_index', 'http://www.geopackage.org/spec130/#extension_rtree', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('occupancy', 'tile_data', 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('seen', 'tile_data', 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('wifi', 'tile_data', 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('lanes', 'geom', 'gpkg_rtree_index', 'http://www.geopackage.org/spec130/#extension_rtree', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('docks', 'geom', 'gpkg_rtree_index', 'http://www.geopackage.org/spec130/#extension_rtree', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('doors', 'geom', 'gpkg_rtree_index', 'http://www.geopackage.org/spec130/#extension_rtree', 'write-only');
INSERT INTO "gpkg_geometry_columns" VALUES ('objects', 'geom', 'GEOMETRY', -1, 0, 0);
INSERT INTO "gpkg_geometry_columns" VALUES ('lanes', 'geom', 'LINESTRING', -1, 0, 0);
INSERT INTO "gpkg_geometry_columns" VALUES ('docks', 'geom', 'POINT', -1, 0, 0);
INSERT INTO "gpkg_geometry_columns" VALUES ('doors', 'geom', 'GEOMETRY', -1, 0, 0);
INSERT INTO "gpkg_tile_matrix_set" VALUES ('occupancy', -1, -209730.6, -209727.40000000002, 209699.80000000002, 209703.0);
INSERT INTO "gpkg_tile_matrix_set" VALUES ('seen', -1, -1048575.0, -1048574.0, 1048577.0, 1048578.0);
INSERT INTO "gpkg_tile_matrix_set" VALUES ('wifi', -1, -1048575.0, -1048574.0, 1048577.0, 1048578.0);
INSERT INTO "gpkg_tile_matrix" VALUES ('occupancy', 0, 65536, 65536, 128, 128, 0.05, 0.05);
INSERT INTO "gpkg_tile_matrix" VALUES ('seen', 0, 65536, 65536, 128, 128, 0.25, 0.25);
INSERT INTO "gpkg_tile_matrix" VALUES ('wifi', 0, 65536, 65536, 128, 128, 0.25, 0.25);
INSERT INTO "gpkg_2d_gridded_coverage_ancillary" VALUES (1, 'occupancy', 'integer', 0.0001, 0.0, 0.0001, 65535.0, 'grid-value-is-area', NULL, 'occupancy', 'probability of occupation');
INSERT INTO "gpkg_2d_gridded_coverage_ancillary" VALUES (2, 'seen', 'integer', 1.0, 0.0, 1.0, 65535.0, 'grid-value-is-area', NULL, 'exploration', 'explored');
INSERT INTO "gpkg_2d_gridded_coverage_ancillary" VALUES (3, 'wifi', 'float', 1.0, 0.0, NULL, -3.4028234663852886e+38, 'grid-value-is-area', 'dBm', 'scalar', 'measured value');
INSERT INTO "gpkg_2d_gridded_tile_ancillary" VALUES (1, 'occupancy', 1, 1.0, 0.0, NULL, NULL, NULL, NULL);
INSERT INTO "gpkg_2d_gridded_tile_ancillary" VALUES (2, 'occupancy', 2, 1.0, 0.0, NULL, NULL, NULL, NULL);
INSERT INTO "gpkg_2d_gridded_tile_ancillary" VALUES (3, 'seen', 1, 1.0, 0.0, NULL, NULL, NULL, NULL);
INSERT INTO "gpkg_2d_gridded_tile_ancillary" VALUES (4, 'wifi', 1, 1.0, 0.0, NULL, NULL, NULL, NULL);
INSERT INTO "gpkg_2d_gridded_tile_ancillary" VALUES (5, 'wifi', 2, 1.0, 0.0, NULL, NULL, NULL, NULL);
INSERT INTO "hypermap_metadata" VALUES (1, 8, 'golden', 'map', 1700000000123456789, 'create golden', 5, 9, 0, -6148914691236517206, 0, 0, 0, 0, 0);
INSERT INTO "hypermap_time_marks" VALUES (1, 0, 1700000000123456789, 1700000000123456789, 1700000000123456789, 1700000000123456789, '0d24e7f6-0a5c-4a3e-9a53-5e1b1a1f7c11', 3600000000000);
INSERT INTO "hypermap_time_marks" VALUES (2, 5, 1700003600000000000, 1700000010000000000, 1700003600000000000, 1700003600000000001, '7f9f6c0e-58a4-4f0f-8f0e-2f8a7a4a9d52', 60000000000);
INSERT INTO "hypermap_layers" VALUES (1, 'objects', 'semantic', 'objects', 'map', NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, '{"aliases":{"becher":["cup","mug"]},"free_below":0.196,"occupied_above":0.65,"unit":""}', 1);
INSERT INTO "hypermap_layers" VALUES (2, 'occupancy', 'occupancy', 'occupancy', 'map', -15.4, -12.2, 0.0, 0.05, -1, 2, 2, 5, '{"free_below":0.25,"occupied_above":0.75,"unit":""}', 2);
INSERT INTO "hypermap_layers" VALUES (3, 'seen', 'exploration', 'seen', 'robot/base', 1.0, 2.0, 1.5, 0.25, 0, 1, 0, 3, '{"free_below":0.196,"occupied_above":0.65,"unit":""}', 3);
INSERT INTO "hypermap_layers" VALUES (4, 'wifi', 'scalar', 'wifi', 'robot/base', 1.0, 2.0, 1.5, 0.25, 0, 1, -2, 1, '{"free_below":0.196,"occupied_above":0.65,"unit":"dBm"}', 4);
INSERT INTO "hypermap_layers" VALUES (5, 'lanes', 'semantic', 'lanes', 'map', NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["line_string"],"unit":""}', 6);
INSERT INTO "hypermap_layers" VALUES (6, 'docks', 'semantic', 'docks', 'map', NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["point"],"unit":""}', 7);
INSERT INTO "hypermap_layers" VALUES (7, 'doors', 'semantic', 'doors', 'map', NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["line_string","point"],"unit":""}', 8);
INSERT INTO "hypermap_frames" VALUES (1, 'robot/base', 'map', 3.0, 5.0, 0.5);
INSERT INTO "hypermap_revisions" VALUES (1, 1700000000000000000, 'tester', 15);
INSERT INTO "hypermap_revisions" VALUES (2, 1700000001000000000, 'tester', 7);
INSERT INTO "hypermap_revisions" VALUES (3, 1700000002000000000, 'tester', 1);
INSERT INTO "hypermap_revisions" VALUES (4, 1700000003000000000, 'tester', 8);
INSERT INTO "hypermap_revisions" VALUES (5, 1700000004000000000, 'tester', 3);
INSERT INTO "hypermap_receipts" VALUES (1, 'put', 1, 1700000000000000000, X'00020203000000000000', X'000102030405060708090A0B0C0D0E0F101112131415161718191A1B1C1D1E1F');
INSERT INTO "hypermap_fusion" VALUES (1, 'objects', 'evidence', '{}', 'seen');
INSERT INTO "hypermap_observations" VALUES (1, 'objects', 1700000002123456789, 'cart', 0, -5, 0, 1700000002123456794, 10, X'78014BCB2C2A2E51284E4DCD030015F703F4');
INSERT INTO "hypermap_observations" VALUES (2, 'objects', 1700000003123456789, 'cart', 1, 7, 1, 1700000003123456794, 10, X'78012B49CC4ECD53484A4CCE0600152603C5');
INSERT INTO "hypermap_observations" VALUES (3, 'objects', 1700000004123456789, 'lift', 0, 1099511627776, 0, 1700000004123456794, 100, X'7801CB492C2E51C8A12D010041992491');
INSERT INTO "hypermap_operator_facts" VALUES (1, 'objects', 1700000002123456789, 'cart', 0, 1, 'pin', 'cart/0/1', X'6120637570');
INSERT INTO "hypermap_fusion_tracks" VALUES (1, 'objects', 'cart/0/0', 1);
INSERT INTO "hypermap_fusion_tracks" VALUES (2, 'objects', 'cart/0/1', 2);
INSERT INTO "hypermap_fusion_checkpoints" VALUES (1, 'objects', 1700000002123456789, 'cart', 0, 1, 20, X'78012B2E492C4955484C2B492D5228C94855484B4C2E01004FA40773', 1700000005000000000);
INSERT INTO "hypermap_fusion_bases" VALUES (1, 'objects', 1700000001123456789, 'lorry', 9, 0, 0, 26, X'78012B2E492C4955C84F5328CF482C51C82C5648CB2F4ACF2F2949CD030082BC09DF');
INSERT INTO "hypermap_forgotten_sequences" VALUES (1, 'objects', 'lorry', 2, 9);
INSERT INTO "hypermap_lineages" VALUES (1, 'objects', 'semantic', 'objects', 'map', NULL, NULL, NULL, NULL, 1, NULL);
INSERT INTO "hypermap_lineages" VALUES (2, 'occupancy', 'occupancy', 'occupancy', 'map', -15.4, -12.2, 0.0, 0.05, 1, NULL);
INSERT INTO "hypermap_lineages" VALUES (3, 'seen', 'exploration', 'seen', 'robot/base', 1.0, 2.0, 1.5, 0.25, 1, NULL);
INSERT INTO "hypermap_lineages" VALUES (4, 'wifi', 'scalar', 'wifi', 'robot/base', 1.0, 2.0, 1.5, 0.25, 1, NULL);
INSERT INTO "hypermap_lineages" VALUES (5, 'gone', 'semantic', 'gone', 'map', NULL, NULL, NULL, NULL, 2, 3);
INSERT INTO "hypermap_lineages" VALUES (6, 'lanes', 'semantic', 'lanes', 'map', NULL, NULL, NULL, NULL, 4, NULL);
INSERT INTO "hypermap_lineages" VALUES (7, 'docks', 'semantic', 'docks', 'map', NULL, NULL, NULL, NULL, 4, NULL);
INSERT INTO "hypermap_lineages" VALUES (8, 'doors', 'semantic', 'doors', 'map', NULL, NULL, NULL, NULL, 4, NULL);
INSERT INTO "hypermap_layer_history" VALUES (1, 1, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (1, 2, NULL, NULL, NULL, NULL, '{"aliases":{"becher":["cup","mug"]},"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (2, 1, -1, 1, 2, 5, '{"free_below":0.25,"occupied_above":0.75,"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (2, 2, -1, 2, 2, 5, '{"free_below":0.25,"occupied_above":0.75,"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (3, 1, 0, 1, 0, 3, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (4, 1, 0, 1, -2, 1, '{"free_below":0.196,"occupied_above":0.65,"unit":"dBm"}');
INSERT INTO "hypermap_layer_history" VALUES (5, 2, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (6, 4, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["line_string"],"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (7, 4, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["point"],"unit":""}');
INSERT INTO "hypermap_layer_history" VALUES (8, 4, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["line_string","point"],"unit":""}');
INSERT INTO "hypermap_layer_revisions" VALUES (1, 1);
INSERT INTO "hypermap_layer_revisions" VALUES (1, 2);
INSERT INTO "hypermap_layer_revisions" VALUES (1, 4);
INSERT INTO "hypermap_layer_revisions" VALUES (1, 5);
INSERT INTO "hypermap_layer_revisions" VALUES (2, 1);
INSERT INTO "hypermap_layer_revisions" VALUES (2, 2);
INSERT INTO "hypermap_layer_revisions" VALUES (3, 1);
INSERT INTO "hypermap_layer_revisions" VALUES (4, 1);
INSERT INTO "hypermap_layer_revisions" VALUES (5, 2);
INSERT INTO "hypermap_layer_revisions" VALUES (5, 3);
INSERT INTO "hypermap_layer_revisions" VALUES (6, 4);
INSERT INTO "hypermap_layer_revisions" VALUES (7, 4);
INSERT INTO "hypermap_layer_revisions" VALUES (7, 5);
INSERT INTO "hypermap_layer_revisions" VALUES (8, 4);
INSERT INTO "hypermap_frame_history" VALUES ('robot/base', 1, 'map', 3.0, 4.0, -0.5);
INSERT INTO "hypermap_frame_history" VALUES ('robot/base', 2, 'map', 3.0, 5.0, 0.5);
INSERT INTO "hypermap_object_history" VALUES (1, 1, 2, 1, 2, X'47500003FFFFFFFF000000000000F8BF000000000000F0BF0000000000000040000000000000024001030000000100000004000000000000000000F8BF0000000000000040000000000000F0BF0000000000000040000000000000F0BF0000000000000240000000000000F8BF0000000000000040', 'cup', 1.0, '{}', '[]', '{}', NULL, NULL, NULL);
INSERT INTO "hypermap_object_history" VALUES (2, 5, 3, 2, 3, X'47500003FFFFFFFF0000000000000000000000000000F03F0000000000000000000000000000F03F0103000000010000000500000000000000000000000000000000000000000000000000F03F0000000000000000000000000000F03F000000000000F03F0000000000000000000000000000F03F00000000000000000000000000000000', 'box', 1.0, '{}', '[]', '{}', NULL, NULL, NULL);
INSERT INTO "hypermap_object_history" VALUES (3, 7, 5, 4, 5, X'47500001FFFFFFFF01010000000000000000000440000000000000F03F', 'dock', 1.0, '{}', '[]', '{}', NULL, NULL, NULL);
INSERT INTO "hypermap_object_history" VALUES (4, 1, 7, 4, 5, X'47500003FFFFFFFF000000000000F03F0000000000000040000000000000F03F000000000000F03F010200000002000000000000000000F03F000000000000F03F0000000000000040000000000000F03F', 'sill', 1.0, '{}', '[]', '{}', NULL, NULL, NULL);
INSERT INTO "hypermap_object_history" VALUES (5, 1, 8, 4, 5, X'47500001FFFFFFFF010100000000000000000008400000000000000C40', 'socket', 1.0, '{}', '[]', '{}', NULL, NULL, NULL);
INSERT INTO "hypermap_object_boxes" VALUES (1, -1500, -1000, 2000, 2250, 1, 1, 1, 2);
INSERT INTO "hypermap_object_boxes" VALUES (2, 0, 1000, 0, 1000, 2, 2, 5, 6);
INSERT INTO "hypermap_object_boxes" VALUES (3, 2500, 2500, 1000, 1000, 4, 4, 7, 8);
INSERT INTO "hypermap_object_boxes" VALUES (4, 1000, 2000, 1000, 1000, 4, 4, 1, 2);
INSERT INTO "hypermap_object_boxes" VALUES (5, 3000, 3000, 3500, 3500, 4, 4, 1, 2);
INSERT INTO "hypermap_tile_history" VALUES (1, 2, 32768, 32768, 1, NULL);
INSERT INTO "hypermap_tile_history" VALUES (2, 2, 32768, 32767, 1, NULL);
INSERT INTO "hypermap_tile_history" VALUES (3, 3, 32768, 32767, 1, NULL);
INSERT INTO "hypermap_tile_history" VALUES (4, 4, 32767, 32767, 1, NULL);
INSERT INTO "hypermap_tile_history" VALUES (5, 4, 32768, 32767, 1, NULL);
INSERT INTO "hypermap_tile_history" VALUES (6, 2, 32768, 32767, 2, X'89504E470D0A1A0A0000000D4948445200000080000000801000000000B6C5E254000000F849444154785EEDD50109C0301004C1F01007355D7D1594406DEC44C2B1939F137FB3E2CF00F100960214105F008178003E410410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BEC04FE079F757DDE102AA670185EC9CF1640000000049454E44AE426082');
INSERT INTO "hypermap_changes" VALUES (1, 0, 'layer_created', 1, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_changes" VALUES (1, 1, 'layer_created', 2, NULL, NULL, NULL, '{"free_below":0.25,"occupied_above":0.75,"unit":""}');
INSERT INTO "hypermap_changes" VALUES (1, 2, 'layer_created', 3, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_changes" VALUES (1, 3, 'layer_created', 4, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":"dBm"}');
INSERT INTO "hypermap_changes" VALUES (1, 4, 'transform', NULL, NULL, NULL, NULL, '{"child":"robot/base","parent":"map","x":3.0,"y":4.0,"yaw":-0.5}');
INSERT INTO "hypermap_changes" VALUES (1, 5, 'put', 1, 1, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (1, 6, 'put', 1, 2, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (1, 7, 'extent', 2, NULL, NULL, NULL, '[-1,1,2,5]');
INSERT INTO "hypermap_changes" VALUES (1, 8, 'tile', 2, NULL, 32768, 32768, NULL);
INSERT INTO "hypermap_changes" VALUES (1, 9, 'tile', 2, NULL, 32768, 32767, NULL);
INSERT INTO "hypermap_changes" VALUES (1, 10, 'extent', 3, NULL, NULL, NULL, '[0,1,0,3]');
INSERT INTO "hypermap_changes" VALUES (1, 11, 'tile', 3, NULL, 32768, 32767, NULL);
INSERT INTO "hypermap_changes" VALUES (1, 12, 'extent', 4, NULL, NULL, NULL, '[0,1,-2,1]');
INSERT INTO "hypermap_changes" VALUES (1, 13, 'tile', 4, NULL, 32767, 32767, NULL);
INSERT INTO "hypermap_changes" VALUES (1, 14, 'tile', 4, NULL, 32768, 32767, NULL);
INSERT INTO "hypermap_changes" VALUES (2, 0, 'layer_created', 5, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_changes" VALUES (2, 1, 'aliases', 1, NULL, NULL, NULL, '{"after":{"becher":["cup","mug"]},"before":{}}');
INSERT INTO "hypermap_changes" VALUES (2, 2, 'transform', NULL, NULL, NULL, NULL, '{"child":"robot/base","parent":"map","x":3.0,"y":5.0,"yaw":0.5}');
INSERT INTO "hypermap_changes" VALUES (2, 3, 'put', 5, 3, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (2, 4, 'put', 1, 2, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (2, 5, 'extent', 2, NULL, NULL, NULL, '[-1,2,2,5]');
INSERT INTO "hypermap_changes" VALUES (2, 6, 'tile', 2, NULL, 32768, 32767, NULL);
INSERT INTO "hypermap_changes" VALUES (3, 0, 'layer_deleted', 5, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_changes" VALUES (4, 0, 'layer_created', 6, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["line_string"],"unit":""}');
INSERT INTO "hypermap_changes" VALUES (4, 1, 'layer_created', 7, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["point"],"unit":""}');
INSERT INTO "hypermap_changes" VALUES (4, 2, 'layer_created', 8, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"shape_kinds":["line_string","point"],"unit":""}');
INSERT INTO "hypermap_changes" VALUES (4, 3, 'put', 7, 5, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (4, 4, 'put', 7, 6, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (4, 5, 'put', 6, 4, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (4, 6, 'put', 1, 7, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (4, 7, 'put', 1, 8, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (5, 0, 'put', 7, 5, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (5, 1, 'remove', 1, 7, NULL, NULL, NULL);
INSERT INTO "hypermap_changes" VALUES (5, 2, 'put', 1, 8, NULL, NULL, NULL);
INSERT INTO "objects" VALUES (1, X'47500003FFFFFFFF000000000000000000000000000010400000000000000000000000000000104001030000000200000005000000000000000000000000000000000000000000000000001040000000000000000000000000000010400000000000001040000000000000000000000000000010400000000000000000000000000000000004000000000000000000F03F000000000000F03F000000000000F03F000000000000004000000000000000400000000000000040000000000000F03F000000000000F03F', 'Küchentisch', 0.75, '{"bench":0.25,"diningtable":0.97}', '["furniture","kitchen"]', '{"movable":true,"owner":"Ada","seen":3,"weight_kg":21.0}', 0.5, 0.75, 1, NULL);
INSERT INTO "objects" VALUES (2, X'47500003FFFFFFFF000000000000F8BF000000000000F0BF0000000000000040000000000000024001030000000100000004000000000000000000F8BF0000000000000040000000000000F0BF0000000000000040000000000000F0BF0000000000000240000000000000F8BF0000000000000040', 'mug', 1.0, '{}', '[]', '{}', NULL, NULL, 2, 1700003602000000000);
INSERT INTO "objects" VALUES (8, X'47500003FFFFFFFF000000000000084000000000000008400000000000000C40000000000000104001020000000300000000000000000008400000000000000C400000000000000840000000000000104000000000000008400000000000000C40', 'cable', 1.0, '{}', '[]', '{}', NULL, NULL, 5, NULL);
INSERT INTO "rtree_objects_geom" VALUES (1, 0.0, 4.0, 0.0, 4.0);
INSERT INTO "rtree_objects_geom" VALUES (2, -1.5, -1.0, 2.0, 2.25);
INSERT INTO "rtree_objects_geom" VALUES (8, 3.0, 3.0, 3.5, 4.0);
INSERT INTO "occupancy" VALUES (1, 0, 32768, 32768, X'89504E470D0A1A0A0000000D4948445200000080000000801000000000B6C5E2540000010449444154785EEDD5411580301043C1BE2AC005FEDDE00209A5C5C69FBD702664C85CFBC6B8AFF32CDE1CFBD67ADEF32CDE1F40F90450FEFAE7DD354003E20920102F809F200208C41340205E002B800002F104108817C00A2080403C0104E205B0020820104F00817801AC000208C41340205E002B800002F104108817C00A2080403C0104E205B0020820104F00817801AC000208C41340205E002B800002F104108817C00A2080403C0104E205B0020820104F00817801AC000208C41340205E002B800002F104108817C00A2080403C0104E205B0020820104F00817801AC000208C41340205E002B800002F104108817C00A2080403C0104E205B0020820104FE003753700107793811F0000000049454E44AE426082');
INSERT INTO "occupancy" VALUES (2, 0, 32768, 32767, X'89504E470D0A1A0A0000000D4948445200000080000000801000000000B6C5E254000000FC49444154785EEDD5C10D802014054142E285FE4B820A2C488D6DEC50C2E60D7F3EF13747FC09101FC0B0000B881740203E009F200208C40B20101F802B800002F10208C407E00A208040BC0002F101B8020820102F80407C00AE000208C40B20101F802B800002F10208C407E00A208040BC0002F101B8020820102F80407C00AE000208C40B20101F802B800002F10208C407E00A208040BC0002F101B8020820102F80407C00AE000208C40B20101F802B800002F10208C407E00A208040BC0002F101B8020820102F80407C00AE000208C40B20101F802B800002F10208C407E00A208040BC0002F101B8020820F01558A79BE127B0F6755713BC7554028558DADE0F0000000049454E44AE426082');
INSERT INTO "seen" VALUES (1, 0, 32768, 32767, X'89504E470D0A1A0A0000000D4948445200000080000000801000000000B6C5E254000000EF49444154785EEDD5011100200CC4B06DFE3D839006097F0DBB177F37F167807800A30005C41740201E804F100104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F80403C0057000104E20B20100FC015400081F80208C4037005104020BE0002F1005C010410882F70BB9B66F001432F0015561CA1510000000049454E44AE426082');
INSERT INTO "wifi" VALUES (1, 0, 32767, 32767, X'49492A0078030000803FDFE7F8140E0B04814220D0983C36190F85C4615138744A2B14884622D198BC76391F8DC8635238F48A4B24904A24D2993CB6592F95CC65533974CA6B34984E26D399BCF6793F9DD0675439F50A8B44A05228D49A3D36994FA5D469553A754AAB54A8562AD59ABD76B95FADD86B563AF58ACB64B05A2CD69B3DB6D96FB5DC6D573B75CAEB74B85E2ED79BBDF6F97FBDE06F583BF60B0B84C06230D89C3E37198FC5E471593C764B2B94C86632D99CBE77399FCDE8735A3CF68B4BA4D06A34DA9D3EB759AFD5EC755B3D76CB6BB4D86E36DB9DBEF779BFDDF0775C3DF70B8BC4E07238DC9E3F3799CFE5F4795D3E774BABD4E8763ADD9EBF77B9DFEDF87B5E3EF78BCBE4F07A3CDE9F3FB7D9EFF5FC7D5F3F77CBEBF4F87E3EDF9FBFF7F8FFBF700BF501BFD0140B024010440D04C0F06C1907C1708C1509C1D0942B0A4210C42D0CC2F0EC390FC3710C3511C3D1144B124411444D14C4F16C5917C5718C5519C5D1946B1A4611C46D1CC6F1EC791FC7720C7521C7D2148B224812448D24C8F26C9927C9728C9529C9D294AB2A4A12C4AD2CCAF2ECB92FCB730CB531CBD314CB324C1344CD34CCF36CD937CD738CD539CDD394EB3A4E13C4ED3CCEF3ECF93FCF740CF541CFD4150B425014450D44D0F46D1947D1748D1549D1D4952B4A5214C52D4CD2F4ED394FD3750D3551D3D5154B525415454D54D4F56D5957D5758D5559D5D5956B5A5615C56D5CD6F5ED795FD7760D7561D7D6158B625816458D64D8F66D9967D9768D9569D9D695AB6A5A16C5AD6CDAF6EDB96FDB770DB571DBD715CB725C1745CD74DCF76DD977DD778DD579DDD795EB7A5E17C5ED7CDEF7EDF97FDF780DF581DFD8160B826018460D84E0F86E1987E1788E1589E1D8962B8A6218C62D8CE2F8EE398FE3790E3591E3D9164B926419464D94E4F96E5997E5798E5599E5D9966B9A6619C66D9CE6F9EE799FE77A0E75A1E7DA168BA2681A468DA4E8FA6E99A7E97A8E95A9E9DA96ABAA6A1AC6ADACEAFAEEB9AFEB7B0EB5B1EBDB16CBB26C1B46CDB4ECFB6ED9B7ED7B8ED5B9EDDB96EBBA6E1BC6EDBCEEFBEEF9BFEF7C0EF5C1EFDC170BC2701C470DC4F0FC6F19C7F17C8F15C9F1DC972BCA721CC72DCCF2FCEF39CFF37D0F35D1F3DD174BD2741D474DD4F4FD6F59D7F57D8F55D9F5DD976BDA761DC76DDCF6FDEF79DFF77E0F75E1F7DE178BE2781E478DE4F8FE6F99E7F97E8A2800000391848620200B000001030001000000800000000101030001000000800000000201030001000000200000000301030001000000050000000601030001000000010000001101040001000000080000001501030001000000010000001601030001000000800000001701040001000000700300001C010300010000000100000053010300010000000300000000000000');
INSERT INTO "wifi" VALUES (2, 0, 32768, 32767, X'49492A0078030000803FDFE7F8140E0B04814220D0983C36190F85C4615138744A2B14884622D198BC76391F8DC8635238F48A4B24904A24D2993CB6592F95CC65533974CA6B34984E26D399BCF6793F9DD0675439F50A8B44A05228D49A3D36994FA5D469553A754AAB54A8562AD59ABD76B95FADD86B563AF58ACB64B05A2CD69B3DB6D96FB5DC6D573B75CAEB74B85E2ED79BBDF6F97FBDE06F583BF60B0B84C06230D89C3E37198FC5E471593C764B2B94C86632D99CBE77399FCDE8735A3CF68B4BA4D06A34DA9D3EB759AFD5EC755B3D76CB6BB4D86E36DB9DBEF779BFDDF0775C3DF70B8BC4E07238DC9E3F3799CFE5F4795D3E774BABD4E8763ADD9EBF77B9DFEDF87B5E3EF78BCBE4F07A3CDE9F3FB7D9EFF5FC7D5F3F77CBEBF4F87E3EDF9FBFF7F8FFBF700BF501BFD0140B024010440D04C0F06C1907C1708C1509C1D0942B0A4210C42D0CC2F0EC390FC3710C3511C3D1144B124411444D14C4F16C5917C5718C5519C5D1946B1A4611C46D1CC6F1EC791FC7720C7521C7D2148B224812448D24C8F26C9927C9728C9529C9D294AB2A4A12C4AD2CCAF2ECB92FCB730CB531CBD314CB324C1344CD34CCF36CD937CD738CD539CDD394EB3A4E13C4ED3CCEF3ECF93FCF740CF541CFD4150B425014450D44D0F46D1947D1748D1549D1D4952B4A5214C52D4CD2F4ED394FD3750D3551D3D5154B525415454D54D4F56D5957D5758D5559D5D5956B5A5615C56D5CD6F5ED795FD7760D7561D7D6158B625816458D64D8F66D9967D9768D9569D9D695AB6A5A16C5AD6CDAF6EDB96FDB770DB571DBD715CB725C1745CD74DCF76DD977DD778DD579DDD795EB7A5E17C5ED7CDEF7EDF97FDF780DF581DFD8160B826018460D84E0F86E1987E1788E1589E1D8962B8A6218C62D8CE2F8EE398FE3790E3591E3D9164B926419464D94E4F96E5997E5798E5599E5D9966B9A6619C66D9CE6F9EE799FE77A0E75A1E7DA168BA2681A468DA4E8FA6E99A7E97A8E95A9E9DA96ABAA6A1AC6ADACEAFAEEB9AFEB7B0EB5B1EBDB16CBB26C1B46CDB4ECFB6ED9B7ED7B8ED5B9EDDB96EBBA6E1BC6EDBCEEFBEEF9BFEF7C0EF5C1EFDC170BC2701C470DC4F0FC6F19C7F17C8F15C9F1DC972BCA721CC72DCCF2FCEF39CFF37D0F35D1F3DD174BD2741D474DD4F4FD6F59D7F57D8F55D9F5DD976BDA761DC76DDCF6FDEF79DFF77E0F75E1F7DE178BE2781E478DE4F8FE6F98D60004011C6179FE5E8C8080000B0000010300010000008000000001010300010000008000000002010300010000002000000003010300010000000500000006010300010000000100000011010400010000000800000015010300010000000100000016010300010000008000000017010400010000006F0300001C010300010000000100000053010300010000000300000000000000');
INSERT INTO "lanes" VALUES (4, X'47500003FFFFFFFF0000000000000000000000000000204000000000000004C0000000000000F03F0102000000030000000000000000000000000000000000F03F0000000000002040000000000000F03F000000000000204000000000000004C0', 'lane', 1.0, '{}', '[]', '{}', NULL, NULL, 4, NULL);
INSERT INTO "rtree_lanes_geom" VALUES (4, 0.0, 8.0, -2.5, 1.0);
INSERT INTO "docks" VALUES (5, X'47500001FFFFFFFF01010000000000000000000440000000000000F83F', 'dock', 1.0, '{}', '[]', '{}', NULL, NULL, 5, NULL);
INSERT INTO "docks" VALUES (6, X'47500001FFFFFFFF0101000000000000000000B0BF0000000080842E41', 'dock', 1.0, '{}', '[]', '{}', NULL, NULL, 4, NULL);
INSERT INTO "rtree_docks_geom" VALUES (6, -0.0625, -0.0625, 1000000.0, 1000000.0);
INSERT INTO "rtree_docks_geom" VALUES (5, 2.5, 2.5, 1.5, 1.5);
DELETE FROM sqlite_sequence;
INSERT INTO sqlite_sequence VALUES ('hypermap_lineages', 8);
INSERT INTO sqlite_sequence VALUES ('gpkg_2d_gridded_coverage_ancillary', 3);
INSERT INTO sqlite_sequence VALUES ('objects', 8);
INSERT INTO sqlite_sequence VALUES ('occupancy', 3);
INSERT INTO sqlite_sequence VALUES ('gpkg_2d_gridded_tile_ancillary', 6);
INSERT INTO sqlite_sequence VALUES ('seen', 1);
INSERT INTO sqlite_sequence VALUES ('wifi', 2);
INSERT INTO sqlite_sequence VALUES ('docks', 6);
INSERT INTO sqlite_sequence VALUES ('lanes', 4);
CREATE INDEX hypermap_observations_order
  ON hypermap_observations (layer, stamp_ns, robot, sequence);
CREATE INDEX "hypermap_objects_label" ON "objects" (label);
CREATE INDEX "hypermap_lanes_label" ON "lanes" (label);
CREATE INDEX "hypermap_docks_label" ON "docks" (label);
CREATE INDEX "hypermap_doors_label" ON "doors" (label);
CREATE TRIGGER "rtree_objects_geom_insert" AFTER INSERT ON "objects"
  WHEN (new."geom" NOT NULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_objects_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_objects_geom_update1" AFTER UPDATE OF "geom" ON "objects"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_objects_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_objects_geom_update2" AFTER UPDATE OF "geom" ON "objects"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_objects_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_objects_geom_update3" AFTER UPDATE ON "objects"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_objects_geom" WHERE id = OLD."id";
  INSERT OR REPLACE INTO "rtree_objects_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_objects_geom_update4" AFTER UPDATE ON "objects"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_objects_geom" WHERE id IN (OLD."id", NEW."id");
END;
CREATE TRIGGER "rtree_objects_geom_delete" AFTER DELETE ON "objects"
  WHEN old."geom" NOT NULL
BEGIN
  DELETE FROM "rtree_objects_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_lanes_geom_insert" AFTER INSERT ON "lanes"
  WHEN (new."geom" NOT NULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_lanes_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_lanes_geom_update1" AFTER UPDATE OF "geom" ON "lanes"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_lanes_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_lanes_geom_update2" AFTER UPDATE OF "geom" ON "lanes"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_lanes_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_lanes_geom_update3" AFTER UPDATE ON "lanes"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_lanes_geom" WHERE id = OLD."id";
  INSERT OR REPLACE INTO "rtree_lanes_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_lanes_geom_update4" AFTER UPDATE ON "lanes"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_lanes_geom" WHERE id IN (OLD."id", NEW."id");
END;
CREATE TRIGGER "rtree_lanes_geom_delete" AFTER DELETE ON "lanes"
  WHEN old."geom" NOT NULL
BEGIN
  DELETE FROM "rtree_lanes_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_docks_geom_insert" AFTER INSERT ON "docks"
  WHEN (new."geom" NOT NULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_docks_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_docks_geom_update1" AFTER UPDATE OF "geom" ON "docks"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_docks_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_docks_geom_update2" AFTER UPDATE OF "geom" ON "docks"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_docks_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_docks_geom_update3" AFTER UPDATE ON "docks"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_docks_geom" WHERE id = OLD."id";
  INSERT OR REPLACE INTO "rtree_docks_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_docks_geom_update4" AFTER UPDATE ON "docks"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_docks_geom" WHERE id IN (OLD."id", NEW."id");
END;
CREATE TRIGGER "rtree_docks_geom_delete" AFTER DELETE ON "docks"
  WHEN old."geom" NOT NULL
BEGIN
  DELETE FROM "rtree_docks_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_doors_geom_insert" AFTER INSERT ON "doors"
  WHEN (new."geom" NOT NULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_doors_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_doors_geom_update1" AFTER UPDATE OF "geom" ON "doors"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_doors_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_doors_geom_update2" AFTER UPDATE OF "geom" ON "doors"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_doors_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_doors_geom_update3" AFTER UPDATE ON "doors"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_doors_geom" WHERE id = OLD."id";
  INSERT OR REPLACE INTO "rtree_doors_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_doors_geom_update4" AFTER UPDATE ON "doors"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_doors_geom" WHERE id IN (OLD."id", NEW."id");
END;
CREATE TRIGGER "rtree_doors_geom_delete" AFTER DELETE ON "doors"
  WHEN old."geom" NOT NULL
BEGIN
  DELETE FROM "rtree_doors_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "hypermap_gpkg_contents_insert" AFTER INSERT ON "gpkg_contents"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_gpkg_contents_update" AFTER UPDATE ON "gpkg_contents"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_gpkg_contents_delete" AFTER DELETE ON "gpkg_contents"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_objects_insert" AFTER INSERT ON "objects"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_objects_update" AFTER UPDATE ON "objects"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_objects_delete" AFTER DELETE ON "objects"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_occupancy_insert" AFTER INSERT ON "occupancy"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_occupancy_update" AFTER UPDATE ON "occupancy"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_occupancy_delete" AFTER DELETE ON "occupancy"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_seen_insert" AFTER INSERT ON "seen"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_seen_update" AFTER UPDATE ON "seen"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_seen_delete" AFTER DELETE ON "seen"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_wifi_insert" AFTER INSERT ON "wifi"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_wifi_update" AFTER UPDATE ON "wifi"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_wifi_delete" AFTER DELETE ON "wifi"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_lanes_insert" AFTER INSERT ON "lanes"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_lanes_update" AFTER UPDATE ON "lanes"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_lanes_delete" AFTER DELETE ON "lanes"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_docks_insert" AFTER INSERT ON "docks"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_docks_update" AFTER UPDATE ON "docks"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_docks_delete" AFTER DELETE ON "docks"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_doors_insert" AFTER INSERT ON "doors"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_doors_update" AFTER UPDATE ON "doors"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_doors_delete" AFTER DELETE ON "doors"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
UPDATE hypermap_metadata SET schema_cookie = (SELECT schema_version FROM pragma_schema_version)
  WHERE id = 1;
COMMIT;
