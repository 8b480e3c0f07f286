//! Registers of aarch64: NEON.

#[allow(clippy::wildcard_imports)] // instructions
use std::arch::aarch64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::Lanes;
use crate::number::real::Real;

register! {
    /// NEON, which every aarch64 has.
    F64x2(float64x2_t), 2, uint64x2_t, "neon", fused true, apart apart_baseline;
    vaddq_f64 vsubq_f64 vmulq_f64 vdivq_f64 vsqrtq_f64 vdupq_n_f64 vld1q_f64 vst1q_f64;
    neg |a| vnegq_f64(a);
    mul_add |a, b, c| vfmaq_f64(c, a, b);
    abs |a| vabsq_f64(a);
    signum |a| vbslq_f64(vdupq_n_u64(1 << 63), a, vdupq_n_f64(1.0));
    greater |a, b| vcgtq_f64(a, b);
    at_most |a, b| vcleq_f64(a, b);
    select |mask, a, b| vbslq_f64(mask, a, b);
}
