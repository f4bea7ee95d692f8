"""Hostile files for imports: damaged archives, images, YAML and JSON, names that lead out of
folders, and files that take more than a server should give."""

import base64
import io
import json
import warnings
import zipfile
import zlib

from test_bad_input import (BILLION_LAUGHS, GRID_CONFIG, GRID_YAML, OBJECT_CONFIG, geojson, hmap,
                            objects, png_of)

# Limits of the server, small enough to be exceeded by small files.
MAX_VERTICES = 1000
MAX_MEMBERS = 50
MAX_UNPACKED_BYTES = 8 << 20
LIMITS = (f"--max_vertices={MAX_VERTICES}", f"--max_archive_members={MAX_MEMBERS}",
          f"--max_unpacked_bytes={MAX_UNPACKED_BYTES}", "--max_import_bytes=4000000")

GOOD_OBJECTS = "- {name: x, shape: 'POLYGON((0 0,1 0,1 1))'}\n"
GOOD = hmap(hmap_config__yaml=OBJECT_CONFIG, s=GOOD_OBJECTS)
GOOD_PNG = png_of(2, 2, zlib.compress(bytes(6)))
PGM = b"P5\n2 2\n255\n\0\0\0\0"


def archive(*members, compression=zipfile.ZIP_DEFLATED):
    """Returns a zip of (name, content) pairs, whose names may be odd or occur twice."""
    packed = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(packed, "w", compression) as file:
        warnings.simplefilter("ignore")  # of names that occur twice
        for name, data in members:
            file.writestr(name, data)
    return packed.getvalue()


def with_member(name):
    """Returns a good .hmap file with one more member."""
    return archive(("hmap_config.yaml", OBJECT_CONFIG), ("s", GOOD_OBJECTS), (name, "x"))


def patched(data, signature, offset, value):
    """Returns a zip whose first record with this signature has other bytes at an offset."""
    at = data.index(signature) + offset
    return data[:at] + value + data[at + len(value):]


LOCAL, CENTRAL, END = b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06"


