//! One source, compiled for several instruction sets; the machine's widest is chosen at run time.
//!
//! The one idea: vectorised work is a value whose `run` is inlined into a function that is compiled
//! once per instruction set. Nothing is fused or reordered, so that every instruction set gives the
//! same bits.

use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};

/// Name of the environment variable that limits the instruction set, read once by a process.
///
/// `sse2`, `avx2` and `avx512` name the widest registers that an x86-64 machine may use; a machine
/// without them uses the widest it has. Every other value sets no limit, and is returned by
/// [`unknown_instruction_limit`]. Results do not depend on the limit: the variable exists to check
/// this.
///
/// Builds with debug assertions have no code for AVX-512, which takes half of the time to compile
/// the simulator: there `avx512` means AVX2.
pub const INSTRUCTION_LIMIT: &str = "GRAZEMAP_SIMD";

/// The widest registers that may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Limit {
    Sse2,
    Avx2,
    Avx512,
}

/// Value of [`INSTRUCTION_LIMIT`], if it does not name an instruction set.
pub fn unknown_instruction_limit() -> Option<String> {
    let value = std::env::var_os(INSTRUCTION_LIMIT)?;
    let value = value.to_string_lossy();
    limit(&value).is_none().then(|| value.into_owned())
}

/// Limit with a given name.
fn limit(name: &str) -> Option<Limit> {
    match name {
        "sse2" => Some(Limit::Sse2),
        "avx2" => Some(Limit::Avx2),
        "avx512" => Some(Limit::Avx512),
        _ => None,
    }
}

/// Instruction set that vectorised work runs with.
#[inline(always)]
fn instructions() -> Arch {
    static CHOSEN: LazyLock<Arch> = LazyLock::new(|| {
        let value = std::env::var(INSTRUCTION_LIMIT).ok();
        chosen(value.and_then(|name| limit(&name)))
    });
    *CHOSEN
}

/// Widest instruction set of this machine up to a limit.
#[cfg(target_arch = "x86_64")]
fn chosen(most: Option<Limit>) -> Arch {
    let is_narrowed = cfg!(debug_assertions) || most == Some(Limit::Avx2);
    match Arch::new() {
        _ if most == Some(Limit::Sse2) => Arch::Scalar,
        Arch::V4(_) if is_narrowed => pulp::x86::V3::try_new().map_or(Arch::Scalar, Arch::V3),
        widest => widest,
    }
}

/// Instruction set of this machine, which has one kind of registers.
#[cfg(not(target_arch = "x86_64"))]
fn chosen(_: Option<Limit>) -> Arch {
    Arch::new()
}

/// Work in loops over numbers, compiled once per instruction set.
///
/// `run` and everything it calls in its loops must be `#[inline(always)]`: functions that are not
/// inlined are compiled for SSE2.
pub trait Vectorised: Sized {
    /// The result of the work.
    type Output;

    /// Does the work.
    fn run(self) -> Self::Output;

    /// Does the same work, to the last bit, with little code: for double-double, and for lanes in
    /// SSE2, which gain little from unrolled loops.
    #[inline(always)]
    fn run_compact(self) -> Self::Output {
        self.run()
    }
}

/// Runs work with the widest registers of this machine: AVX2 or AVX-512 on x86-64 (the compact
/// form with SSE2 alone), NEON on aarch64; not wider than [`INSTRUCTION_LIMIT`] allows.
///
/// The results are the same to the last bit on each: products and sums are rounded separately.
///
/// ```
/// use grazemap_jet::numeric::{Vectorised, widest};
/// struct Double<'a>(&'a mut [f64]);
/// impl Vectorised for Double<'_> {
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
pub fn widest<W: Vectorised>(work: W) -> W::Output {
    match in_wide_registers(work) {
        Ok(output) => output,
        Err(work) => work.run_compact(),
    }
}

/// Runs work if registers are wider than SSE2, as on any aarch64 machine; `None` otherwise.
///
/// Lanes split into pairs are no faster than single numbers in turn; long code does not need
/// that form, nor its compilation.
#[inline(always)]
pub fn wide<W: Vectorised>(work: W) -> Option<W::Output> {
    in_wide_registers(work).ok()
}

/// Whether registers are wider than SSE2, as on any aarch64 machine. If so, flights run in lanes.
pub fn is_wide() -> bool {
    #[cfg(target_arch = "x86_64")]
    let is_wide = matches!(instructions(), Arch::V3(_) | Arch::V4(_));
    #[cfg(not(target_arch = "x86_64"))]
    let is_wide = true;
    is_wide
}

/// Runs work in registers wider than SSE2, or returns the work.
#[inline(always)]
fn in_wide_registers<W: Vectorised>(work: W) -> Result<W::Output, W> {
    match instructions() {
        #[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
        Arch::V4(simd) => Ok(Simd::vectorize(simd, Inlined(work))),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Ok(Simd::vectorize(simd, Inlined(work))),
        #[cfg(target_arch = "x86_64")]
        _ => Err(work),
        #[cfg(not(target_arch = "x86_64"))]
        arch => Ok(arch.dispatch(Inlined(work))),
    }
}

struct Inlined<K>(K);

impl<K: Vectorised> WithSimd for Inlined<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run()
    }
}
