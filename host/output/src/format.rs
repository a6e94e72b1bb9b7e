//! Numbers as text, with as many digits as are known.

/// Typographic minus sign, as wide as a digit.
const MINUS: char = '−';
/// Text for a missing value.
const NONE: &str = "–";

/// Characters of an exponent, and how each is written raised.
const RAISED: [(char, char); 11] = [
    ('0', '⁰'),
    ('1', '¹'),
    ('2', '²'),
    ('3', '³'),
    ('4', '⁴'),
    ('5', '⁵'),
    ('6', '⁶'),
    ('7', '⁷'),
    ('8', '⁸'),
    ('9', '⁹'),
    ('-', '⁻'),
];

/// Formats a power of ten: `10⁻⁵`.
pub fn power_of_ten(exponent: i32) -> String {
    let raised = |c| RAISED.iter().find(|(plain, _)| *plain == c);
    let digits = exponent.to_string();
    let digits = digits.chars().filter_map(|c| raised(c).map(|own| own.1));
    "10".chars().chain(digits).collect()
}

/// Returns the digit or minus sign that is written raised as `c`; `None` for any other character.
pub fn of_exponent(c: char) -> Option<char> {
    let found = RAISED.iter().find(|(_, raised)| *raised == c);
    found.map(|(plain, _)| *plain)
}

/// Formats a number with a fixed count of decimals; never `−0`.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_owned(),
        Some(rest) => format!("{MINUS}{rest}"),
        None => text,
    }
}

/// Returns mantissa and decimal exponent of a value after rounding to `digits` significant digits.
fn scientific(value: f64, digits: usize) -> (f64, i32) {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    let mut parts = text.split('e');
    let mantissa = parts.next().and_then(|m| m.parse().ok()).unwrap_or(0.0);
    let exponent = parts.next().and_then(|e| e.parse().ok()).unwrap_or(0);
    (mantissa, exponent)
}

/// Returns true if a number of this decimal exponent is written as a plain decimal.
fn plain(exponent: i32) -> bool {
    (-4..6).contains(&exponent)
}

/// Formats a value with `digits` significant digits, with trailing zeros because they are known:
/// `format_significant(0.50012, 3)` is `0.500`, `1.2345e-7` is `1.23·10⁻⁷`, a missing value is `–`.
#[must_use]
pub fn format_significant(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return NONE.to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    let digits = digits.clamp(1, 15);
    if value == 0.0 {
        return "0".to_owned();
    }
    let (mantissa, exponent) = scientific(value, digits);
    if plain(exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        fixed(value, decimals)
    } else {
        format!("{}·{}", fixed(mantissa, digits - 1), power_of_ten(exponent))
    }
}

/// Formats like [`format_significant`] without trailing zeros: `6` for 6.000.
#[must_use]
pub fn format_trimmed(value: f64, digits: usize) -> String {
    let text = format_significant(value, digits);
    match text.split_once('·') {
        Some((mantissa, power)) => format!("{}·{power}", without_zeros(mantissa)),
        None => without_zeros(&text).to_owned(),
    }
}

/// Formats a value for messages: at most six significant digits, no trailing zeros: `250`, `0.5`, `1.04·10²²⁴`.
#[must_use]
pub fn format_short(value: f64) -> String {
    match value.is_nan() {
        true => "NaN".to_owned(),
        false => format_trimmed(value, 6),
    }
}

/// Formats a time stamp in s for messages, to the microsecond: six digits would not find a row in a long recording.
#[must_use]
pub fn format_time(seconds: f64) -> String {
    // Below this, a microsecond is larger than the resolution of the number.
    if seconds.abs() < 4e9 {
        without_zeros(&fixed(seconds, 6)).to_owned()
    } else {
        format_short(seconds)
    }
}

