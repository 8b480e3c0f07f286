//! Poses of several states side by side, one in each lane.

use crate::number::lanes::{Lanes, Row};
use crate::spatial::motion::Pose;
use crate::spatial::vector::{Mat3, Vec3};

/// The columns of R and o of each.
pub(crate) type Poses = [Row; 12];

#[inline(always)]
pub(crate) fn load<V: Lanes>(poses: &Poses, k: usize) -> Pose<V> {
    let mut columns = [Vec3::<V>::zero(); 4];
    for i in 0..4 {
        let [x, y, z] = [&poses[3 * i], &poses[3 * i + 1], &poses[3 * i + 2]];
        columns[i] = Vec3::new(V::load(&x[k..]), V::load(&y[k..]), V::load(&z[k..]));
    }
    let [x, y, z, o] = columns;
    Pose { rotation: Mat3::from_columns(x, y, z), o }
}

#[inline(always)]
pub(crate) fn store<V: Lanes>(pose: &Pose<V>, poses: &mut Poses, k: usize) {
    let [x, y, z] = pose.rotation.0;
    let columns = [x, y, z, pose.o];
    for i in 0..4 {
        columns[i].x.store(&mut poses[3 * i][k..]);
        columns[i].y.store(&mut poses[3 * i + 1][k..]);
        columns[i].z.store(&mut poses[3 * i + 2][k..]);
    }
}

pub(crate) fn get(poses: &Poses, k: usize) -> Pose<f64> {
    let column = |i: usize| Vec3::new(poses[3 * i][k], poses[3 * i + 1][k], poses[3 * i + 2][k]);
    Pose { rotation: Mat3::from_columns(column(0), column(1), column(2)), o: column(3) }
}

pub(crate) fn put(poses: &mut Poses, k: usize, pose: &Pose<f64>) {
    let [x, y, z] = pose.rotation.0;
    for (i, column) in [x, y, z, pose.o].into_iter().enumerate() {
        [poses[3 * i][k], poses[3 * i + 1][k], poses[3 * i + 2][k]] = column.array();
    }
}
