//! The page's server: the page, its WebSocket, uploads and stop.
//!
//! On the WebSocket the server sends packets (binary, [`packet`](super::packet)) and JSON: `hello` once, `status` 25
//! times a second, `answer` to an order, and `missed` with the number of samples that this client has missed because it
//! was too slow. The client sends orders as JSON: `{"op": "arm", "id": 3}`. `{"op": "stop"}` has no answer: `status`
//! tells how far the stop has got. Uploads come by their own request, so that a stop never waits behind a file.

use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc;

use super::access::Access;
use super::guarded::{Guarded, guard};
use super::hub::{Action, Answer, Hub};
use super::packet::Packet;
use super::page;

/// Largest upload, bytes; the reader of trajectory files takes no more either.
const MAX_UPLOAD: usize = 1 << 20;
/// Largest order on the WebSocket, bytes.
const MAX_ORDER: usize = 1 << 14;
/// Answers that wait for a slow client.
const ANSWERS: usize = 16;

/// Returns the server of the page.
pub(crate) fn app(hub: Arc<Hub>, access: Access) -> Router {
    let app = Guarded { hub, access };
    Router::new()
        .route("/", get(show))
        .route("/live", get(upgrade))
        .route("/motion", post(load))
        .route("/stop", post(stop))
        .layer(DefaultBodyLimit::max(MAX_UPLOAD))
        .layer(from_fn_with_state(app.clone(), page_guard))
        .with_state(app)
}

/// [`guard`], and the headers that keep the page to itself.
async fn page_guard(app: State<Guarded>, request: Request, next: Next) -> Response {
    let mut response = guard(app, request, next).await;
    let headers = response.headers_mut();
    let fixed = [
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, page::POLICY),
    ];
    for (name, value) in fixed {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn show(State(app): State<Guarded>) -> Response {
    let mut response = Html(page::page()).into_response();
    let cookie = app.access.cookie();
    if let Some(cookie) = cookie.and_then(|text| HeaderValue::from_str(&text).ok()) {
        response.headers_mut().insert(header::SET_COOKIE, cookie);
    }
    response
}

async fn stop(State(app): State<Guarded>) -> &'static str {
    app.hub.stop();
    "Stop was sent; the page and the mode of the rig tell when the board has confirmed it.\n"
}

/// Loads a trajectory file; its name stands in the query, percent-encoded.
async fn load(State(app): State<Guarded>, uri: Uri, body: Bytes) -> Response {
    let name = (uri.query().unwrap_or_default().split('&'))
        .find_map(|pair| pair.strip_prefix("name="))
        .map_or_else(|| "motion.toml".to_owned(), decoded);
    let answer = match String::from_utf8(body.to_vec()) {
        Ok(text) => app.hub.ask(Action::Load { name, text }).await,
        Err(_) => Err(format!(
            "{name} is no text; a trajectory file is TOML, as `rig excite` writes it."
        )
        .into()),
    };
    let status = if answer.is_ok() {
        StatusCode::OK
    } else {
        StatusCode::UNPROCESSABLE_ENTITY
    };
    (status, sentence(answer)).into_response()
}

fn sentence(answer: Answer) -> String {
    answer.unwrap_or_else(|refused| refused.text)
}

