//! Hash of all bits, the same on every machine.

use grazemap::numeric::{Dd, Real};

/// 64-bit FNV-1a hash.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hash(u64);

impl Hash {
    /// Hash of empty input.
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Hash of a text.
    pub(crate) fn of(text: &str) -> Self {
        let mut hash = Self::new();
        hash.text(text);
        hash
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// Adds a text, with its length.
    pub(crate) fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes(text.as_bytes());
    }

    /// Adds a count.
    pub(crate) fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    /// Adds all bits of a number, including the sign of zero; all NaNs are equal.
    pub(crate) fn number<S: Real>(&mut self, value: S) {
        let Dd { hi, lo } = value.to_dd();
        for part in [hi, lo] {
            let part = if part.is_nan() { f64::NAN } else { part };
            self.bytes(&part.to_bits().to_le_bytes());
        }
    }

    /// Adds numbers, with their count.
    pub(crate) fn numbers<S: Real>(&mut self, values: &[S]) {
        self.count(values.len());
        values.iter().for_each(|&value| self.number(value));
    }

    /// Value of the hash.
    pub(crate) fn value(self) -> u64 {
        self.0
    }
}

/// Reproducible random numbers in `[-1, 1)` (xorshift).
#[derive(Clone, Debug)]
pub(crate) struct Scatter(u64);

impl Scatter {
    /// Generator for a name.
    pub(crate) fn of(name: &str) -> Self {
        Self(Hash::of(name).value() | 1)
    }

    /// Next number.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
