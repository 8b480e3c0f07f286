//! Singularity analysis at a pose: determinant, singular values, kind, uncontrolled twist \[T24\]
//! \[T30\] \[T31\] \[T32\] \[T33\].

use nalgebra::{DMatrix, DVector};

use crate::kinematics::idle;
use crate::kinematics::leg;
use crate::kinematics::rows::{constraint_row, gram, pure_jacobian, pure_rows};
use crate::kinematics::singular::SINGULAR;
use crate::model::mechanism::{Constraint, Leg, Mechanism};
use crate::number::order::larger;
use crate::number::real::{Dual, Ordered};
use crate::numerics::gauss;
use crate::numerics::svd::Svd;
use crate::spatial::motion::pure_row;
use crate::spatial::{Pose, Twist, Vec3};

/// Kind of a singularity, by the conditions of \[T32\]: the first that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    None = 0,
    LegLength = 1,
    ConstraintVanishes = 2,
    Constraint = 3,
    LegFrame = 4,
    Actuation = 5,
    DependentRows = 6,
    StrutAcrossRail = 7,
}

impl Kind {
    pub const ALL: [Kind; 8] = [
        Kind::None,
        Kind::LegLength,
        Kind::ConstraintVanishes,
        Kind::Constraint,
        Kind::LegFrame,
        Kind::Actuation,
        Kind::DependentRows,
        Kind::StrutAcrossRail,
    ];

    #[must_use]
    pub fn message(self) -> &'static str {
        match self {
            Kind::None => "no singularity",
            Kind::LegLength => {
                "inverse singularity: a leg has no length, so it has no direction, and its actuator moves \
                 nothing"
            }
            Kind::StrutAcrossRail => {
                "inverse singularity: the strut of a slider is perpendicular to its rail, so that its \
                 carriage moves the platform no longer, and two branches meet"
            }
            Kind::ConstraintVanishes => {
                "constraint singularity: the wrench of a constraint vanishes (c = τ = 0, as where L ∥ l and \
                 r ∥ L), and the platform gains degrees of freedom that no actuator controls"
            }
            Kind::Constraint => {
                "constraint singularity: the legs' constraint wrenches depend on one another, and the \
                 platform gains degrees of freedom that no actuator controls"
            }
            Kind::LegFrame => {
                "passive singularity: a leg lies along the axis of its universal joint or rod, so its \
                 rotation about itself is not determined"
            }
            Kind::Actuation => {
                "direct singularity: with all actuators locked the platform can still move, and forces grow \
                 without limit"
            }
            Kind::DependentRows => {
                "no singularity of the mechanism: the constraints that J holds depend on one another here, \
                 while redundant ones that it leaves out hold the platform"
            }
        }
    }
}

/// Singular values of the leg Jacobian on the twists that the constraints allow; rotations are counted as
/// arcs at the given length, so that all entries are pure numbers \[T24\].
#[derive(Clone, Copy, Debug)]
pub struct Conditioning {
    pub sigma_min: f64,
    pub sigma_max: f64,
    /// `sigma_max / sigma_min`.
    pub condition: f64,
}

/// All that [`singularity`] finds at a pose.
#[derive(Clone, Debug)]
pub struct Singularity {
    pub determinant: f64,
    pub conditioning: Conditioning,
    /// The smallest singular value of the constraints' rows that generic poses have; infinite without
    /// constraints.
    pub constraint_sigma: f64,
    /// Length of each leg by the scale, and sine of the angle between it and the axis that its frame hangs
    /// on.
    pub leg_length: Vec<f64>,
    pub leg_sine: Vec<f64>,
    /// Cosine of the angle between each leg and its prismatic joint: one for telescopic legs \[T68\].
    pub transmission: Vec<f64>,
    pub kind: Kind,
    /// The leg that the kind speaks of.
    pub leg: Option<usize>,
    /// Number of degrees of freedom that remain with locked actuators.
    pub uncontrolled: usize,
    /// The allowed twist that the legs notice least, `|(v, Λω)| = 1`.
    pub twist: Twist<f64>,
    pub screw: Screw,
}

/// A twist as a rotation about an axis and a slide along it \[T33\].
#[derive(Clone, Copy, Debug)]
pub struct Screw {
    /// Unit direction, base axes.
    pub axis: Vec3<f64>,
    /// Slide per rotation, m/rad; infinite for a pure translation.
    pub pitch: f64,
    /// The point of the axis that is nearest to o, base axes; o itself for a pure translation.
    pub point: Vec3<f64>,
}

/// Rounding error of a determinant, relative to the product of its rows' sizes, below which it counts as
/// zero.
const DETERMINANT_ROUNDING: f64 = 4e-15;

