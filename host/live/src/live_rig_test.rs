//! The thread of the line against the emulated rig, as fast as it runs.
#![allow(clippy::unwrap_used)]

use std::cell::Cell;

use rig_link::{EmulatedPort, SessionSettings};
use rig_model::robot::ONE_LINK_TEMPLATE;
use rig_plant::PlantConfig;
use rig_plant::emulated::{EmulatedRig, Nameplate, hardware_of};
use serde_json::Value;

use super::*;

type Emulated = Session<EmulatedPort<EmulatedRig>>;

fn open() -> Emulated {
    let robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
    let nameplate = Nameplate::from_robot(&robot).unwrap();
    let plant = PlantConfig::laboratory_with(&hardware_of(&robot).unwrap(), 1);
    let rig = EmulatedRig::new(&nameplate, plant, 1).unwrap();
    Session::open(EmulatedPort::new(rig), SessionSettings::default()).unwrap()
}

/// Ends when the status shows what is wanted, or after many looks.
struct Until {
    hub: Arc<Hub>,
    done: fn(&Value) -> bool,
    looks: Cell<u32>,
}

impl Surroundings for Until {
    fn ended(&self) -> bool {
        self.looks.set(self.looks.get() + 1);
        let status = self.hub.status().borrow().clone();
        let status = serde_json::from_str(&status).unwrap_or_default();
        (self.done)(&status) || self.looks.get() > 100_000
    }
    fn writing(&self, _: Option<&Path>) {}
    fn say(&self, _: &str) {}
}

/// Runs until `done`; returns the last status.
fn watch(
    session: &mut Emulated,
    hub: &Arc<Hub>,
    orders: &Receiver<Order>,
    done: fn(&Value) -> bool,
) -> Value {
    let settings = RigSettings {
        source: "test".to_owned(),
        settings: Vec::new(),
        motion: None,
        robot: None,
        folder: PathBuf::from("."),
    };
    let until = Until {
        hub: hub.clone(),
        done,
        looks: Cell::new(0),
    };
    run(session, settings, hub, orders, &until).unwrap();
    let status = hub.status().borrow().clone();
    serde_json::from_str(&status).unwrap()
}

#[test]
fn stop_passes_before_orders_that_wait() {
    let (hub, orders) = Hub::new();
    let waits = hub.clone();
    let asked = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        runtime.block_on(async { tokio::join!(waits.ask(Action::Arm), waits.ask(Action::Arm)) })
    });
    // Both wait before the line looks for the first time.
    std::thread::sleep(Duration::from_millis(200));
    hub.stop();
    let mut session = open();
    let status = watch(&mut session, &hub, &orders, |status| {
        status["stop"]["phase"] == "off"
    });
    assert_eq!(status["stop"]["phase"], "off");
    assert_eq!(status["mode"], "disarmed");
    let (first, second) = asked.join().unwrap();
    for answer in [first, second] {
        let refused = answer.unwrap_err();
        assert!(
            refused.text.contains("because of the stop"),
            "{}",
            refused.text
        );
    }
    // The bridge was never on.
    assert!(!session.port().device().state().mode.drives());
}

#[test]
fn a_fault_is_told_in_words_also_if_it_was_there_before() {
    for before in [false, true] {
        let (hub, orders) = Hub::new();
        let mut session = open();
        when_calibrated(&mut session, RequestBody::Arm).unwrap();
        session
            .port_mut()
            .device_mut()
            .plant_mut()
            .faults_mut()
            .driver = true;
        if before {
            // Its report passes while nobody listens.
            while session.port().device().state().mode != Mode::Fault {
                session.next_report(Duration::from_millis(10)).unwrap();
            }
            while session
                .next_report(Duration::from_millis(10))
                .unwrap()
                .is_some_and(|report| {
                    !matches!(report, rig_shared::wire::message::Report::Fault(_))
                })
            {}
        }
        let status = watch(&mut session, &hub, &orders, |status| {
            !status["fault"].is_null()
        });
        assert_eq!(status["mode"], "fault");
        let said = status["fault"].as_str().unwrap();
        assert!(said.contains("[Driver, at t = "), "{said}");
    }
}

#[test]
fn recordings_are_numbered_and_hold_what_came_meanwhile() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let row = |k: u32| Row {
        t: 1e-3 * f64::from(k),
        ..Row::default()
    };
    for name in ["live-1.csv", "live-2.csv"] {
        let mut recording = Recording::start(folder).unwrap();
        for k in 0..5 {
            recording.push(&row(k)).unwrap();
        }
        recording.lose(3);
        let said = recording.finish().unwrap();
        assert!(
            said.ends_with(&format!("{name}: 5 samples, 3 missing.")),
            "{said}"
        );
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!(text.lines().count(), 6);
    }
}
