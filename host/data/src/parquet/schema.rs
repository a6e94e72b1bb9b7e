//! Columns of a Parquet file, from the tree of its schema.

use parquet::basic::{ConvertedType, LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::schema::types::Type;

use super::number::{Clock, Number};

/// A column that holds numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Leaf {
    /// Its name, or that of the list.
    pub name: String,
    /// Place among the stored columns.
    pub at: usize,
    pub number: Number,
    /// Definition level of a value that is there.
    pub defined: i16,
    /// True if the value itself may be missing.
    pub is_optional: bool,
    /// True if a row holds a list of values.
    pub is_list: bool,
}

/// Columns of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Columns {
    pub leaves: Vec<Leaf>,
    /// Names of columns that hold no numbers, with what they hold.
    pub others: Vec<String>,
}

/// Finds the columns of a schema.
pub(super) fn columns(root: &Type) -> Columns {
    let mut found = Columns::default();
    let mut stored = 0;
    for field in root.get_fields() {
        let mut nodes = Vec::new();
        preorder(field, &mut nodes);
        match column(&nodes, stored) {
            Ok(leaf) => found.leaves.push(leaf),
            Err(what) => {
                let name = field.name().escape_debug();
                found.others.push(format!("{name} ({what})"));
            }
        }
        stored += nodes.iter().filter(|own| own.is_primitive()).count();
    }
    found
}

fn preorder<'a>(node: &'a Type, nodes: &mut Vec<&'a Type>) {
    nodes.push(node);
    if node.is_group() {
        for child in node.get_fields() {
            preorder(child, nodes);
        }
    }
}

/// Returns the column of a subtree: a number, or a list of numbers in any of the three forms that writers use.
fn column(nodes: &[&Type], at: usize) -> Result<Leaf, &'static str> {
    let (first, leaf) = match nodes {
        [one] => (one, one),
        [first, .., last] => (first, last),
        [] => return Err("nothing"),
    };
    let groups = &nodes[..nodes.len() - 1];
    let is_chain =
        nodes.len() <= 3 && leaf.is_primitive() && groups.iter().all(|own| is_single(own));
    let repeated = |own: &Type| repetition(own) == Repetition::REPEATED;
    let is_list = match nodes.iter().filter(|own| repeated(own)).count() {
        0 if nodes.len() == 1 && leaf.is_primitive() => false,
        // The values themselves, or the one group between the list and them.
        1 if is_chain && repeated(nodes[groups.len().min(1)]) => true,
        _ => return Err("nested"),
    };
    let is_optional = |own: &&&Type| repetition(own) != Repetition::REQUIRED;
    Ok(Leaf {
        name: first.name().into(),
        at,
        number: number(leaf)?,
        defined: nodes.iter().filter(is_optional).count() as i16,
        is_optional: repetition(leaf) == Repetition::OPTIONAL,
        is_list,
    })
}

fn is_single(node: &Type) -> bool {
    node.is_group() && node.get_fields().len() == 1
}

/// Returns the repetition of a node; the old field may be absent.
fn repetition(node: &Type) -> Repetition {
    let about = node.get_basic_info();
    match about.has_repetition() {
        true => about.repetition(),
        false => Repetition::REQUIRED,
    }
}

/// Returns what the numbers of a column are, or what it holds instead. The newer field (`LogicalType`) goes before the older.
fn number(leaf: &Type) -> Result<Number, &'static str> {
    let about = leaf.get_basic_info();
    let number = match about.logical_type_ref() {
        None => converted(about.converted_type())?,
        Some(LogicalType::Decimal(_)) => return Err("decimals"),
        Some(LogicalType::Date) => return Err("dates"),
        Some(LogicalType::Time(time) | LogicalType::Timestamp(time)) => {
            Number::Clock(match time.unit {
                TimeUnit::MILLIS => Clock::MILLISECONDS,
                TimeUnit::MICROS => Clock::MICROSECONDS,
                TimeUnit::NANOS => Clock::NANOSECONDS,
            })
        }
        Some(LogicalType::Integer(whole)) if !whole.is_signed => Number::Unsigned,
        Some(LogicalType::Integer(_)) => Number::Plain,
        Some(LogicalType::Unknown) => return Err("nothing"),
        Some(LogicalType::Float16) => return Err("half precision"),
        Some(_) => return Err("text or bytes"),
    };
    match leaf.get_physical_type() {
        Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY => Err("text or bytes"),
        Physical::INT96 => Ok(Number::Clock(Clock::NANOSECONDS)),
        _ => Ok(number),
    }
}

/// Returns the meaning by the older field.
fn converted(meaning: ConvertedType) -> Result<Number, &'static str> {
    Ok(match meaning {
        ConvertedType::DECIMAL => return Err("decimals"),
        ConvertedType::DATE => return Err("dates"),
        ConvertedType::TIME_MILLIS | ConvertedType::TIMESTAMP_MILLIS => {
            Number::Clock(Clock::MILLISECONDS)
        }
        ConvertedType::TIME_MICROS | ConvertedType::TIMESTAMP_MICROS => {
            Number::Clock(Clock::MICROSECONDS)
        }
        ConvertedType::UINT_8
        | ConvertedType::UINT_16
        | ConvertedType::UINT_32
        | ConvertedType::UINT_64 => Number::Unsigned,
        ConvertedType::NONE
        | ConvertedType::INT_8
        | ConvertedType::INT_16
        | ConvertedType::INT_32
        | ConvertedType::INT_64 => Number::Plain,
        _ => return Err("text or bytes"),
    })
}
