//! `rig live` with the emulated rig: each kind of client, and who is refused.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::path::Path;
use std::process::{Child, ChildStdout, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use crate::run::{refuse, rig, robot, succeed};

/// Longest wait for anything: a busy computer runs the emulated rig slower than real time.
const PATIENCE: Duration = Duration::from_secs(60);
/// Columns of a sample: t, q1, i1, u1, ref1, qd1, tau_cmd1, limits, mode.
const COLUMNS: usize = 9;
const POSITION: usize = 1;
const MODE: usize = 8;
const DISARMED: f64 = 1.0;
const HOLDING: f64 = 2.0;
const RUNNING: f64 = 3.0;

/// A running `rig live`.
struct Live {
    child: Child,
    /// Held open: who prints to a closed pipe ends.
    _lines: BufReader<ChildStdout>,
    folder: TempDir,
    page: String,
    foxglove: Option<String>,
}

impl Live {
    fn start(args: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut child = rig()
            .args([
                "live",
                "--emulated",
                "--listen",
                "127.0.0.1:0",
                "--out",
                ".",
            ])
            .args(args)
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let wanted = 1 + usize::from(args.contains(&"--foxglove"));
        let mut reader = BufReader::new(child.stdout.take().unwrap());
        let lines: Vec<String> = (reader.by_ref().lines())
            .take(wanted)
            .map(Result::unwrap)
            .collect();
        let address = |line: &String| {
            let (_, rest) = line.split_once("://").unwrap();
            rest.split(['/', ' ']).next().unwrap().to_owned()
        };
        Self {
            child,
            _lines: reader,
            folder,
            page: address(&lines[0]),
            foxglove: lines.get(1).map(address),
        }
    }

    fn http(&self, head: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        http(&self.page, head, headers, body)
    }

    fn watch(&self) -> Watcher {
        let socket = socket(&format!("ws://{}/live", self.page), &[]).unwrap();
        Watcher {
            socket,
            samples: Vec::new(),
            next: None,
            estimates: 0,
            status: Value::Null,
            answers: Vec::new(),
        }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

/// Sends one request and returns the status and the whole answer. A header named `Host` replaces the usual one.
fn http(address: &str, head: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut text = format!(
        "{head} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n",
        body.len()
    );
    if !headers.iter().any(|(name, _)| *name == "Host") {
        text += &format!("Host: {address}\r\n");
    }
    for (name, value) in headers {
        text += &format!("{name}: {value}\r\n");
    }
    stream.write_all((text + "\r\n" + body).as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
    (status, answer)
}

/// Opens a WebSocket, or returns the status of the refusal.
fn socket(url: &str, headers: &[(&'static str, &str)]) -> Result<WebSocket<TcpStream>, u16> {
    let mut request = url.into_client_request().unwrap();
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().unwrap());
    }
    let address = request.uri().authority().unwrap().to_string();
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    match tungstenite::client(request, stream) {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(other) => panic!("{other}"),
    }
}

/// The next message. A read with a timeout ends with `EINTR` if the process is halted and goes on (signal(7)).
fn read(socket: &mut WebSocket<TcpStream>) -> Message {
    loop {
        match socket.read() {
            Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
            message => return message.unwrap(),
        }
    }
}

/// A page, as the server sees it.
struct Watcher {
    socket: WebSocket<TcpStream>,
    samples: Vec<[f64; COLUMNS]>,
    /// Number of the next sample.
    next: Option<f64>,
    estimates: usize,
    status: Value,
    answers: Vec<Value>,
}

impl Watcher {
    /// Takes messages until `done`.
    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let begin = Instant::now();
        while !done(self) {
            assert!(begin.elapsed() < PATIENCE, "no {what}; {}", self.status);
            match read(&mut self.socket) {
                Message::Text(text) => {
                    let message: Value = serde_json::from_str(&text).unwrap();
                    match message["op"].as_str().unwrap() {
                        "status" => self.status = message,
                        "answer" => self.answers.push(message),
                        other => assert_eq!(other, "hello", "{message}"),
                    }
                }
                Message::Binary(bytes) => self.packet(&bytes),
                other => panic!("{other}"),
            }
        }
    }

    fn packet(&mut self, bytes: &[u8]) {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let number = |k: usize| f64::from_le_bytes(bytes[8 * k..8 * k + 8].try_into().unwrap());
        let count = word(4) as usize;
        if word(0) == 2 {
            assert_eq!(bytes.len(), 16 + 8 * count);
            self.estimates += 1;
            return;
        }
        assert_eq!((word(0), bytes.len()), (1, 16 + 8 * COLUMNS * count));
        // Nothing was missed on the way to this client.
        assert_eq!(*self.next.get_or_insert(number(1)), number(1));
        self.next = Some(number(1) + count as f64);
        for k in 0..count {
            self.samples
                .push(std::array::from_fn(|column| number(2 + column * count + k)));
        }
    }

    fn order(&mut self, order: Value) {
        self.socket.send(Message::text(order.to_string())).unwrap();
    }

    /// Sends an order and returns its answer.
    fn ask(&mut self, mut order: Value) -> Value {
        let id = self.answers.len();
        order["id"] = json!(id);
        self.order(order);
        self.until("answer", |page| page.answers.len() > id);
        assert_eq!(self.answers[id]["id"], json!(id));
        self.answers[id].clone()
    }

    fn until_mode(&mut self, mode: f64) {
        self.until(&format!("mode {mode}"), |page| {
            page.samples
                .last()
                .is_some_and(|sample| sample[MODE] == mode)
        });
    }

    /// Asserts that the samples are 1 ms apart, without a gap.
    fn is_gapless(&self) {
        for pair in self.samples.windows(2) {
            let step = pair[1][0] - pair[0][0];
            assert!((step - 1e-3).abs() < 1e-9, "{step} s at {} s", pair[0][0]);
        }
    }
}

#[test]
fn the_page_comes_from_one_place_and_its_samples_come_whole() {
    let live = Live::start(&[]);
    let (status, page) = live.http("GET /", &[], "");
    assert_eq!(status, 200);
    assert!(page.contains("frame-ancestors 'none'"), "may be framed");
    let (_, body) = page.split_once("<!DOCTYPE html>").unwrap();
    for elsewhere in [
        "src=\"http",
        "href=\"http",
        "src=\"//",
        "@import",
        "url(http",
    ] {
        assert!(!body.contains(elsewhere), "{elsewhere}");
    }
    assert!(body.contains("uPlot") && body.contains("Permission is hereby granted"));
    assert!(!body.contains("/*theme*/") && !body.contains("/*live*/"));
    let mut page = live.watch();
    page.until("samples", |page| {
        page.samples.len() >= 3000 && page.estimates > 0
    });
    page.is_gapless();
    assert_eq!(page.status["missing"], 0);
}

/// A trajectory file for the emulated rig.
fn motion(folder: &Path) -> String {
    let out = folder.join("motion.toml");
    let described = robot("one-link.toml");
    succeed(
        rig()
            .args(["excite", "--kind", "chirp", "--start", "-1.5708", "--robot"])
            .args([&described, Path::new("--out"), &out]),
    );
    std::fs::read_to_string(out).unwrap()
}

#[test]
fn a_motion_is_loaded_run_recorded_and_stopped() {
    let live = Live::start(&[]);
    let mut page = live.watch();
    page.until_mode(DISARMED);
    let (status, answer) = live.http(
        "POST /motion?name=my%20file.toml",
        &[],
        "robot = \"x\"\njoint = 3\n",
    );
    assert_eq!(status, 422);
    assert!(answer.contains("my file.toml:2:9: "), "{answer}");
    assert_eq!(page.ask(json!({"op": "dance"}))["ok"], false);
    let early = page.ask(json!({"op": "start"}));
    assert!(
        early["text"]
            .as_str()
            .unwrap()
            .contains("No motion is loaded")
    );
    let (status, answer) = live.http("POST /motion?name=m.toml", &[], &motion(live.folder.path()));
    assert!(
        status == 200 && answer.contains("m.toml is loaded"),
        "{answer}"
    );

    assert_eq!(page.ask(json!({"op": "record", "on": true}))["ok"], true);
    assert_eq!(page.ask(json!({"op": "arm"}))["ok"], true);
    page.until_mode(HOLDING);
    assert_eq!(page.ask(json!({"op": "start"}))["ok"], true);
    page.until_mode(RUNNING);
    page.until("motion", |page| {
        let positions =
            [page.samples[0], page.samples[page.samples.len() - 1]].map(|s| s[POSITION]);
        (positions[1] - positions[0]).abs() > 0.05
    });
    page.order(json!({"op": "stop"}));
    page.until_mode(DISARMED);
    page.until("confirmation", |page| page.status["stop"]["phase"] == "off");
    assert_eq!(page.status["stop"]["count"], 1);
    let ended = page.ask(json!({"op": "record", "on": false}));
    assert!(
        ended["text"].as_str().unwrap().contains(" 0 missing"),
        "{ended}"
    );
    page.is_gapless();

    // The file has what the page has seen, value for value.
    let text = std::fs::read_to_string(live.folder.path().join("live-1.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("t,q1,i1,u1,ref1,qd1,tau_cmd1,limits,mode")
    );
    let rows: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(',')
                .map(|field| field.parse().unwrap())
                .collect()
        })
        .collect();
    let first = page
        .samples
        .iter()
        .position(|sample| sample[0] == rows[0][0])
        .unwrap();
    page.until("the rest", |page| page.samples.len() >= first + rows.len());
    for (row, sample) in rows.iter().zip(&page.samples[first..]) {
        assert_eq!(row, sample);
    }
    assert!(rows.iter().any(|row| row[MODE] == RUNNING));
}

#[test]
fn stop_comes_without_a_page_and_without_a_viewer() {
    let live = Live::start(&[]);
    let mut page = live.watch();
    page.until_mode(DISARMED);
    page.ask(json!({"op": "arm"}));
    page.until_mode(HOLDING);
    assert_eq!(live.http("POST /stop", &[], "").0, 200);
    page.until_mode(DISARMED);
    page.ask(json!({"op": "arm"}));
    page.until_mode(HOLDING);
    drop(page);
    // An armed rig that nobody watches stops.
    std::thread::sleep(Duration::from_secs(5));
    let mut page = live.watch();
    page.until_mode(DISARMED);
    page.until("status", |page| page.status["stop"]["count"] == 2);
    assert!(
        page.status["notice"]
            .as_str()
            .unwrap()
            .contains("no page was open")
    );
}

#[test]
fn pages_from_elsewhere_are_refused() {
    let live = Live::start(&[]);
    let url = format!("ws://{}/live", live.page);
    for origin in ["http://example.org", "null", "http://127.0.0.1:1"] {
        assert_eq!(
            socket(&url, &[("origin", origin)]).err(),
            Some(403),
            "{origin}"
        );
        let (status, _) = live.http("POST /stop", &[("Origin", origin)], "");
        assert_eq!(status, 403);
    }
    let own = format!("http://{}", live.page);
    assert!(socket(&url, &[("origin", &own)]).is_ok());
    // A name that was made to point to this computer.
    let (status, _) = live.http("GET /", &[("Host", "example.org")], "");
    assert_eq!(status, 403);
}

#[test]
fn a_token_is_asked_of_everybody() {
    let token = "a-token-for-the-lab";
    let live = Live::start(&["--token", token, "--foxglove", "127.0.0.1:0"]);
    assert_eq!(live.http("GET /", &[], "").0, 401);
    assert_eq!(live.http("GET /?token=a-token-for-the-lax", &[], "").0, 401);
    assert_eq!(live.http("POST /stop", &[], "").0, 401);
    let (status, page) = live.http(&format!("GET /?token={token}"), &[], "");
    assert_eq!(status, 200);
    assert!(
        page.contains("HttpOnly; SameSite=Strict"),
        "{}",
        &page[..600]
    );
    let url = format!("ws://{}/live", live.page);
    assert_eq!(socket(&url, &[]).err(), Some(401));
    assert_eq!(
        socket(&url, &[("cookie", "rig_token=another-token-1")]).err(),
        Some(401)
    );
    assert!(socket(&url, &[("cookie", &format!("rig_token={token}"))]).is_ok());
    let foxglove = format!("ws://{}", live.foxglove.as_ref().unwrap());
    let asked = [("sec-websocket-protocol", "foxglove.sdk.v1")];
    assert_eq!(socket(&foxglove, &asked).err(), Some(401));
    assert!(socket(&format!("{foxglove}/?token={token}"), &asked).is_ok());
}

#[test]
fn an_open_address_without_a_token_is_refused() {
    for (args, says) in [
        (["--listen", "0.0.0.0:0"], "give --token TEXT"),
        (["--foxglove", "0.0.0.0:0"], "--foxglove 0.0.0.0:0"),
        (["--token", "short"], "at least 12"),
    ] {
        let listen = ["--listen", "127.0.0.1:0"];
        let listen = if args[0] == listen[0] {
            &[][..]
        } else {
            &listen
        };
        let said = refuse(rig().args(["live", "--emulated"]).args(listen).args(args));
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn foxglove_clients_of_both_protocols_decode_the_samples() {
    let live = Live::start(&["--foxglove", "127.0.0.1:0"]);
    let url = format!("ws://{}", live.foxglove.as_ref().unwrap());
    assert_eq!(socket(&url, &[]).err(), Some(400));
    let page = [
        ("origin", "https://example.org"),
        ("sec-websocket-protocol", "foxglove.sdk.v1"),
    ];
    assert_eq!(socket(&url, &page).err(), Some(403));
    for protocol in ["foxglove.websocket.v1", "foxglove.sdk.v1"] {
        // Lichtblick on a server of this computer has another origin.
        let headers = [
            ("sec-websocket-protocol", protocol),
            ("origin", "http://localhost:9999"),
        ];
        let mut client = socket(&url, &headers).unwrap();
        let next = |client: &mut WebSocket<TcpStream>| -> Value {
            serde_json::from_str(read(client).to_text().unwrap()).unwrap()
        };
        assert_eq!(next(&mut client)["op"], "serverInfo");
        let advertised = next(&mut client);
        let channels = advertised["channels"].as_array().unwrap().clone();
        let state = channels
            .iter()
            .find(|one| one["topic"] == "/rig/state")
            .unwrap();
        assert_eq!(
            (state["encoding"].as_str(), state["schemaEncoding"].as_str()),
            (Some("cdr"), Some("ros2msg"))
        );
        let fields: Vec<&str> = (state["schema"].as_str().unwrap().lines())
            .map(|line| line.strip_prefix("float64 ").unwrap())
            .collect();
        assert_eq!(fields[..2], ["t", "q1"]);
        let subscribe =
            json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": state["id"]}]});
        client.send(Message::text(subscribe.to_string())).unwrap();
        let (mut times, mut stamps) = (Vec::new(), Vec::new());
        while times.len() < 500 {
            let Message::Binary(bytes) = read(&mut client) else {
                panic!("no data")
            };
            assert_eq!((bytes[0], &bytes[1..5]), (1, &7u32.to_le_bytes()[..]));
            stamps.push(u64::from_le_bytes(bytes[5..13].try_into().unwrap()));
            assert_eq!(bytes[13..17], [0, 1, 0, 0]);
            let values: Vec<f64> = (bytes[17..].chunks_exact(8))
                .map(|eight| f64::from_le_bytes(eight.try_into().unwrap()))
                .collect();
            assert_eq!(values.len(), fields.len());
            times.push(values[0]);
            // The emulated link hangs.
            assert!(
                (values[1] + std::f64::consts::FRAC_PI_2).abs() < 0.01,
                "{values:?}"
            );
        }
        for (time, stamp) in times.windows(2).zip(stamps.windows(2)) {
            assert!((time[1] - time[0] - 1e-3).abs() < 1e-9);
            assert!((stamp[1] - stamp[0]).abs_diff(1_000_000) < 1000);
        }
        client
            .send(Message::text(
                json!({"op": "unsubscribe", "subscriptionIds": [7]}).to_string(),
            ))
            .unwrap();
    }
}

#[test]
fn plotjuggler_gets_every_sample_as_json() {
    let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
    receiver.set_read_timeout(Some(PATIENCE)).unwrap();
    let address = receiver.local_addr().unwrap().to_string();
    let _live = Live::start(&["--plotjuggler", &address]);
    let (mut bytes, mut times) = ([0; 2048], Vec::new());
    while times.len() < 500 {
        let length = match receiver.recv(&mut bytes) {
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            length => length.unwrap(),
        };
        let message: Value = serde_json::from_slice(&bytes[..length]).unwrap();
        if message.get("rig").is_some() {
            times.push(message["timestamp"].as_f64().unwrap());
            assert!(message["rig"]["q1"].is_number() && message["rig"]["mode"].is_number());
        }
    }
    // UDP may lose; on one computer with room for half a megabyte it does not.
    assert!(times.windows(2).all(|pair| pair[1] > pair[0]));
}
