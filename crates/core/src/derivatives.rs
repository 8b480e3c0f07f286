//! Derivatives of inverse dynamics by the motion and by the geometry: the same equations with dual numbers, one
//! direction at a time \[T56\].

use crate::coordinates::{self, MAX_COORDINATES, Set, Values};
use crate::dynamics;
use crate::leg;
use crate::mechanism::Mechanism;
use crate::real::{Constant, Dual, Jet};
use crate::spatial::{Acceleration, Motion, Pose, Twist, Wrench};

/// What a motion is varied in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Pose: o moves, and the platform turns about axes of the base through o.
    Pose,
    Twist,
    Acceleration,
}

impl Part {
    pub const ALL: [Part; 3] = [Part::Pose, Part::Twist, Part::Acceleration];
}

/// The load on the platform for a pose that varies.
pub trait Load: Fn(&Pose<Dual<f64>>) -> Wrench<Dual<f64>> {}
impl<L: Fn(&Pose<Dual<f64>>) -> Wrench<Dual<f64>>> Load for L {}

/// Columns of the derivatives of active forces and multipliers by one part of the motion in six directions, the
/// other parts kept.
#[must_use]
pub fn by_motion(mech: &Mechanism, platform: &Motion<f64>, load: &impl Load, part: Part) -> [[f64; 6]; 6] {
    std::array::from_fn(|direction| {
        let unit = |of: Part| -> [f64; 6] {
            std::array::from_fn(|i| if of == part && i == direction { 1.0 } else { 0.0 })
        };
        let (step, twist, second) = (
            Twist::from_array(unit(Part::Pose)),
            Twist::from_array(unit(Part::Twist)),
            Acceleration::from_array(unit(Part::Acceleration)),
        );
        let at = platform;
        let varied = Motion {
            pose: at.pose.along(&step),
            twist: Twist::new(at.twist.v.with_rate(twist.v), at.twist.omega.with_rate(twist.omega)),
            acceleration: Acceleration::new(
                at.acceleration.a.with_rate(second.a),
                at.acceleration.eps.with_rate(second.eps),
            ),
        };
        forces(mech, &varied, load)
    })
}

fn forces(
    mech: &Mechanism<impl Constant<Dual<f64>>>,
    varied: &Motion<Dual<f64>>,
    load: &impl Load,
) -> [f64; 6] {
    dynamics::inverse_dynamics(mech, varied, load(&varied.pose)).0.map(|f| f.d)
}

/// Columns of the derivatives by the given coordinates, by their rates, and by their second rates, the others of these
/// kept and dependent coordinates following; none where the coordinates do not determine the motion.
#[must_use]
pub fn by_coordinates(
    mech: &Mechanism,
    platform: &Motion<f64>,
    load: &impl Load,
    set: &Set,
    given: &[bool; MAX_COORDINATES],
) -> Option<[Vec<[f64; 6]>; 3]> {
    let q = coordinates::along(mech, set, platform);
    let mut columns: [Vec<[f64; 6]>; 3] = [vec![], vec![], vec![]];
    for k in (0..set.names().len()).filter(|&k| given[k]) {
        for (order, columns) in columns.iter_mut().enumerate() {
            let mut seeded = kept(&q);
            match order {
                0 => seeded[k].x.d = 1.0,
                1 => seeded[k].d.d = 1.0,
                _ => seeded[k].dd.d = 1.0,
            }
            let (varied, pivots) = coordinates::varied(mech, set, &seeded, given);
            let column = forces(mech, &varied, load);
            let determined = pivots > coordinates::DEPENDENT_PIVOTS;
            if !determined || !column.iter().all(|f| f.is_finite()) {
                return None;
            }
            columns.push(column);
        }
    }
    Some(columns)
}

/// Coordinates and their rates that do not vary.
fn kept(q: &Values<Jet<f64>>) -> Values<Jet<Dual<f64>>> {
    q.map(|c| Jet::new(Dual::new(c.x, 0.0), Dual::new(c.d, 0.0), Dual::new(c.dd, 0.0)))
}

/// What varies with one number of the geometry.
#[derive(Clone, Debug)]
pub struct ByGeometry {
    /// Active forces and multipliers.
    pub forces: [f64; 6],
    /// Lengths of all legs.
    pub lengths: Vec<f64>,
}

/// Derivatives by the number of the geometry that the mechanism `varied` varies with, the given coordinates, their rates
/// and second rates kept and dependent coordinates following; none where the coordinates do not determine the motion.
#[must_use]
pub fn by_geometry(
    varied: &Mechanism<Dual<f64>>,
    q: &Values<Jet<f64>>,
    load: &impl Load,
    set: &Set<Dual<f64>>,
    given: &[bool; MAX_COORDINATES],
) -> Option<ByGeometry> {
    let (platform, pivots) = coordinates::varied(varied, set, &kept(q), given);
    let column = ByGeometry {
        forces: forces(varied, &platform, load),
        lengths: varied.legs.iter().map(|leg| leg::position(leg, &platform.pose).length.d).collect(),
    };
    let finite = column.forces.iter().chain(&column.lengths).all(|x| x.is_finite());
    (pivots > coordinates::DEPENDENT_PIVOTS && finite).then_some(column)
}
