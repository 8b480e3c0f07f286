//! Mechanisms and motions to test with: every leg of the catalogue, at generic places.

#![allow(dead_code)] // each test file uses its share

use polypod_core::assembly::build::assemble;
use polypod_core::kinematics::coordinate_sets::{MAX_COORDINATES, Set};
use polypod_core::kinematics::dependent_coordinates::{self, DEPENDENT_PIVOTS};
use polypod_core::kinematics::leg;
use polypod_core::mobility::degrees_of_freedom;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::model::spec::Spec;
use polypod_core::model::status::Status;
use polypod_core::number::order::larger;
use polypod_core::number::real::Jet;
use polypod_core::spatial::{Mat3, Motion, Pose, Vec3};

/// A small generator: tests must draw the same numbers everywhere.
pub struct Draw(u64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Uniform in (-1, 1).
    pub fn number(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 11) as f64 / (1_u64 << 53) as f64) * 2.0 - 1.0
    }

    pub fn vector(&mut self) -> Vec3<f64> {
        Vec3::new(self.number(), self.number(), self.number())
    }
}

/// Every pair of joints.
pub fn every_leg() -> Vec<String> {
    let letters = ["S", "U", "R", "F"];
    letters.iter().flat_map(|base| letters.iter().map(move |platform| format!("{base}P{platform}"))).collect()
}

/// Every pair of joints that a slider can have.
pub const SLIDERS: [&str; 6] = ["PSS", "PUS", "PSU", "PUU", "PRS", "PRU"];

/// Every leg of the catalogue, rods with one to three legs, one slider of each kind, six of them, and the
/// published manipulator.
pub fn mechanisms() -> Vec<Mechanism> {
    every_leg()
        .iter()
        .enumerate()
        .map(|(i, letters)| with_leg(letters, i as u64 + 1))
        .chain([on_rod(1, 3), on_rod(2, 4), on_rod(3, 5), published()])
        .chain(SLIDERS.iter().enumerate().map(|(i, letters)| with_leg(letters, i as u64 + 21)))
        .chain([six_sliders()])
        .collect()
}

pub fn six_sliders() -> Mechanism {
    generic("6-PUS", &vec!["PUS".to_owned(); 6], 0, 6, 31)
}

fn body(draw: &mut Draw, symmetric: bool) -> serde_json::Value {
    // A sum of point masses is the inertia of a body that exists.
    let mut inertia = [[0.0; 3]; 3];
    for _ in 0..4 {
        let p = (draw.vector() * 0.2).array();
        for i in 0..3 {
            for j in 0..3 {
                let square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
                inertia[i][j] += (if i == j { square } else { 0.0 }) - p[i] * p[j];
            }
        }
    }
    let center = if symmetric { [0.0, 0.1, 0.0] } else { (draw.vector() * 0.1).array() };
    if symmetric {
        let (across, along) = (inertia[0][0] + inertia[2][2], inertia[0][0]);
        inertia = [[across, 0.0, 0.0], [0.0, along, 0.0], [0.0, 0.0, across]];
    }
    serde_json::json!({ "mass": 2.0 + draw.number(), "center": center, "inertia": inertia })
}

fn joint(
    letter: &str,
    point: Vec3<f64>,
    delta: Vec3<f64>,
    n: Vec3<f64>,
    tilt: f64,
    to_body: &Mat3<f64>,
) -> serde_json::Value {
    let seen = |a: Vec3<f64>| Some(to_body.transpose_mul(a).array());
    let (axis, normal) = match letter {
        "U" => (seen(delta * tilt.sin() + n.cross(delta) * tilt.cos()), None),
        "R" => (seen(n), None),
        "F" => (seen(delta), seen(n)),
        _ => (None, None),
    };
    serde_json::json!({ "joint": letter, "point": point.array(), "axis": axis, "normal": normal, "rod": null, "cone": null })
}

/// The letters of a leg's joints on the base (or carriage) and on the platform.
fn joints_of(letters: &str) -> [&str; 2] {
    if letters.starts_with('P') { [&letters[1..2], &letters[2..]] } else { [&letters[..1], &letters[2..]] }
}