def hmap_files(outside):
    """Yields (description, content) of .hmap files. `outside` is a path outside of the data
    folder."""
    stored = archive(("hmap_config.yaml", OBJECT_CONFIG), ("s", GOOD_OBJECTS),
                     compression=zipfile.ZIP_STORED)
    yield "the magic of gzip", b"\x1f\x8b\x08" + bytes(100)
    yield "an end of the directory only", END + bytes(17)
    yield "a directory without members' data", GOOD[GOOD.index(CENTRAL):]
    yield "no directory", GOOD[:GOOD.index(CENTRAL)]
    yield "a directory beyond the end of the file", patched(GOOD, END, 16, b"\xf0\xff\xff\x7f")
    yield "65534 members that are not there", patched(GOOD, END, 8, b"\xfe\xff\xfe\xff")
    yield "a member beyond the end of the file", patched(GOOD, CENTRAL, 42, b"\xf0\xff\xff\x7f")
    yield "a wrong checksum", patched(stored, b"layers:", 0, b"Layers:")
    yield "an unknown compression", patched(GOOD, CENTRAL, 10, b"\x63\x00")
    yield "an encrypted member", patched(GOOD, CENTRAL, 8, b"\x01\x00")
    yield "damaged compressed data", patched(GOOD, b"hmap_config.yaml", 16, b"\xff" * 8)
    for name in ("../x", "a/../../x", "..\\x", "\\x", f"{outside}/x", "/etc/hypermap-x", ".."):
        yield f"a member {name}", with_member(name)
    yield "more members than allowed", archive(
        *((f"m{i}", "") for i in range(MAX_MEMBERS)), ("hmap_config.yaml", "layers: []"))
    yield "a member that unpacks to too much", hmap(
        hmap_config__yaml=OBJECT_CONFIG, s=b"#" * (MAX_UNPACKED_BYTES + 1))
    yield "a configuration that unpacks to too much", hmap(
        hmap_config__yaml=b"#" * (MAX_UNPACKED_BYTES - 1))
    for what, text in (
            ("a list", "[1, 2]"), ("invalid UTF-8", b"layers: \xff\xfe\x80"),
            ("zeros", bytes(1000)), ("a node that contains itself", "layers: &a [*a]"),
            ("a tower of aliases", BILLION_LAUGHS + "layers: *i\n"),
            ("layers that are a number", "layers: 7"), ("a layer that is text", "layers: [x]"),
            ("a layer without a name", OBJECT_CONFIG.replace("name: s,", "")),
            ("an unknown class", OBJECT_CONFIG.replace("SemanticLayer", "EvilLayer")),
            ("a layer twice", OBJECT_CONFIG + OBJECT_CONFIG[len("layers:\n"):]),
            ("a file outside", OBJECT_CONFIG.replace("file: s", f"file: {outside}/x")),
            ("a frame in itself", OBJECT_CONFIG + transforms(("a", "a", 0))),
            ("frames in a circle",
             OBJECT_CONFIG + transforms(("a", "b", 0), ("b", "c", 0), ("c", "a", 0))),
            ("a transform that is not finite", OBJECT_CONFIG + transforms(("a", "b", ".nan"))),
            ("a transform of huge numbers", OBJECT_CONFIG + transforms(("map", "b", "1e300"))),
            ("a chain of too many frames",
             OBJECT_CONFIG + transforms(*((f"f{i}", f"f{i + 1}", 0) for i in range(257)))),
            ("a class of a thousand letters", OBJECT_CONFIG.replace("SemanticLayer", "x" * 1000)),
            ("too many transforms",
             OBJECT_CONFIG + transforms(*((f"f{i}", f"f{i + 1}", 0) for i in range(2001))))):
        yield f"a configuration with {what}", hmap(hmap_config__yaml=text, s=GOOD_OBJECTS)
    for what, text in (
            ("aliases", "- &a " + GOOD_OBJECTS[2:] + "- *a\n"), ("deep lists", "[" * 100_000),
            ("an object instead of a list", "name: x"), ("confidences that are not finite",
             "- {name: x, shape: 'POLYGON((0 0,1 0,1 1))', tags: [a], confidence: [.nan]}"),
            ("hexadecimal coordinates", "- {name: x, shape: 'POLYGON((0 0,0x1 0,1 1))'}")):
        yield f"objects with {what}", hmap(hmap_config__yaml=OBJECT_CONFIG, s=text)
    ring = ",".join(f"{i} {i * i}" for i in range(MAX_VERTICES + 1))
    yield "a shape of too many vertices", objects(f"POLYGON(({ring}))")
    for what, image in (
            ("that is cut in its data", GOOD_PNG[:50]),
            ("of a wrong checksum", GOOD_PNG[:30] + b"?" + GOOD_PNG[31:]),
            ("whose data is not compressed", png_of(2, 2, bytes(6))),
            ("without pixels", png_of(0, 0))):
        yield f"an image {what}", hmap(hmap_config__yaml=GRID_CONFIG, g__yaml=GRID_YAML,
                                       g__png=image)


def transforms(*of):
    """Returns the transforms of a configuration: (frame, its child, x of the pose)."""
    return "transforms:\n" + "".join(
        f"- {{frame_id: {parent}, child_frame_id: {child}, transform_pose: [{x}, 0, 0]}}\n"
        for parent, child, x in of)


