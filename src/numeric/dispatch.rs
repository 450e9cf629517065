//! One source, compiled for several instruction sets; the machine's widest is chosen at run time.
//!
//! The one idea: a kernel is a value whose `run` is inlined into a function that is compiled once per
//! instruction set. Nothing is fused or reordered, so that every instruction set gives the same bits.

use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};

/// Name of the environment variable that limits the instruction set, read once by a process.
///
/// `sse2`, `avx2` and `avx512` name the widest registers that an x86-64 machine may use; a machine
/// that lacks them uses the widest it has. Every other value is no limit in the library, and
/// [`unknown_instruction_limit`] says so; the program refuses it. Results do not depend on the
/// limit: it is there so that this can be seen.
pub const INSTRUCTION_LIMIT: &str = "GRAZEMAP_SIMD";

/// The widest registers that may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Limit {
    Sse2,
    Avx2,
    Avx512,
}

/// The value of [`INSTRUCTION_LIMIT`], where it names no instruction set.
pub fn unknown_instruction_limit() -> Option<String> {
    let value = std::env::var_os(INSTRUCTION_LIMIT)?;
    let value = value.to_string_lossy();
    limit(&value).is_none().then(|| value.into_owned())
}

/// The limit of a name.
fn limit(name: &str) -> Option<Limit> {
    match name {
        "sse2" => Some(Limit::Sse2),
        "avx2" => Some(Limit::Avx2),
        "avx512" => Some(Limit::Avx512),
        _ => None,
    }
}

/// The instructions that kernels run with.
#[inline(always)]
fn instructions() -> Arch {
    static CHOSEN: LazyLock<Arch> = LazyLock::new(|| {
        let value = std::env::var(INSTRUCTION_LIMIT).ok();
        chosen(value.and_then(|name| limit(&name)))
    });
    *CHOSEN
}

/// The widest instructions of this machine up to a limit.
#[cfg(target_arch = "x86_64")]
fn chosen(most: Option<Limit>) -> Arch {
    match (most, Arch::new()) {
        (Some(Limit::Sse2), _) => Arch::Scalar,
        (Some(Limit::Avx2), Arch::V4(_)) => pulp::x86::V3::try_new().map_or(Arch::Scalar, Arch::V3),
        (_, widest) => widest,
    }
}

/// The instructions of this machine, which has one kind of registers.
#[cfg(not(target_arch = "x86_64"))]
fn chosen(_: Option<Limit>) -> Arch {
    Arch::new()
}

/// Work on lanes that is worth a choice of instructions.
///
/// `run` and everything it calls in its loops must be `#[inline(always)]`: what is not inlined is compiled for
/// the least machine.
pub trait Kernel {
    /// What the work returns.
    type Output;

    /// Does the work.
    fn run(self) -> Self::Output;
}

/// Runs a kernel with the widest registers of this machine: SSE2, AVX2 or AVX-512 on x86-64, NEON
/// on aarch64; at most those that [`INSTRUCTION_LIMIT`] names.
///
/// The results are the same to the last bit on each: products and sums are rounded separately.
///
/// ```
/// use grazemap::numeric::{Kernel, widest};
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
    instructions().dispatch(Inlined(kernel))
}

/// Runs a kernel where registers are wider than SSE2, as they are on any aarch64; `None` where they are not.
///
/// Lanes that are taken apart into pairs are no faster than one number after another: a large kernel is spared that code,
/// and its compilation.
#[inline(always)]
pub(crate) fn wide<K: Kernel>(kernel: K) -> Option<K::Output> {
    #[cfg(target_arch = "x86_64")]
    let output = match instructions() {
        Arch::V4(simd) => Some(Simd::vectorize(simd, Inlined(kernel))),
        Arch::V3(simd) => Some(Simd::vectorize(simd, Inlined(kernel))),
        _ => None,
    };
    #[cfg(not(target_arch = "x86_64"))]
    let output = Some(widest(kernel));
    output
}

/// Whether registers are wider than SSE2 here, as they are on any aarch64: whether flights are flown in lanes.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_instruction_sets_are_limits_and_no_others() {
        let known = ["sse2", "avx2", "avx512"].map(limit);
        assert_eq!(known, [Limit::Sse2, Limit::Avx2, Limit::Avx512].map(Some));
        assert_eq!(["", "AVX2", "avx", "neon"].map(limit), [None; 4]);
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn a_limit_is_the_most_that_is_used() {
        assert!(matches!(chosen(Some(Limit::Sse2)), Arch::Scalar));
        assert!(!matches!(chosen(Some(Limit::Avx2)), Arch::V4(_)));
    }
}
