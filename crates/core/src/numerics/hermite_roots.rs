//! Zeros of a function known with its derivative at some points, by cubic Hermite interpolation; also pairs
//! of zeros and double zeros between two points of the same sign \[T34\].

use crate::number::order::{by_size, larger, smaller};

/// A function's value and rate at a point. The rate may be NaN where it is not known.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    pub t: f64,
    pub f: f64,
    pub d: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The function changes its sign.
    Crossing,
    /// It comes nearest to zero without a change of sign, as far as the cubics tell.
    Dip,
}

/// Zeros and near misses of the cubics through points in order, with the place of each. Points without a
/// value are passed over.
///
/// Two zeros nearer to each other than `resolution` are one that is touched: rounding makes two of one.
#[must_use]
pub fn events(nodes: &[Node], resolution: f64) -> Vec<(f64, Event)> {
    let known = without_noise(nodes.iter().copied().filter(|n| n.f.is_finite()).collect());
    let mut found: Vec<(f64, Event)> = Vec::new();
    let mut sign_before = 0.0;
    for (i, node) in known.iter().enumerate() {
        let (before, after) = (i.checked_sub(1).map(|j| known[j]), known.get(i + 1));
        let rising = if node.d.is_finite() { node.d } else { 0.0 };
        let sides = match (before, after) {
            // Where it is zero, its rate tells on which side it comes from, or where it comes from as far as
            // is known.
            _ if node.f != 0.0 => [node.f; 2],
            _ if rising != 0.0 => [-rising, rising],
            (_, after) => [sign_before, after.map_or(0.0, |n| n.f)],
        };
        if before.is_some() && sides[0] * sides[1] < 0.0 {
            found.push((node.t, Event::Crossing));
        } else if node.d == 0.0 || node.f == 0.0 {
            found.push((node.t, Event::Dip));
        }
        if sides[1] != 0.0 {
            sign_before = sides[1].signum();
        }
        if let Some(next) = after
            && (node.f != 0.0 || next.f != 0.0 || node.d != 0.0 || next.d != 0.0)
        {
            Cubic::between(node, next).events(&mut found);
        }
    }
    merged(found, resolution)
}

/// Change between two points that is rounding: the function is a pure number of the order of one.
const ROUNDING: f64 = 1e-13;

/// Neighbours that are both zero and do not move away from it lie in a stretch of zeros: what their rates say
/// is rounding.
fn without_noise(mut known: Vec<Node>) -> Vec<Node> {
    for i in 1..known.len() {
        let (a, b) = (known[i - 1], known[i]);
        if a.f == 0.0 && b.f == 0.0 && larger(a.d.abs(), b.d.abs()) * (b.t - a.t) <= ROUNDING {
            known[i - 1].d = 0.0;
            known[i].d = 0.0;
        }
    }
    known
}

/// The function's sign beside a point, on the side of the other: where it is zero there, its rate tells.
fn sign_near(node: &Node, other: &Node) -> f64 {
    if node.f != 0.0 {
        node.f.signum()
    } else if node.d.is_finite() && node.d != 0.0 {
        (node.d * (other.t - node.t)).signum()
    } else {
        other.f.signum()
    }
}

fn merged(found: Vec<(f64, Event)>, resolution: f64) -> Vec<(f64, Event)> {
    let mut result: Vec<(f64, Event)> = Vec::new();
    for (t, event) in found {
        match result.last_mut() {
            Some(last) if t - last.0 <= resolution && (last.1 == event || event == Event::Dip) => {
                // Two changes of sign are none; two dips are one; a dip beside a crossing belongs to it.
                last.1 = if event == Event::Crossing { Event::Dip } else { last.1 };
            }
            Some(last) if t - last.0 <= resolution => *last = (t, Event::Crossing),
            _ => result.push((t, event)),
        }
    }
    result
}

/// The cubic with the values and rates of both its ends, over u in [0, 1].
struct Cubic {
    start: Node,
    width: f64,
    signs: [f64; 2],
    /// Of 1, u, u², u³.
    coefficients: [f64; 4],
}

impl Cubic {
    fn between(a: &Node, b: &Node) -> Self {
        let width = b.t - a.t;
        let chord = b.f - a.f;
        let slope = |d: f64| if d.is_finite() { d * width } else { chord };
        let (p, q) = (slope(a.d), slope(b.d));
        let coefficients = [a.f, p, 3.0 * chord - 2.0 * p - q, p + q - 2.0 * chord];
        Cubic { start: *a, width, signs: [sign_near(a, b), sign_near(b, a)], coefficients }
    }

    fn value(&self, u: f64) -> f64 {
        let [a, b, c, d] = self.coefficients;
        a + u * (b + u * (c + u * d))
    }

    /// Zeros of the derivative, strictly inside, in order.
    fn extremes(&self) -> Vec<f64> {
        let [_, b, c, d] = self.coefficients;
        // b + 2 c u + 3 d u² = 0, each root by the form that does not cancel.
        let root = (c * c - 3.0 * b * d).sqrt();
        let q = -(c + root.copysign(c));
        let mut inside: Vec<f64> =
            [q / (3.0 * d), b / q].into_iter().filter(|u| *u > 0.0 && *u < 1.0).collect();
        inside.sort_by(|&a, &b| by_size(a, b));
        inside
    }

