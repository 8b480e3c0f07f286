//! Mobility from ranks: which constraints are independent, how many loop closures are redundant and which
//! legs they couple, which degrees of freedom are passive \[T18\].
//!
//! Ranks are taken at several generic poses near home, which the machine can have, and the largest counts: at
//! a singular pose a rank only drops.

use crate::kinematics::constraint;
use crate::kinematics::idle;
use crate::kinematics::leg;
use crate::model::joint::{Joint, JointKind, Normal};
use crate::model::mechanism::{
    Constraint, ConstraintRow, Graph, GraphJoint, GraphLink, Leg, Mechanism, Mobility, Turning,
};
use crate::model::mechanism::{Idle, IdleRow};
use crate::model::spec::Axes;
use crate::numerics::random::Random;
use crate::numerics::svd::Svd;
use crate::spatial::{Mat3, Pose, Twist, Vec3, Wrench};
use nalgebra::{DMatrix, DVector};

/// Singular values below this share of the largest count as zero.
pub(crate) const RANK_TOLERANCE: f64 = 1e-9;

/// Generic poses looked at.
const SAMPLES: u32 = 12;

/// How far from home they are sought, in characteristic lengths and radians, nearer where the mechanism
/// cannot be so far off: poses far away may be those of another mode.
const SPREADS: [f64; 4] = [0.03, 0.01, 0.003, 0.001];

const NEWTON_STEPS: usize = 60;

/// Independent constraints, local degrees of freedom and the mobility of a mechanism whose parts are in
/// place.
#[must_use]
pub fn analyse(mech: &Mechanism) -> (Vec<Constraint>, Vec<Idle>, Mobility) {
    let poses = generic_poses(mech);
    let chosen = independent_rows(mech, &poses);
    let independent = chosen.iter().map(|&i| mech.constraints[i]).collect::<Vec<_>>();
    let idle = idle::find(mech, &independent, &poses);
    let graph = graph(mech);

    let closures: Vec<Closure> = poses.iter().map(|pose| closure(mech, pose)).collect();
    let freedoms: usize = graph.joints.iter().map(|j| joint_freedoms(j.kind)).sum();
    let loops = graph.joints.len() + 1 - graph.links.len();
    let best = closures.iter().max_by_key(|c| c.rank);
    let rank = best.map_or(0, |c| c.rank).saturating_sub(6);
    let dof = 6 - independent.len();
    let mobility = Mobility {
        dof,
        links: graph.links.len(),
        joints: graph.joints.len(),
        joint_freedoms: freedoms,
        loops,
        closure_rank: rank,
        redundant: 6 * loops - rank,
        redundant_legs: best.map_or_else(Vec::new, |c| c.redundant_legs.clone()),
        passive: best.map_or(0, |c| c.passive),
        passive_legs: best.map_or_else(Vec::new, |c| c.passive_legs.clone()),
        uncontrolled: poses
            .iter()
            .map(|pose| uncontrolled(mech, &independent, &idle, pose))
            .min()
            .unwrap_or(0),
        idle: idle.iter().map(IdleRow::of).collect(),
        constraints: mech
            .constraints
            .iter()
            .enumerate()
            .map(|(i, c)| ConstraintRow {
                leg: c.leg,
                kind: format!("{:?}", c.kind),
                independent: chosen.contains(&i),
            })
            .collect(),
        graph,
    };
    (independent, idle, mobility)
}

/// Of a joint of the graph: the joint of a drive has one.
fn joint_freedoms(letter: &str) -> usize {
    JointKind::ALL.into_iter().find(|kind| kind.letter() == letter).map_or(1, JointKind::freedoms)
}

/// Poses near home that the mechanism can have, the same ones every time.
pub(crate) fn generic_poses(mech: &Mechanism) -> Vec<Pose<f64>> {
    let mut draw = Random(0x2545_F491_4F6C_DD1D);
    let size = mech.characteristic_length;
    let mut poses = Vec::new();
    for _ in 0..SAMPLES {
        let [turn, shift] = [(); 2].map(|()| draw.vector(Random::number));
        let near = |spread: f64| {
            let rotation = Mat3::from_rotation_vector(turn * spread) * mech.home.rotation;
            let start = Pose { rotation, o: mech.home.o + shift * (spread * size) };
            project(&mech.constraints, size, &start).filter(|pose| is_possible(mech, pose))
        };
        poses.extend(SPREADS.into_iter().find_map(near));
    }
    if poses.is_empty() {
        poses.push(mech.home);
    }
    poses
}

