//! Clients of the services of `hypermap-ros2`, which take requests and give responses as JSON.

use std::error::Error;

use futures::executor::block_on;
use ros2_client::{
    Client, Message, Name, Node, QosProfile, ServiceMapping, ServiceTypeName, qos::History,
};
use serde_json::Value;

use crate::messages::*;

/// A client of a service of any type.
pub trait JsonClient {
    /// Waits until the service is there, calls it, and waits for the response, without a deadline.
    fn call(&self, node: &Node, request: &Value) -> Result<Value, Box<dyn Error>>;
}

impl<Request, Response> JsonClient for Client<Request, Response>
where
    Request: Message + 'static,
    Response: Message + 'static,
{
    fn call(&self, node: &Node, request: &Value) -> Result<Value, Box<dyn Error>> {
        let request = Request::deserialize(request)?;
        block_on(self.wait_for_service(node));
        let response = block_on(self.async_call_service(request))?;
        Ok(serde_json::to_value(response)?)
    }
}

/// Makes a client of the service with this name, whose last part decides its type.
pub fn make_client(
    node: &mut Node,
    mapping: ServiceMapping,
    name: &str,
) -> Result<Box<dyn JsonClient>, Box<dyn Error>> {
    macro_rules! client {
        ($request:ty => $response:ty, $package:literal, $type:literal) => {{
            let qos = QosProfile::publisher_default().history(History::KeepLast { depth: 10 });
            let client = node.create_client::<$request, $response>(
                mapping,
                &Name::parse(name)?,
                &ServiceTypeName::new($package, $type),
                qos.clone(),
                qos,
            )?;
            Ok(Box::new(client))
        }};
    }
    match name.rsplit('/').next().unwrap_or_default() {
        "get_int_at_point" => client!(AtPoint => Int, "hypermap_msgs", "GetIntAtPoint"),
        "get_string_at_point" => client!(AtPoint => Text, "hypermap_msgs", "GetStringAtPoint"),
        "get_ints_by_area" => client!(ByArea => Ints, "hypermap_msgs", "GetIntsByArea"),
        "get_strings_by_area" => client!(ByArea => Texts, "hypermap_msgs", "GetStringsByArea"),
        "get_locations_by_int" => {
            client!(ByInt => Locations, "hypermap_msgs", "GetLocationsByInt")
        }
        "get_locations_by_string" => {
            client!(ByString => Locations, "hypermap_msgs", "GetLocationsByString")
        }
        "get_semantic_by_area" => client!(InArea => Objects, "hypermap_msgs", "GetSemanticByArea"),
        "get_semantic_by_string" => {
            client!(Named => Objects, "hypermap_msgs", "GetSemanticByString")
        }
        "map" => client!(GetMap => Map, "nav_msgs", "GetMap"),
        "load_map" => client!(LoadMap => LoadedMap, "nav2_msgs", "LoadMap"),
        _ => Err(format!("no service {name} is known").into()),
    }
}