/// A mechanism with one leg of the given letters, made up with UPS legs, with generic bodies, load and
/// damping.
pub fn with_leg(letters: &str, seed: u64) -> Mechanism {
    let freedoms = |l: &str| match l {
        "S" => 3,
        "U" => 2,
        "R" => 1,
        _ => 0,
    };
    let [base, platform] = joints_of(letters);
    let dof = (freedoms(base) + freedoms(platform) + 1).min(6);
    let mut legs = vec![letters.to_owned()];
    legs.resize(dof, "UPS".to_owned());
    generic(letters, &legs, 0, dof, seed)
}

/// A pose that keeps the constraints of [`with_leg`], with the first leg rotated about and as long as at
/// home.
pub fn with_leg_backwards(mech: &Mechanism) -> Pose<f64> {
    let r = leg::position(&mech.legs[0], &mech.home).r;
    Pose { o: mech.home.o - r * 2.0, ..mech.home }
}

/// A mechanism whose last `count` legs are RPU on one rod, in planes of their own, with UPS legs for what
/// degrees of freedom they leave. Sliding along the rod and rotating about it always remain, so that the
/// third leg adds one constraint only.
pub fn on_rod(count: usize, seed: u64) -> Mechanism {
    let dof: usize = [5, 3, 2][count - 1];
    let mut legs = vec!["UPS".to_owned(); dof.saturating_sub(count).max(1)];
    legs.resize(legs.len() + count, "RPU".to_owned());
    generic(&format!("{count} on a rod"), &legs, count, dof, seed)
}

/// More legs than it takes: two with pins below and UPS legs for more than the degrees of freedom that they
/// leave.
pub fn redundant(seed: u64) -> Mechanism {
    let letters: Vec<String> = ["UPS", "UPS", "UPS", "UPS", "UPS", "RPS", "RPS"].map(str::to_owned).to_vec();
    generic("redundant", &letters, 0, 7, seed)
}

/// Five legs, or more, whose joints in one body lie on a line.
pub fn pentapod(count: usize, body: &str, seed: u64) -> Mechanism {
    let mut spec = generic_spec("pentapod", &vec!["UPS".to_owned(); count], 0, count, seed);
    let mut draw = Draw::new(seed + 100);
    let (point, line) = (draw.vector() * 0.1, (Vec3::X + draw.vector()).unit());
    for leg in spec["legs"].as_array_mut().expect("legs") {
        leg[body]["point"] = serde_json::json!((point + line * (0.4 * draw.number())).array());
    }
    make(&spec.to_string())
}

/// Generic legs, bodies, load and damping; the last `on_rod` legs stand on a rod, the first `actuated` are
/// driven.
fn generic(name: &str, letters: &[String], on_rod: usize, actuated: usize, seed: u64) -> Mechanism {
    make(&generic_spec(name, letters, on_rod, actuated, seed).to_string())
}

