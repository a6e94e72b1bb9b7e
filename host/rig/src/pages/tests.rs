#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;
use rig_data::Block;
use rig_data::prepare::InMemory;
use rig_identify::{DroppedPass, FrictionFit, FrictionMap, FrictionPoint, Options, identify};
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Inputs, Model, closed_loop};
use rig_report::render;

/// The one-link description with a controller.
fn robot() -> Robot {
    let mut robot = Robot::from_toml(
        rig_model::robot::ONE_LINK_TEMPLATE,
        std::path::Path::new("r.toml"),
    )
    .unwrap();
    robot.joints[0].controller = Some(Controller {
        position_gain: 16.0,
        velocity_gain: 60.0,
        torque_gain: 0.17,
    });
    robot
}

/// Thirty seconds of its closed loop; the torque has a ripple that no model has.
fn recording(robot: &Robot) -> InMemory {
    let reference: Vec<f64> = (0..30_000)
        .map(|k| f64::from(k) * 1e-3)
        .map(|t| 0.8 * (1.0 - (1.3 * t).cos()) + 0.3 * (3.7 * t).sin().powi(2))
        .collect();
    let model = Model::from_robot(robot).unwrap();
    let controllers = [robot.joints[0].controller.clone().unwrap()];
    let inputs = Inputs {
        period: 1e-3,
        reference: std::slice::from_ref(&reference),
        feed_forward: &[],
        added: &[],
        q: &[0.0],
        v: &[0.0],
        substeps: 4,
        held: true,
    };
    let mut motion = closed_loop(robot, &model, &controllers, &inputs, |_| ()).unwrap();
    for (k, tau) in motion.tau[0].iter_mut().enumerate() {
        *tau += 0.02 * (0.37 * k as f64).sin();
    }
    InMemory {
        label: "made <b>up</b>.csv".into(),
        blocks: vec![Block::of_motion(
            motion,
            1e-3,
            std::slice::from_ref(&reference),
        )],
    }
}

fn map() -> FrictionMap {
    let fit = |coulomb, vs: Option<f64>| FrictionFit {
        coulomb,
        viscous: 0.3,
        breakaway_excess: if vs.is_some() { 0.11 } else { 0.0 },
        offset: 0.004,
        stribeck_velocity: vs,
        half_interval: vec![0.01; if vs.is_some() { 3 } else { 2 }],
        squares: 12.0,
        leave_one_out_rms: 0.02,
    };
    FrictionMap {
        joint: "link".into(),
        points: [-1.0, -0.1, 0.1, 1.0]
            .map(|speed: f64| FrictionPoint {
                speed,
                friction: 0.4 * speed.signum() + 0.3 * speed,
                std: 0.01,
                start: 1.0,
                duration: 0.4,
                rows: (0, 0),
            })
            .to_vec(),
        dropped: vec![DroppedPass {
            speed: 0.0123,
            start: 30.0,
            duration: 7.0,
            why: "the torque is at its limit in 12 of 7000 rows".into(),
        }],
        from_reference: true,
        scatter: 0.003,
        simple: fit(0.4123, None),
        stribeck: Some(fit(0.3987, Some(0.05))),
        profile: vec![[0.02, 9.0], [0.05, 8.0], [0.1, 8.5]],
        p_value: Some(1e-4),
        stribeck_left_out_rms: Some(0.02),
        warranted: true,
        text: "A Stribeck term is warranted by four points.".into(),
        note: None,
        doubts: Vec::new(),
    }
}

