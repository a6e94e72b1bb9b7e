//! JSON over UDP for PlotJuggler's "UDP Server": one datagram a sample, with the time in `timestamp`.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use rig_link::COLUMNS;
use serde_json::{Map, Value, json};
use tokio::net::UdpSocket;
use tokio::sync::broadcast::error::RecvError;

use super::foxglove::estimate_fields;
use super::hub::Hub;
use super::packet::Packet;

/// Sends every packet to `address`. Datagrams that nobody takes are lost, without an effect on the rest.
pub(crate) async fn send(hub: Arc<Hub>, address: SocketAddr) -> io::Result<()> {
    let here: SocketAddr = if address.is_ipv4() {
        ([0, 0, 0, 0], 0).into()
    } else {
        ([0; 8], 0).into()
    };
    let socket = UdpSocket::bind(here).await?;
    let mut packets = hub.packets();
    let parameters = estimate_fields();
    loop {
        match packets.recv().await {
            Ok(packet) => {
                for datagram in datagrams(&packet, &parameters) {
                    // Refused while no receiver listens.
                    let _refused = socket.send_to(datagram.as_bytes(), address).await;
                }
            }
            Err(RecvError::Lagged(_)) => {}
            Err(RecvError::Closed) => return Ok(()),
        }
    }
}

fn datagrams(packet: &Packet, parameters: &[String]) -> Vec<String> {
    match packet {
        Packet::Samples(samples) => (samples.rows.iter())
            .map(|row| datagram("rig", COLUMNS.into_iter(), &row.values()))
            .collect(),
        Packet::Estimate(estimate) => {
            let names = parameters.iter().map(String::as_str);
            vec![datagram("estimate", names, &estimate.values)]
        }
    }
}

/// Returns the values under their names; the first one is the time.
fn datagram<'a>(group: &str, names: impl Iterator<Item = &'a str>, values: &[f64]) -> String {
    let named: Map<String, Value> = names
        .zip(values)
        .skip(1)
        .map(|(name, value)| (name.to_owned(), json!(value)))
        .collect();
    json!({"timestamp": values.first(), group: named}).to_string()
}