fn generic_spec(
    name: &str,
    letters: &[String],
    on_rod: usize,
    actuated: usize,
    seed: u64,
) -> serde_json::Value {
    let mut draw = Draw::new(seed);
    let rotation = Mat3::from_rotation_vector(draw.vector() * 0.4);
    let home = (draw.vector() * 0.1 + Vec3::new(0.0, 0.0, 1.0), rotation);
    let (line, point) = ((Vec3::X + draw.vector() * 0.3).unit(), draw.vector() * 0.2);
    let mut legs = Vec::new();
    for (i, joints) in letters.iter().enumerate() {
        let [base, platform] = joints_of(joints);
        let stands_on_rod = i + on_rod >= letters.len();
        let (mut below, above) = (draw.vector() * 0.5, draw.vector() * 0.3);
        if stands_on_rod {
            below = point + line * draw.number();
        }
        let delta = (home.0 + rotation * above - below).unit();
        let n = if stands_on_rod { line.cross(delta).unit() } else { delta.cross(draw.vector()).unit() };
        let symmetric = base == "S" && platform == "S";
        let mut tilts = [0.5 * draw.number(), 0.5 * draw.number()];
        if joints == "PUU" {
            tilts[0] = 0.9; // its axis is the rail, which must be far from perpendicular to the strut
        }
        let slider = joints.starts_with('P').then(|| {
            // The rail is far from perpendicular to the strut, the carriage somewhere on it.
            let side = n.cross(delta);
            let axis = match (base, platform) {
                ("R", _) => delta + side * 0.7,
                ("U", "U") => delta * tilts[0].sin() + side * tilts[0].cos(),
                _ => delta * tilts[1].signum() + draw.vector() * 0.5,
            };
            let strut = (home.0 + rotation * above - below).norm();
            let branch = axis.dot(delta).signum();
            below = below - axis.unit() * (0.3 * draw.number());
            let carriage = serde_json::json!({ "mass": 3.0, "center": draw.vector().array() });
            serde_json::json!({ "axis": axis.array(), "strut": strut, "branch": branch, "carriage": carriage })
        });
        let mut below = joint(base, below, delta, n, tilts[0], &Mat3::identity());
        if stands_on_rod {
            below["rod"] = 0.into();
            below["axis"] = serde_json::Value::Null;
        }
        legs.push(serde_json::json!({
            "name": format!("{}", i + 1), "actuated": i < actuated, "stroke": null, "radius": null,
            "slider": slider, "base": below, "platform": joint(platform, above, delta, n, tilts[1], &rotation),
            "cylinder": body(&mut draw, symmetric), "piston": body(&mut draw, symmetric),
        }));
    }
    let rod = serde_json::json!({ "name": "L", "point": point.array(), "axis": line.array(), "body": body(&mut draw, false) });
    let rods = if on_rod > 0 { vec![rod] } else { vec![] };
    serde_json::json!({
        "name": name, "angles_known": true, "legs": legs, "rods": rods, "platform": body(&mut draw, false),
        "gravity": [0.3, -0.2, -9.81], "efficiency": 0.9, "linear_damping": 3.0, "angular_damping": 0.4,
        "load": { "force": [10.0, -20.0, 30.0], "torque": [4.0, 5.0, -6.0], "axes": "platform" },
        "home": { "position": home.0.array(), "rotation_vector": rotation.rotation_vector().array() },
        "tool": { "point": [0.0, 0.0, 0.1], "axis": [0.0, 0.0, 1.0] },
    })
}

/// The published manipulator, its numbers straight from Table II.
pub fn published() -> Mechanism {
    let degrees = [18.0_f64, 90.0, 162.0, 234.0, 306.0];
    let body = |mass: f64, center: f64, inertia: f64| {
        serde_json::json!({ "mass": mass, "center": [0.0, center, 0.0],
            "inertia": [[inertia, 0.0, 0.0], [0.0, inertia, 0.0], [0.0, 0.0, inertia]] })
    };
    let legs: Vec<serde_json::Value> = degrees
        .iter()
        .enumerate()
        .map(|(i, angle)| {
            let (s, c) = angle.to_radians().sin_cos();
            let on_rod = i == 0 || i == 2;
            let (outer, piston) = if on_rod { (0.270, -0.100) } else { (0.265, -0.098) };
            let axis = if on_rod { [1.0, 0.0, 0.0] } else { [-c, -s, 0.0] };
            serde_json::json!({
                "name": format!("{}", i + 1), "actuated": true, "stroke": [0.65, 0.85], "radius": null,
                "base": { "joint": if on_rod { "R" } else { "S" }, "point": [outer * c, outer * s, 0.0], "axis": null,
                    "normal": null, "rod": if on_rod { Some(0) } else { None }, "cone": null },
                "platform": { "joint": "U", "point": [0.150 * c, 0.150 * s, 0.0], "axis": axis, "normal": null, "rod": null,
                    "cone": null },
                "cylinder": body(2.0, 0.050, 2.0), "piston": body(3.0, piston, 3.0),
            })
        })
        .collect();
    let line = 0.270 * 18.0_f64.to_radians().sin();
    let spec = serde_json::json!({
        "name": "lu", "angles_known": true, "legs": legs, "platform": body(3.0, 0.0, 5.0),
        "rods": [{ "name": "L", "point": [0.0, line, 0.0], "axis": [1.0, 0.0, 0.0], "body": body(2.0, 0.0, 2.0) }],
        "gravity": [0.0, 0.0, -9.81], "efficiency": 1.0, "linear_damping": 0.0, "angular_damping": 0.0,
        "load": { "force": [10.0, 10.0, 500.0], "torque": [0.0, 0.0, 1000.0], "axes": "base" },
        "home": { "position": [0.0, 0.120 * 18.0_f64.to_radians().sin(), 0.740], "rotation_vector": [0.0, 0.0, 0.0] },
        "tool": { "point": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0] },
    });
    make(&spec.to_string())
}

