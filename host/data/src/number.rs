//! Numbers in the notation of recordings.

/// Powers of ten that are exact in double precision.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Reads a plain decimal number at the start of `text`: nearly every field of a recording is one. Returns the number,
/// its end in bytes, and whether it contains `mark`, the decimal point or comma.
///
/// The digits must form an exact integer below 2⁵³. With at most 22 of them after the point, the quotient of two exact
/// numbers is the nearest double (Clinger 1990), as from the standard library. Other numbers give `None`.
#[inline]
pub(super) fn decimal(text: &[u8], mark: u8) -> (Option<f64>, usize, bool) {
    let negative = text.first() == Some(&b'-');
    let start = usize::from(negative);
    let mut mantissa = 0u64;
    let mut point = None;
    let mut end = start;
    for byte in &text[start..] {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            // At most 18 digits are used below, so overflow here has no effect.
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        } else if *byte == mark && point.is_none() {
            point = Some(end);
        } else {
            break;
        }
        end += 1;
    }
    let digits = end - start - usize::from(point.is_some());
    let behind = point.map_or(0, |p| end - p - 1);
    if !(1..=18).contains(&digits) || mantissa >= 1 << 53 {
        return (None, end, point.is_some());
    }
    let value = mantissa as f64 / POWERS[behind];
    (
        Some(if negative { -value } else { value }),
        end,
        point.is_some(),
    )
}

/// Reads the number in a field with this decimal mark, also `+1.5e3` and `1.5D-01` (Fortran). Returns NaN if there is
/// no number.
pub(super) fn number(field: &[u8], mark: u8) -> f64 {
    let parse = |bytes: &[u8]| std::str::from_utf8(bytes).ok().and_then(|s| s.parse().ok());
    let field = field.trim_ascii();
    let odd = |byte: &u8| *byte == b',' || byte.eq_ignore_ascii_case(&b'd');
    if mark == b'.' && !field.iter().any(odd) {
        return parse(field).unwrap_or(f64::NAN);
    }
    // No number is this long, so no text is copied.
    if field.len() > 64 || field.iter().any(|b| *b == b'.' && mark != b'.') {
        return f64::NAN;
    }
    let plain: Vec<u8> = field
        .iter()
        .map(|byte| match byte {
            b if *b == mark => b'.',
            b'd' | b'D' => b'e',
            other => *other,
        })
        .collect();
    parse(&plain).unwrap_or(f64::NAN)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn plain_numbers_are_read_as_the_standard_library_reads_them() {
        let mut g = rand_pcg::Pcg64::seed_from_u64(9);
        let mut quick = 0;
        for k in 0..200_000 {
            let x = (g.random::<f64>() - 0.5) * 10f64.powi(k % 19 - 9);
            let text = match k % 4 {
                0 => format!("{x:.7}"),
                1 => format!("{x}"),
                2 => format!("{x:.0}"),
                _ => format!("{x:.digits$}", digits = (k % 24) as usize),
            };
            let (found, used, _) = decimal(text.as_bytes(), b'.');
            if let Some(found) = found {
                assert_eq!(used, text.len());
                assert_eq!(
                    found.to_bits(),
                    text.parse::<f64>().unwrap().to_bits(),
                    "{text}"
                );
                quick += 1;
            }
        }
        assert!(quick > 100_000, "{quick}");
        for text in [
            "",
            "-",
            ".",
            "-.",
            "1e5",
            "nan",
            "+1",
            "9007199254740993",
            "1_0",
            " 1",
            "0x1",
        ] {
            let (found, used, _) = decimal(text.as_bytes(), b'.');
            assert!(found.is_none() || used < text.len(), "{text}");
        }
        for (text, value) in [
            ("0", 0.0),
            ("-0.0", -0.0),
            ("5.", 5.0),
            (".5", 0.5),
            ("-12.25", -12.25),
        ] {
            let (found, ..) = decimal(text.as_bytes(), b'.');
            assert_eq!(found.unwrap().to_bits(), f64::to_bits(value), "{text}");
        }
    }
}
