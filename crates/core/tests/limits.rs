//! Limits of joints: what they measure and how it moves, for every leg of the catalogue.

mod common;

use common::{mechanisms, moving, published, states};
use std::sync::Arc;

use polypod_core::batch::{self, Loads, States};
use polypod_core::dynamics::inverse_dynamics;
use polypod_core::kinematics::leg;
use polypod_core::kinematics::passive_joints;
use polypod_core::limits::margins::{binding, margins};
use polypod_core::model::joint::JointKind;
use polypod_core::model::limit::Zero;
use polypod_core::model::limit::{Bound, Limit, Measure, Strut};
use polypod_core::model::mechanism::Mechanism;
use polypod_core::model::spec::Axes;
use polypod_core::number::order::larger;
use polypod_core::spatial::distance::Hull;

fn limit(measure: Measure, bound: Bound) -> Limit {
    Limit { name: String::new(), measure, bound, scale: 1.0 }
}

/// The measured quantity of each kind of joint, with what kinematics says of it and of its rate.
fn pairs(mech: &Mechanism, state: &polypod_core::spatial::Motion<f64>) -> Vec<(Measure, [f64; 2])> {
    let mut found = Vec::new();
    for (i, leg) in mech.legs.iter().enumerate() {
        let zero = Zero::of(leg, &mech.home);
        let s = leg::state(leg, state);
        let both = passive_joints::angles(leg, &zero, state, &s);
        found.push((Measure::Length(i), [s.position.coordinate, s.end.rate]));
        for (side, at, joint) in
            [(Axes::Base, &both[0], &leg.base), (Axes::Platform, &both[1], &leg.platform)]
        {
            found.push((Measure::Cone(i, side), [at.cone, f64::NAN]));
            let on_rod = side == Axes::Base && leg.rod.is_some();
            if joint.kind == JointKind::Revolute || on_rod {
                let k = usize::from(on_rod);
                found.push((Measure::Angle(i, side, zero), [at.angles[k], at.rates[k]]));
            }
        }
        for (r, rod) in mech.rods.iter().enumerate().filter(|(_, rod)| rod.leader == i) {
            let angle = passive_joints::rod_angle(mech, r, &zero, s.frame.n());
            found.push((Measure::RodAngle(r, zero), [angle, leg::rod_turn(rod.axis, &s).rate]));
        }
    }
    found
}

#[test]
fn joints_are_measured_as_kinematics_measures_them_and_move_at_their_rates() {
    let mut angles = 0;
    for mech in mechanisms() {
        for state in states(&mech, 4, 5) {
            for (measure, [value, rate]) in pairs(&mech, &state) {
                angles += usize::from(matches!(measure, Measure::Angle(..)));
                let found =
                    limit(measure.clone(), Bound::Least(0.0)).geometric(&mech, &moving(&state)).unwrap();
                assert!((found.x - value).abs() < 1e-12, "{}: {measure:?} {} {value}", mech.name, found.x);
                let off = (found.d - rate).abs();
                assert!(rate.is_nan() || off < 1e-10 * larger(rate.abs(), 1.0), "{}: {measure:?}", mech.name);
            }
        }
    }
    assert!(angles > 50, "the catalogue has revolute joints");
}

#[test]
fn the_margin_of_a_range_is_continuous_around_the_circle() {
    let range = Bound::Between(-0.5, 2.5);
    let expected = [
        (0.0, 0.5),
        (1.0, 1.5),
        (2.5, 0.0),
        (3.0, -0.5),
        (-0.5, 0.0),
        (-0.7, -0.2),
        (8.0, 2.5 + std::f64::consts::TAU - 8.0),
    ];
    for (angle, margin) in expected {
        assert!((range.margin(angle) - margin).abs() < 1e-15, "{angle}");
    }
    let steps = 10_000;
    let at = |i: i32| range.margin(f64::from(i) * std::f64::consts::TAU / f64::from(steps));
    for i in 0..2 * steps {
        assert!((at(i + 1) - at(i)).abs() < 1.001 * std::f64::consts::TAU / f64::from(steps));
    }
}

#[test]
fn strokes_are_all_that_the_published_manipulator_has() {
    let mech = published();
    let names: Vec<&str> = mech.limits.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names.len(), 10);
    assert_eq!(names[..2], ["stroke min of leg 1", "stroke max of leg 1"]);
    let mut found = [0.0; 10];
    margins(&mech, &mech.home, None, &mut found);
    for (i, leg) in mech.legs.iter().enumerate() {
        let length = leg::position(leg, &mech.home).length;
        assert!((found[2 * i] - (length - 0.65)).abs() < 1e-15);
        assert!((found[2 * i + 1] - (0.85 - length)).abs() < 1e-15);
    }
    // Leg 2 is the shortest of the five at home, 744 mm.
    assert_eq!(binding(&mech, &found), Some(2));
    found[7] = -0.01;
    assert_eq!(binding(&mech, &found), Some(7));
    found[0] = f64::NAN;
    assert_eq!(binding(&mech, &found), None);
}