def nav2_files():
    """Yields (description, list of files) of nav2 maps."""
    yaml = GRID_YAML.replace("g.png", "g.pgm")
    for what, old, new in (
            ("resolution 0", "0.05", "0"), ("resolution -1", "0.05", "-1"),
            ("resolution inf", "0.05", ".inf"), ("resolution 1e-320", "0.05", "1e-320"),
            ("resolution 1e300", "0.05", "1e300"), ("a resolution of text", "0.05", "small"),
            ("an origin of two numbers", "[0, 0, 0]", "[0, 0]"),
            ("an origin that is not finite", "[0, 0, 0]", "[0, .nan, 0]"),
            ("an origin of huge numbers", "[0, 0, 0]", "[1e300, -1e300, 0]"),
            ("an unknown negate", "negate: 0", "negate: perhaps"),
            ("an unknown mode", "negate: 0", "mode: evil"),
            ("a threshold that is not finite", "0.65", ".nan"),
            ("itself as image", "g.pgm", "g.yaml"), ("a list as image", "g.pgm", "[g.pgm]"),
            ("aliases as image", "image: g.pgm", BILLION_LAUGHS + "image: *i")):
        assert old in yaml
        yield f"a YAML with {what}", [("g.yaml", yaml.replace(old, new)), ("g.pgm", PGM)]
    for what, image in (
            ("no pixels", b"P5\n0 0\n255\n"), ("maxval 0", b"P5\n2 2\n0\n\0\0\0\0"),
            ("maxval 70000", b"P5\n2 2\n70000\n" + bytes(8)), ("one byte too few", PGM[:-1]),
            ("two bytes for each pixel, half of them", b"P5\n2 2\n256\n\0\0\0\0"),
            ("a size beyond 64 bits", b"P5\n99999999999999999999 1\n255\n\0"),
            ("a product of sizes beyond 32 bits", b"P5\n65536 65537\n255\n\0"),
            ("a comment without end", b"P5\n#" + b"x" * 1000), ("the header only", b"P5\n2 2\n255"),
            ("numbers that are text", b"P2\n2 2\n255\n1 2 x 4\n"),
            ("numbers above maxval", b"P2\n2 2\n3\n1 2 3 4\n"),
            ("too few numbers", b"P2\n2 2\n255\n1 2 3"), ("colours", b"P6\n1 1\n255\n\0\0\0"),
            ("nothing", b"")):
        yield f"a PGM with {what}", [("g.yaml", yaml), ("g.pgm", image)]
    yield "two YAMLs", [("g.yaml", yaml), ("h.yaml", yaml), ("g.pgm", PGM)]
    yield "no YAML", [("g.pgm", PGM)]
    yield "too many files", [("g.yaml", yaml), ("g.pgm", PGM),
                             *((f"f{i}", b"") for i in range(15))]
    yield "a file in pieces with another between them", [("g.yaml", yaml), ("g.pgm", PGM[:4]),
                                                         ("h", b""), ("g.pgm", PGM[4:])]


def odd_files():
    """Yields (description, format, list of files) of odd files that are imported nevertheless, with
    what is wrong left out or replaced."""
    def one(what, data):
        return what, "HMAP", [("x.hmap", data)]

    yield one("a member's header with a wrong magic", patched(GOOD, LOCAL, 0, b"PK\x03\x05"))
    yield one("two configurations", archive(
        ("hmap_config.yaml", OBJECT_CONFIG), ("hmap_config.yaml", "layers: []"),
        ("s", GOOD_OBJECTS)))
    yield one("a label of invalid UTF-8", hmap(
        hmap_config__yaml=OBJECT_CONFIG, s=GOOD_OBJECTS.encode().replace(b" x", b" \xff\xfe")))
    yield one("huge coordinates", objects("POLYGON((0 0,1e300 0,1 1,0 1e300))"))
    yield one("an image without its end", hmap(
        hmap_config__yaml=GRID_CONFIG, g__yaml=GRID_YAML, g__png=GOOD_PNG[:-12]))
    point = geojson([0, 0], "Point")
    yield "a label with a zero", "GEOJSON", [("x.geojson", point.replace(b'"x"', b'"x\\u0000x"'))]
    yield "a huge height", "GEOJSON", [
        ("x.geojson", point.replace(b'"x"', b'"x", "height": [-1e308, 1e308]'))]