/// det J, zero within rounding, and its exact rate along a twist \[T30\]; det JᵀJ where J has more rows than
/// columns \[T72\].
#[must_use]
#[inline(always)]
pub fn determinant<V: Ordered>(mech: &Mechanism, pose: &Pose<V>, twist: &Twist<V>, scale: f64) -> Dual<V> {
    let moving = pose.along(twist);
    if mech.is_redundant() {
        let square = gram(mech, &moving, scale);
        let (det, mut trace) = (gauss::determinant(&square), V::zero());
        for i in 0..6 {
            trace = trace + square[i][i].x.scale(1.0 / 6.0);
        }
        // The mean to the sixth is the most that it can be; sums of products round by parts of the largest.
        let cube = trace * trace * trace;
        return rounded(det, cube * cube);
    }
    let rows = pure_jacobian(mech, &moving, scale);
    let (det, mut size) = (gauss::determinant(&rows), V::one());
    for i in 0..6 {
        let mut square = V::zero();
        for j in 0..6 {
            square = rows[i][j].x.mul_add(rows[i][j].x, square);
        }
        size = size * square.sqrt();
    }
    rounded(det, size)
}

/// Zero where a determinant is rounding of that, beside the given size.
#[inline(always)]
fn rounded<V: Ordered>(det: Dual<V>, size: V) -> Dual<V> {
    let nothing = det.x.abs().at_most(size.scale(DETERMINANT_ROUNDING));
    Dual::new(V::select(nothing, V::zero(), det.x), det.d)
}

/// The smallest singular value of J in pure numbers; NaN where an actuated leg has no direction.
#[must_use]
pub fn smallest(mech: &Mechanism, pose: &Pose<f64>, scale: f64) -> f64 {
    values_and_vectors(&pure_rows(mech, pose, scale)).0[5]
}

/// Singular values, largest first, and right singular vectors of rows of six; NaN if an entry is.
fn values_and_vectors(rows: &[[f64; 6]]) -> (DVector<f64>, DMatrix<f64>) {
    Svd::of(&DMatrix::from_fn(rows.len(), 6, |i, j| rows[i][j])).map_or_else(
        || (DVector::from_element(6, f64::NAN), DMatrix::from_element(6, 6, f64::NAN)),
        |svd| (svd.values, svd.v_t),
    )
}

/// The twists that the constraints allow at a pose, from all of their rows \[T31\].
struct Allowed {
    /// The singular value that is the smallest at generic poses to differ from zero.
    sigma: f64,
    /// Fewer independent rows than at generic poses.
    lost: bool,
    /// Orthonormal twists (v, Λω), one a row.
    basis: DMatrix<f64>,
}

fn allowed(mech: &Mechanism, pose: &Pose<f64>, scale: f64, tolerance: f64) -> Allowed {
    let rows: Vec<[f64; 6]> = mech.constraints.iter().map(|c| constraint_row(c, pose, scale)).collect();
    let ((values, vectors), generic) = (values_and_vectors(&rows), 6 - mech.dof());
    let rank = values.iter().take(generic).filter(|&&s| !(s <= tolerance)).count();
    Allowed {
        sigma: if generic == 0 { f64::INFINITY } else { values[generic - 1] },
        lost: rank < generic,
        basis: without_idle(mech, pose, scale, vectors.rows(rank, 6 - rank).into_owned()),
    }
}

/// The part of a basis of twists (v, Λω) that is perpendicular to the idle ones, which no leg is there to
/// control \[T70\].
fn without_idle(mech: &Mechanism, pose: &Pose<f64>, scale: f64, basis: DMatrix<f64>) -> DMatrix<f64> {
    if mech.idle.is_empty() {
        return basis;
    }
    let twists: Vec<[f64; 6]> = mech
        .idle
        .iter()
        .map(|idle| {
            let Twist { v, omega } = idle::twist(idle, pose);
            Twist::new(v, omega * scale).array()
        })
        .collect();
    let shares = DMatrix::from_fn(twists.len(), 6, |i, j| twists[i][j]) * basis.transpose();
    match Svd::of(&shares) {
        Some(svd) => svd.v_t.rows(twists.len(), basis.nrows() - twists.len()) * basis,
        None => DMatrix::from_element(basis.nrows() - twists.len(), 6, f64::NAN),
    }
}

/// Singular values of the legs' rows on the allowed twists, largest first and as many as those, and the
/// allowed twist of the smallest \[T24\] \[T31\].
fn leg_values(mech: &Mechanism, pose: &Pose<f64>, scale: f64, allowed: &Allowed) -> (Vec<f64>, Twist<f64>) {
    let freedoms = allowed.basis.nrows();
    let has_row = |(leg, p): &(&Leg, leg::Position<f64>)| {
        p.length > SINGULAR * scale && leg::transmission(leg, p).abs() > SINGULAR
    };
    let legs: Vec<_> = mech.actuated().map(|(_, leg)| (leg, leg::position(leg, pose))).collect();
    let nothing = (vec![f64::NAN; freedoms], Twist::from_array([f64::NAN; 6]));
    if !legs.iter().all(has_row) {
        return nothing;
    }
    let rows: Vec<[f64; 6]> = legs.iter().map(|(leg, p)| pure_row(leg::row(leg, p), scale)).collect();
    let legs = DMatrix::from_fn(rows.len(), 6, |i, j| rows[i][j]);
    // Where a constraint is lost there are fewer legs than degrees of freedom, so that the last values are
    // zero.
    let Some(svd) = Svd::of(&(legs * allowed.basis.transpose())) else { return nothing };
    let twist = svd.v_t.row(freedoms - 1) * &allowed.basis;
    // One of two opposite twists: the one whose largest entry is positive.
    let sign = twist.iter().fold(0.0_f64, |m, &e| if e.abs() > m.abs() { e } else { m }).signum();
    let entry = |i: usize| sign * twist[i] / if i < 3 { 1.0 } else { scale };
    (svd.values.iter().copied().collect(), Twist::from_array(std::array::from_fn(entry)))
}

