//! The pages of real recordings, to look at while changing them:
//! `cargo run -p rig --example pages_from_emps -- out` writes `identification.html` and `validation.html`
//! from the EMPS recordings (see `rig_output::data_dir`).

use std::error::Error;
use std::path::{Path, PathBuf};

use rig::pages;
use rig::pages::Context;
use rig_data::Source;
use rig_identify::{Options, identified_robot, identify};
use rig_model::robot::{EMPS, Robot};
use rig_output::data_dir;
use rig_report::write;

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let Some(folder) = data_dir() else {
        println!("The folder of real recordings is not there; set RIG_DATA to it.");
        return Ok(());
    };
    let robot = Robot::from_toml(EMPS, Path::new("emps.toml"))?;
    let train = Source::open(&folder.join("emps/train.csv"), &robot)?;
    let test = Source::open(&folder.join("emps/test_pulses.csv"), &robot)?;
    let found = identify(&robot, &[&train], &[&test], &Options::default())?;
    let (identified, remarks) = identified_robot(&robot, &found);
    let mut context = Context {
        command:
            "rig identify --robot emps.toml --data train.csv --holdout test_pulses.csv --out result"
                .into(),
        identified: Some(("identified.toml".into(), identified.to_toml()?)),
        remarks,
        warnings: Vec::new(),
    };
    write(
        &out.join("identification.html"),
        &pages::identification(&robot, &found, &context),
    )?;
    let checked = rig_validate::validate(
        &identified,
        &[&test],
        &rig_validate::Options::default(),
        &mut |_| (),
    )?;
    context.command =
        "rig validate --robot identified.toml --data test_pulses.csv --out result".into();
    context.identified = None;
    write(
        &out.join("validation.html"),
        &pages::validation(&identified, &checked, &context),
    )?;
    Ok(())
}
