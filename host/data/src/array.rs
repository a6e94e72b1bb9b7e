//! Arrays of numbers from files of other programs, as the columns of one table.

use super::columns::Signal;
use super::time_names::is_time;
use super::unit::Unit;

/// An array with a name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Array {
    pub name: String,
    pub shape: Vec<usize>,
    /// The numbers, the first index running fastest.
    pub values: Vec<f64>,
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Columns {
    pub names: Vec<String>,
    pub values: Vec<Vec<f64>>,
    /// Names and shapes of arrays that are no columns.
    pub others: Vec<String>,
}

/// Turns arrays into columns. The number of rows is the length of the array that is named as a time, without one that of most
/// arrays. An array of several columns gives `q1`, `q2` and so on, with a unit behind the number (`q_deg` gives `q1_deg`); if
/// its rows lie along the second index, it is transposed.
pub(super) fn columns(arrays: Vec<Array>) -> Columns {
    let longest = |array: &Array| array.shape.iter().copied().max().unwrap_or(1);
    let time = (arrays.iter().find(|a| a.name == "t"))
        .or_else(|| arrays.iter().find(|a| is_time(&a.name)));
    let rows = time.map(longest).unwrap_or_else(|| {
        let alike = |n: usize| arrays.iter().filter(|a| longest(a) == n).count();
        let lengths = arrays.iter().map(longest);
        lengths.max_by_key(|n| (alike(*n), *n)).unwrap_or(0)
    });
    let names: Vec<String> = arrays.iter().map(|a| a.name.clone()).collect();
    let mut found = Columns::default();
    for array in arrays {
        let (count, is_across) = match array.shape.as_slice() {
            [n] if *n == rows => (1, false),
            [n, count] if *n == rows => (*count, false),
            [count, n] if *n == rows => (*count, true),
            _ => {
                let shape: Vec<String> = array.shape.iter().map(usize::to_string).collect();
                let shape = if shape.is_empty() {
                    "1".to_owned()
                } else {
                    shape.join(" × ")
                };
                found.others.push(format!("{} ({shape})", array.name));
                continue;
            }
        };
        for (k, name) in names_of(&array.name, count, &names).into_iter().enumerate() {
            found.names.push(name);
            let at = |row: usize| {
                if is_across {
                    row * count + k
                } else {
                    k * rows + row
                }
            };
            let value = |row| array.values.get(at(row)).copied().unwrap_or(f64::NAN);
            found.values.push((0..rows).map(value).collect());
        }
    }
    found
}

/// Returns the names of the columns of an array: `q_deg` gives `q1_deg`, `q2_deg` and so on. `names` are those of all arrays.
pub(super) fn names_of(array: &str, count: usize, names: &[String]) -> Vec<String> {
    let bare = Unit::split(array).map_or(array, |(bare, _)| bare);
    let unit = array.strip_prefix(bare).unwrap_or_default();
    let gap = match bare.ends_with(|c: char| c.is_ascii_digit()) {
        true => "_",
        false => "",
    };
    let of = |k: usize| {
        let numbered = format!("{bare}{gap}{}{unit}", k + 1);
        // `q` of a robot with one joint is `q1`, but `t` stays `t`, and `q1` stays `q1`.
        let is_short = gap.is_empty()
            && Signal::split(&format!("{bare}1")).is_some()
            && !names.contains(&numbered);
        match count > 1 || is_short {
            true => numbered,
            false => array.to_owned(),
        }
    };
    (0..count).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_of(arrays: &[(&str, &[usize])]) -> Vec<String> {
        let of = |(name, shape): &(&str, &[usize])| Array {
            name: (*name).to_owned(),
            shape: shape.to_vec(),
            values: vec![0.0; shape.iter().product()],
        };
        columns(arrays.iter().map(of).collect()).names
    }

    #[test]
    fn the_unit_of_an_array_stands_behind_the_number_of_its_columns() {
        let names = names_of(&[("t", &[9]), ("q_deg", &[9, 2]), ("tau_mNm", &[9, 2])]);
        assert_eq!(names, ["t", "q1_deg", "q2_deg", "tau1_mNm", "tau2_mNm"]);
        assert_eq!(
            names_of(&[("t_ms", &[9, 1]), ("q_deg", &[9])]),
            ["t_ms", "q1_deg"]
        );
    }

    #[test]
    fn an_array_of_one_column_keeps_the_name_of_a_column() {
        for shape in [&[9][..], &[9, 1], &[1, 9]] {
            assert_eq!(names_of(&[("t", &[9]), ("q1", shape)]), ["t", "q1"]);
            assert_eq!(names_of(&[("t", &[9]), ("q1_deg", shape)]), ["t", "q1_deg"]);
            assert_eq!(names_of(&[("t", &[9]), ("q", shape)]), ["t", "q1"]);
        }
        // Columns of `q1` are not those of the joints 11 and 12.
        assert_eq!(
            names_of(&[("t", &[9]), ("q1", &[9, 2])]),
            ["t", "q1_1", "q1_2"]
        );
    }
}