/// Decodes percent-encoded text; what is no UTF-8 is replaced.
fn decoded(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let code = (tail.get(..2))
            .filter(|_| first == b'%')
            .and_then(|two| std::str::from_utf8(two).ok())
            .and_then(|two| u8::from_str_radix(two, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = tail
            .get(if code.is_some() { 2 } else { 0 }..)
            .unwrap_or_default();
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

async fn upgrade(State(app): State<Guarded>, socket: WebSocketUpgrade) -> Response {
    socket
        .max_message_size(MAX_ORDER)
        .on_upgrade(move |socket| converse(app.hub, socket))
}

/// Talks to one page. Sending and receiving do not wait for each other, so that a page that is too slow for the
/// samples can still stop the rig.
async fn converse(hub: Arc<Hub>, socket: WebSocket) {
    let _open = hub.viewer();
    let (to, from) = socket.split();
    let (answers, answered) = mpsc::channel(ANSWERS);
    tokio::select! {
        _ = send(&hub, to, answered) => {}
        () = receive(&hub, from, answers) => {}
    }
}

async fn send(
    hub: &Hub,
    mut to: SplitSink<WebSocket, Message>,
    mut answered: mpsc::Receiver<String>,
) -> Result<(), axum::Error> {
    let mut packets = hub.packets();
    let mut status = hub.status();
    to.send(text(hub.hello().await.as_ref())).await?;
    status.mark_changed();
    let (mut expected, mut missed) = (None, 0);
    loop {
        tokio::select! {
            biased;
            Ok(()) = status.changed() => {
                let now = status.borrow_and_update().clone();
                if !now.is_empty() {
                    to.send(text(now.as_ref())).await?;
                }
            }
            Some(answer) = answered.recv() => to.send(text(&answer)).await?,
            packet = packets.recv() => match packet {
                Ok(packet) => {
                    if let Packet::Samples(samples) = packet.as_ref() {
                        let lost = samples.first - expected.unwrap_or(samples.first);
                        expected = Some(samples.first + samples.rows.len() as u64);
                        missed += lost;
                        if lost > 0 {
                            let told = json!({"op": "missed", "samples": lost, "total": missed});
                            to.send(text(&told.to_string())).await?;
                        }
                    }
                    to.send(Message::Binary(bytes_of(&packet))).await?;
                }
                // The next packet tells by its number how many samples are missing.
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return Ok(()),
            },
        }
    }
}

fn text(text: &str) -> Message {
    Message::Text(text.into())
}

fn bytes_of(packet: &Packet) -> Bytes {
    match packet {
        Packet::Samples(samples) => samples.bytes.clone(),
        Packet::Estimate(estimate) => estimate.bytes.clone(),
    }
}

async fn receive(hub: &Arc<Hub>, mut from: SplitStream<WebSocket>, answers: mpsc::Sender<String>) {
    while let Some(Ok(message)) = from.next().await {
        let Message::Text(order) = message else {
            continue;
        };
        let order: Value = serde_json::from_str(&order).unwrap_or_default();
        let id = order["id"].clone();
        let action = match order["op"].as_str().unwrap_or_default() {
            "stop" => {
                hub.stop();
                continue;
            }
            "arm" => Ok(Action::Arm),
            "disarm" => Ok(Action::Disarm),
            "clear" => Ok(Action::ClearFault),
            "start" => Ok(Action::Start {
                shifted: order["shifted"].as_bool().unwrap_or_default(),
            }),
            "record" => Ok(Action::Record(order["on"].as_bool().unwrap_or_default())),
            other => Err(format!("There is no order \"{other}\".")),
        };
        // An order may wait for the rig: the next message, which may be stop, must not wait for it.
        let (hub, answers) = (hub.clone(), answers.clone());
        tokio::spawn(async move {
            let answer = match action {
                Ok(action) => hub.ask(action).await,
                Err(sentence) => Err(sentence.into()),
            };
            let told = match answer {
                Ok(text) => json!({"op": "answer", "id": id, "ok": true, "text": text}),
                Err(refused) => json!({
                    "op": "answer", "id": id, "ok": false,
                    "text": refused.text, "shift": refused.shift,
                }),
            };
            // A page that has closed needs no answer.
            let _closed = answers.send(told.to_string()).await;
        });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use std::io::ErrorKind;
    use std::net::TcpStream;
    use std::time::{Duration, Instant};

    use super::super::access::Origins;
    use super::*;
    use rig_link::Row;

    #[test]
    fn names_are_decoded() {
        assert_eq!(decoded("my%20motion%C3%A9.toml"), "my motioné.toml");
        assert_eq!(decoded("100%"), "100%");
        assert_eq!(decoded("%zz%4"), "%zz%4");
    }

    /// The next message. A read with a timeout ends with `EINTR` if the process is halted and goes on (signal(7)).
    fn read(socket: &mut tungstenite::WebSocket<TcpStream>) -> tungstenite::Message {
        loop {
            match socket.read() {
                Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
                message => return message.unwrap(),
            }
        }
    }

    /// Starts the server on its own thread; returns its address.
    fn serve(hub: Arc<Hub>) -> String {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap().to_string();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build()
                .unwrap();
            runtime.block_on(async {
                let listener = tokio::net::TcpListener::from_std(listener).unwrap();
                let access = Access {
                    token: None,
                    origins: Origins::Own,
                };
                axum::serve(listener, app(hub, access)).await.unwrap();
            });
        });
        address
    }

    /// A page that does not read: it delays nobody, can still stop the rig, and is told how many samples it has missed.
    #[test]
    fn a_slow_page_delays_nothing_and_is_told_what_it_missed() {
        const ROWS: u64 = 40;
        const PACKETS: u64 = 5000;
        let (hub, _orders) = Hub::new();
        hub.set_hello(r#"{"op":"hello"}"#.to_owned());
        let address = serve(hub.clone());
        let stream = TcpStream::connect(&address).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        let (mut socket, _) = tungstenite::client(format!("ws://{address}/live"), stream).unwrap();
        let hello = read(&mut socket);
        assert!(hello.is_text());
        for k in 0..PACKETS {
            let rows = vec![Row::default(); ROWS as usize];
            hub.publish(Packet::samples(k * ROWS, rows));
            // Time for the server's thread to fill the buffers of the connection.
            if k % 200 == 0 {
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        socket
            .send(tungstenite::Message::text(r#"{"op":"stop"}"#))
            .unwrap();
        let begin = Instant::now();
        while hub.stops() == 0 {
            assert!(begin.elapsed() < Duration::from_secs(20), "stop waits");
            std::thread::sleep(Duration::from_millis(1));
        }
        let (mut received, mut missed, mut told) = (0, 0, 0);
        while received + missed < PACKETS * ROWS {
            match read(&mut socket) {
                tungstenite::Message::Binary(bytes) => {
                    let first = f64::from_le_bytes(bytes[8..16].try_into().unwrap()) as u64;
                    // What is missing before this packet was told before.
                    assert_eq!(first, received + missed);
                    received += ROWS;
                }
                tungstenite::Message::Text(text) => {
                    let message: Value = serde_json::from_str(&text).unwrap();
                    if message["op"] == "missed" {
                        missed += message["samples"].as_u64().unwrap();
                        told = message["total"].as_u64().unwrap();
                    }
                }
                other => panic!("{other}"),
            }
        }
        assert!(missed > 0 && missed == told, "{missed} of {told}");
    }
}
