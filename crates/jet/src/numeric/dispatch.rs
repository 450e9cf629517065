//! One source, compiled for several instruction sets; the machine's widest is chosen at run time.
//!
//! The one idea: a kernel is a value whose `run` is inlined into a function that is compiled once
//! per instruction set. Nothing is fused or reordered, so that every instruction set gives the same
//! bits.

use pulp::{Arch, Simd, WithSimd};

/// Work on lanes that is worth a choice of instructions.
///
/// `run` and everything it calls in its loops must be `#[inline(always)]`: what is not inlined is
/// compiled for the least machine.
pub trait Kernel {
    /// What the work returns.
    type Output;

    /// Does the work.
    fn run(self) -> Self::Output;
}

/// Runs a kernel with the widest registers of this machine: SSE2, AVX2 or AVX-512 on x86-64, NEON
/// on aarch64.
///
/// The results are the same to the last bit on each: products and sums are rounded separately.
///
/// ```
/// use grazemap_jet::numeric::{Kernel, widest};
/// struct Double<'a>(&'a mut [f64]);
/// impl Kernel for Double<'_> {
///     type Output = ();
///     #[inline(always)]
///     fn run(self) {
///         self.0.iter_mut().for_each(|value| *value *= 2.0);
///     }
/// }
/// let mut values = [1.0, 2.0, 3.0];
/// widest(Double(&mut values));
/// assert_eq!(values, [2.0, 4.0, 6.0]);
/// ```
#[inline(always)]
pub fn widest<K: Kernel>(kernel: K) -> K::Output {
    Arch::new().dispatch(Inlined(kernel))
}

/// Runs a kernel where registers are wider than SSE2, as they are on any aarch64; `None` where they
/// are not.
///
/// Lanes that are taken apart into pairs are no faster than one number after another: a large
/// kernel is spared that code, and its compilation.
#[inline(always)]
pub fn wide<K: Kernel>(kernel: K) -> Option<K::Output> {
    #[cfg(target_arch = "x86_64")]
    let output = match Arch::new() {
        Arch::V4(simd) => Some(Simd::vectorize(simd, Inlined(kernel))),
        Arch::V3(simd) => Some(Simd::vectorize(simd, Inlined(kernel))),
        _ => None,
    };
    #[cfg(not(target_arch = "x86_64"))]
    let output = Some(widest(kernel));
    output
}

/// Whether registers are wider than SSE2 here, as they are on any aarch64: whether flights are
/// flown in lanes.
pub fn is_wide() -> bool {
    wide(Nothing).is_some()
}

struct Nothing;

impl Kernel for Nothing {
    type Output = ();

    #[inline(always)]
    fn run(self) {}
}

struct Inlined<K>(K);

impl<K: Kernel> WithSimd for Inlined<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run()
    }
}
