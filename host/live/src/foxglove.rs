//! A Foxglove WebSocket server: the numbers for PlotJuggler, Lichtblick and Foxglove, to read alone.
//!
//! Written from the protocol's specification, version 1 (<https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>):
//! `serverInfo`, `advertise`, `subscribe`, `unsubscribe`, and message data with operation code 1. Subprotocol
//! `foxglove.sdk.v1` has the same messages. Left out: everything that a client could change (its own messages,
//! parameters, services) and time, connection graph and assets; `serverInfo` announces no such capability.
//!
//! A message is CDR (OMG DDS-XTypes, the encoding of ROS 2): four bytes of head for little-endian, then the fields, all
//! `float64`, which lie aligned without padding.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use axum::Router;
use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use rig_link::COLUMNS;
use rig_shared::link::PARAMETER_NAMES;
use serde_json::{Value, json};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc;

use super::access::Access;
use super::guarded::{Guarded, guard};
use super::hub::Hub;
use super::packet::Packet;

/// Subprotocols, the preferred one first.
const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Channel of the samples.
const STATE: u64 = 1;
/// Channel of the on-line estimates.
const ESTIMATE: u64 = 2;
/// Largest message of a client, bytes.
const MAX_MESSAGE: usize = 1 << 16;

/// Returns the server.
pub(crate) fn app(hub: Arc<Hub>, access: Access) -> Router {
    let app = Guarded { hub, access };
    Router::new()
        .route("/", get(upgrade))
        .layer(from_fn_with_state(app.clone(), guard))
        .with_state(app)
}

async fn upgrade(State(app): State<Guarded>, socket: WebSocketUpgrade) -> Response {
    let socket = socket.protocols(SUBPROTOCOLS);
    if socket.selected_protocol().is_none() {
        let said = format!(
            "This is a Foxglove WebSocket server; ask for the subprotocol {}.\n",
            SUBPROTOCOLS.join(" or ")
        );
        return (StatusCode::BAD_REQUEST, said).into_response();
    }
    socket
        .max_message_size(MAX_MESSAGE)
        .on_upgrade(move |socket| converse(app.hub, socket))
}

/// A change of a client's subscriptions: its number, and the channel or its end.
type Change = (u32, Option<u64>);

async fn converse(hub: Arc<Hub>, socket: WebSocket) {
    let (to, from) = socket.split();
    let (changes, changed) = mpsc::unbounded_channel();
    tokio::select! {
        _ = send(&hub, to, changed) => {}
        () = receive(from, changes) => {}
    }
}

async fn receive(mut from: SplitStream<WebSocket>, changes: mpsc::UnboundedSender<Change>) {
    while let Some(Ok(message)) = from.next().await {
        let Message::Text(text) = message else {
            continue;
        };
        let message: Value = serde_json::from_str(&text).unwrap_or_default();
        let list = |key: &str| message[key].as_array().cloned().unwrap_or_default();
        let number = |value: &Value| value.as_u64().and_then(|id| u32::try_from(id).ok());
        let asked: Vec<Change> = match message["op"].as_str().unwrap_or_default() {
            "subscribe" => (list("subscriptions").iter())
                .filter_map(|one| Some((number(&one["id"])?, Some(one["channelId"].as_u64()?))))
                .collect(),
            "unsubscribe" => (list("subscriptionIds").iter())
                .filter_map(|id| Some((number(id)?, None)))
                .collect(),
            // Among them clientInfo of the newer subprotocol, which needs no answer.
            _ => Vec::new(),
        };
        for change in asked {
            if changes.send(change).is_err() {
                return;
            }
        }
    }
}