/// Whether every leg has a length, and every strut its rail within reach, with none backwards in a fixed
/// joint.
pub(crate) fn is_possible(mech: &Mechanism, pose: &Pose<f64>) -> bool {
    let has_length =
        |leg: &Leg| leg::position(leg, pose).length > RANK_TOLERANCE * mech.characteristic_length;
    let reaches = |leg: &Leg| leg::position(leg, pose).coordinate.is_finite();
    leg::all_ahead(mech, pose) && mech.legs.iter().all(|leg| has_length(leg) && reaches(leg))
}

/// The pose that satisfies `constraints`, found from `start` by damped Gauss-Newton steps of least size, or
/// none.
#[must_use]
pub fn project(constraints: &[Constraint], size: f64, start: &Pose<f64>) -> Option<Pose<f64>> {
    let mut pose = *start;
    for _ in 0..NEWTON_STEPS {
        let rows: Vec<Wrench<f64>> = constraints.iter().map(|c| constraint::row(c, &pose)).collect();
        let sizes: Vec<f64> = rows.iter().map(|row| constraint::row_unit(row, size)).collect();
        let residual = DVector::from_iterator(
            rows.len(),
            constraints.iter().zip(&sizes).map(|(c, s)| constraint::value(c, &pose) / s),
        );
        if residual.amax() <= 1e-13 * size {
            return Some(pose);
        }
        if !residual.amax().is_finite() {
            return None;
        }
        let g = scaled_rows(&rows, &sizes, size);
        // Off the constraints redundant rows disagree; a damping of the order of the residual (Levenberg and
        // Marquardt) keeps their disagreement from being followed and vanishes with it.
        let (Svd { values, u, v_t }, damping) = (Svd::of(&g)?, residual.amax() / size);
        let floor = values.max() * RANK_TOLERANCE;
        let damped = |s: f64| if s > floor { s / (s * s + damping * damping) } else { 0.0 };
        let step = v_t.transpose() * values.map(damped).component_mul(&(u.transpose() * &residual));
        let [x, y, z, p, q, r]: [f64; 6] = std::array::from_fn(|i| -step[i]);
        pose.o = pose.o + Vec3::new(x, y, z);
        pose.rotation = Mat3::from_rotation_vector(Vec3::new(p, q, r) * (1.0 / size)) * pose.rotation;
    }
    None
}

/// Rows (c, τ/scale) divided by their size, so that ranks and steps have one unit.
fn scaled_rows(rows: &[Wrench<f64>], sizes: &[f64], scale: f64) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), 6, |i, j| {
        let row = rows[i].array();
        (if j < 3 { row[j] } else { row[j] / scale }) / sizes[i]
    })
}

/// Indices of the constraints that raise the rank at a pose, taken in the order of the legs: of all poses of
/// largest rank those that are independent at the most poses.
fn independent_rows(mech: &Mechanism, poses: &[Pose<f64>]) -> Vec<usize> {
    let size = mech.characteristic_length;
    let at = |pose: &Pose<f64>| {
        let rows: Vec<Wrench<f64>> = mech.constraints.iter().map(|c| constraint::row(c, pose)).collect();
        let sizes: Vec<f64> = rows.iter().map(|row| constraint::row_unit(row, size)).collect();
        scaled_rows(&rows, &sizes, size)
    };
    let rows: Vec<DMatrix<f64>> = poses.iter().map(at).collect();
    let independent = |rows: &DMatrix<f64>, set: &[usize]| rank_of(&rows.select_rows(set)) == set.len();
    let raising = |rows: &DMatrix<f64>| {
        let mut chosen: Vec<usize> = Vec::new();
        for i in 0..rows.nrows() {
            chosen.push(i);
            if !independent(rows, &chosen) {
                chosen.pop();
            }
        }
        chosen
    };
    let mut sets: Vec<Vec<usize>> = rows.iter().map(raising).collect();
    let most = sets.iter().map(Vec::len).max().unwrap_or(0);
    sets.retain(|set| set.len() == most);
    sets.dedup();
    // Of equals the last one is taken: from behind the first.
    let best =
        sets.into_iter().rev().max_by_key(|set| rows.iter().filter(|rows| independent(rows, set)).count());
    best.unwrap_or_default()
}