/// Returns a text with its first letter in upper case.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Lists items in words: `a`, `a and b`, `a, b and c`.
pub fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Returns a decimal number without trailing zeros.
fn without_zeros(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

/// Formats a unit for print: `kg*m^2` is `kg·m²`.
#[must_use]
pub fn format_unit(ascii: &str) -> String {
    ascii.replace("^2", "²").replace('*', "·")
}

/// Spells the units within a sentence as [`format_unit`] does: `0.12 kg*m^2 or N*m` is `0.12 kg·m² or N·m`. Other products and
/// powers stay.
#[must_use]
pub fn spell_units(sentence: &str) -> String {
    if !sentence.contains(['*', '^']) {
        return sentence.to_owned();
    }
    const SPELLED: [(&str, &str); 8] = [
        ("N*m", "N·m"),
        ("kg*m", "kg·m"),
        ("N*s", "N·s"),
        ("m*s", "m·s"),
        ("rad*K", "rad·K"),
        ("m^2", "m²"),
        ("s^2", "s²"),
        ("rad^2", "rad²"),
    ];
    (SPELLED.iter()).fold(sentence.to_owned(), |text, (ascii, printed)| {
        text.replace(ascii, printed)
    })
}

/// Formats a value and its standard deviation, both rounded to the deviation's two significant digits (the rule of the
/// Guide to the Expression of Uncertainty in Measurement, JCGM 100:2008, 7.2.6): `format_value(95.1123, 0.1083)` is
/// `95.11 ± 0.11`.
///
/// Very large or small values share a power of ten: `(1.235 ± 0.012)·10⁻⁵`. A deviation of zero means an exact value;
/// NaN means an unknown uncertainty: `95.11 ± –`.
#[must_use]
pub fn format_value(value: f64, std: f64) -> String {
    let std = std.abs();
    if !value.is_finite() {
        return format_significant(value, 4);
    }
    if std == 0.0 {
        return format_significant(value, 4);
    }
    if !std.is_finite() {
        return format!(
            "{} ± {}",
            format_significant(value, 4),
            format_significant(std, 2)
        );
    }
    match Rounding::of(value, std) {
        Rounding::Plain(decimals) => {
            format!("{} ± {}", plainly(value, decimals), plainly(std, decimals))
        }
        Rounding::Power { exponent, decimals } => format!(
            "({} ± {})·{}",
            fixed(shifted(value, exponent), decimals),
            fixed(shifted(std, exponent), decimals),
            power_of_ten(exponent)
        ),
        Rounding::Digits => format_significant(value, 15),
    }
}

/// Formats the ends of an interval, rounded as [`format_value`] rounds the value: `94.90 to 95.33`.
#[must_use]
pub fn format_interval(ends: [f64; 2], value: f64, std: f64) -> String {
    let std = std.abs();
    let known = value.is_finite() && std.is_finite() && std > 0.0;
    let rounding = if known && ends.iter().all(|end| end.is_finite()) {
        Rounding::of(value, std)
    } else {
        Rounding::Digits
    };
    match rounding {
        Rounding::Plain(decimals) => {
            let [low, high] = ends.map(|end| plainly(end, decimals));
            format!("{low} to {high}")
        }
        Rounding::Power { exponent, decimals } => {
            let [low, high] = ends.map(|end| fixed(shifted(end, exponent), decimals));
            format!("({low} to {high})·{}", power_of_ten(exponent))
        }
        Rounding::Digits => {
            let [low, high] = ends.map(|end| format_significant(end, 4));
            format!("{low} to {high}")
        }
    }
}

/// Rounding of a value to the two significant digits of its deviation.
enum Rounding {
    /// To this number of decimals; negative before the decimal point.
    Plain(i32),
    /// With a power of ten.
    Power { exponent: i32, decimals: usize },
    /// The deviation is far below the value's own digits, so not all digits are written.
    Digits,
}

impl Rounding {
    fn of(value: f64, std: f64) -> Self {
        let (_, std_exponent) = scientific(std, 2);
        let (_, value_exponent) = scientific(value, 2);
        let exponent = if value == 0.0 {
            std_exponent
        } else {
            value_exponent.max(std_exponent)
        };
        let decimals = 1 - std_exponent;
        if exponent - std_exponent > 15 {
            Self::Digits
        } else if plain(exponent) && decimals <= 8 {
            Self::Plain(decimals)
        } else {
            Self::Power {
                exponent,
                decimals: (decimals + exponent).max(0) as usize,
            }
        }
    }
}

/// Formats a number with `decimals` decimals; rounds to tens, hundreds and so on if negative.
fn plainly(value: f64, decimals: i32) -> String {
    match usize::try_from(decimals) {
        Ok(decimals) => fixed(value, decimals),
        Err(_) => {
            let unit = 10f64.powi(-decimals);
            fixed((value / unit).round() * unit, 0)
        }
    }
}

/// Divides a value by a power of ten, through text instead of powi: 10^-320 has no exact double.
fn shifted(value: f64, exponent: i32) -> f64 {
    format!("{value:e}")
        .split_once('e')
        .and_then(|(m, e)| {
            let e: i32 = e.parse().ok()?;
            format!("{m}e{}", e - exponent).parse::<f64>().ok()
        })
        .unwrap_or(0.0)
}

/// Formats a probability: `0.031`, `4·10⁻¹²`, and `< 10⁻³⁰⁰` below the range of the computation.
#[must_use]
pub fn format_p_value(p: f64) -> String {
    if p.is_nan() {
        NONE.to_owned()
    } else if p < 1e-300 {
        format!("< {}", power_of_ten(-300))
    } else if p >= 0.001 {
        format_significant(p, 2)
    } else {
        let (mantissa, exponent) = scientific(p, 1);
        format!("{}·{}", fixed(mantissa, 0), power_of_ten(exponent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_to_two_digits_of_their_deviation() {
        assert_eq!(format_value(95.1123, 0.1083), "95.11 ± 0.11");
        assert_eq!(format_value(-0.04567, 0.00123), "−0.0457 ± 0.0012");
        assert_eq!(format_value(1234.0, 234.0), "1230 ± 230");
        assert_eq!(format_value(0.0, 0.5), "0.00 ± 0.50");
        assert_eq!(format_value(3.0, 40.0), "3 ± 40");
    }

    #[test]
    fn intervals_are_rounded_as_their_value_is() {
        let of = |ends, value, std| format_interval(ends, value, std);
        assert_eq!(of([1.211642, 1.286091], 1.249, 0.019), "1.212 to 1.286");
        assert_eq!(of([-0.510356, 0.0001], -0.466, 0.022), "−0.510 to 0.000");
        assert_eq!(of([765.0, 1702.0], 1234.0, 234.0), "770 to 1700");
        assert_eq!(
            of([1.211e-5, 1.259e-5], 1.235e-5, 1.2e-7),
            "(1.211 to 1.259)·10⁻⁵"
        );
        assert_eq!(of([2.0, 2.0], 2.0, 0.0), "2.000 to 2.000");
        assert_eq!(of([f64::NEG_INFINITY, 1.0], 0.5, 0.1), "−∞ to 1.000");
    }

    #[test]
    fn rounding_up_into_the_next_decade_keeps_two_digits() {
        assert_eq!(format_value(1.0, 0.0996), "1.00 ± 0.10");
        assert_eq!(format_value(1.0, 9.96), "1 ± 10");
    }

    #[test]
    fn small_and_large_values_share_a_power_of_ten() {
        assert_eq!(format_value(1.23456e-5, 1.2e-7), "(1.235 ± 0.012)·10⁻⁵");
        assert_eq!(format_value(-2.5e9, 1.5e7), "(−2.500 ± 0.015)·10⁹");
        assert_eq!(format_value(5e-320, 1e-321), "(5.00 ± 0.10)·10⁻³²⁰");
        // Without such a form, this would need twelve decimals.
        assert_eq!(format_value(0.001, 1e-9), "(1.0000000 ± 0.0000010)·10⁻³");
    }

    #[test]
    fn what_is_not_known_is_not_invented() {
        assert_eq!(format_value(f64::NAN, 0.1), "–");
        assert_eq!(format_value(95.1123, f64::NAN), "95.11 ± –");
        assert_eq!(format_value(95.1123, f64::INFINITY), "95.11 ± ∞");
        assert_eq!(format_value(2.0, 0.0), "2.000");
        assert_eq!(format_value(1.0, 1e-300), "1.00000000000000");
    }

    #[test]
    fn significant_digits() {
        assert_eq!(format_significant(0.50012, 3), "0.500");
        assert_eq!(format_significant(-12345.6, 3), "−12346");
        assert_eq!(format_significant(1.2345e-7, 3), "1.23·10⁻⁷");
        assert_eq!(format_significant(999.96, 4), "1000");
        assert_eq!(format_significant(f64::NEG_INFINITY, 3), "−∞");
        assert_eq!(format_significant(-0.0, 3), "0");
    }

    #[test]
    fn p_values() {
        assert_eq!(format_p_value(0.0312), "0.031");
        assert_eq!(format_p_value(4.2e-12), "4·10⁻¹²");
        assert_eq!(format_p_value(0.0), "< 10⁻³⁰⁰");
    }

    #[test]
    fn messages_have_six_digits_without_zeros_behind() {
        for (value, text) in [
            (250.000_000_000_000_06, "250"),
            (0.5, "0.5"),
            (-12.25, "−12.25"),
            (1234.5678, "1234.57"),
            (1.04e224, "1.04·10²²⁴"),
            (1e-9, "1·10⁻⁹"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(format_short(value), text);
        }
        for (seconds, text) in [
            (0.1, "0.1"),
            (47.0, "47"),
            (1_700_000_000.123_456_7, "1700000000.123457"),
            (1e300, "1·10³⁰⁰"),
        ] {
            assert_eq!(format_time(seconds), text);
        }
    }

    #[test]
    fn units_within_a_sentence_are_spelled_and_expressions_are_not() {
        for (ascii, printed) in [
            ("0.12 kg*m^2 or 3 N*m", "0.12 kg·m² or 3 N·m"),
            ("N*m*s/rad, N*m*s^2/rad^2", "N·m·s/rad, N·m·s²/rad²"),
            ("mx1 + 0.3*m2 - d2^2*m3", "mx1 + 0.3*m2 - d2^2*m3"),
            ("none", "none"),
        ] {
            assert_eq!(spell_units(ascii), printed);
        }
        for unit in ["kg*m^2", "N*m*s/rad", "N*m*s/(rad*K)", "kg*m", "N*s/m"] {
            assert_eq!(spell_units(unit), format_unit(unit));
        }
    }
}
