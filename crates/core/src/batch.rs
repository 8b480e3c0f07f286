//! Many states at once: arrays in, a [`Table`] out, one status per state, NaN where there is no answer.

use crate::constraint;
use crate::coordinates::{self, MAX_COORDINATES, Set, State, Values};
use crate::dynamics;
use crate::jacobian;
use crate::joints::{self, Zero, cone_angle};
use crate::leg;
use crate::mechanism::Mechanism;
use crate::mobility;
use crate::quadratic::quadratic;
use crate::real::{Dual, Jet};
use crate::singularity;
use crate::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3, Wrench};
use crate::spec::Axes;
use crate::status::Status;

/// One output array: its row for a state has the given shape.
#[derive(Clone, Debug)]
pub struct Field {
    pub name: &'static str,
    pub shape: Vec<usize>,
    pub data: Vec<f64>,
}

/// Named output arrays over the states, all NaN until set.
#[derive(Clone, Debug)]
pub struct Table {
    pub fields: Vec<Field>,
    pub status: Vec<Status>,
}

/// The number of a field in its table.
#[derive(Clone, Copy, Debug)]
struct FieldId(usize);

impl Table {
    fn new<const N: usize>(states: usize, fields: [(&'static str, Vec<usize>); N]) -> (Self, [FieldId; N]) {
        let fields = fields.map(|(name, shape)| {
            let width: usize = shape.iter().product();
            Field { name, shape, data: vec![f64::NAN; states * width] }
        });
        let table = Table { fields: fields.into(), status: vec![Status::Ok; states] };
        (table, std::array::from_fn(FieldId))
    }

    /// Writes `values` as the `part`-th piece of that size in the state's row.
    fn set(&mut self, field: FieldId, state: usize, part: usize, values: &[f64]) {
        let field = &mut self.fields[field.0];
        let width: usize = field.shape.iter().product();
        let start = state * width + part * values.len();
        field.data[start..start + values.len()].copy_from_slice(values);
    }
}

/// Poses (16 numbers each, rows of the homogeneous matrix), twists and accelerations (6 each) of the states.
#[derive(Clone, Copy, Debug)]
pub struct States<'a> {
    pub poses: &'a [f64],
    pub twists: &'a [f64],
    pub accelerations: &'a [f64],
}

impl States<'_> {
    #[must_use]
    pub fn len(&self) -> usize {
        self.poses.len() / 16
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// The state, and whether it is one that the mechanism can be in.
    fn read(&self, mech: &Mechanism, i: usize) -> (Motion<f64>, Status) {
        let (pose, status) = read_pose(mech, self.poses, i);
        let twist = Twist::from_array(six(self.twists, i));
        let acceleration = Acceleration::from_array(six(self.accelerations, i));
        let status = then(status, || check_twist(mech, &pose, &twist));
        let status = then(status, || check_acceleration(mech, &pose, &twist, &acceleration));
        (Motion { pose, twist, acceleration }, status)
    }
}

/// Largest entry of `RᵀR - 1` for a rotation.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// How far a pose may miss a constraint, relative to the characteristic length; for twists and accelerations
/// relative to their own size.
pub const CONSTRAINT_TOLERANCE: f64 = 1e-6;

/// Pivot ratio of the scaled Jacobian below which it is singular to working precision.
const SINGULAR_PIVOTS: f64 = 1e-12;

/// Sine of the angle between a leg and the axis of its universal joint, and length of a leg relative to the
/// characteristic length, below which the leg has no frame.
const LEG_TOLERANCE: f64 = 1e-6;

fn six(values: &[f64], i: usize) -> [f64; 6] {
    std::array::from_fn(|k| values[6 * i + k])
}

fn raw_pose(poses: &[f64], i: usize) -> Pose<f64> {
    let m = &poses[16 * i..16 * i + 16];
    Pose {
        rotation: Mat3::from_rows([[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]]),
        o: Vec3::new(m[3], m[7], m[11]),
    }
}

/// Whether sixteen numbers are a homogeneous matrix.
fn is_rotation(poses: &[f64], i: usize) -> bool {
    let m = &poses[16 * i..16 * i + 16];
    m.iter().all(|x| x.is_finite())
        && m[12..] == [0.0, 0.0, 0.0, 1.0]
        && raw_pose(poses, i).rotation.rotation_error() <= ROTATION_TOLERANCE
}

fn read_pose(mech: &Mechanism, poses: &[f64], i: usize) -> (Pose<f64>, Status) {
    let pose = raw_pose(poses, i);
    let valid = is_rotation(poses, i);
    let status = if valid { Status::Ok } else { Status::InvalidInput };
    let status = then(status, || check_legs(mech, &pose));
    (pose, then(status, || check_pose(mech, &pose)))
}

/// Whether every leg has a direction and a frame: no length of zero, no axis of a universal joint (or rod) along it.
fn check_legs(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    let regular = mech.legs.iter().all(|leg| {
        let p = leg::position(leg, pose);
        let sine = leg::frame(leg, pose, &p).sine;
        p.length > LEG_TOLERANCE * mech.characteristic_length && sine > LEG_TOLERANCE
    });
    if regular { Status::Ok } else { Status::Singular }
}

/// Whether a pose satisfies the constraints.
fn check_pose(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    let kept = constraint::largest_distance(mech, pose) <= CONSTRAINT_TOLERANCE * mech.characteristic_length;
    if kept { Status::Ok } else { Status::OffConstraint }
}

/// Whether a twist keeps the constraints: `(c, τ)·V = 0`.
fn check_twist(mech: &Mechanism, pose: &Pose<f64>, twist: &Twist<f64>) -> Status {
    let speed = speed(mech, twist);
    let kept = mech.independent.iter().all(|c| {
        let row = constraint::row(c, pose);
        let size = constraint::row_size(&row, mech.characteristic_length);
        row.power(twist).abs() <= CONSTRAINT_TOLERANCE * speed * size
    });
    match (speed.is_finite(), kept) {
        (false, _) => Status::InvalidInput,
        (true, false) => Status::OffConstraint,
        (true, true) => Status::Ok,
    }
}

/// Whether an acceleration keeps the constraints with that twist: `(c, τ)·A + Vᵀ h V = 0`.
fn check_acceleration(
    mech: &Mechanism,
    pose: &Pose<f64>,
    twist: &Twist<f64>,
    a: &Acceleration<f64>,
) -> Status {
    let as_twist = Twist::new(a.a, a.eps);
    let scale = mech.characteristic_length;
    let (speed, second) = (speed(mech, twist), self::speed(mech, &as_twist));
    let kept = mech.independent.iter().all(|c| {
        let row = constraint::row(c, pose);
        let size = constraint::row_size(&row, scale);
        let g = row.power(&as_twist) + quadratic(&constraint::hessian(c, pose), &twist.array());
        g.abs() <= CONSTRAINT_TOLERANCE * (second + speed * speed / scale) * size
    });
    match (second.is_finite(), kept) {
        (false, _) => Status::InvalidInput,
        (true, false) => Status::OffConstraint,
        (true, true) => Status::Ok,
    }
}

/// Size of a twist, turns counted as arcs at the characteristic length.
fn speed(mech: &Mechanism, twist: &Twist<f64>) -> f64 {
    twist.v.norm() + twist.omega.norm() * mech.characteristic_length
}

/// The first of two outcomes that is not ok; the second is looked at only if the first is.
fn then(first: Status, second: impl FnOnce() -> Status) -> Status {
    if first == Status::Ok { second() } else { first }
}

fn check_finite(values: &[f64]) -> Status {
    if values.iter().all(|x| x.is_finite()) { Status::Ok } else { Status::InvalidInput }
}

/// The limit that a pose breaks, strokes before cones.
fn limit_status(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    let mut status = Status::Ok;
    for leg in &mech.legs {
        let p = leg::position(leg, pose);
        if !(leg.stroke[0] <= p.length && p.length <= leg.stroke[1]) {
            return Status::OutOfStroke;
        }
        let seen = [(&leg.base, p.delta), (&leg.platform, pose.rotation.transpose_mul(p.delta))];
        if seen.iter().any(|(joint, delta)| joint.cone_limit.is_some_and(|a| cone_angle(joint, *delta) > a)) {
            status = Status::OutOfCone;
        }
    }
    status
}

/// Lengths, vectors r and directions δ of all legs [Eq. 3].
#[must_use]
pub fn inverse_kinematics(mech: &Mechanism, poses: &[f64]) -> Table {
    let (states, legs) = (poses.len() / 16, mech.legs.len());
    let (mut table, [lengths, vectors, directions]) = Table::new(
        states,
        [("lengths", vec![legs]), ("vectors", vec![legs, 3]), ("directions", vec![legs, 3])],
    );
    for i in 0..states {
        let (pose, mut status) = read_pose(mech, poses, i);
        if status == Status::Ok {
            status = limit_status(mech, &pose);
            for (k, leg) in mech.legs.iter().enumerate() {
                let p = leg::position(leg, &pose);
                table.set(lengths, i, k, &[p.length]);
                table.set(vectors, i, k, &p.r.array());
                table.set(directions, i, k, &p.delta.array());
            }
        }
        table.status[i] = status;
    }
    table
}

/// J for each pose, constraint satisfied or not [Eq. 13].
#[must_use]
pub fn jacobians(mech: &Mechanism, poses: &[f64]) -> Table {
    let states = poses.len() / 16;
    let (mut table, [matrix]) = Table::new(states, [("jacobian", vec![6, 6])]);
    for i in 0..states {
        if !is_rotation(poses, i) {
            continue;
        }
        for (k, row) in jacobian::jacobian(mech, &raw_pose(poses, i)).iter().enumerate() {
            table.set(matrix, i, k, row);
        }
    }
    table
}

/// H for each pose, constraint satisfied or not [Eq. 19].
#[must_use]
pub fn hessians(mech: &Mechanism, poses: &[f64]) -> Table {
    let states = poses.len() / 16;
    let (mut table, [layers]) = Table::new(states, [("hessian", vec![6, 6, 6])]);
    for i in 0..states {
        if !is_rotation(poses, i) {
            continue;
        }
        for (k, row) in jacobian::hessian(mech, &raw_pose(poses, i)).as_flattened().iter().enumerate() {
            table.set(layers, i, k, row);
        }
    }
    table
}

/// Every quantity of legs, rods, cylinders, pistons and joints [Eq. 2-39].
#[must_use]
pub fn kinematics(mech: &Mechanism, states: &States) -> Table {
    let (n, legs, rods) = (states.len(), mech.legs.len(), mech.rods.len());
    let (scalar, vector, pair) = (|| vec![legs], || vec![legs, 3], || vec![legs, 2]);
    let (mut table, ids) = Table::new(
        n,
        [
            ("lengths", scalar()),
            ("rates", scalar()),
            ("accelerations", scalar()),
            ("directions", vector()),
            ("leg_omega", vector()),
            ("leg_eps", vector()),
            ("leg_spin", scalar()),
            ("leg_spin_rate", scalar()),
            ("piston_velocity", vector()),
            ("piston_acceleration", vector()),
            ("cylinder_velocity", vector()),
            ("cylinder_acceleration", vector()),
            ("base_joint_angles", pair()),
            ("base_joint_rates", pair()),
            ("platform_joint_angles", pair()),
            ("platform_joint_rates", pair()),
            ("base_cone_angle", scalar()),
            ("platform_cone_angle", scalar()),
            ("rod_angle", vec![rods]),
            ("rod_omega", vec![rods, 3]),
            ("rod_eps", vec![rods, 3]),
        ],
    );
    let zeros: Vec<Zero> = mech.legs.iter().map(|leg| Zero::of(leg, &mech.home)).collect();
    for i in 0..n {
        let (platform, status) = states.read(mech, i);
        table.status[i] = then(status, || limit_status(mech, &platform.pose));
        if status != Status::Ok {
            continue;
        }
        for (k, leg) in mech.legs.iter().enumerate() {
            let state = leg::state(leg, &platform);
            let leg::State { position: p, end, turn, frame } = &state;
            let (piston, cylinder) = (leg::piston(leg, &state), leg::cylinder(leg, &state));
            let [below, above] = joints::angles(leg, &zeros[k], &platform, &state);
            let values: [&[f64]; 18] = [
                &[p.length],
                &[end.rate],
                &[end.acceleration],
                &p.delta.array(),
                &turn.omega.array(),
                &turn.eps.array(),
                &[turn.spin],
                &[turn.spin_rate],
                &piston.velocity.array(),
                &piston.acceleration.array(),
                &cylinder.velocity.array(),
                &cylinder.acceleration.array(),
                &below.angles,
                &below.rates,
                &above.angles,
                &above.rates,
                &[below.cone],
                &[above.cone],
            ];
            for (id, value) in ids.iter().zip(values) {
                table.set(*id, i, k, value);
            }
            for (r, rod) in mech.rods.iter().enumerate().filter(|(_, rod)| rod.leader == k) {
                let rod_turn = leg::rod_turn(rod.axis, &state);
                table.set(ids[18], i, r, &[joints::rod_angle(mech, r, &zeros[k], frame)]);
                table.set(ids[19], i, r, &(rod.axis * rod_turn.rate).array());
                table.set(ids[20], i, r, &(rod.axis * rod_turn.acceleration).array());
            }
        }
    }
    table
}

/// The loads of the states: the mechanism's own, or six numbers for each.
#[derive(Clone, Copy, Debug)]
pub enum Loads<'a> {
    Own,
    Given(&'a [f64], Axes),
}

impl Loads<'_> {
    fn at(&self, mech: &Mechanism, pose: &Pose<f64>, i: usize) -> Wrench<f64> {
        match self {
            Loads::Own => dynamics::load_in_base(mech.load.wrench, mech.load.axes, pose),
            Loads::Given(values, axes) => {
                dynamics::load_in_base(Wrench::from_array(six(values, i)), *axes, pose)
            }
        }
    }
}

