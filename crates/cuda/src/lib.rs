//! CUDA kernels on many points, compiled at run time and launched on a GPU.
//!
//! The points are independent. They run in pieces on two streams in turn: while one piece is
//! computed, the results of the one before are copied back and consumed. The driver and the
//! compiler (NVRTC) are libraries that are looked for when a [`Device`] is opened.
//!
//! Deliberately absent: the mathematics of the kernels.

#[expect(
    unsafe_code,
    reason = "libraries of others and kernels; each place says what it relies on"
)]
mod border;
mod device;

pub use border::Real;
pub use device::{CudaError, Device, Kernel, Piece, Points};
