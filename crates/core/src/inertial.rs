//! Inertial parameters of the links, and the regressor: forces are linear in the parameters, so that their
//! coefficients are the forces of unit parameters \[T57\].

use crate::dynamics;
use crate::jacobian::scaled_jacobian;
use crate::leg;
use crate::mechanism::{Body, Leg, Mechanism, Turning};
use crate::real::{Dual, Real};
use crate::spatial::{Mat3, Motion, Vec3, Wrench};

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

/// m, m c, and the entries of the inertia about the origin of the link's axes: those that forces are linear in.
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

/// What a body has that is symmetric about its leg, as it must be where the leg spins freely: I_xx and I_zz are one.
const SYMMETRIC: [&[usize]; 4] = [&[0], &[2], &[4, 9], &[7]];

/// One inertial parameter of a link.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    pub link: Link,
    /// Which of the ten numbers it is; two for a radius of symmetry.
    pub numbers: &'static [usize],
}

impl Parameter {
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
            Link::Cylinder(i) => format!("cylinder {}", mech.legs[i].name),
            Link::Piston(i) => format!("piston {}", mech.legs[i].name),
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
pub fn parameters(mech: &Mechanism) -> Vec<Parameter> {
    let legs = mech.legs.iter().enumerate().flat_map(|(i, leg)| {
        let numbers: &[&[usize]] = if spins_freely(leg) { &SYMMETRIC } else { &EACH };
        [(Link::Cylinder(i), numbers), (Link::Piston(i), numbers)]
    });
    let rods = (0..mech.rods.len()).map(|i| (Link::Rod(i), &EACH[..]));
    std::iter::once((Link::Platform, &EACH[..]))
        .chain(legs)
        .chain(rods)
        .flat_map(|(link, numbers)| numbers.iter().map(move |numbers| Parameter { link, numbers }))
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
    let mut body = Body { mass: 0.0, center: Vec3::zero(), inertia: Mat3([Vec3::zero(); 3]) };
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
    let value = |p: &Parameter| standard(central(body(mech, p.link)))[p.numbers[0]];
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

fn body_mut(mech: &mut Mechanism, link: Link) -> &mut Body {
    match link {
        Link::Platform => &mut mech.platform,
        Link::Cylinder(i) => &mut mech.legs[i].cylinder,
        Link::Piston(i) => &mut mech.legs[i].piston,
        Link::Rod(i) => &mut mech.rods[i].body,
    }
}

/// Forces of unit parameters, from the mechanism with one body at a time.
pub struct Regressor {
    pub parameters: Vec<Parameter>,
    /// Without bodies.
    damped: Mechanism,
    /// Without damping either.
    bare: Mechanism,
}

impl Regressor {
    #[must_use]
    pub fn new(mech: &Mechanism) -> Self {
        let parameters = parameters(mech);
        let mut damped = mech.clone();
        for p in &parameters {
            *body_mut(&mut damped, p.link) = no_body();
        }
        let mut bare = damped.clone();
        (bare.linear_damping, bare.angular_damping) = (0.0, 0.0);
        Regressor { parameters, damped, bare }
    }

    /// For each parameter the active forces and multipliers that its unit asks for: a column of Y \[T57\].
    pub fn columns(&mut self, platform: &Motion<f64>) -> Vec<[f64; 6]> {
        let legs: Vec<_> = self.bare.legs.iter().map(|leg| leg::state(leg, platform)).collect();
        let jacobian = dynamics::transposed(&scaled_jacobian(&self.bare, &platform.pose));
        let mut columns = Vec::with_capacity(self.parameters.len());
        for i in 0..self.parameters.len() {
            let p = self.parameters[i];
            let wrenches = p.numbers.iter().map(|&k| self.wrench(p.link, k, platform, &legs));
            let wrench = wrenches.fold(Wrench::zero(), |sum, w| sum + w);
            columns.push(dynamics::balanced(&self.bare, jacobian, wrench).0);
        }
        columns
    }

    /// What the unit of a standard parameter puts on the platform, its link being the only one with a body.
    fn wrench(
        &mut self,
        link: Link,
        number: usize,
        platform: &Motion<f64>,
        legs: &[leg::State<f64>],
    ) -> Wrench<f64> {
        let mut of = |number: usize| {
            *body_mut(&mut self.bare, link) = unit_body(number);
            let mech = &self.bare;
            let wrench = match link {
                Link::Platform => dynamics::own_wrench(mech, platform, Wrench::zero()),
                Link::Cylinder(i) | Link::Piston(i) => dynamics::links_wrench(mech, &mech.legs[i], &legs[i]),
                Link::Rod(i) => dynamics::carried_rod(mech, &mech.rods[i], &legs[mech.rods[i].leader]),
            };
            *body_mut(&mut self.bare, link) = no_body();
            wrench
        };
        let wrench = of(number);
        if (1..=3).contains(&number) { wrench + of(0) * -1.0 } else { wrench }
    }

    /// The active forces and multipliers of load and damping alone: what forces are with all parameters zero.
    #[must_use]
    pub fn offset(&self, platform: &Motion<f64>, load: Wrench<f64>) -> [f64; 6] {
        dynamics::inverse_dynamics(&self.damped, platform, load).0
    }

    /// From columns of Y to the derivatives by mass, mass centre, and inertia about it, of the same parameters in
    /// order \[T57\].
    #[must_use]
    pub fn by_bodies(&self, mech: &Mechanism, columns: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let derivative = |p: &Parameter| {
            let mut seeded = central(body(mech, p.link)).map(|x| Dual::new(x, 0.0));
            p.numbers.iter().for_each(|&k| seeded[k].d = 1.0);
            let rates = standard(seeded).map(|x| x.d);
            let mut sum = [0.0; 6];
            for (other, column) in self.parameters.iter().zip(columns).filter(|(q, _)| q.link == p.link) {
                sum = std::array::from_fn(|i| sum[i] + column[i] * rates[other.numbers[0]]);
            }
            sum
        };
        self.parameters.iter().map(derivative).collect()
    }
}

fn no_body() -> Body {
    Body { mass: 0.0, center: Vec3::zero(), inertia: Mat3([Vec3::zero(); 3]) }
}
