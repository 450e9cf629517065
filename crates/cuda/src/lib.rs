//! Kernels of CUDA on many points, compiled at run time and launched where a graphics processor is.
//!
//! One idea: points are independent, so that they run in pieces on two streams in turn: while one
//! piece is computed, the numbers of the one before are copied back and taken in. The driver and
//! the compiler (NVRTC) are libraries that are looked for when a [`Device`] is opened.
//!
//! Deliberately absent: what a kernel computes.

#[expect(
    unsafe_code,
    reason = "libraries of others and kernels; each place says what it relies on"
)]
mod border;
mod device;

pub use border::Real;
pub use device::{CudaError, Device, Kernel, Piece, Points};
