//! Natural numbers of any size: what exact decimal conversion needs, and no more.

use std::cmp::Ordering;

/// A natural number in limbs of 32 bits, least significant first, without leading zero limbs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Natural {
    limbs: Vec<u32>,
}

impl Natural {
    /// The number as it stands.
    pub(super) fn from_u64(value: u64) -> Natural {
        let mut result = Natural {
            limbs: vec![value as u32, (value >> 32) as u32],
        };
        result.trim();
        result
    }

    /// Whether the number is zero.
    pub(super) fn is_zero(&self) -> bool {
        self.limbs.is_empty()
    }

    /// Count of binary digits; zero has none.
    pub(super) fn bit_length(&self) -> usize {
        match self.limbs.last() {
            None => 0,
            Some(top) => 32 * self.limbs.len() - top.leading_zeros() as usize,
        }
    }

    /// Whether the number is odd.
    pub(super) fn is_odd(&self) -> bool {
        self.limbs.first().is_some_and(|limb| limb & 1 == 1)
    }

    /// `self * factor + addend`, in place.
    pub(super) fn multiply_add(&mut self, factor: u32, addend: u32) {
        let mut carry = u64::from(addend);
        for limb in &mut self.limbs {
            let product = u64::from(*limb) * u64::from(factor) + carry;
            *limb = product as u32;
            carry = product >> 32;
        }
        if carry > 0 {
            self.limbs.push(carry as u32);
        }
        self.trim();
    }

    /// `self * 10^exponent`, in place.
    pub(super) fn multiply_by_power_of_ten(&mut self, exponent: usize) {
        for _ in 0..exponent / 9 {
            self.multiply_add(1_000_000_000, 0);
        }
        self.multiply_add(10_u32.pow((exponent % 9) as u32), 0);
    }

    /// Divides in place by a positive divisor and returns the remainder.
    pub(super) fn divide(&mut self, divisor: u32) -> u32 {
        let mut remainder = 0_u64;
        for limb in self.limbs.iter_mut().rev() {
            let dividend = (remainder << 32) | u64::from(*limb);
            *limb = (dividend / u64::from(divisor)) as u32;
            remainder = dividend % u64::from(divisor);
        }
        self.trim();
        remainder as u32
    }

    /// Floor division in place by `10^exponent`; says whether a remainder was dropped.
    pub(super) fn divide_by_power_of_ten(&mut self, exponent: usize) -> Remainder {
        let mut dropped = 0;
        for _ in 0..exponent / 9 {
            dropped |= self.divide(1_000_000_000);
        }
        dropped |= self.divide(10_u32.pow((exponent % 9) as u32));
        Remainder::of(dropped == 0)
    }

    /// `self * 2^bits`.
    pub(super) fn shifted_up(&self, bits: usize) -> Natural {
        let mut limbs = vec![0; bits / 32];
        limbs.extend_from_slice(&self.limbs);
        let mut result = Natural { limbs };
        result.multiply_add(1 << (bits % 32), 0);
        result
    }

    /// `floor(self / 2^bits)`, and whether a remainder was dropped.
    pub(super) fn shifted_down(&self, bits: usize) -> (Natural, Remainder) {
        let whole = (bits / 32).min(self.limbs.len());
        let dropped = self.limbs[..whole].iter().any(|&limb| limb != 0);
        let mut result = Natural {
            limbs: self.limbs[whole..].to_vec(),
        };
        let remainder = result.divide(1 << (bits % 32));
        (result, Remainder::of(!dropped && remainder == 0))
    }

    /// `self + other`.
    pub(super) fn plus(&self, other: &Natural) -> Natural {
        let length = self.limbs.len().max(other.limbs.len()) + 1;
        let mut carry = 0_u64;
        let limbs = (0..length).map(|index| {
            let sum = self.limb(index) + other.limb(index) + carry;
            carry = sum >> 32;
            sum as u32
        });
        let mut result = Natural {
            limbs: limbs.collect(),
        };
        result.trim();
        result
    }

    /// `self - other`, for `other <= self`.
    pub(super) fn minus(&self, other: &Natural) -> Natural {
        let mut borrow = 0_u64;
        let limbs = (0..self.limbs.len()).map(|index| {
            let difference = (1 << 32) + self.limb(index) - other.limb(index) - borrow;
            borrow = 1 - (difference >> 32);
            difference as u32
        });
        let mut result = Natural {
            limbs: limbs.collect(),
        };
        result.trim();
        result
    }

    /// The number as a `u64`, if it has at most 64 binary digits.
    pub(super) fn to_u64(&self) -> Option<u64> {
        (self.limbs.len() <= 2).then(|| self.limb(0) | (self.limb(1) << 32))
    }

    /// Decimal digits; `"0"` for zero.
    pub(super) fn to_decimal(&self) -> String {
        let mut rest = self.clone();
        let mut groups = Vec::new();
        while !rest.is_zero() {
            groups.push(rest.divide(1_000_000_000));
        }
        let Some(first) = groups.pop() else {
            return "0".to_owned();
        };
        groups
            .iter()
            .rev()
            .fold(first.to_string(), |text, group| format!("{text}{group:09}"))
    }

    fn limb(&self, index: usize) -> u64 {
        self.limbs.get(index).copied().map_or(0, u64::from)
    }

    fn trim(&mut self) {
        while self.limbs.last() == Some(&0) {
            self.limbs.pop();
        }
    }
}

impl Ord for Natural {
    fn cmp(&self, other: &Natural) -> Ordering {
        let by_length = self.limbs.len().cmp(&other.limbs.len());
        by_length.then_with(|| self.limbs.iter().rev().cmp(other.limbs.iter().rev()))
    }
}

impl PartialOrd for Natural {
    fn partial_cmp(&self, other: &Natural) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Whether a floor division dropped something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Remainder {
    /// The division was exact.
    Zero,
    /// A positive remainder was dropped.
    Positive,
}

impl Remainder {
    /// The remainder of one division of which the quotient was divided again.
    pub(super) fn or(self, other: Remainder) -> Remainder {
        Remainder::of(self == Remainder::Zero && other == Remainder::Zero)
    }

    fn of(exact: bool) -> Remainder {
        if exact {
            Remainder::Zero
        } else {
            Remainder::Positive
        }
    }
}

/// Half the number, plus what a dropped remainder adds, rounded half to even.
pub(super) fn rounded_half(doubled: Natural, remainder: Remainder) -> Natural {
    let (half, last_bit) = doubled.shifted_down(1);
    let up = last_bit == Remainder::Positive && (remainder == Remainder::Positive || half.is_odd());
    if up {
        half.plus(&Natural::from_u64(1))
    } else {
        half
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factorial_of_thirty_is_written_digit_for_digit() {
        let mut product = Natural::from_u64(1);
        (1..=30).for_each(|factor| product.multiply_add(factor, 0));
        assert_eq!(product.to_decimal(), "265252859812191058636308480000000");
    }

    #[test]
    fn shifts_sums_and_differences_undo_each_other() {
        let number = Natural::from_u64(0x1234_5678_9abc_def1);
        let up = number.shifted_up(77);
        assert_eq!(up.shifted_down(77), (number.clone(), Remainder::Zero));
        assert_eq!(number.shifted_down(1).1, Remainder::Positive);
        assert_eq!(up.plus(&number).minus(&up), number);
        assert_eq!(up.bit_length(), number.bit_length() + 77);
    }
}
