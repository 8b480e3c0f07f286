//! Inertial parameters of the links, and the regressor: forces are linear in the parameters, so that their
//! coefficients are the forces of unit parameters \[T57\].

use crate::dynamics::force_balance::UnitForceResponse;
use crate::dynamics::inverse_dynamics;
use crate::kinematics::leg;
use crate::model::mechanism::{Body, Leg, Mechanism, Turning};
use crate::number::real::{Dual, Real};
use crate::number::slices;
use crate::spatial::{Mat3, Motion, Twist, Vec3, Wrench};

/// A link that may have mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    Platform,
    Cylinder(usize),
    Piston(usize),
    Rod(usize),
}

/// Numbers of a body: by their first moments or by mass centre and inertia about it.
pub const NUMBERS: usize = 10;

/// m, m c, and the entries of the inertia about the origin of the link's axes: those that forces are linear
/// in.
const STANDARD: [&str; NUMBERS] =
    ["m", "mc_x", "mc_y", "mc_z", "I_xx", "I_xy", "I_xz", "I_yy", "I_yz", "I_zz"];

/// Mass, mass centre, and the entries of the inertia about it: those of the file.
const CENTRAL: [&str; NUMBERS] = [
    "mass",
    "center_x",
    "center_y",
    "center_z",
    "inertia_xx",
    "inertia_xy",
    "inertia_xz",
    "inertia_yy",
    "inertia_yz",
    "inertia_zz",
];

/// Rows and columns of the inertia's entries, in the order of the numbers.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Each number of a body by itself.
const EACH: [&[usize]; NUMBERS] = [&[0], &[1], &[2], &[3], &[4], &[5], &[6], &[7], &[8], &[9]];

/// Parameters of a body symmetric about its leg, as it must be where the leg spins freely: I_xx = I_zz.
const SYMMETRIC: [&[usize]; 4] = [&[0], &[2], &[4, 9], &[7]];

/// One inertial parameter of a link.
#[derive(Clone, Copy, Debug)]
pub struct InertialParameter {
    pub link: Link,
    /// Which of the ten numbers it is; two for a radius of symmetry.
    pub numbers: &'static [usize],
}

impl InertialParameter {
    /// Name of the standard parameter: `piston 1 mc_y`.
    #[must_use]
    pub fn standard_name(&self, mech: &Mechanism) -> String {
        self.name(mech, &STANDARD)
    }

    /// Name of the file's number: `piston 1 center_y`.
    #[must_use]
    pub fn central_name(&self, mech: &Mechanism) -> String {
        self.name(mech, &CENTRAL)
    }

    fn name(&self, mech: &Mechanism, names: &[&str; NUMBERS]) -> String {
        let link = match self.link {
            Link::Platform => "platform".to_owned(),
            Link::Cylinder(i) => format!("{} {}", mech.legs[i].links()[0], mech.legs[i].name),
            Link::Piston(i) => format!("{} {}", mech.legs[i].links()[1], mech.legs[i].name),
            Link::Rod(i) => format!("rod {}", mech.rods[i].name),
        };
        let names: Vec<&str> = self.numbers.iter().map(|&k| names[k]).collect();
        format!("{link} {}", names.join(" = "))
    }
}

fn spins_freely(leg: &Leg) -> bool {
    matches!(leg.turning, Turning::Free(_))
}

/// The parameters of all links in order: platform, cylinder and piston of each leg, rods.
#[must_use]
pub fn parameters(mech: &Mechanism) -> Vec<InertialParameter> {
    let legs = mech.legs.iter().enumerate().flat_map(|(i, leg)| {
        let numbers: &[&[usize]] = if spins_freely(leg) { &SYMMETRIC } else { &EACH };
        let first = leg.drive.kind().own_numbers.unwrap_or(numbers);
        [(Link::Cylinder(i), first), (Link::Piston(i), numbers)]
    });
    let rods = (0..mech.rods.len()).map(|i| (Link::Rod(i), &EACH[..]));
    std::iter::once((Link::Platform, &EACH[..]))
        .chain(legs)
        .chain(rods)
        .flat_map(|(link, numbers)| numbers.iter().map(move |numbers| InertialParameter { link, numbers }))
        .collect()
}

/// Mass, mass centre and inertia about it, as ten numbers.
fn central(body: &Body) -> [f64; NUMBERS] {
    let ([x, y, z], inertia) = (body.center.array(), body.inertia.rows());
    let mut numbers = [body.mass, x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for (number, (i, j)) in numbers[4..].iter_mut().zip(ENTRIES) {
        *number = 0.5 * (inertia[i][j] + inertia[j][i]);
    }
    numbers
}

/// [T57] m, m c, and the inertia about the origin, `I + m (c·c 1 - c cᵀ)`.
fn standard<T: Real>([m, x, y, z, inertia @ ..]: [T; NUMBERS]) -> [T; NUMBERS] {
    let c = [x, y, z];
    let square = x * x + y * y + z * z;
    let mut numbers = [m, m * x, m * y, m * z, m, m, m, m, m, m];
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        let diagonal = if i == j { square } else { T::zero() };
        numbers[4 + k] = inertia[k] + m * (diagonal - c[i] * c[j]);
    }
    numbers
}