fn make(spec: &str) -> Mechanism {
    assemble(&Spec::from_json(spec).expect("a readable spec")).expect("a sound mechanism")
}

/// States that keep the constraints: a pose near home and a motion through it, made with the coordinate set
/// `pose`, whose independent coordinates are the first that determine the others.
pub fn states(mech: &Mechanism, count: usize, seed: u64) -> Vec<Motion<f64>> {
    let mut draw = Draw::new(seed);
    let mut result = Vec::new();
    'next: for _ in 0..count.max(100) * 2 {
        if result.len() == count {
            break;
        }
        let start = Pose {
            rotation: Mat3::from_rotation_vector(draw.vector() * 0.3) * mech.home.rotation,
            o: mech.home.o + draw.vector() * 0.1,
        };
        let Some(pose) = degrees_of_freedom::project(&mech.constraints, mech.characteristic_length, &start)
        else {
            continue;
        };
        let at = Set::Pose.values(mech, &pose);
        let motion: [(f64, f64); 6] = std::array::from_fn(|_| (draw.number(), draw.number()));
        for mask in 0..64_u32 {
            let given: Vec<bool> = (0..MAX_COORDINATES).map(|k| k >= 6 || mask & (1 << k) != 0).collect();
            if mask.count_ones() as usize != mech.dof() {
                continue;
            }
            let q: [Jet<f64>; MAX_COORDINATES] = std::array::from_fn(|k| {
                let (d, dd) = if k < 6 { motion[k] } else { (0.0, 0.0) };
                Jet::new(at[k], d, dd)
            });
            let state =
                dependent_coordinates::state(mech, &Set::Pose, &q, &given, 1.0, &pose, DEPENDENT_PIVOTS);
            let speed = state.platform.twist.v.norm() + state.platform.twist.omega.norm();
            if state.status == Status::Ok && speed < 20.0 {
                result.push(state.platform);
                continue 'next;
            }
        }
    }
    assert_eq!(result.len(), count, "{}: too few states", mech.name);
    result
}

/// The pose as it moves: columns of R and o with their rates.
pub fn moving(state: &Motion<f64>) -> Pose<Jet<f64>> {
    let (w, eps) = (state.twist.omega, state.acceleration.eps);
    let column = |c: Vec3<f64>| {
        let d = w.cross(c);
        jets(c, d, eps.cross(c) + w.cross(d))
    };
    Pose {
        rotation: Mat3(state.pose.rotation.0.map(column)),
        o: jets(state.pose.o, state.twist.v, state.acceleration.a),
    }
}

pub fn jets(x: Vec3<f64>, d: Vec3<f64>, dd: Vec3<f64>) -> Vec3<Jet<f64>> {
    Vec3::new(Jet::new(x.x, d.x, dd.x), Jet::new(x.y, d.y, dd.y), Jet::new(x.z, d.z, dd.z))
}

/// The parts of a vector of jets.
pub fn parts(a: Vec3<Jet<f64>>) -> [Vec3<f64>; 3] {
    [a.map(|j| j.x), a.map(|j| j.d), a.map(|j| j.dd)]
}

/// Asserts that two vectors are equal to `tolerance`, relative to the larger of them and one.
pub fn close(found: Vec3<f64>, expected: Vec3<f64>, tolerance: f64, what: &str) {
    let error = (found - expected).norm() / larger(expected.norm(), 1.0);
    assert!(error <= tolerance, "{what}: {found:?} is not {expected:?}, off by {error:e}");
}
