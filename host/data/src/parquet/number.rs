//! Numbers as Parquet stores them.

use parquet::data_type::{
    BoolType, DataType, DoubleType, FloatType, Int32Type, Int64Type, Int96, Int96Type,
};

/// Unit of a time stamp or a time of day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Clock {
    a_second: i64,
}

impl Clock {
    pub(super) const MILLISECONDS: Self = Self { a_second: 1_000 };
    pub(super) const MICROSECONDS: Self = Self {
        a_second: 1_000_000,
    };
    pub(super) const NANOSECONDS: Self = Self {
        a_second: 1_000_000_000,
    };
}

/// What the numbers of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    Plain,
    /// Whole numbers without a sign.
    Unsigned,
    /// Time stamps or times of day.
    Clock(Clock),
}

/// A stored value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stored {
    Real(f64),
    /// With the sign of its type.
    Whole(i64),
    /// A whole number of 32 bits.
    Short(i32),
}

impl Number {
    /// Returns true for time stamps and times of day.
    pub(super) fn is_clock(self) -> bool {
        matches!(self, Self::Clock(_))
    }

    /// Returns the value. Time stamps are counted in s from `origin`, the whole seconds of the first one, as dates in text are:
    /// a double of nanoseconds since 1970 would resolve 256 ns.
    pub(super) fn value(self, stored: Stored, origin: &mut Option<i64>) -> f64 {
        let whole = match stored {
            Stored::Real(value) => return value,
            Stored::Whole(whole) => whole,
            Stored::Short(short) if self == Self::Unsigned => {
                return f64::from(short.cast_unsigned());
            }
            Stored::Short(short) => i64::from(short),
        };
        match self {
            Self::Plain => whole as f64,
            Self::Unsigned => whole.cast_unsigned() as f64,
            Self::Clock(Clock { a_second }) => {
                let (seconds, rest) = (whole.div_euclid(a_second), whole.rem_euclid(a_second));
                let origin = *origin.get_or_insert(seconds);
                let nanoseconds = rest * (Clock::NANOSECONDS.a_second / a_second);
                seconds.saturating_sub(origin) as f64 + nanoseconds as f64 * 1e-9
            }
        }
    }
}

/// A physical type that holds numbers.
pub(super) trait Numeric: DataType {
    /// Returns a value as it is stored.
    fn stored(value: &Self::T) -> Stored;
}

impl Numeric for BoolType {
    fn stored(value: &bool) -> Stored {
        Stored::Short(i32::from(*value))
    }
}

impl Numeric for Int32Type {
    fn stored(value: &i32) -> Stored {
        Stored::Short(*value)
    }
}

impl Numeric for Int64Type {
    fn stored(value: &i64) -> Stored {
        Stored::Whole(*value)
    }
}

/// Nanoseconds of a day and its Julian day, as Spark and Impala wrote times.
impl Numeric for Int96Type {
    fn stored(value: &Int96) -> Stored {
        Stored::Whole(value.to_nanos())
    }
}

impl Numeric for FloatType {
    fn stored(value: &f32) -> Stored {
        Stored::Real(f64::from(*value))
    }
}

impl Numeric for DoubleType {
    fn stored(value: &f64) -> Stored {
        Stored::Real(*value)
    }
}