/// Active forces of all legs (zero for passive ones) and multipliers of the independent constraints [Eq. 43].
#[must_use]
pub fn inverse_dynamics(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let n = states.len();
    let (mut table, [forces, multipliers]) =
        Table::new(n, [("forces", vec![mech.legs.len()]), ("constraint", vec![mech.independent.len()])]);
    for i in 0..n {
        let (platform, status) = states.read(mech, i);
        let load = loads.at(mech, &platform.pose, i);
        let mut status = then(status, || check_finite(&load.array()));
        if status == Status::Ok {
            let (f, pivots) = dynamics::inverse_dynamics(mech, &platform, load);
            status = outcome(mech, &f, pivots);
            if status == Status::Ok {
                status = limit_status(mech, &platform.pose);
                put_forces(mech, &mut table, forces, i, &f);
                table.set(multipliers, i, 0, &f[mech.dof()..]);
            }
        }
        table.status[i] = status;
    }
    table
}

fn outcome(mech: &Mechanism, solution: &[f64; 6], pivots: f64) -> Status {
    let controlled = mech.mobility.uncontrolled == 0;
    if controlled && pivots > SINGULAR_PIVOTS && solution.iter().all(|x| x.is_finite()) {
        Status::Ok
    } else {
        Status::Singular
    }
}

