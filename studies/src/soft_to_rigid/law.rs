//! Law by which a hardening stop tends to the rigid one with `r = 1`.
//!
//! A stiff contact returns the speed after half a period of its own, `δ = π √(M/k2)`, minus the
//! losses in the dampers:
//!
//! ```text
//! D_soft − D_rigid = δ E(−t1) (v, a_e − (R1 − R2) v/2) + O(1/k2)
//! ```
//!
//! Here `t1 < 0` is the time of the entry, `v` the speed there, `a_e = (k1 σ − G)/M`, and `E` the
//! homogeneous free flow.

use super::direct::Jump;
use super::family::{DAMPING, Stop};

/// Leading difference of the jumps of `w` and `v`, for a stop with a damper.
pub fn approach_law(stop: &Stop, jump: &Jump, k2: f64, stop_damping: f64) -> [f64; 2] {
    let speed = jump.entry_state[1].to_f64();
    let amplitude = stop.orbit.parameters()[0].to_f64();
    let push = 1.0 - amplitude * jump.entry_state[2].to_f64().cos();
    let delta = std::f64::consts::PI / k2.sqrt();
    let kick = [delta * speed, delta * (push - 0.5 * (DAMPING - stop_damping) * speed)];
    homogeneous(kick, -jump.entry.to_f64())
}

/// The flow of `u'' + R1 u' + u = 0`.
fn homogeneous([u, v]: [f64; 2], time: f64) -> [f64; 2] {
    let half = 0.5 * DAMPING;
    let frequency = (1.0 - half * half).sqrt();
    let (sine, cosine) = (frequency * time).sin_cos();
    let (decay, share) = ((-half * time).exp(), sine / frequency);
    [
        decay * (u * (cosine + half * share) + v * share),
        decay * (v * (cosine - half * share) - u * share),
    ]
}