    fn events(&self, found: &mut Vec<(f64, Event)>) {
        let mut places = vec![(0.0, self.signs[0])];
        let extremes = self.extremes();
        places.extend(extremes.iter().map(|&u| (u, self.value(u))));
        places.push((1.0, self.signs[1]));
        for (i, pair) in places.windows(2).enumerate() {
            let [(a, at_a), (b, at_b)] = [pair[0], pair[1]];
            if at_a * at_b < 0.0 {
                found.push((self.place(self.zero(a, b, at_a)), Event::Crossing));
            }
            // An extreme whose neighbours have its sign comes nearest to zero if it bends away from it.
            let is_extreme = i + 2 < places.len();
            if is_extreme && at_b * self.bend(b) > 0.0 && at_b * at_a > 0.0 && at_b * places[i + 2].1 > 0.0 {
                found.push((self.place(b), Event::Dip));
            }
            if is_extreme && at_b == 0.0 {
                let crosses = at_a * places[i + 2].1 < 0.0;
                found.push((self.place(b), if crosses { Event::Crossing } else { Event::Dip }));
            }
        }
    }

    fn bend(&self, u: f64) -> f64 {
        2.0 * self.coefficients[2] + 6.0 * self.coefficients[3] * u
    }

    fn place(&self, u: f64) -> f64 {
        self.start.t + self.width * u
    }