fn rank_of(m: &DMatrix<f64>) -> usize {
    Svd::of(m).map_or(0, |svd| svd.rank(RANK_TOLERANCE))
}

/// Degrees of freedom, local ones apart, that are left when the actuated legs keep their lengths, at a pose.
fn uncontrolled(mech: &Mechanism, independent: &[Constraint], idle: &[Idle], pose: &Pose<f64>) -> usize {
    let size = mech.characteristic_length;
    let legs = mech.actuated().map(|(_, leg)| leg::row(leg, &leg::position(leg, pose)));
    let others = independent.iter().map(|c| constraint::row(c, pose));
    let rows: Vec<Wrench<f64>> =
        legs.chain(others).chain(idle.iter().map(|idle| idle::row(idle, pose))).collect();
    let sizes: Vec<f64> = rows.iter().map(|row| constraint::row_unit(row, size)).collect();
    6 - rank_of(&scaled_rows(&rows, &sizes, size))
}

struct Closure {
    rank: usize,
    /// Joint rates that leave the platform at rest.
    passive: usize,
    redundant_legs: Vec<usize>,
    passive_legs: Vec<usize>,
}

/// Loop closures at a pose: for each leg, the twists of its joints add up to the platform's. Unknown are all
/// joint rates and the platform's twist; a rod's rotation is one unknown for all legs that it carries.
fn closure(mech: &Mechanism, pose: &Pose<f64>) -> Closure {
    let size = mech.characteristic_length;
    let legs: Vec<Vec<JointScrew>> = mech.legs.iter().map(|leg| leg_screws(leg, pose)).collect();
    let own: usize = legs.iter().map(Vec::len).sum();
    let columns = mech.rods.len() + own + 6;
    let mut m = DMatrix::zeros(6 * legs.len(), columns);
    let put = |m: &mut DMatrix<f64>, leg: usize, column: usize, screw: &JointScrew| {
        let (linear, angular) = (screw.linear.map(|c| c / size).array(), screw.angular.array());
        for i in 0..3 {
            m[(6 * leg + i, column)] = linear[i];
            m[(6 * leg + 3 + i, column)] = angular[i];
        }
    };
    let mut column = mech.rods.len();
    let mut passive_legs = Vec::new();
    for (i, screws) in legs.iter().enumerate() {
        let first = column;
        for screw in screws {
            put(&mut m, i, column, screw);
            column += 1;
        }
        if rank_of(&m.view((6 * i, first), (6, screws.len())).into_owned()) < screws.len() {
            passive_legs.push(i);
        }
        if let Some(rod) = mech.legs[i].rod {
            put(&mut m, i, rod, &JointScrew::turn(mech.rods[rod].axis, mech.rods[rod].point - pose.o));
        }
        for k in 0..6 {
            m[(6 * i + k, own + mech.rods.len() + k)] = -1.0;
        }
    }
    let joints = own + mech.rods.len();
    let passive = joints - rank_of(&m.columns(0, joints).into_owned());
    // Left null vectors are sets of leg wrenches, each unfelt by its own joints, that cancel on the platform.
    let svd = Svd::of(&m);
    let rank = svd.as_ref().map_or(0, |svd| svd.rank(RANK_TOLERANCE));
    let felt = |row: usize| svd.as_ref().map_or(1.0, |svd| svd.u.row(row).columns(0, rank).norm_squared());
    let redundant_legs =
        (0..legs.len()).filter(|&leg| (0..6).any(|k| 1.0 - felt(6 * leg + k) > 1e-6)).collect();
    Closure { rank, passive, redundant_legs, passive_legs }
}

/// The twist of a unit joint rate, at o.
struct JointScrew {
    linear: Vec3<f64>,
    angular: Vec3<f64>,
}

impl JointScrew {
    /// A rotation about a line through o + point.
    fn turn(axis: Vec3<f64>, point: Vec3<f64>) -> Self {
        JointScrew { linear: point.cross(axis), angular: axis }
    }
}

