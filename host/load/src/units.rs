//! Units of forces and moments that sensors and their drivers use.

use crate::settle::{DECISIVE, settled};
use crate::system::{Fit, Nuisance, Sensed};

/// A pair of units of which the ratio is not that of N·m and N.
#[derive(Debug)]
pub(crate) struct Unit {
    /// Moments as read per moment in N·m, over forces as read per force in N.
    factor: f64,
    /// Names it in a sentence.
    pub words: &'static str,
    /// Options of the command that convert it.
    pub option: &'static str,
}

/// Exact by definition: a kilogram-force is 9.80665 N, a pound-force 4.4482216152605 N, a foot 0.3048 m.
const UNITS: [Unit; 11] = [
    Unit {
        factor: 1e3,
        words: "the moments look like N·mm",
        option: "--unit mx=Nmm --unit my=Nmm --unit mz=Nmm",
    },
    Unit {
        factor: 1e2,
        words: "the moments look like N·cm",
        option: "--unit mx=Ncm --unit my=Ncm --unit mz=Ncm",
    },
    Unit {
        factor: 9.806_65,
        words: "the forces look like kgf",
        option: "--unit fx=kgf --unit fy=kgf --unit fz=kgf",
    },
    Unit {
        factor: 1.0 / 9.806_65,
        words: "the moments look like kgf·m",
        option: "--unit mx=kgfm --unit my=kgfm --unit mz=kgfm",
    },
    Unit {
        factor: 1.0 / 0.098_066_5,
        words: "the moments look like kgf·cm",
        option: "--unit mx=kgfcm --unit my=kgfcm --unit mz=kgfcm",
    },
    Unit {
        factor: 1e-3,
        words: "the forces look like mN",
        option: "--unit fx=mN --unit fy=mN --unit fz=mN",
    },
    Unit {
        factor: 4.448_221_615_260_5,
        words: "the forces look like lbf",
        option: "--unit fx=lbf --unit fy=lbf --unit fz=lbf",
    },
    Unit {
        factor: 1.0 / 1.355_817_948_331_4,
        words: "the moments look like lbf·ft",
        option: "--unit mx=lbfft --unit my=lbfft --unit mz=lbfft",
    },
    Unit {
        factor: 1.0 / 0.112_984_829_027_6,
        words: "the moments look like lbf·in",
        option: "--unit mx=lbfin --unit my=lbfin --unit mz=lbfin",
    },
    Unit {
        factor: 1.0 / 0.3048,
        words: "forces and moments look like lbf and lbf·ft",
        option: "--unit fx=lbf --unit fy=lbf --unit fz=lbf --unit mx=lbfft --unit my=lbfft --unit mz=lbfft",
    },
    Unit {
        factor: 1.0 / 0.0254,
        words: "forces and moments look like lbf and lbf·in",
        option: "--unit fx=lbf --unit fy=lbf --unit fz=lbf --unit mx=lbfin --unit my=lbfin --unit mz=lbfin",
    },
];

/// Ratio of a scale to that of a unit beyond which it is not tried.
const NEAR: f64 = 1.5;

/// Returns the units that explain the readings as well as the estimated scale of the moments does.
pub(crate) fn named(sensed: &Sensed, fit: &Fit) -> Vec<&'static Unit> {
    let unknowns = fit.unknowns.without(Nuisance::Scale);
    let found = UNITS.iter().filter(|unit| {
        let change = unit.factor / fit.mounting.scale;
        let fixed = |change: f64| settled(sensed, &fit.mounting.scaled(change), &unknowns).misfit();
        change.ln().abs() < NEAR.ln() && fixed(change) < fit.misfit() + DECISIVE
    });
    found.collect()
}

/// Distances of a centre of mass from the sensor that a load at a wrist has, m.
const LEVERS: [f64; 2] = [0.005, 0.5];

/// Returns the units of the moments for which the centre of mass of a load lies at a usual distance from the sensor.
/// `lever` is that in N and N·m.
pub(crate) fn by_lever(lever: f64) -> Vec<&'static Unit> {
    let [near, far] = LEVERS;
    let found = UNITS.iter().filter(|unit| {
        let is_simple = unit.option.starts_with("--unit mx") && unit.factor >= 100.0;
        is_simple && (near..far).contains(&(lever / unit.factor))
    });
    found.collect()
}