fn put_forces(mech: &Mechanism, table: &mut Table, field: FieldId, state: usize, forces: &[f64; 6]) {
    for k in 0..mech.legs.len() {
        table.set(field, state, k, &[0.0]);
    }
    for ((k, _), f) in mech.actuated().zip(forces) {
        table.set(field, state, k, &[*f]);
    }
}

/// The platform's twist from the rates of all legs; those of passive legs are not read [Eq. 13].
#[must_use]
pub fn platform_twist(mech: &Mechanism, poses: &[f64], rates: &[f64]) -> Table {
    let n = poses.len() / 16;
    let (mut table, [field]) = Table::new(n, [("twist", vec![6])]);
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        let legs = actuated_values(mech, rates, i);
        let mut status = then(status, || check_finite(&legs));
        if status == Status::Ok {
            let (twist, pivots) = jacobian::platform_twist(mech, &pose, &legs);
            status = outcome(mech, &twist.array(), pivots);
            if status == Status::Ok {
                table.set(field, i, 0, &twist.array());
            }
        }
        table.status[i] = status;
    }
    table
}

/// The platform's acceleration from its twist and the accelerations of all legs [Eq. 19].
#[must_use]
pub fn platform_acceleration(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    accelerations: &[f64],
) -> Table {
    let n = poses.len() / 16;
    let (mut table, [field]) = Table::new(n, [("acceleration", vec![6])]);
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        let twist = Twist::from_array(six(twists, i));
        let legs = actuated_values(mech, accelerations, i);
        let status = then(status, || check_twist(mech, &pose, &twist));
        let mut status = then(status, || check_finite(&legs));
        if status == Status::Ok {
            let (a, pivots) = jacobian::platform_acceleration(mech, &pose, &twist, &legs);
            status = outcome(mech, &a.array(), pivots);
            if status == Status::Ok {
                table.set(field, i, 0, &a.array());
            }
        }
        table.status[i] = status;
    }
    table
}

