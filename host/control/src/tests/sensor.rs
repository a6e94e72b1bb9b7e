//! The force of a contact by a described wrist sensor.

use super::robot;
use crate::{
    Bench, Contact, ContactOptions, ContactTask, ControlError, LawKind, LawModel, Run, Settings,
    Surface,
};
use rig_model::robot::{Robot, WristSensor};
use rig_model::simulate::Model;

/// A sensor that is turned about all axes and lies beside the flange.
fn sensor() -> WristSensor {
    WristSensor {
        position: [0.02, -0.03, 0.05],
        rotation: [0.4, -0.9, 2.1],
        ..WristSensor::default()
    }
}

fn press(
    robot: &Robot,
    surface: Surface,
    force: f64,
    settings: Settings,
) -> Result<Run<Contact>, ControlError> {
    let truth = Model::from_robot(robot)?;
    let model = LawModel::of(robot)?;
    let options = ContactOptions {
        surface,
        slide: 0.05,
        force: Some(force),
        ..ContactOptions::default()
    };
    let task = ContactTask::choose(&model, &options, &settings)?;
    let reference = task.joint_reference((task.duration * settings.rate) as usize);
    let bench = Bench {
        robot,
        truth: &truth,
        reference: &reference,
        tool: task.tool,
        settings,
        wrong: None,
    };
    bench.press(LawKind::Hybrid, &model, "own", &task)
}

/// Wherever the sensor is and however it is turned, the law presses as with the force itself.
#[test]
fn a_turned_sensor_gives_the_force_in_the_base_frame() {
    for name in ["edda.toml", "irp6.toml"] {
        let bare = robot(name);
        let mut sensed = bare.clone();
        sensed.wrist_sensor = Some(sensor());
        let surface = Surface::default();
        let [own, other] =
            [&bare, &sensed].map(|robot| press(robot, surface, 20.0, Settings::default()).unwrap());
        let most = (own.trace.force.iter().zip(&other.trace.force))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        // The controller turns the readings by its encoders, which differ from the links by a count.
        assert!(most < 0.02 * 20.0, "{name}: {most}");
        assert!(other.measures.steady_error.abs() < 0.02, "{name}");
        assert!(
            other.measures.warnings.is_empty(),
            "{:?}",
            other.measures.warnings
        );
        assert!(
            other
                .notes
                .iter()
                .any(|note| note.contains("[wrist_sensor]"))
        );
        assert!(!own.notes.iter().any(|note| note.contains("[wrist_sensor]")));
    }
}

#[test]
fn a_force_beyond_the_range_of_the_sensor_is_refused_or_told() {
    let mut robot = robot("edda.toml");
    robot.wrist_sensor = Some(WristSensor {
        force_range: Some(10.0),
        ..WristSensor::default()
    });
    let surface = Surface::default();
    let refused = press(&robot, surface, 30.0, Settings::default())
        .err()
        .unwrap();
    let said = refused.to_string();
    assert!(said.contains("its range is 10.0 N"), "{said}");
    // Noise of the readings takes some of them beyond the range.
    let noisy = Settings {
        force_noise: 2.0,
        ..Settings::default()
    };
    robot.wrist_sensor = Some(WristSensor {
        force_range: Some(21.0),
        ..WristSensor::default()
    });
    let run = press(&robot, surface, 20.0, noisy).unwrap();
    let warnings = run.measures.warnings.join(" ");
    assert!(warnings.contains("a force beyond its 21.0 N"), "{warnings}");
    // A long lever, and a sensor that bears little.
    robot.wrist_sensor = Some(WristSensor {
        position: [0.0, 0.0, -0.5],
        moment_range: Some(0.1),
        ..WristSensor::default()
    });
    let run = press(&robot, surface, 20.0, Settings::default()).unwrap();
    let warnings = run.measures.warnings.join(" ");
    assert!(
        warnings.contains("a moment beyond its 0.100 N·m"),
        "{warnings}"
    );
}
