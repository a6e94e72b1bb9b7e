//! Groups similar sentences into one.

/// A sentence about one of several joints or recordings to which the same may apply.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Kind of the sentence.
    pub kind: &'static str,
    /// Severity within its kind: larger is worse.
    pub size: f64,
    /// The whole sentence.
    pub sentence: String,
    /// Subject and value in a few words: `elbow (31 %)`.
    pub short: String,
}

/// Groups things by kind, the worst of each kind first. `rank` returns the kind and the severity. The kinds keep the
/// order of their first members.
pub fn worst_first<T, K: PartialEq>(
    things: impl IntoIterator<Item = T>,
    rank: impl Fn(&T) -> (K, f64),
) -> Vec<Vec<T>> {
    let mut kinds: Vec<(K, Vec<T>)> = Vec::new();
    for thing in things {
        let (kind, _) = rank(&thing);
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, own)) => own.push(thing),
            None => kinds.push((kind, vec![thing])),
        }
    }
    let sorted = |(_, mut own): (K, Vec<T>)| {
        own.sort_by(|a, b| rank(b).1.total_cmp(&rank(a).1));
        own
    };
    kinds.into_iter().map(sorted).collect()
}

/// Returns one line per kind: the worst sentence, then the other subjects for which it holds.
pub fn one_a_kind(findings: Vec<Finding>) -> Vec<String> {
    let line = |own: Vec<Finding>| {
        let mut own = own.into_iter();
        let worst = own.next().map_or_else(String::new, |worst| worst.sentence);
        let others: Vec<String> = own.map(|other| other.short).collect();
        match others.as_slice() {
            [] => worst,
            _ => format!("{worst} The same holds for {}.", others.join(", ")),
        }
    };
    let kinds = worst_first(findings, |finding| (finding.kind, finding.size));
    kinds.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_of_a_kind_speaks_for_the_others() {
        let of = |kind, size: f64, name: &str| Finding {
            kind,
            size,
            sentence: format!("Joint {name} leaves {size} %."),
            short: format!("{name} ({size} %)"),
        };
        let list = vec![
            of("left", 31.0, "a"),
            of("still", 0.0, "d"),
            of("left", 52.0, "b"),
            of("left", 40.0, "c"),
        ];
        let said = one_a_kind(list);
        assert_eq!(
            said,
            [
                "Joint b leaves 52 %. The same holds for c (40 %), a (31 %).",
                "Joint d leaves 0 %."
            ]
        );
    }
}