/// The body with one standard parameter of one, and for a first moment with a mass of one, too.
fn unit_body(number: usize) -> Body {
    let mut body = NO_BODY;
    let mut rows = [[0.0; 3]; 3];
    match number {
        0 => body.mass = 1.0,
        1..=3 => {
            // Inertia about the origin is zero if that about the centre is minus that of the mass there.
            let axis = number - 1;
            (0..3).filter(|&i| i != axis).for_each(|i| rows[i][i] = -1.0);
            let center: [f64; 3] = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
            (body.mass, body.center) = (1.0, center.into());
        }
        _ => {
            let (i, j) = ENTRIES[number - 4];
            (rows[i][j], rows[j][i]) = (1.0, 1.0);
        }
    }
    body.inertia = Mat3::from_rows(rows);
    body
}

/// The current values of the standard parameters.
#[must_use]
pub fn standard_values(mech: &Mechanism) -> Vec<f64> {
    let value = |p: &InertialParameter| standard(central(body(mech, p.link)))[p.numbers[0]];
    parameters(mech).iter().map(value).collect()
}

fn body(mech: &Mechanism, link: Link) -> &Body {
    match link {
        Link::Platform => &mech.platform,
        Link::Cylinder(i) => &mech.legs[i].cylinder,
        Link::Piston(i) => &mech.legs[i].piston,
        Link::Rod(i) => &mech.rods[i].body,
    }
}

/// Forces of unit parameters.
pub struct Regressor {
    pub parameters: Vec<InertialParameter>,
    /// The bodies whose wrenches, with these signs, are that of each parameter's unit.
    units: Vec<Vec<(f64, Body)>>,
    /// From columns of Y to the derivatives by the file's numbers: columns and their factors, for each.
    by_bodies: Vec<Vec<(usize, f64)>>,
}

impl Regressor {
    #[must_use]
    pub fn new(mech: &Mechanism) -> Self {
        let parameters = parameters(mech);
        let unit = |&k: &usize| {
            // A first moment has a mass of one with it, which is taken off.
            let first_moment = (1..=3).contains(&k);
            [Some((1.0, unit_body(k))), first_moment.then(|| (-1.0, unit_body(0)))].into_iter().flatten()
        };
        let units: Vec<_> = parameters.iter().map(|p| p.numbers.iter().flat_map(unit).collect()).collect();
        let derivative = |p: &InertialParameter| {
            let mut seeded = central(body(mech, p.link)).map(|x| Dual::new(x, 0.0));
            p.numbers.iter().for_each(|&k| seeded[k].d = 1.0);
            let rates = standard(seeded).map(|x| x.d);
            let of_link = parameters.iter().enumerate().filter(|(_, q)| q.link == p.link);
            let factors = of_link.map(|(at, q)| (at, rates[q.numbers[0]]));
            factors.filter(|(_, rate)| *rate != 0.0).collect()
        };
        let by_bodies = parameters.iter().map(derivative).collect();
        Regressor { parameters, units, by_bodies }
    }

    /// For each parameter the active forces and multipliers for a unit of it: the columns of Y \[T57\].
    pub fn columns(&self, mech: &Mechanism, platform: &Motion<f64>) -> Vec<Vec<f64>> {
        let legs: Vec<_> = mech.legs.iter().map(|leg| leg::state(leg, platform)).collect();
        let mut response = UnitForceResponse::new(mech);
        response.set(mech, &platform.pose);
        let column = |k: usize| {
            let mut column = vec![0.0; mech.rows()];
            response.put(self.wrench(mech, platform, &legs, k), &[], &mut column);
            column
        };
        (0..self.parameters.len()).map(column).collect()
    }

    /// Wrench on the platform of a unit of the k-th parameter.
    #[inline(always)]
    pub(crate) fn wrench<T: Real>(
        &self,
        mech: &Mechanism,
        platform: &Motion<T>,
        legs: &[leg::LegState<T>],
        k: usize,
    ) -> Wrench<T> {
        let mut sum = Wrench::zero();
        for (sign, body) in &self.units[k] {
            let wrench = match self.parameters[k].link {
                Link::Platform => {
                    inverse_dynamics::body_wrench(mech, body, platform) * T::lit(1.0 / mech.efficiency)
                }
                Link::Cylinder(i) => {
                    inverse_dynamics::links_wrench(mech, &mech.legs[i], [body, &NO_BODY], &legs[i])
                }
                Link::Piston(i) => {
                    inverse_dynamics::links_wrench(mech, &mech.legs[i], [&NO_BODY, body], &legs[i])
                }
                Link::Rod(i) => {
                    inverse_dynamics::carried_rod(mech, &mech.rods[i], body, &legs[mech.rods[i].leader])
                }
            };
            sum = sum + wrench * T::lit(*sign);
        }
        sum
    }

    /// Wrench of load and damping on the platform, divided by the efficiency.
    #[inline(always)]
    pub(crate) fn rest<T: Real>(mech: &Mechanism, twist: &Twist<T>, load: Wrench<T>) -> Wrench<T> {
        (load + inverse_dynamics::damping_wrench(mech, twist)) * T::lit(1.0 / mech.efficiency)
    }

    /// From the columns of Y, one after the other, to the k-th of the derivatives by mass, mass centre, and
    /// inertia about it \[T57\].
    #[inline(always)]
    pub(crate) fn put_by_bodies<T: Real>(&self, columns: &[T], k: usize, sum: &mut [T]) {
        let width = sum.len();
        slices::fill(sum, T::zero());
        for &(column, factor) in &self.by_bodies[k] {
            for (row, x) in sum.iter_mut().enumerate() {
                *x = *x + columns[column * width + row].scale(factor);
            }
        }
    }
}

const NO_BODY: Body = {
    let zero = Vec3 { x: 0.0, y: 0.0, z: 0.0 };
    Body { mass: 0.0, center: zero, inertia: Mat3([zero; 3]) }
};
