//! Messages with the column names of the file.

use super::quantity::Quantity;
use super::source::Source;

/// Quantities that messages name.
const NAMED: [Quantity; 8] = [
    Quantity::Position,
    Quantity::Effort,
    Quantity::Velocity,
    Quantity::Acceleration,
    Quantity::Reference,
    Quantity::Voltage,
    Quantity::Temperature,
    Quantity::LinkPosition,
];

/// Replaces words in `text` by `names` (before, after), except between quotation marks.
fn renamed(text: &str, names: &[[String; 2]]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut word = String::new();
    let mut quoted = false;
    let end = |word: &mut String, quoted: bool, out: &mut String| {
        let other = names.iter().find(|[before, _]| !quoted && before == word);
        out.push_str(other.map_or(word.as_str(), |[_, after]| after));
        word.clear();
    };
    for c in text.chars() {
        if c.is_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        end(&mut word, quoted, &mut out);
        quoted ^= c == '"';
        out.push(c);
    }
    end(&mut word, quoted, &mut out);
    out
}

impl Source {
    /// Returns a message with the file's own column names instead of the standard ones. Both names appear if the values
    /// are converted from the column (`tau1 (from i1)`).
    pub fn in_its_names(&self, text: &str) -> String {
        let joints = 0..self.joint_count();
        let names: Vec<[String; 2]> = joints
            .flat_map(|j| NAMED.map(|quantity| (j, quantity)))
            .map(|(j, quantity)| {
                let before = format!("{}{}", quantity.prefix(), j + 1);
                let name = self.column_name(j, quantity);
                let own = !self.layout.is_turned(j, quantity) || name.starts_with(&before);
                let after = match own {
                    true => name,
                    false => format!("{before} (from {name})"),
                };
                [before, after]
            })
            .filter(|[before, after]| before != after)
            .collect();
        renamed(text, &names)
    }
}

#[cfg(test)]
mod tests {
    use super::renamed;

    #[test]
    fn whole_words_outside_quotation_marks_are_renamed() {
        let names = [["tau1", "i1"], ["q1", "qm1"]].map(|pair| pair.map(str::to_owned));
        let text = "tau1 and tau12 of joint \"q1\": q1, taum1 (tau1)";
        assert_eq!(
            renamed(text, &names),
            "i1 and tau12 of joint \"q1\": qm1, taum1 (i1)"
        );
    }
}
