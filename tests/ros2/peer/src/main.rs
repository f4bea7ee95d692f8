//! One node of ROS 2 that does what a test tells it, on 127.0.0.1 and without multicast.
//!
//!     hypermap_ros2_peer DOMAIN cyclone|enhanced
//!
//! The second argument is how its clients tell calls apart: as rmw_cyclonedds_cpp, or as
//! rmw_fastrtps_cpp. Each line of stdin is a command in JSON, and is answered by a line:
//!
//! | command | answer |
//! |---|---|
//! | `{"map": TOPIC}` | the OccupancyGrid of a latched topic; `data` is the CRC-32 of its cells |
//! | `{"node": NAME}` | `null`, as soon as the graph has the node |
//! | `{"call": SERVICE, "request": {…}}` | the response |
//!
//! A command that fails ends the program with an error. Deadlines are the test's.

mod messages;
mod services;

use std::collections::{BTreeSet, HashMap};
use std::error::Error;
use std::io::{self, BufRead};
use std::net::Ipv4Addr;
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use futures::executor::block_on;
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::qos::{Durability, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeEvent, NodeName, NodeOptions, QosProfile,
    ServiceMapping,
};
use serde_json::Value;

use messages::OccupancyGrid;
use services::JsonClient;

struct Peer {
    node: Node,
    mapping: ServiceMapping,
    clients: HashMap<String, Box<dyn JsonClient>>,
    /// What the graph tells, and what of it was received.
    told_nodes: Receiver<String>,
    known_nodes: BTreeSet<String>,
}

impl Peer {
    fn new(domain: u16, mapping: ServiceMapping) -> Result<Self, Box<dyn Error>> {
        let participant = DomainParticipantBuilder::new(domain)
            .with_only_networks([Ipv4Addr::LOCALHOST])
            .build()?;
        let mut node = Context::from_domain_participant(participant)?
            .new_node(NodeName::new("/", "peer")?, NodeOptions::new())?;
        let told_nodes = watch_graph(&mut node)?;
        Ok(Self {
            node,
            mapping,
            clients: HashMap::new(),
            told_nodes,
            known_nodes: BTreeSet::new(),
        })
    }

    fn answer(&mut self, command: &Value) -> Result<Value, Box<dyn Error>> {
        if let Some(topic) = command["map"].as_str() {
            Ok(serde_json::to_value(self.next_map(topic)?)?)
        } else if let Some(name) = command["node"].as_str() {
            self.await_node(name)?;
            Ok(Value::Null)
        } else if let Some(service) = command["call"].as_str() {
            self.call(service, &command["request"])
        } else {
            Err(format!("no such command: {command}").into())
        }
    }

    fn next_map(&mut self, topic: &str) -> Result<OccupancyGrid, Box<dyn Error>> {
        let qos = QosProfile::subscription_default()
            .reliability_reliable(WhenFull::DEFAULT)
            .durability(Durability::TransientLocal);
        let topic = self.node.create_topic(
            &Name::parse(topic)?,
            MessageTypeName::new("nav_msgs", "OccupancyGrid"),
            &qos,
        )?;
        let subscription = self.node.create_subscription(&topic, Some(qos))?;
        let (grid, _) = block_on(subscription.async_take())?;
        Ok(grid)
    }

    fn await_node(&mut self, name: &str) -> Result<(), Box<dyn Error>> {
        while !self.known_nodes.contains(name) {
            self.known_nodes.insert(self.told_nodes.recv()?);
        }
        Ok(())
    }

    fn call(&mut self, service: &str, request: &Value) -> Result<Value, Box<dyn Error>> {
        if !self.clients.contains_key(service) {
            let client = services::make_client(&mut self.node, self.mapping, service)?;
            self.clients.insert(service.to_owned(), client);
        }
        self.clients[service].call(&self.node, request)
    }
}

/// Lets the node take part in the graph, and returns the names of the nodes there as they come.
fn watch_graph(node: &mut Node) -> Result<Receiver<String>, Box<dyn Error>> {
    let spinner = node.spinner()?;
    let events = node.status_receiver().ok_or("the node has no events")?;
    thread::spawn(move || block_on(spinner.spin()));
    let (sender, names) = channel();
    // Only a few events are kept, so this takes them all the time.
    thread::spawn(move || {
        while let Ok(event) = events.recv_blocking() {
            let NodeEvent::ParticipantEntities(info) = event else {
                continue;
            };
            for node in info.nodes() {
                // Nobody receives at the end of the program.
                let _ = sender.send(node.fully_qualified_name());
            }
        }
    });
    Ok(names)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, domain, mapping] = arguments.as_slice() else {
        return Err("usage: hypermap_ros2_peer DOMAIN cyclone|enhanced".into());
    };
    let mapping = match mapping.as_str() {
        "cyclone" => ServiceMapping::Cyclone,
        "enhanced" => ServiceMapping::Enhanced,
        _ => return Err(format!("no mapping {mapping}").into()),
    };
    let mut peer = Peer::new(domain.parse()?, mapping)?;
    for line in io::stdin().lock().lines() {
        let command = serde_json::from_str(&line?)?;
        println!("{}", peer.answer(&command)?);
    }
    Ok(())
}