fn actuated_values(mech: &Mechanism, values: &[f64], i: usize) -> Vec<f64> {
    mech.actuated().map(|(k, _)| values[i * mech.legs.len() + k]).collect()
}

/// Forces on the platform at the ends of two coupled legs, and the torque on their rod, from the multiplier \[T16\].
/// None for a mechanism without such a pair.
#[must_use]
pub fn coupled_forces(
    mech: &Mechanism,
    poses: &[f64],
    multipliers: &[f64],
    as_printed: bool,
) -> Option<([usize; 2], Table)> {
    let (pair, axis, platform_axis) = mobility::coupled_pair(mech)?;
    let index = mech.independent.iter().position(|c| pair.contains(&c.leg))?;
    let (n, k) = (poses.len() / 16, mech.independent.len());
    let (mut table, [forces, torque]) = Table::new(n, [("forces", vec![2]), ("torque", vec![])]);
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        let f_c = multipliers[i * k + index];
        table.status[i] = then(status, || check_finite(&[f_c]));
        if table.status[i] == Status::Ok {
            let c = dynamics::coupled_forces(mech, pair, axis, platform_axis, &pose, f_c, as_printed);
            if c.forces.iter().all(|f| f.is_finite()) {
                table.set(forces, i, 0, &c.forces);
                table.set(torque, i, 0, &[c.torque]);
            } else {
                table.status[i] = Status::Singular;
            }
        }
    }
    Some((pair, table))
}

