//! Interpolation between the rows of a column.

/// Returns the value at `t` of the cubic between the points `from` and `from + 1`.
///
/// The cubic has their values. Its slope at each of them is that of the parabola through the point and its neighbours
/// (at an end of the list, through the three points there; of two points, that of the line). It is exact for parabolas.
/// `points` are times and values in order of time, at least two.
pub(crate) fn cubic(points: &[(f64, f64)], from: usize, t: f64) -> f64 {
    let ((t0, x0), (t1, x1)) = (points[from], points[from + 1]);
    let width = t1 - t0;
    let chord = (x1 - x0) / width;
    let last = points.len() - 1;
    let slope_at = |k: usize| {
        if last < 2 {
            return chord;
        }
        let middle = k.clamp(1, last - 1);
        let around = [points[middle - 1], points[middle], points[middle + 1]];
        slope(around, k + 1 - middle)
    };
    let u = (t - t0) / width;
    let (d0, d1) = (slope_at(from) * width, slope_at(from + 1) * width);
    // Cubic Hermite interpolation.
    let (a, b) = (d0 - (x1 - x0), (x1 - x0) - d1);
    x0 + u * (x1 - x0) + u * (1.0 - u) * ((1.0 - u) * a + u * b)
}

/// Slope of the parabola through three points at point number `at`.
fn slope(points: [(f64, f64); 3], at: usize) -> f64 {
    let [(t0, x0), (t1, x1), (t2, x2)] = points;
    let (left, right) = ((x1 - x0) / (t1 - t0), (x2 - x1) / (t2 - t1));
    let bend = (right - left) / (t2 - t0);
    match at {
        0 => left - bend * (t1 - t0),
        1 => left + bend * (t1 - t0),
        _ => right + bend * (t2 - t1),
    }
}

/// Interpolates linearly at the fraction `u` from `a` to `b`; between two whole numbers (a mode or a flag) returns the
/// nearer one.
pub(crate) fn between(a: f64, b: f64, u: f64) -> f64 {
    match a.fract() == 0.0 && b.fract() == 0.0 {
        true if u < 0.5 => a,
        true => b,
        false => a + u * (b - a),
    }
}