/// Joint twists of a leg without its rod: base joint, prismatic, platform joint.
fn leg_screws(leg: &Leg, pose: &Pose<f64>) -> Vec<JointScrew> {
    let p = leg::position(leg, pose);
    let n = leg::frame(leg, pose, &p).n();
    let below = leg::foot(leg, &p) - pose.o;
    let Twist { v: linear, omega: angular } = leg.drive.twist(&p);
    let (base, platform) = (leg.base.axis.unwrap_or(n), leg.platform.axis.map_or(n, |a| pose.rotation * a));
    let mut base_turns = leg.base.kind.turns(base, n);
    if leg.rod.is_some() {
        // The rod's own rotation is shared with its other legs; what is left is R about n.
        base_turns.remove(0);
    }
    let mut screws: Vec<JointScrew> = base_turns.into_iter().map(|a| JointScrew::turn(a, below)).collect();
    screws.push(JointScrew { linear, angular });
    screws.extend(leg.platform.kind.turns(platform, n).into_iter().map(|a| JointScrew::turn(a, p.e)));
    screws
}

/// Links and joints as a graph: the base, the platform, rods, cylinders and pistons. A fixed joint makes one
/// link of two.
fn graph(mech: &Mechanism) -> Graph {
    let mut names: Vec<String> = vec!["base".into(), "platform".into()];
    let mut joints: Vec<GraphJoint> = Vec::new();
    let mut rods = Vec::new();
    for rod in &mech.rods {
        rods.push(names.len());
        joints.push(GraphJoint { kind: "R", name: format!("rod {}", rod.name), links: [0, names.len()] });
        names.push(format!("rod {}", rod.name));
    }
    for leg in &mech.legs {
        let mut link = |joint: &Joint, body: usize, name: &str| {
            // A joint F makes one link of two; what a drive below it moves is a link whatever the joint on
            // it.
            if joint.kind.is_fixed() && !leg.drive.moves_foot() {
                return body;
            }
            names.push(format!("{name} {}", leg.name));
            names.len() - 1
        };
        let ground = leg.rod.map_or(0, |rod| rods[rod]);
        let [first, second] = leg.links();
        let (first, second) = (link(&leg.base, 0, first), link(&leg.platform, 1, second));
        let below = leg.base_kind();
        let mut join = |kind: &'static str, place: &str, links| {
            joints.push(GraphJoint { kind, name: format!("{place} {}", leg.name), links });
        };
        let [base_joint, prismatic] = leg.drive.between([ground, first, second]);
        if !below.is_fixed() {
            join(below.letter(), "base joint", base_joint);
        }
        join(leg.drive.kind().letter, "prismatic", prismatic);
        if !leg.platform.kind.is_fixed() {
            join(leg.platform.kind.letter(), "platform joint", [second, 1]);
        }
    }
    let links = names.into_iter().enumerate().map(|(i, name)| {
        let on = joints.iter().enumerate().filter(|(_, j)| j.links.contains(&i)).map(|(k, _)| k);
        GraphLink { joints: on.collect(), name }
    });
    Graph { links: links.collect(), joints }
}

/// The two legs of a rod that carry one constraint together, with its axes in base and platform.
#[must_use]
pub fn coupled_pair(mech: &Mechanism) -> Option<([usize; 2], Vec3<f64>, Vec3<f64>)> {
    mech.rods.iter().enumerate().find_map(|(r, rod)| {
        let on: Vec<usize> = (0..mech.legs.len()).filter(|&i| mech.legs[i].rod == Some(r)).collect();
        let &[first, second] = on.as_slice() else {
            return None;
        };
        let axis = |i: usize| match (mech.legs[i].turning, mech.legs[i].platform.normal()) {
            (Turning::Across(Axes::Base, _), Some(Normal::Across(axis))) => Some(axis),
            _ => None,
        };
        let (a, b) = (axis(first)?, axis(second)?);
        let line = mech.legs[first].platform.point - mech.legs[second].platform.point;
        let parallel = |u: Vec3<f64>, v: Vec3<f64>| u.cross(v).norm() <= 1e-9 * u.norm() * v.norm();
        (parallel(a, b) && parallel(a, line)).then_some(([first, second], rod.axis, a))
    })
}
