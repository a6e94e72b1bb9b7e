//! Torque added to the controller's: columns `added<k>` and `pulses` of a recording.

use rig_data::Block;
use rig_model::robot::Controller;

/// Returns the torque added to joint `j` over the first `rows` rows of a block, with a text at its first occurrence.
pub fn added_torque(
    block: &Block,
    j: usize,
    controllers: &[Controller],
    rows: usize,
    named: &mut Vec<String>,
) -> Vec<f64> {
    let mut sum = vec![0.0; rows];
    let mut add = |name: &str, gain: f64, words: String| {
        if let Some((_, column)) = block.extra.iter().find(|(n, _)| n == name) {
            for (s, v) in sum.iter_mut().zip(column) {
                *s += gain * v;
            }
            if !named.contains(&words) {
                named.push(words);
            }
        }
    };
    let column = format!("added{}", j + 1);
    add(
        &column,
        1.0,
        format!(
            "Column {column} is taken as a torque beside the controller's on joint {}, part of tau{}.",
            j + 1,
            j + 1
        ),
    );
    if j == 0 {
        let gain = controllers.first().map_or(1.0, |c| c.torque_gain);
        add(
            "pulses",
            gain,
            format!(
                "Column pulses is taken as added to the output of the first joint's controller, in its unit (times its torque_gain of {gain}), and as part of tau1."
            ),
        );
    }
    sum
}
