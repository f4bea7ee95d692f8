-- A map of schema version 2 as Hypermap wrote it: every program from here on must read it.
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
  next_object_id INTEGER NOT NULL
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
  parameters TEXT NOT NULL
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
  revision INTEGER NOT NULL REFERENCES hypermap_revisions(revision),
  object_ids BLOB NOT NULL
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
  UNIQUE (layer, stamp_ns, robot, sequence, number)
);
CREATE TABLE "objects" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom POLYGON NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL DEFAULT 1.0,
  classes TEXT NOT NULL DEFAULT '{}',
  tags TEXT NOT NULL DEFAULT '[]',
  attributes TEXT NOT NULL DEFAULT '{}',
  height_min DOUBLE,
  height_max DOUBLE
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
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined', 'undefined Cartesian coordinate reference system');
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', 'undefined geographic coordinate reference system');
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('WGS 84 geodetic', 4326, 'EPSG', 4326, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AXIS["Latitude",NORTH],AXIS["Longitude",EAST],AUTHORITY["EPSG","4326"]]', 'longitude/latitude coordinates in decimal degrees on the WGS 84 spheroid');
INSERT INTO "gpkg_spatial_ref_sys" VALUES ('WGS 84 3D', 4979, 'EPSG', 4979, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AXIS["Latitude",NORTH],AXIS["Longitude",EAST],AXIS["Ellipsoidal height",UP],AUTHORITY["EPSG","4979"]]', 'longitude/latitude/height coordinates on the WGS 84 spheroid');
INSERT INTO "gpkg_contents" VALUES ('hypermap_layers', 'attributes', 'layers of the map', 'kind, frame and origin of each layer', '2023-11-14T22:13:21.000Z', NULL, NULL, NULL, NULL, NULL);
INSERT INTO "gpkg_contents" VALUES ('objects', 'features', 'objects', 'semantic layer, metres in frame map', '2023-11-14T22:13:21.000Z', -1.5, 0.0, 4.0, 4.0, -1);
INSERT INTO "gpkg_contents" VALUES ('occupancy', '2d-gridded-coverage', 'occupancy', 'occupancy layer, metres in frame map', '2023-11-14T22:13:21.000Z', -15.3, -12.25, -15.15, -12.149999999999999, -1);
INSERT INTO "gpkg_contents" VALUES ('seen', '2d-gridded-coverage', 'seen', 'exploration layer, metres in frame robot/base', '2023-11-14T22:13:21.000Z', 1.0, 2.0, 1.75, 2.25, -1);
INSERT INTO "gpkg_contents" VALUES ('wifi', '2d-gridded-coverage', 'wifi', 'scalar layer, metres in frame robot/base', '2023-11-14T22:13:21.000Z', 0.5, 2.0, 1.25, 2.25, -1);
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
INSERT INTO "gpkg_extensions" VALUES ('objects', 'geom', 'gpkg_rtree_index', 'http://www.geopackage.org/spec130/#extension_rtree', 'write-only');
INSERT INTO "gpkg_extensions" VALUES ('occupancy', 'tile_data', 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('seen', 'tile_data', 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_extensions" VALUES ('wifi', 'tile_data', 'gpkg_2d_gridded_coverage', 'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
INSERT INTO "gpkg_geometry_columns" VALUES ('objects', 'geom', 'POLYGON', -1, 0, 0);
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
INSERT INTO "hypermap_metadata" VALUES (1, 2, 'golden', 'map', 1700000000123456789, 'create golden', 1, 3);
INSERT INTO "hypermap_layers" VALUES (1, 'objects', 'semantic', 'objects', 'map', NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_layers" VALUES (2, 'occupancy', 'occupancy', 'occupancy', 'map', -15.4, -12.2, 0.0, 0.05, -1, 1, 2, 5, '{"free_below":0.25,"occupied_above":0.75,"unit":""}');
INSERT INTO "hypermap_layers" VALUES (3, 'seen', 'exploration', 'seen', 'robot/base', 1.0, 2.0, 1.5, 0.25, 0, 1, 0, 3, '{"free_below":0.196,"occupied_above":0.65,"unit":""}');
INSERT INTO "hypermap_layers" VALUES (4, 'wifi', 'scalar', 'wifi', 'robot/base', 1.0, 2.0, 1.5, 0.25, 0, 1, -2, 1, '{"free_below":0.196,"occupied_above":0.65,"unit":"dBm"}');
INSERT INTO "hypermap_frames" VALUES (1, 'robot/base', 'map', 3.0, 4.0, -0.5);
INSERT INTO "hypermap_revisions" VALUES (1, 1700000001000000000, 'ada', 15);
INSERT INTO "hypermap_receipts" VALUES (1, 'put', 1, X'00020203000000000000');
INSERT INTO "hypermap_fusion" VALUES (1, 'objects', 'evidence', '{}', 'seen');
INSERT INTO "hypermap_observations" VALUES (1, 'objects', 1700000002123456789, 'cart', 0, -5, 0, 1700000002123456794, 10, X'78014bcb2c2a2e51284e4dcd030015f703f4');
INSERT INTO "hypermap_observations" VALUES (2, 'objects', 1700000003123456789, 'cart', 1, 7, 1, 1700000003123456794, 10, X'78012b49cc4ecd53484a4cce0600152603c5');
INSERT INTO "hypermap_observations" VALUES (3, 'objects', 1700000004123456789, 'lift', 0, 1099511627776, 0, 1700000004123456794, 100, X'7801cb492c2e51c8a12d010041992491');
INSERT INTO "hypermap_operator_facts" VALUES (1, 'objects', 1700000002123456789, 'cart', 0, 1, 'pin', 'cart/0/1', X'6120637570');
INSERT INTO "hypermap_fusion_tracks" VALUES (1, 'objects', 'cart/0/0', 1);
INSERT INTO "hypermap_fusion_tracks" VALUES (2, 'objects', 'cart/0/1', 2);
INSERT INTO "hypermap_fusion_checkpoints" VALUES (1, 'objects', 1700000002123456789, 'cart', 0, 1, 20, X'78012b2e492c4955484c2b492d5228c94855484b4c2e01004fa40773');
INSERT INTO "objects" VALUES (1, X'47500003ffffffff000000000000000000000000000010400000000000000000000000000000104001030000000200000005000000000000000000000000000000000000000000000000001040000000000000000000000000000010400000000000001040000000000000000000000000000010400000000000000000000000000000000004000000000000000000f03f000000000000f03f000000000000f03f000000000000004000000000000000400000000000000040000000000000f03f000000000000f03f', 'Küchentisch', 0.75, '{"bench":0.25,"diningtable":0.97}', '["furniture","kitchen"]', '{"movable":true,"owner":"Ada","seen":3,"weight_kg":21.0}', 0.5, 0.75);
INSERT INTO "objects" VALUES (2, X'47500003ffffffff000000000000f8bf000000000000f0bf0000000000000040000000000000024001030000000100000004000000000000000000f8bf0000000000000040000000000000f0bf0000000000000040000000000000f0bf0000000000000240000000000000f8bf0000000000000040', 'cup', 1.0, '{}', '[]', '{}', NULL, NULL);
INSERT INTO "rtree_objects_geom" VALUES (1, 0.0, 4.0, 0.0, 4.0);
INSERT INTO "rtree_objects_geom" VALUES (2, -1.5, -1.0, 2.0, 2.25);
INSERT INTO "occupancy" VALUES (1, 0, 32768, 32768, X'89504e470d0a1a0a0000000d4948445200000080000000801000000000b6c5e2540000010449444154785eedd5411580301043c1be2ac005fedde00209a5c5c69fbd702664c85cfbc6b8aff32cde1cfbd67adef32cde1f40f90450fefae7dd354003e20920102f809f200208c41340205e002b800002f104108817c00a2080403c0104e205b0020820104f00817801ac000208c41340205e002b800002f104108817c00a2080403c0104e205b0020820104f00817801ac000208c41340205e002b800002f104108817c00a2080403c0104e205b0020820104f00817801ac000208c41340205e002b800002f104108817c00a2080403c0104e205b0020820104f00817801ac000208c41340205e002b800002f104108817c00a2080403c0104e205b0020820104fe003753700107793811f0000000049454e44ae426082');
INSERT INTO "occupancy" VALUES (2, 0, 32768, 32767, X'89504e470d0a1a0a0000000d4948445200000080000000801000000000b6c5e254000000f849444154785eedd50109c0301004c1f01007355d7d1594406dec44c2b1939f137fb3e2cf00f100960214105f008178003e410410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020bec04fe079f757dde102aa670185ec9cf1640000000049454e44ae426082');
INSERT INTO "seen" VALUES (1, 0, 32768, 32767, X'89504e470d0a1a0a0000000d4948445200000080000000801000000000b6c5e254000000ef49444154785eedd5011100200cc4b06dfe3d839006097f0dbb177f37f167807800a30005c41740201e804f100104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f80403c0057000104e20b20100fc015400081f80208c4037005104020be0002f1005c010410882f70bb9b66f001432f0015561ca1510000000049454e44ae426082');
INSERT INTO "wifi" VALUES (1, 0, 32767, 32767, X'49492a0078030000803fdfe7f8140e0b04814220d0983c36190f85c4615138744a2b14884622d198bc76391f8dc8635238f48a4b24904a24d2993cb6592f95cc65533974ca6b34984e26d399bcf6793f9dd0675439f50a8b44a05228d49a3d36994fa5d469553a754aab54a8562ad59abd76b95fadd86b563af58acb64b05a2cd69b3db6d96fb5dc6d573b75caeb74b85e2ed79bbdf6f97fbde06f583bf60b0b84c06230d89c3e37198fc5e471593c764b2b94c86632d99cbe77399fcde8735a3cf68b4ba4d06a34da9d3eb759afd5ec755b3d76cb6bb4d86e36db9dbef779bfddf0775c3df70b8bc4e07238dc9e3f3799cfe5f4795d3e774babd4e8763add9ebf77b9dfedf87b5e3ef78bcbe4f07a3cde9f3fb7d9eff5fc7d5f3f77cbebf4f87e3edf9fbff7f8ffbf700bf501bfd0140b024010440d04c0f06c1907c1708c1509c1d0942b0a4210c42d0cc2f0ec390fc3710c3511c3d1144b124411444d14c4f16c5917c5718c5519c5d1946b1a4611c46d1cc6f1ec791fc7720c7521c7d2148b224812448d24c8f26c9927c9728c9529c9d294ab2a4a12c4ad2ccaf2ecb92fcb730cb531cbd314cb324c1344cd34ccf36cd937cd738cd539cdd394eb3a4e13c4ed3ccef3ecf93fcf740cf541cfd4150b425014450d44d0f46d1947d1748d1549d1d4952b4a5214c52d4cd2f4ed394fd3750d3551d3d5154b525415454d54d4f56d5957d5758d5559d5d5956b5a5615c56d5cd6f5ed795fd7760d7561d7d6158b625816458d64d8f66d9967d9768d9569d9d695ab6a5a16c5ad6cdaf6edb96fdb770db571dbd715cb725c1745cd74dcf76dd977dd778dd579ddd795eb7a5e17c5ed7cdef7edf97fdf780df581dfd8160b826018460d84e0f86e1987e1788e1589e1d8962b8a6218c62d8ce2f8ee398fe3790e3591e3d9164b926419464d94e4f96e5997e5798e5599e5d9966b9a6619c66d9ce6f9ee799fe77a0e75a1e7da168ba2681a468da4e8fa6e99a7e97a8e95a9e9da96abaa6a1ac6adaceafaeeb9afeb7b0eb5b1ebdb16cbb26c1b46cdb4ecfb6ed9b7ed7b8ed5b9eddb96ebba6e1bc6edbceefbeef9bfef7c0ef5c1efdc170bc2701c470dc4f0fc6f19c7f17c8f15c9f1dc972bca721cc72dccf2fcef39cff37d0f35d1f3dd174bd2741d474dd4f4fd6f59d7f57d8f55d9f5dd976bda761dc76ddcf6fdef79dff77e0f75e1f7de178be2781e478de4f8fe6f99e7f97e8a2800000391848620200b000001030001000000800000000101030001000000800000000201030001000000200000000301030001000000050000000601030001000000010000001101040001000000080000001501030001000000010000001601030001000000800000001701040001000000700300001c010300010000000100000053010300010000000300000000000000');
INSERT INTO "wifi" VALUES (2, 0, 32768, 32767, X'49492a0078030000803fdfe7f8140e0b04814220d0983c36190f85c4615138744a2b14884622d198bc76391f8dc8635238f48a4b24904a24d2993cb6592f95cc65533974ca6b34984e26d399bcf6793f9dd0675439f50a8b44a05228d49a3d36994fa5d469553a754aab54a8562ad59abd76b95fadd86b563af58acb64b05a2cd69b3db6d96fb5dc6d573b75caeb74b85e2ed79bbdf6f97fbde06f583bf60b0b84c06230d89c3e37198fc5e471593c764b2b94c86632d99cbe77399fcde8735a3cf68b4ba4d06a34da9d3eb759afd5ec755b3d76cb6bb4d86e36db9dbef779bfddf0775c3df70b8bc4e07238dc9e3f3799cfe5f4795d3e774babd4e8763add9ebf77b9dfedf87b5e3ef78bcbe4f07a3cde9f3fb7d9eff5fc7d5f3f77cbebf4f87e3edf9fbff7f8ffbf700bf501bfd0140b024010440d04c0f06c1907c1708c1509c1d0942b0a4210c42d0cc2f0ec390fc3710c3511c3d1144b124411444d14c4f16c5917c5718c5519c5d1946b1a4611c46d1cc6f1ec791fc7720c7521c7d2148b224812448d24c8f26c9927c9728c9529c9d294ab2a4a12c4ad2ccaf2ecb92fcb730cb531cbd314cb324c1344cd34ccf36cd937cd738cd539cdd394eb3a4e13c4ed3ccef3ecf93fcf740cf541cfd4150b425014450d44d0f46d1947d1748d1549d1d4952b4a5214c52d4cd2f4ed394fd3750d3551d3d5154b525415454d54d4f56d5957d5758d5559d5d5956b5a5615c56d5cd6f5ed795fd7760d7561d7d6158b625816458d64d8f66d9967d9768d9569d9d695ab6a5a16c5ad6cdaf6edb96fdb770db571dbd715cb725c1745cd74dcf76dd977dd778dd579ddd795eb7a5e17c5ed7cdef7edf97fdf780df581dfd8160b826018460d84e0f86e1987e1788e1589e1d8962b8a6218c62d8ce2f8ee398fe3790e3591e3d9164b926419464d94e4f96e5997e5798e5599e5d9966b9a6619c66d9ce6f9ee799fe77a0e75a1e7da168ba2681a468da4e8fa6e99a7e97a8e95a9e9da96abaa6a1ac6adaceafaeeb9afeb7b0eb5b1ebdb16cbb26c1b46cdb4ecfb6ed9b7ed7b8ed5b9eddb96ebba6e1bc6edbceefbeef9bfef7c0ef5c1efdc170bc2701c470dc4f0fc6f19c7f17c8f15c9f1dc972bca721cc72dccf2fcef39cff37d0f35d1f3dd174bd2741d474dd4f4fd6f59d7f57d8f55d9f5dd976bda761dc76ddcf6fdef79dff77e0f75e1f7de178be2781e478de4f8fe6f98d60004011c6179fe5e8c8080000b0000010300010000008000000001010300010000008000000002010300010000002000000003010300010000000500000006010300010000000100000011010400010000000800000015010300010000000100000016010300010000008000000017010400010000006f0300001c010300010000000100000053010300010000000300000000000000');
CREATE INDEX hypermap_observations_order
  ON hypermap_observations (layer, stamp_ns, robot, sequence);
CREATE INDEX "hypermap_objects_label" ON "objects" (label);
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
COMMIT;
