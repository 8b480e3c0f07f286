//! Quadratic forms Vᵀ h V of the twist: the velocity-dependent part of second rates \[T11\], \[T12\].

use crate::number::real::Real;
use crate::spatial::{Mat3, Vec3};

/// A 6×6 block of the Hessian, rows and columns as (v, ω).
pub type Hessian<T> = [[T; 6]; 6];

/// `vᵀ h v`.
#[inline(always)]
pub fn quadratic<T: Real>(h: &Hessian<T>, v: &[T; 6]) -> T {
    let mut sum = T::zero();
    for i in 0..6 {
        for j in 0..6 {
            sum = (v[i] * h[i][j]).mul_add(v[j], sum);
        }
    }
    sum
}

/// The columns of `v + ω×e` as a linear map of the twist.
#[inline(always)]
pub fn point_columns<T: Real>(e: Vec3<T>) -> [Vec3<T>; 6] {
    let axes = Mat3::<T>::identity().0;
    let mut columns = [Vec3::zero(); 6];
    for i in 0..3 {
        columns[i] = axes[i];
        columns[3 + i] = axes[i].cross(e);
    }
    columns
}

/// Adds the form `[ω×(ω×x)]·y = (ω·x)(ω·y) - (x·y) ω·ω`.
#[inline(always)]
pub fn add_centripetal<T: Real>(h: &mut Hessian<T>, x: Vec3<T>, y: Vec3<T>) {
    let (xy, half) = (x.dot(y), T::lit(0.5));
    let (x, y) = (x.array(), y.array());
    for i in 0..3 {
        for j in 0..3 {
            h[3 + i][3 + j] = h[3 + i][3 + j] + (x[i] * y[j] + y[i] * x[j]) * half;
        }
        h[3 + i][3 + i] = h[3 + i][3 + i] - xy;
    }
}

/// Adds the form `2 v_b·q(ω)` with `v_b = v + ω×e` and q linear, given for the three axes.
#[inline(always)]
pub fn add_mixed<T: Real>(h: &mut Hessian<T>, e: Vec3<T>, q: [Vec3<T>; 3]) {
    for (j, q) in q.into_iter().enumerate() {
        let (linear, angular) = (q.array(), e.cross(q).array());
        for i in 0..3 {
            h[i][3 + j] = h[i][3 + j] + linear[i];
            h[3 + j][i] = h[3 + j][i] + linear[i];
            h[3 + i][3 + j] = h[3 + i][3 + j] + angular[i];
            h[3 + j][3 + i] = h[3 + j][3 + i] + angular[i];
        }
    }
}
