//! Addition of a product.

use super::element::Element;

/// Rule for adding a product to a number.
pub trait MulAdd<T>: Copy {
    /// True if the product is added without rounding.
    const FUSED: bool;

    /// a·b + c
    fn mul_add(a: T, b: T, c: T) -> T;
}

/// Product and sum rounded one after the other: the same bits on every machine.
///
/// The caller chooses the fused kind if the machine has an instruction for it; otherwise it is a slow function.
#[derive(Clone, Copy, Debug)]
pub struct Rounded;

impl<T: Element> MulAdd<T> for Rounded {
    const FUSED: bool = false;

    #[inline(always)]
    fn mul_add(a: T, b: T, c: T) -> T {
        a * b + c
    }
}