def geojson_files():
    """Yields (description, content) of GeoJSON files."""
    point = json.loads(geojson([0, 0], "Point"))

    def feature(**members):
        return json.dumps({**point["features"][0], **members}).encode()

    def properties(**members):
        return feature(properties={"label": "x", **members})

    whole = geojson([[[0, 0], [1, 0], [1, 1], [0, 0]]])
    yield "a cut file", whole[:-1]
    yield "two documents", whole + whole
    for root in (b"null", b"7", b'"x"', b"[]", b"{}", b"\xef\xbb\xbf", b"\0" * 1000, b"NaN"):
        yield f"the root {root[:9]}", root
    yield "invalid UTF-8", properties(label="?").replace(b"?", b"\xff\xfe")
    yield "half of a surrogate pair", properties(label="?").replace(b"?", b"\\ud800")
    yield "NaN as a coordinate", whole.replace(b"1]", b"NaN]")
    yield "1,000 digits", whole.replace(b"1]", b"9" * 1000 + b"]")
    yield "huge coordinates", whole.replace(b"1]", b"1e300]")
    yield "features that are no list", b'{"type": "FeatureCollection", "features": {}}'
    yield "a feature that is a number", b'{"type": "FeatureCollection", "features": [7]}'
    yield "deep properties", properties(label="?").replace(
        b'"?"', b'"x", "deep": ' + b"[" * 1000 + b"]" * 1000)
    for what, geometry in (
            ("text", "x"), ("without coordinates", {"type": "Point"}),
            ("of an unknown type", {"type": "Curve", "coordinates": [0, 0]}),
            ("of coordinates in an object", {"type": "Point", "coordinates": {"x": 0}}),
            ("of a polygon of numbers", {"type": "Polygon", "coordinates": [0, 0]}),
            ("of a polygon without rings", {"type": "Polygon", "coordinates": []}),
            ("of a ring without vertices", {"type": "Polygon", "coordinates": [[]]}),
            ("of a multipolygon of points", {"type": "MultiPolygon", "coordinates": [[0, 0]]}),
            ("of too many vertices", {"type": "LineString", "coordinates": [
                [i, 0] for i in range(MAX_VERTICES + 1)]})):
        yield f"a geometry {what}", feature(geometry=geometry)
    yield "a hole outside", geojson([[[0, 0], [1, 0], [1, 1], [0, 0]],
                                     [[5, 5], [6, 5], [6, 6], [5, 5]]])
    for what, members in (
            ("a number as label", {"label": 7}), ("an empty label", {"label": ""}),
            ("text as classes", {"classes": "x"}),
            ("null as confidence", {"classes": {"x": None}}),
            ("confidence 2", {"classes": {"x": 2}}), ("existence -1", {"existence": -1}),
            ("numbers as tags", {"tags": [1, 2]}),
            ("a height upside down", {"height_min": 2, "height_max": 1})):
        yield f"an object with {what}", properties(**members)
    yield "an object as id", feature(id={})
    yield "a deletion of nothing", feature(id=7, geometry=None)
    yield "a frame of odd letters", json.dumps({**point, "frame": "a\0/b"}).encode()


def chunk(name, data):
    data = data.encode() if isinstance(data, str) else data
    return {"chunk": {"file_name": name, "data": base64.b64encode(data).decode()}}


def upload(file_format, *files, layer="new"):
    """Returns a function from the name of a map to the requests of ImportMap."""
    return lambda name: [
        {"header": {"map": name, "format": file_format, "layer": layer, "create_map": True}},
        *(chunk(*file) for file in files)]


def uploads(outside):
    """Yields (description, function from the name of a map to the requests of ImportMap)."""
    for what, data in hmap_files(outside):
        yield f"hmap: {what}", upload("FILE_FORMAT_HMAP", ("x.hmap", data))
    for what, files in nav2_files():
        yield f"nav2: {what}", upload("FILE_FORMAT_NAV2", *files)
    for what, data in geojson_files():
        yield f"geojson: {what}", upload("FILE_FORMAT_GEOJSON", ("x.geojson", data))
    good = ("x.hmap", GOOD)
    for name in ("", "../x.hmap", f"{outside}/x.hmap", "..\\x.hmap", "a/b"):
        yield f"the file name {name!r}", upload("FILE_FORMAT_HMAP", (name, GOOD))
    for layer in ("", "../x", "a/b", "a\0b", "x" * 64):
        yield f"the layer {layer!r}", upload("FILE_FORMAT_GEOJSON",
                                             ("x.geojson", geojson([0, 0], "Point")), layer=layer)
    for what, unknown in (("no", 0), ("an unknown", 99)):
        yield f"{what} format", upload(unknown, good)
    yield "no file", upload("FILE_FORMAT_HMAP")
    yield "two files", upload("FILE_FORMAT_HMAP", good, ("y.hmap", GOOD))
    yield "more than may be imported", upload(
        "FILE_FORMAT_HMAP", *(("x.hmap", bytes(1_000_000)) for _ in range(5)))
    yield "no header", lambda name: [chunk(*good)]
    yield "nothing", lambda name: []
    yield "an empty message", lambda name: [*upload("FILE_FORMAT_HMAP", good)(name), {}]
    yield "two headers", lambda name: 2 * upload("FILE_FORMAT_HMAP")(name)