/// The mechanism with a limit of every kind that it can have; some hold and some do not.
fn with_every_limit(mut mech: Mechanism) -> Mechanism {
    let near = |measure: Measure, value: f64| {
        [Bound::Least(value), Bound::Most(value)].map(|b| limit(measure.clone(), b))
    };
    let home = &states(&mech, 1, 9)[0];
    let of_joints: Vec<Limit> = pairs(&mech, home)
        .into_iter()
        .flat_map(|(measure, [value, _])| match measure {
            Measure::Angle(..) | Measure::RodAngle(..) => {
                vec![limit(measure, Bound::Between(value - 0.1, value + 2.0))]
            }
            _ => near(measure, value).into(),
        })
        .collect();
    let strut = |leg: usize, cut: [f64; 2]| Strut { leg, radius: 0.01, cut };
    let mut others = Vec::new();
    for i in 0..mech.legs.len() {
        for j in 0..i {
            let cut = if j == 0 { [0.1, 0.0] } else { [0.0, 0.05] };
            others.push(Measure::Struts([strut(i, cut), strut(j, cut)]));
        }
    }
    let points: Vec<_> = mech.legs.iter().map(|leg| leg.platform.point).collect();
    for points in [&points[..], &points[..3.min(points.len())], &points[..2.min(points.len())]] {
        let hull = Arc::new(Hull::of(points));
        others.extend((0..mech.legs.len()).map(|i| Measure::Plate(strut(i, [0.0, 0.06]), Arc::clone(&hull))));
    }
    others.push(Measure::Conditioning);
    others.extend(mech.actuated().enumerate().map(|(row, (leg, _))| Measure::Force { leg, row }));
    mech.limits = of_joints;
    mech.limits.extend(others.into_iter().flat_map(|measure| near(measure, 0.03)));
    mech
}

/// Relative to one, or to the number: what other rounding in lanes may make of a margin.
const ROUNDING: f64 = 1e-9;

#[test]
fn margins_of_many_poses_are_those_of_each() {
    let mut kinds = std::collections::BTreeSet::new();
    for mech in mechanisms() {
        let mech = with_every_limit(mech);
        kinds.extend(mech.limits.iter().map(Limit::kind));
        let motions = states(&mech, 11, 9);
        let poses: Vec<f64> = motions.iter().flat_map(|s| s.pose.matrix()).collect();
        let twists: Vec<f64> = motions.iter().flat_map(|s| s.twist.array()).collect();
        let accelerations: Vec<f64> = motions.iter().flat_map(|s| s.acceleration.array()).collect();
        let all = States { poses: &poses, twists: &twists, accelerations: &accelerations };
        let table = batch::limits(&mech, &all, &Loads::Own);
        let [together, relative, binds, within] = [0, 1, 2, 3].map(|k| &table.fields[k].data);
        let count = mech.limits.len();
        let mut alone = vec![0.0; count];
        for (i, motion) in motions.iter().enumerate() {
            let load = inverse_dynamics::load_in_base(mech.load.wrench, mech.load.axes, &motion.pose);
            let (forces, _) = inverse_dynamics::inverse_dynamics(&mech, motion, load);
            margins(&mech, &motion.pose, Some(&forces), &mut alone);
            let mut broken = 0;
            for (k, (limit, margin)) in mech.limits.iter().zip(&alone).enumerate() {
                let place = i * count + k;
                let off = (margin - together[place]).abs();
                assert!(off <= ROUNDING * larger(margin.abs(), 1.0), "{}: {limit:?}", mech.name);
                assert_eq!(margin.to_bits(), limit.margin(&mech, &motion.pose, Some(&forces)).to_bits());
                assert_eq!((together[place] / limit.scale).to_bits(), relative[place].to_bits());
                broken += usize::from(!(*margin >= 0.0));
            }
            assert!(table.status[i].stands() && broken > 0 && broken < count);
            assert_eq!(within[i], 0.0);
            let of_block = binding(&mech, &together[i * count..(i + 1) * count]);
            assert_eq!(of_block, Some(binds[i] as usize), "{}", mech.name);
        }
    }
    assert_eq!(kinds.len(), 12, "{kinds:?}");
}