    /// The zero of a piece without extremes inside: halving to the last bit, safe whatever the slope.
    fn zero(&self, mut a: f64, mut b: f64, at_a: f64) -> f64 {
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            if self.value(middle) * at_a > 0.0 {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    }
}

/// Result of a search along a path.
#[derive(Clone, Copy, Debug)]
pub struct FoundRoots {
    /// The first zero, if there is one.
    pub zero: Option<f64>,
    /// End of the search: the reach, or the end of the function's domain.
    pub end: f64,
}

/// Rounds of looking closer at one step before the cubics must have settled.
const ROUNDS: usize = 40;

/// The first zero of a function from 0 on, followed in steps up to `reach`. A dip is a zero where `touches`
/// says so.
pub fn first_zero(
    mut at: impl FnMut(f64) -> Option<Node>,
    mut touches: impl FnMut(f64) -> bool,
    step: f64,
    reach: f64,
) -> FoundRoots {
    let Some(mut from) = at(0.0) else { return FoundRoots { zero: None, end: 0.0 } };
    if touches(0.0) {
        return FoundRoots { zero: Some(0.0), end: 0.0 };
    }
    let mut stride = step;
    while from.t < reach {
        let t = smaller(from.t + stride, reach);
        let Some(to) = at(t) else {
            // The function ends within this step: go on to its end by ever smaller steps.
            stride *= 0.5;
            if stride < 1e-9 * step {
                break;
            }
            continue;
        };
        if let Some(zero) = zero_within(&mut at, &mut touches, from, to) {
            return FoundRoots { zero: Some(zero), end: zero };
        }
        from = to;
    }
    FoundRoots { zero: None, end: from.t }
}

/// The first zero of one step: the function is evaluated where the cubics have events until these stay where
/// they are.
fn zero_within(
    at: &mut impl FnMut(f64) -> Option<Node>,
    touches: &mut impl FnMut(f64) -> bool,
    from: Node,
    to: Node,
) -> Option<f64> {
    let mut nodes = vec![from, to];
    let span = to.t - from.t;
    let precision = Precision {
        crossing: 1e-15 * larger(to.t.abs(), span),
        dip: 1e-6 * span,
        resolution: RESOLUTION * span,
    };
    for _ in 0..ROUNDS {
        let unknown = unsettled(&nodes, &precision);
        if unknown.is_empty() {
            break;
        }
        nodes.extend(unknown.into_iter().filter_map(&mut *at));
        nodes.sort_by(|a, b| by_size(a.t, b.t));
        nodes.dedup_by(|a, b| a.t == b.t);
    }
    let found = events(&nodes, precision.resolution);
    found.into_iter().find(|&(t, event)| event == Event::Crossing || touches(t)).map(|(t, _)| t)
}

/// Share of a step below which two zeros are one.
pub const RESOLUTION: f64 = 1e-4;

/// Tolerances: distance of a node from an event at which it is settled, and distance below which two zeros
/// are one.
#[derive(Clone, Copy, Debug)]
pub struct Precision {
    pub crossing: f64,
    /// An extreme is known less well than a zero, by about the square root of the rounding; its value is
    /// known well.
    pub dip: f64,
    pub resolution: f64,
}

/// Places of the events that no node is near to: where the function must be evaluated next.
#[must_use]
pub fn unsettled(nodes: &[Node], precision: &Precision) -> Vec<f64> {
    let far = |&(t, event): &(f64, Event)| {
        let near = if event == Event::Crossing { precision.crossing } else { precision.dip };
        !nodes.iter().any(|n| (n.t - t).abs() <= near)
    };
    events(nodes, precision.resolution).into_iter().filter(far).map(|(t, _)| t).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function with its derivative, searched from 0 to 10 in steps of one.
    fn search(f: fn(f64) -> f64, d: fn(f64) -> f64) -> Option<f64> {
        let at = |t: f64| Some(Node { t, f: f(t), d: d(t) });
        first_zero(at, |t| f(t).abs() < 1e-11, 1.0, 10.0).zero
    }

    fn near(found: Option<f64>, place: f64) -> bool {
        found.is_some_and(|t| (t - place).abs() < 1e-12)
    }

    /// A touched zero is known less well than a crossed one, by the precision of dips.
    fn touched(found: Option<f64>, place: f64) -> bool {
        found.is_some_and(|t| (t - place).abs() < 2e-6)
    }

    #[test]
    fn single_double_and_touched_zeros_within_a_step_are_found() {
        assert!(near(search(|t| (t - 3.3).sin(), |t| (t - 3.3).cos()), 3.3 - std::f64::consts::PI));
        // Two zeros 0.01 apart between two points of one sign.
        assert!(near(search(|t| (t - 3.4) * (t - 3.41), |t| 2.0 * t - 6.81), 3.4));
        assert!(near(
            search(|t| -(t - 3.4) * (t - 3.41) * t.exp(), |t| -(t * t - 4.81 * t + 4.784) * t.exp()),
            3.4
        ));
        // Zeros that are only touched, also by a function that is no cubic, and at a point of the search.
        assert!(touched(search(|t| (t - 3.4).powi(2), |t| 2.0 * (t - 3.4)), 3.4));
        assert!(touched(search(|t| 1.0 - (t - 3.4).cos(), |t| (t - 3.4).sin()), 3.4));
        assert!(touched(search(|t| (t - 3.0).powi(2), |t| 2.0 * (t - 3.0)), 3.0));
        assert!(touched(search(|t| (t - 3.0).powi(3), |t| 3.0 * (t - 3.0).powi(2)), 3.0));
        assert!(near(search(|t| t - 10.0, |_| 1.0), 10.0) || search(|t| t - 10.0, |_| 1.0).is_none());
        assert_eq!(search(|t| t, |_| 1.0), Some(0.0));
    }

    #[test]
    fn near_misses_are_no_zeros() {
        assert_eq!(search(|t| (t - 3.4).powi(2) + 1e-6, |t| 2.0 * (t - 3.4)), None);
        assert_eq!(search(|t| 1.0 + (7.0 * t).sin() * 0.9, |t| 6.3 * (7.0 * t).cos()), None);
    }

    #[test]
    fn a_search_goes_on_to_the_very_end_of_the_function() {
        let until = |end: f64| move |t: f64| (t <= end).then_some(Node { t, f: t - 3.45, d: 1.0 });
        let short = first_zero(until(3.3), |_| false, 1.0, 10.0);
        assert!(short.zero.is_none() && (short.end - 3.3).abs() < 1e-8);
        let long = first_zero(until(3.46), |_| false, 1.0, 10.0);
        assert!(near(long.zero, 3.45), "the zero in the last broken step: {long:?}");
    }

    #[test]
    fn without_rates_and_across_gaps_changes_of_sign_are_seen() {
        let node = |t: f64, f: f64| Node { t, f, d: f64::NAN };
        let found = events(&[node(0.0, 1.0), node(1.0, f64::NAN), node(2.0, -1.0), node(3.0, -2.0)], 0.0);
        assert_eq!(found, vec![(1.0, Event::Crossing)]);
    }

    #[test]
    fn a_stretch_of_zeros_is_no_crossing_whatever_rounding_says_of_its_rates() {
        let node = |t: f64, f: f64, d: f64| Node { t, f, d };
        let stretch = |end: f64| {
            let zeros = [node(1.0, 0.0, 1e-17), node(2.0, 0.0, -1e-17), node(3.0, 0.0, 1e-17)];
            let all = [&[node(0.0, 1.0, -1.0)][..], &zeros, &[node(4.0, end, end)]].concat();
            events(&all, 0.0).into_iter().filter(|(_, e)| *e == Event::Crossing).collect::<Vec<_>>()
        };
        assert_eq!(stretch(1.0), vec![]);
        assert_eq!(stretch(-1.0), vec![(3.0, Event::Crossing)]);
    }

    #[test]
    fn zeros_that_rounding_parts_are_one_that_is_touched() {
        let node = |t: f64| Node { t, f: (t - 0.5).powi(2) - 1e-16, d: 2.0 * (t - 0.5) };
        let nodes = [node(0.0), node(1.0)];
        let apart: Vec<Event> = events(&nodes, 0.0).into_iter().map(|(_, e)| e).collect();
        assert_eq!(apart, vec![Event::Crossing, Event::Crossing]);
        let [(t, Event::Dip)] = events(&nodes, 1e-6)[..] else { panic!("one touched zero") };
        assert!((t - 0.5).abs() < 1e-7);
    }
}