/// Energies with their exact rates along the motion, and every power of the balance \[T17\].
#[must_use]
pub fn power(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let n = states.len();
    let names = [
        "kinetic",
        "potential",
        "kinetic_rate",
        "potential_rate",
        "actuators",
        "load",
        "damping",
        "friction",
        "residual",
    ];
    let (mut table, ids) = Table::new(n, names.map(|name| (name, vec![])));
    for i in 0..n {
        let (platform, status) = states.read(mech, i);
        let Motion { pose, twist, .. } = &platform;
        let wrench = loads.at(mech, pose, i);
        table.status[i] = then(status, || check_finite(&wrench.array()));
        if table.status[i] != Status::Ok {
            continue;
        }
        let (kinetic, potential) = energy_along(mech, &platform);
        let load = wrench.power(twist);
        let damping = -(mech.linear_damping * twist.v.dot(twist.v)
            + mech.angular_damping * twist.omega.dot(twist.omega));
        let (f, pivots) = dynamics::inverse_dynamics(mech, &platform, wrench);
        let rates = mech.actuated().map(|(_, leg)| leg::row(&leg::position(leg, pose)).power(twist));
        table.status[i] = then(outcome(mech, &f, pivots), || limit_status(mech, pose));
        let singular = table.status[i] == Status::Singular;
        let actuators = if singular { f64::NAN } else { rates.zip(&f).map(|(rate, f)| rate * f).sum() };
        // What the efficiency takes: actuators serve the platform's term of [Eq. 42] 1/η times.
        let own = (wrench + dynamics::platform_wrench(mech, &platform)).power(twist);
        let friction = (1.0 / mech.efficiency - 1.0) * own;
        let residual = actuators + load + damping + friction - kinetic.d - potential.d;
        let values =
            [kinetic.x, potential.x, kinetic.d, potential.d, actuators, load, damping, friction, residual];
        for (id, value) in ids.iter().zip(values) {
            table.set(*id, i, 0, &[value]);
        }
    }
    table
}

/// Kinetic and potential energy as duals along the motion.
fn energy_along(mech: &Mechanism, platform: &Motion<f64>) -> (Dual<f64>, Dual<f64>) {
    let Motion { pose, twist, acceleration } = platform;
    let dual =
        |x: Vec3<f64>, d: Vec3<f64>| Vec3::new(Dual::new(x.x, d.x), Dual::new(x.y, d.y), Dual::new(x.z, d.z));
    let rotation = Mat3(pose.rotation.0.map(|c| dual(c, twist.omega.cross(c))));
    let moving = Pose { rotation, o: dual(pose.o, twist.v) };
    let twist = Twist::new(dual(twist.v, acceleration.a), dual(twist.omega, acceleration.eps));
    dynamics::energy(mech, &moving, &twist)
}

/// Singular values of the leg Jacobian on the twists that the constraints allow \[T24\].
#[must_use]
pub fn conditioning(mech: &Mechanism, poses: &[f64]) -> Table {
    let n = poses.len() / 16;
    let (mut table, ids) = Table::new(n, ["sigma_min", "sigma_max", "condition"].map(|name| (name, vec![])));
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        table.status[i] = status;
        if status == Status::Ok {
            let c = singularity::conditioning(mech, &pose);
            for (id, value) in ids.iter().zip([c.sigma_min, c.sigma_max, c.condition]) {
                table.set(*id, i, 0, &[value]);
            }
        }
    }
    table
}