/// The singular values at a pose \[T24\]; NaN where an actuated leg has no direction.
#[must_use]
pub fn conditioning(mech: &Mechanism, pose: &Pose<f64>, scale: f64) -> Conditioning {
    values_of(&leg_values(mech, pose, scale, &allowed(mech, pose, scale, SINGULAR)).0)
}

fn values_of(sigma: &[f64]) -> Conditioning {
    let (sigma_max, sigma_min) = (sigma[0], sigma[sigma.len() - 1]);
    Conditioning { sigma_min, sigma_max, condition: sigma_max / sigma_min }
}

/// Everything about a pose's nearness to a singularity, rotations counted as arcs at `scale`; a measure up to
/// `tolerance` counts as zero \[T30\] \[T31\] \[T32\] \[T33\].
#[must_use]
pub fn singularity(mech: &Mechanism, pose: &Pose<f64>, scale: f64, tolerance: f64) -> Singularity {
    let positions: Vec<_> = mech.legs.iter().map(|leg| leg::position(leg, pose)).collect();
    let leg_length: Vec<f64> = positions.iter().map(|p| p.length / scale).collect();
    let leg_sine: Vec<f64> =
        mech.legs.iter().zip(&positions).map(|(leg, p)| leg::frame(leg, pose, p).sine).collect();
    let transmission: Vec<f64> =
        mech.legs.iter().zip(&positions).map(|(leg, p)| leg::transmission(leg, p)).collect();
    let across: Vec<f64> = transmission.iter().map(|t| t.abs()).collect();
    let allowed = allowed(mech, pose, scale, tolerance);
    let (sigma, twist) = leg_values(mech, pose, scale, &allowed);
    let conditioning = values_of(&sigma);
    let known = conditioning.sigma_min.is_finite();

    let first_zero = |values: &[f64], limit: f64| values.iter().position(|&x| x <= limit);
    let row_size = |c: &Constraint| constraint_row(c, pose, scale).iter().map(|e| e * e).sum::<f64>().sqrt();
    let vanishing = mech.constraints.iter().find(|c| row_size(c) <= tolerance);
    let (kind, leg) = if let Some(leg) = first_zero(&leg_length, larger(tolerance, SINGULAR)) {
        (Kind::LegLength, Some(leg))
    } else if let Some(leg) = first_zero(&across, larger(tolerance, SINGULAR)) {
        (Kind::StrutAcrossRail, Some(leg))
    } else if let (true, Some(c)) = (allowed.lost, vanishing) {
        (Kind::ConstraintVanishes, Some(c.leg))
    } else if allowed.lost {
        (Kind::Constraint, None)
    } else if let Some(leg) = first_zero(&leg_sine, tolerance) {
        (Kind::LegFrame, Some(leg))
    } else if conditioning.sigma_min <= tolerance {
        (Kind::Actuation, None)
    } else if smallest_of_chosen(mech, pose, scale) <= tolerance {
        (Kind::DependentRows, None)
    } else {
        (Kind::None, None)
    };
    Singularity {
        determinant: if known { determinant(mech, pose, &Twist::zero(), scale).x } else { f64::NAN },
        conditioning,
        constraint_sigma: allowed.sigma,
        leg_length,
        leg_sine,
        transmission,
        kind,
        leg,
        uncontrolled: sigma.iter().filter(|&&s| s <= tolerance).count(),
        twist,
        screw: screw(pose.o, &twist, scale),
    }
}

/// The smallest singular value of the constraints' rows in J; infinite without any.
fn smallest_of_chosen(mech: &Mechanism, pose: &Pose<f64>, scale: f64) -> f64 {
    let rows: Vec<[f64; 6]> = mech.independent.iter().map(|c| constraint_row(c, pose, scale)).collect();
    if rows.is_empty() { f64::INFINITY } else { values_and_vectors(&rows).0[rows.len() - 1] }
}

/// The screw of a twist of o \[T33\].
#[must_use]
pub fn screw(o: Vec3<f64>, twist: &Twist<f64>, scale: f64) -> Screw {
    let Twist { v, omega } = *twist;
    let square = omega.dot(omega);
    if scale * omega.norm() <= SINGULAR * v.norm() {
        return Screw { axis: v.unit(), pitch: f64::INFINITY, point: o };
    }
    Screw { axis: omega.unit(), pitch: v.dot(omega) / square, point: o + omega.cross(v) * (1.0 / square) }
}
