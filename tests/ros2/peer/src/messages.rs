//! Messages and services as `.msg` and `.srv` files define them. serde encodes them in CDR for the
//! network and in JSON for the test.

use ros2_client::Message;
use serde::{Deserialize, Serialize, Serializer};

/// Defines structs of public fields that can be sent.
macro_rules! messages {
    ($($name:ident { $($(#[$attribute:meta])* $field:ident: $type:ty),* $(,)? })*) => {$(
        #[derive(Clone, Serialize, Deserialize)]
        pub struct $name { $($(#[$attribute])* pub $field: $type),* }
        impl Message for $name {}
    )*};
}

// builtin_interfaces, std_msgs, geometry_msgs, nav_msgs and hypermap_msgs
messages! {
    Time { sec: i32, nanosec: u32 }
    Header { stamp: Time, frame_id: String }
    Point { x: f64, y: f64, z: f64 }
    Point32 { x: f32, y: f32, z: f32 }
    Quaternion { x: f64, y: f64, z: f64, w: f64 }
    Pose { position: Point, orientation: Quaternion }
    Polygon { points: Vec<Point32> }
    PointStamped { header: Header, point: Point }
    PolygonStamped { header: Header, polygon: Polygon }
    MapMetaData { map_load_time: Time, resolution: f32, width: u32, height: u32, origin: Pose }
    OccupancyGrid {
        header: Header,
        info: MapMetaData,
        #[serde(serialize_with = "serialize_checksum")]
        data: Vec<i8>,
    }
    SemanticObject { id: u32, shape: Polygon, name: String, tags: Vec<String>, confidence: Vec<f64> }
}

// Requests
messages! {
    AtPoint { layer: String, location: PointStamped }
    ByArea { layer: String, area: PolygonStamped }
    ByInt { layer: String, value: i32, area: PolygonStamped }
    ByString { layer: String, name: String, area: PolygonStamped }
    InArea { area: PolygonStamped }
    Named { name: String }
    GetMap { structure_needs_at_least_one_member: u8 }
    LoadMap { map_url: String }
}

// Responses
messages! {
    Int { value: i32 }
    Text { name: String }
    Ints { values: Vec<i32>, locations: Vec<Point> }
    Texts { names: Vec<String>, locations: Vec<Point> }
    Locations { locations: Vec<Point> }
    Objects { objects: Vec<SemanticObject> }
    Map { map: OccupancyGrid }
    LoadedMap { map: OccupancyGrid, result: u8 }
}

/// The cells as the CRC-32 of their bytes. Grids are only received, so only the test gets it.
fn serialize_checksum<S: Serializer>(cells: &[i8], serializer: S) -> Result<S::Ok, S::Error> {
    let bytes: Vec<u8> = cells.iter().map(|&cell| cell as u8).collect();
    serializer.serialize_u32(crc32fast::hash(&bytes))
}