/// Given coordinates of the states with their rates and second rates: `given[k]` holds the three series of the
/// `k`-th number of the set, or nothing where it is to be solved.
#[derive(Clone, Debug)]
pub struct Coordinates<'a> {
    pub set: Set,
    pub given: Vec<Option<[&'a [f64]; 3]>>,
    pub branch: f64,
    /// Poses to start the dependent coordinates from, one for each state or one for all; home without any.
    pub guess: Option<&'a [f64]>,
    /// Start each state from the pose of the last one that was solved.
    pub continued: bool,
}

/// Pose, twist, acceleration and all coordinates of the set [Eq. 2, 5] \[T19\]-\[T23\].
#[must_use]
pub fn states(mech: &Mechanism, input: &Coordinates, n: usize) -> Table {
    let names = input.set.names();
    let (mut table, [poses, twists, accelerations, values, rates, second_rates]) = Table::new(
        n,
        [
            ("pose", vec![4, 4]),
            ("twist", vec![6]),
            ("acceleration", vec![6]),
            ("coordinates", vec![names.len()]),
            ("coordinate_rates", vec![names.len()]),
            ("coordinate_second_rates", vec![names.len()]),
        ],
    );
    let mask: Vec<bool> =
        (0..MAX_COORDINATES).map(|k| k >= names.len() || input.given[k].is_some()).collect();
    let all_given = mask.iter().all(|&given| given) && !mech.independent.is_empty();
    let (mut last, mut branch) = (mech.home, f64::NAN);
    for i in 0..n {
        let q: Values<Jet<f64>> = std::array::from_fn(|k| match input.given.get(k).copied().flatten() {
            Some([x, d, dd]) => Jet::new(x[i], d[i], dd[i]),
            None => Jet::new(0.0, 0.0, 0.0),
        });
        let guess = match input.guess {
            Some(poses) if i == 0 || !input.continued => {
                let k = if poses.len() == 16 { 0 } else { i };
                if !is_rotation(poses, k) {
                    table.status[i] = Status::InvalidInput;
                    continue;
                }
                raw_pose(poses, k)
            }
            None if !input.continued => mech.home,
            _ => last,
        };
        let state = coordinates::state(mech, &input.set, &q, &mask, input.branch, &guess);
        let state = checked(mech, state, all_given);
        let jumped = input.continued && state.status == Status::Ok && state.branch * branch < 0.0;
        table.status[i] = if jumped { Status::BranchJump } else { state.status };
        let found = state.platform.pose.rotation.0.iter().all(|c| c.norm().is_finite());
        let solved = found && matches!(table.status[i], Status::Ok | Status::Fold);
        if solved {
            if state.status == Status::Ok {
                (last, branch) = (state.platform.pose, state.branch);
            }
            let (r, o) = (state.platform.pose.rotation.rows(), state.platform.pose.o.array());
            for k in 0..3 {
                table.set(poses, i, k, &[r[k][0], r[k][1], r[k][2], o[k]]);
            }
            table.set(poses, i, 3, &[0.0, 0.0, 0.0, 1.0]);
        }
        if table.status[i] == Status::Ok {
            table.set(twists, i, 0, &state.platform.twist.array());
            table.set(accelerations, i, 0, &state.platform.acceleration.array());
        }
        for k in 0..names.len() {
            if solved || mask[k] {
                let jet = state.coordinates[k];
                table.set(values, i, k, &[jet.x]);
                table.set(rates, i, k, &[jet.d]);
                table.set(second_rates, i, k, &[jet.dd]);
            }
        }
    }
    table
}

/// A state is none where a leg has no frame, or where coordinates that were all given break the constraints.
fn checked(mech: &Mechanism, mut state: State, all_given: bool) -> State {
    let Motion { pose, twist, acceleration } = &state.platform;
    // A root that a constraint has only because a leg has no frame there is none.
    state.status = then(state.status, || check_legs(mech, pose));
    if all_given && state.status == Status::Ok {
        state.status = then(check_pose(mech, pose), || check_twist(mech, pose, twist));
        state.status = then(state.status, || check_acceleration(mech, pose, twist, acceleration));
    }
    state
}

/// The numbers of a set at each pose: the inverse of [`states`].
#[must_use]
pub fn coordinate_values(mech: &Mechanism, set: &Set, poses: &[f64]) -> Table {
    let n = poses.len() / 16;
    let (mut table, [values]) = Table::new(n, [("coordinates", vec![set.names().len()])]);
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        table.status[i] = status;
        if status == Status::Ok {
            table.set(values, i, 0, &set.values(mech, &pose)[..set.names().len()]);
        }
    }
    table
}
