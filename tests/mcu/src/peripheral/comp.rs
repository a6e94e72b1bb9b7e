//! Comparators (RM0440 section 24): enable, input selection, polarity, output; COMP3 and COMP4 are wired.
//!
//! Left out: hysteresis, blanking, the propagation delay (DS12288: 17 ns typical), the reference's divider, locking,
//! the outputs to pins and EXTI. Divider, blanking and lock are refused.

use super::{Bank, Refusal, Register, told};

const EN: u32 = 1;
/// CSR.INMSEL at "DACA" (table 197): DAC3's first channel for COMP3, its second for COMP4.
const INMSEL: u32 = 7 << 4;
const DACA: u32 = 4 << 4;
const INPSEL: u32 = 1 << 8;
const POLARITY: u32 = 1 << 15;
const VALUE: u32 = 1 << 30;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "COMP1_CSR", 0, 0),
    Register(0x04, "COMP2_CSR", 0, 0),
    // EN, INMSEL, INPSEL, POLARITY, HYST.
    Register(0x08, "COMP3_CSR", 0, 0x0007_8171),
    Register(0x0C, "COMP4_CSR", 0, 0x0007_8171),
    Register(0x10, "COMP5_CSR", 0, 0),
    Register(0x14, "COMP6_CSR", 0, 0),
    Register(0x18, "COMP7_CSR", 0, 0),
];

/// The comparators.
#[derive(Clone, Debug)]
pub struct Comp(Bank);

impl Default for Comp {
    fn default() -> Self {
        Self(Bank::new(REGISTERS))
    }
}

impl Comp {
    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        self.0.read(offset)
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        if value & EN != 0 && value & INMSEL != DACA {
            return told("a comparator against anything but DAC3 is not modelled");
        }
        self.0.write(offset, value).map(|_| ())
    }

    /// Returns the output of comparator `number` (3 or 4) for the voltages of its two positive inputs and its DAC, in
    /// any common unit. Low while it is off; an unconnected input is `None`.
    pub fn compare(&mut self, number: u32, plus: [Option<f64>; 2], dac: f64) -> bool {
        let offset = 4 * (number - 1);
        let control = self.0.get(offset);
        let input = plus[usize::from(control & INPSEL != 0)];
        let above = input.is_some_and(|input| input > dac);
        let high = control & EN != 0 && input.is_some() && above != (control & POLARITY != 0);
        let value = if high { VALUE } else { 0 };
        self.0.put(offset, (control & !VALUE) | value);
        high
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    #[test]
    fn compares_what_is_selected_with_its_polarity() {
        let mut comp = Comp::default();
        let inputs = [Some(1.0), Some(3.0)];
        assert!(!comp.compare(3, inputs, 2.0), "off");
        comp.write(0x08, EN | DACA | INPSEL).unwrap();
        assert!(comp.compare(3, inputs, 2.0));
        assert_eq!(comp.read(0x08).unwrap() & VALUE, VALUE);
        comp.write(0x0C, EN | DACA | POLARITY).unwrap();
        assert!(comp.compare(4, inputs, 2.0), "below, inverted");
        assert!(!comp.compare(4, [None; 2], 2.0));
        assert!(comp.write(0x08, EN).is_err(), "against a divider");
        assert!(comp.write(0x00, EN | DACA).is_err(), "COMP1");
    }
}