#[test]
fn an_identification_shows_every_parameter_warning_and_reason() {
    let robot = robot();
    let data = recording(&robot);
    let mut found = identify(&robot, &[&data], &[&data], &Options::default()).unwrap();
    found
        .warnings
        .push("The <third> warning.".to_owned().into());
    let context = Context {
        command: "rig identify --robot r.toml".into(),
        identified: Some((
            "identified.toml".into(),
            "name = \"identified text\"".into(),
        )),
        remarks: vec!["The remark.".into()],
        warnings: vec!["The data warning.".into()],
    };
    let page = render(&identification(&robot, &found, &context)).unwrap();
    for b in &found.base_parameters {
        assert!(page.contains(&b.expression), "{}", b.expression);
    }
    for text in [
        "The &lt;third&gt; warning.",
        "The data warning.",
        "The remark.",
        "rig identify --robot r.toml",
        "identified text",
        "made &lt;b&gt;up&lt;/b&gt;.csv",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(!page.contains("<b>up</b>"));
    for masked in &found.details.masked {
        assert!(page.contains(&masked.why));
    }
    for d in &found.details.train[0].dependence {
        // Up to the first character that HTML must escape.
        let text = d
            .text
            .split(['(', '\'', '&', '<', '>', '"'])
            .next()
            .unwrap();
        assert!(page.contains(text.trim()), "{}", d.text);
    }
    assert!(page.contains("cut-off"));
}

/// Titles of the figures that are not folded.
fn unfolded(page: &rig_report::Document) -> Vec<&str> {
    let blocks = page.sections.iter().flat_map(|s| &s.blocks);
    let plots = blocks.filter_map(|block| match block {
        rig_report::Block::Plot(plot) => Some(plot.title.as_str()),
        _ => None,
    });
    plots.collect()
}

#[test]
fn an_arm_shows_all_joints_in_one_figure_first_and_folds_each() {
    let mut robot = robot();
    let data = recording(&robot);
    let mut found = identify(&robot, &[&data], &[&data], &Options::default()).unwrap();
    let page = identification(&robot, &found, &Context::default());
    assert!(unfolded(&page).iter().any(|t| t.starts_with("Joint link")));
    // Two more joints with the same figures: only the number of joints matters.
    for name in ["second_joint_of_a_long_name", "third_joint_of_a_long_name"] {
        let mut joint = robot.joints[0].clone();
        joint.name = name.into();
        robot.joints.push(joint);
        let mut figures = found.joints[0].clone();
        figures.name = name.into();
        found.joints.push(figures);
        let details = &mut found.details;
        details.train.push(details.train[0].clone());
        let held = details.holdout_residuals.as_mut().unwrap();
        held.push(held[0].clone());
        let spectra = &mut details.treatment.spectra;
        spectra.push(spectra[0].clone());
        for trial in &mut details.treatment.trials {
            trial.relative_error.push(trial.relative_error[0]);
        }
    }
    let page = identification(&robot, &found, &Context::default());
    let open = unfolded(&page);
    assert_eq!(open.first(), Some(&"Residual of all joints"), "{open:?}");
    assert!(!open.iter().any(|t| t.starts_with("Joint ")), "{open:?}");
    let html = render(&page).unwrap();
    // The names do not fit below the axis.
    assert!(html.contains("Joints: 1 link, 2 second_joint_of_a_long_name, 3 third_joint"));
    for word in [
        "torque over time",
        "tests of the residual",
        "spectrum of the position",
    ] {
        assert!(html.contains(&format!("Joint link: {word}")), "{word}");
    }
}

#[test]
fn a_validation_says_what_was_not_simulated() {
    let robot = robot();
    let mut data = recording(&robot);
    let options = rig_validate::Options::default();
    let check = |data: &InMemory| {
        let found = rig_validate::validate(&robot, &[data], &options, &mut |_| ()).unwrap();
        render(&validation(&robot, &found, &Context::default())).unwrap()
    };
    let page = check(&data);
    assert!(page.contains("halving it changes the motion"));
    assert!(!page.contains("was not simulated. "));
    data.blocks[0].joints[0].reference = None;
    let page = check(&data);
    assert!(page.contains("The motion was not simulated. The recording has no reference"));
}

#[test]
fn a_friction_map_shows_its_decision_and_both_laws() {
    let page = render(&friction_map(&robot(), &map(), &Context::default())).unwrap();
    for text in [
        "A Stribeck term is warranted by four points.",
        "0.412",
        "0.399",
        "0.110",
        "0.0123",
        "the torque is at its limit in 12 of 7000 rows",
        "4 of 5 stretches",
    ] {
        assert!(page.contains(text), "{text}");
    }
    // The page does not show a law that the points do not support.
    let plain = FrictionMap {
        stribeck: None,
        warranted: false,
        text: "No Stribeck term is warranted.".into(),
        ..map()
    };
    let page = render(&friction_map(&robot(), &plain, &Context::default())).unwrap();
    assert!(!page.contains("0.110") && !page.contains("with Stribeck term"));
}

fn figures() -> DemoFigures {
    let at = |value: f64, std: f64| Interval {
        value,
        std,
        low: value - 2.0 * std,
        high: value + 2.0 * std,
    };
    let names = ["J", "gc", "gs", "fv", "fc", "off"];
    let t: Vec<f64> = (0..200).map(|k| 0.1 * f64::from(k)).collect();
    DemoFigures {
        robot: robot(),
        command: "rig demo --out result".into(),
        seconds: 20.0,
        parameters: names
            .iter()
            .enumerate()
            .map(|(k, name)| DemoParameter {
                name: (*name).into(),
                meaning: "of the link".into(),
                unit: "N*m".into(),
                truth: 1.0 + k as f64,
                differential: at(1.01 + k as f64, 0.02),
                integral: at(1.02 + k as f64, 0.02),
                // The last one misses its truth by ten standard deviations.
                online: at(1.0 + k as f64 + if k == 5 { 0.2 } else { 0.0 }, 0.02),
            })
            .collect(),
        online: OnlineEstimates {
            values: (0..6)
                .map(|k| t.iter().map(|t| 1.0 + f64::from(k) - (-t).exp()).collect())
                .collect(),
            std: (0..6)
                .map(|_| t.iter().map(|t| 0.02 + 10.0 * (-t).exp()).collect())
                .collect(),
            t: t.clone(),
        },
        tracking: vec![Tracking {
            motion: "slow reversals".into(),
            unit: "rad".into(),
            reference: t.iter().map(|t| t.sin()).collect(),
            error_without: t.iter().map(|t| 0.01 * t.cos()).collect(),
            error_with: t.iter().map(|t| 0.001 * t.cos()).collect(),
            t,
            rms_without: 0.0071,
            rms_with: 0.00071,
            note: "At rest before and after.".into(),
        }],
        friction: Some(map()),
        friction_text: String::new(),
        wire: Wire {
            received: 20_000,
            lost: 3,
            text: "Three samples were lost.".into(),
        },
        holdout: Vec::new(),
        diagnosis: None,
        beyond_model: vec!["Cogging of the motor".into()],
        warnings: vec!["The demonstration's warning.".into()],
        files: vec![("data.csv".into(), "the recording".into())],
    }
}

#[test]
fn the_demonstration_shows_what_it_was_given() {
    let mut figures = figures();
    let page = render(&demo(&figures)).unwrap();
    for text in [
        "Three samples were lost.",
        "Cogging of the motor",
        "The demonstration&#39;s warning.",
        "data.csv",
        "10 times smaller",
        "6 of 6",
        "6.200 ± 0.040 *",
        "There is no hold-out.",
    ] {
        let plain = text.replace("&#39;", "'");
        assert!(page.contains(text) || page.contains(&plain), "{text}");
    }
    for p in &figures.parameters {
        assert!(page.contains(&format!("{} (of the link)", p.name)));
    }
    // A miss shows in the verdict too.
    for p in &mut figures.parameters {
        p.differential.low = p.truth + 0.001;
    }
    assert!(render(&demo(&figures)).unwrap().contains("0 of 6"));
    if let Some(folder) = std::env::var_os("RIG_PAGES_OUT") {
        rig_report::write(
            &std::path::Path::new(&folder).join("demo.html"),
            &demo(&figures),
        )
        .unwrap();
    }
}