async fn send(
    hub: &Hub,
    mut to: SplitSink<WebSocket, Message>,
    mut changed: mpsc::UnboundedReceiver<Change>,
) -> Result<(), axum::Error> {
    let mut packets = hub.packets();
    for message in [server_info(), advertise()] {
        to.send(Message::Text(message.to_string().into())).await?;
    }
    let mut subscriptions = BTreeMap::new();
    let mut zero = None;
    loop {
        tokio::select! {
            biased;
            Some((id, channel)) = changed.recv() => {
                match channel {
                    Some(channel) => subscriptions.insert(id, channel),
                    None => subscriptions.remove(&id),
                };
            }
            packet = packets.recv() => match packet {
                Ok(packet) => {
                    let zero = *zero.get_or_insert_with(|| wall_clock(&packet));
                    for message in messages(&packet, &subscriptions, zero) {
                        to.feed(Message::Binary(message.into())).await?;
                    }
                    to.flush().await?;
                }
                // A viewer that is too slow sees a gap in the time stamps.
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return Ok(()),
            },
        }
    }
}

/// Returns the time of the computer, s since 1970, at which the rig's clock read zero, according to a packet that has
/// just come.
fn wall_clock(packet: &Packet) -> f64 {
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    let last = match packet {
        Packet::Samples(samples) => samples.rows.last().map_or(0.0, |row| row.t),
        Packet::Estimate(estimate) => estimate.values[0],
    };
    now.as_secs_f64() - last
}

/// Encodes a packet for every subscription of its channel.
fn messages(packet: &Packet, subscriptions: &BTreeMap<u32, u64>, zero: f64) -> Vec<Vec<u8>> {
    let channel = match packet {
        Packet::Samples(_) => STATE,
        Packet::Estimate(_) => ESTIMATE,
    };
    let subscribed = subscriptions.iter().filter(|(_, on)| **on == channel);
    subscribed
        .flat_map(|(id, _)| match packet {
            Packet::Samples(samples) => (samples.rows.iter())
                .map(|row| message_data(*id, zero, &row.values()))
                .collect(),
            Packet::Estimate(estimate) => vec![message_data(*id, zero, &estimate.values)],
        })
        .collect()
}

/// Encodes a message whose first field is its time.
fn message_data(subscription: u32, zero: f64, fields: &[f64]) -> Vec<u8> {
    let time = zero + fields.first().copied().unwrap_or_default();
    let mut bytes = Vec::with_capacity(17 + 8 * fields.len());
    bytes.push(1);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(((time * 1e9) as u64).to_le_bytes());
    // CDR, little-endian.
    bytes.extend([0, 1, 0, 0]);
    bytes.extend(fields.iter().flat_map(|field| field.to_le_bytes()));
    bytes
}

fn server_info() -> Value {
    let started = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    json!({
        "op": "serverInfo",
        "name": "rig live",
        "capabilities": [],
        "metadata": {"rig": env!("CARGO_PKG_VERSION")},
        "sessionId": started.as_millis().to_string(),
    })
}

fn advertise() -> Value {
    let channel = |id: u64, topic: &str, schema: &str, fields: &[String]| {
        json!({
            "id": id,
            "topic": topic,
            "encoding": "cdr",
            "schemaName": schema,
            "schemaEncoding": "ros2msg",
            "schema": fields.iter().map(|name| format!("float64 {name}\n")).collect::<String>(),
        })
    };
    json!({
        "op": "advertise",
        "channels": [
            channel(STATE, "/rig/state", "rig/msg/State", &COLUMNS.map(field_name)),
            channel(ESTIMATE, "/rig/estimate", "rig/msg/Estimate", &estimate_fields()),
        ],
    })
}

/// Returns the name in the form that ROS 2 asks of a field: small letters.
fn field_name(name: &str) -> String {
    name.to_ascii_lowercase()
}

/// Names of what an estimate says of its rows: counts since the estimator's last restart, and the number of
/// [`Learning`](rig_shared::estimation::Learning).
const LEARNING_FIELDS: [&str; 4] = ["rows_used", "rows_masked", "rows_uninformative", "learning"];

/// Returns the names of an estimate's values, in the order of
/// [`EstimateValues`](super::packet::EstimateValues).
pub(crate) fn estimate_fields() -> Vec<String> {
    let each = |end: &str| PARAMETER_NAMES.map(|name| field_name(name) + end);
    ["t", "residual_rms"]
        .map(field_name)
        .into_iter()
        .chain(each(""))
        .chain(each("_std"))
        .chain(each("_trusted"))
        .chain(LEARNING_FIELDS.map(field_name))
        .collect()
}
