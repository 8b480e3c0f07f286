//! Distances between struts, and between a strut and the platform: of segments, and of a segment and a convex
//! body \[T37\]. All are exact, also for parallel, crossing and vanishing segments.

use crate::number::order::largest;
use crate::number::real::{Constant, Ordered, Real};
use crate::spatial::vector::Vec3;

/// From its first point to its second.
#[derive(Clone, Copy, Debug)]
pub struct Segment<T>(pub Vec3<T>, pub Vec3<T>);

impl<T: Real> Segment<T> {
    #[inline(always)]
    fn vector(&self) -> Vec3<T> {
        self.1 - self.0
    }

    /// The point at the share `t` of the way.
    #[inline(always)]
    fn at(&self, t: T) -> Vec3<T> {
        self.0 + self.vector() * t
    }

    /// The segment shortened by `start` and `end` of its length, at most half of it each.
    #[must_use]
    #[inline(always)]
    pub fn without(&self, [start, end]: [f64; 2]) -> Self {
        if start == 0.0 && end == 0.0 {
            return *self;
        }
        let length = self.vector().norm();
        let [start, end] = [share(T::lit(start), length), share(T::lit(end), length)];
        let half = T::lit(0.5);
        Segment(self.at(least(start, half)), self.at(T::one() - least(end, half)))
    }
}

/// The lesser one; the first if they cannot be compared.
#[inline(always)]
fn least<T: Real>(a: T, b: T) -> T {
    T::select(a.value().greater(b.value()), b, a)
}

/// A number brought within [0, 1].
#[inline(always)]
fn within<T: Real>(t: T) -> T {
    least(T::select(T::Value::zero().greater(t.value()), T::zero(), t), T::one())
}

/// A quotient as a share of a segment: within [0, 1], 0 for 0/0.
#[inline(always)]
fn share<T: Real>(numerator: T, denominator: T) -> T {
    let positive = denominator.value().greater(T::Value::zero());
    within(T::select(positive, numerator / denominator, T::zero()))
}

#[inline(always)]
fn square<T: Real>(a: Vec3<T>) -> T {
    a.dot(a)
}

/// A segment with what every distance from it needs.
#[derive(Clone, Copy, Debug)]
struct Line<T> {
    ends: [Vec3<T>; 2],
    vector: Vec3<T>,
    square: T,
    /// 1 / `square`, zero for a segment that vanishes.
    inverse: T,
}

impl<T: Real> Line<T> {
    #[inline(always)]
    fn of(s: &Segment<T>) -> Self {
        let vector = s.vector();
        let square = square(vector);
        let lasts = square.value().greater(T::Value::lit(f64::MIN_POSITIVE));
        let inverse = T::select(lasts, T::one() / square, T::zero());
        Line { ends: [s.0, s.1], vector, square, inverse }
    }

    #[inline(always)]
    fn lift(line: &Line<f64>) -> Self {
        let Line { ends: [start, end], vector, square, inverse } = *line;
        Line {
            ends: [Vec3::lift(start), Vec3::lift(end)],
            vector: Vec3::lift(vector),
            square: square.lift(),
            inverse: inverse.lift(),
        }
    }

    #[inline(always)]
    fn at(&self, t: T) -> Vec3<T> {
        self.ends[0] + self.vector * t
    }

    /// Squared distance of a point.
    #[inline(always)]
    fn to_point(self, p: Vec3<T>) -> T {
        square(p - self.at(within((p - self.ends[0]).dot(self.vector) * self.inverse)))
    }
}

/// Squared distance from the first segment to the point of the second that is nearest to its line, brought to
/// its ends.
#[inline(always)]
fn across<T: Real>(a: &Line<T>, b: &Line<T>) -> T {
    let (u, v, w) = (a.vector, b.vector, a.ends[0] - b.ends[0]);
    let (uu, uv, vv) = (a.square, u.dot(v), b.square);
    let inside = share(uv * v.dot(w) - vv * u.dot(w), uu * vv - uv * uv);
    b.to_point(a.at(inside))
}

/// Squared distance between two segments.
///
/// The squared distance is a convex function on a square of shares (s, t): its minimum is inside, where both
/// of its derivatives vanish, or at an edge, which is an end of one segment against the other. For parallel
/// segments the inner point is not determined, but then an edge is as low; any point of the square will do as
/// a candidate.
#[inline(always)]
fn squared_distance<T: Real>(a: &Line<T>, b: &Line<T>) -> T {
    let from_a = least(b.to_point(a.ends[0]), b.to_point(a.ends[1]));
    let from_b = least(a.to_point(b.ends[0]), a.to_point(b.ends[1]));
    least(least(from_a, from_b), across(a, b))
}

/// Distance between two segments \[T37\].
#[inline(always)]
pub fn distance<T: Real>(a: &Segment<T>, b: &Segment<T>) -> T {
    squared_distance(&Line::of(a), &Line::of(b)).sqrt()
}

/// Relative to the size of the body: what counts as one point, one line, one plane.
const POINT_TOLERANCE: f64 = 1e-9;
const LINE_TOLERANCE: f64 = 1e-6;

/// A convex polygon; of a line or a point its corners are the ends.
#[derive(Clone, Debug)]
struct Facet {
    /// In order about the normal.
    corners: Vec<Vec3<f64>>,
    /// From each corner to the next.
    edges: Vec<Line<f64>>,
    /// In the plane, perpendicular to the edge from each corner to the next, inwards.
    inward: Vec<Vec3<f64>>,
    /// Unit vector, out of the body; zero for a line or a point.
    normal: Vec3<f64>,
}

impl Facet {
    fn new(corners: Vec<Vec3<f64>>, normal: Vec3<f64>) -> Self {
        let next = corners.iter().cycle().skip(1);
        let edges: Vec<_> = corners.iter().zip(next).map(|(a, b)| Line::of(&Segment(*a, *b))).collect();
        let inward = edges.iter().map(|edge| normal.cross(edge.vector)).collect();
        Facet { corners, edges, inward, normal }
    }

    fn is_polygon(&self) -> bool {
        self.corners.len() > 2
    }

    #[inline(always)]
    fn height<T: Real>(&self, p: Vec3<T>) -> T {
        Vec3::lift(self.normal).dot(p - Vec3::lift(self.corners[0]))
    }

    /// How far within the nearest side of a polygon the point's foot in the plane is, negative outside; in a
    /// unit of each side's own.
    #[inline(always)]
    fn depth<T: Real>(&self, p: Vec3<T>) -> T::Value {
        let mut depth = T::Value::lit(f64::INFINITY);
        for k in 0..self.corners.len() {
            let inside = Vec3::lift(self.inward[k]).dot(p - Vec3::lift(self.corners[k]));
            depth = depth.least(inside.value());
        }
        depth
    }

    /// The first number where the point is over the polygon, else the second.
    #[inline(always)]
    fn over<T: Real>(&self, p: Vec3<T>, a: T, b: T) -> T {
        T::select(T::Value::zero().at_most(self.depth(p)), a, b)
    }

    #[inline(always)]
    fn squared_distance<T: Real>(&self, s: &Line<T>) -> T {
        let mut result = T::lit(f64::INFINITY);
        for edge in &self.edges {
            let edge = Line::lift(edge);
            let ends = least(edge.to_point(s.ends[0]), edge.to_point(s.ends[1]));
            // The end of the edge is the start of another.
            result = least(least(result, s.to_point(edge.ends[0])), least(ends, across(s, &edge)));
        }
        if !self.is_polygon() {
            return result;
        }
        let [h0, h1] = [self.height(s.ends[0]), self.height(s.ends[1])];
        result = self.over(s.ends[0], least(result, h0 * h0), result);
        result = self.over(s.ends[1], least(result, h1 * h1), result);
        // Ends on both sides of the plane: the segment may pierce the polygon.
        let pierced = self.over(s.at(h0 / (h0 - h1)), T::zero(), result);
        T::select(T::Value::zero().greater(h0.value() * h1.value()), pierced, result)
    }
}

/// The convex hull of points: a solid, or a flat plate where they lie in a plane.
#[derive(Clone, Debug)]
pub struct Hull(Vec<Facet>);

impl Hull {
    /// The hull of at least one point.
    #[must_use]
    pub fn of(points: &[Vec3<f64>]) -> Self {
        let size = largest(points.iter().map(|p| (*p - points[0]).norm()));
        let mut corners: Vec<Vec3<f64>> = Vec::new();
        for p in points {
            if corners.iter().all(|c| (*c - *p).norm() > POINT_TOLERANCE * size) {
                corners.push(*p);
            }
        }
        let planes = planes(&corners, size);
        if planes.is_empty() {
            return Hull(vec![Facet::new(ends(&corners), Vec3::zero())]);
        }
        Hull(planes.into_iter().map(|(on, normal)| Facet::new(outline(&on, normal, size), normal)).collect())
    }

    /// Distance of a segment from the body, zero where they meet \[T37\].
    #[must_use]
    #[inline(always)]
    pub fn distance<T: Real>(&self, s: &Segment<T>) -> T {
        let line = Line::of(s);
        let mut nearest = T::lit(f64::INFINITY);
        for facet in &self.0 {
            nearest = least(nearest, facet.squared_distance(&line));
        }
        let nearest = nearest.sqrt();
        if self.0.len() == 1 {
            return nearest;
        }
        // Within a solid is what no facet has below it.
        let mut height = T::Value::lit(f64::NEG_INFINITY);
        for facet in &self.0 {
            height = height.most(facet.height(s.0).value());
        }
        T::select(height.at_most(T::Value::zero()), T::zero(), nearest)
    }
}

/// The planes that have all points on one side: the points in each, and its normal away from the others.
fn planes(points: &[Vec3<f64>], size: f64) -> Vec<(Vec<Vec3<f64>>, Vec3<f64>)> {
    let flat = POINT_TOLERANCE * size;
    let mut found: Vec<(Vec<Vec3<f64>>, Vec3<f64>)> = Vec::new();
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points.iter().enumerate().skip(i + 1) {
            for c in &points[j + 1..] {
                let normal = (*b - *a).cross(*c - *a);
                if normal.norm() <= LINE_TOLERANCE * size * size {
                    continue;
                }
                let normal = normal.unit();
                let heights: Vec<f64> = points.iter().map(|p| normal.dot(*p - *a)).collect();
                let (below, above) = (heights.iter().any(|h| *h < -flat), heights.iter().any(|h| *h > flat));
                let on: Vec<Vec3<f64>> =
                    points.iter().zip(&heights).filter(|(_, h)| h.abs() <= flat).map(|(p, _)| *p).collect();
                if !(below && above) && found.iter().all(|(other, _)| *other != on) {
                    found.push((on, if above { -normal } else { normal }));
                }
            }
        }
    }
    found
}

/// The corners of the convex hull of points in a plane, in order about its normal.
fn outline(points: &[Vec3<f64>], normal: Vec3<f64>, size: f64) -> Vec<Vec3<f64>> {
    let flat = POINT_TOLERANCE * size * size;
    // The point farthest from any other is a corner.
    let first = farthest(points, points[0]);
    let mut corners = vec![first];
    while corners.len() <= points.len() {
        let last = corners[corners.len() - 1];
        // Next is the point that has all others on its left, the farthest of those in line.
        let next = points.iter().filter(|p| **p != last).fold(None, |best: Option<Vec3<f64>>, p| {
            let Some(b) = best else { return Some(*p) };
            let left = normal.dot((b - last).cross(*p - last));
            let beyond = left.abs() <= flat && (*p - last).norm() > (b - last).norm();
            Some(if left < -flat || beyond { *p } else { b })
        });
        match next {
            Some(p) if p != first => corners.push(p),
            _ => break,
        }
    }
    corners
}

fn farthest(points: &[Vec3<f64>], from: Vec3<f64>) -> Vec3<f64> {
    let better = |a: Vec3<f64>, b: &Vec3<f64>| if (*b - from).norm() > (a - from).norm() { *b } else { a };
    points.iter().fold(points[0], better)
}

/// The ends of points on one line: two, or one.
fn ends(points: &[Vec3<f64>]) -> Vec<Vec3<f64>> {
    let first = farthest(points, points[0]);
    let last = farthest(points, first);
    if first == last { vec![first] } else { vec![first, last] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::order::smaller;
    use crate::number::real::Dual;

    fn v(x: f64, y: f64, z: f64) -> Vec3<f64> {
        Vec3::new(x, y, z)
    }

    /// The least distance from a segment over a fine grid of its points, each to the nearest of what `to`
    /// gives.
    fn by_search(s: &Segment<f64>, to: impl Fn(Vec3<f64>) -> f64) -> f64 {
        (0..=4000).map(|i| to(s.at(f64::from(i) / 4000.0))).fold(f64::INFINITY, smaller)
    }

    #[test]
    fn segments_that_cross_run_parallel_or_vanish() {
        let (o, x, y, z) = (Vec3::zero(), Vec3::X, Vec3::Y, Vec3::Z);
        for (a, b, expected) in [
            (Segment(-x, x), Segment(z - y, z + y), 1.0), // inside both
            (Segment(-x, x), Segment(-y, y), 0.0),        // they cross
            (Segment(o, x), Segment(y, y + x), 1.0),      // parallel, side by side
            (Segment(o, x), Segment(y + x * 3.0, y + x * 2.0), 2_f64.sqrt()), // parallel, one beyond the other
            (Segment(o, x * 2.0), Segment(x, x * 3.0), 0.0),                  // on one line, overlapping
            (Segment(o, x), Segment(x * 3.0, x * 2.0), 1.0),                  // on one line, apart
            (Segment(o, o), Segment(y - x, y + x), 1.0),                      // a point and a segment
            (Segment(o, o), Segment(z, z), 1.0),                              // two points
            (Segment(o, x), Segment(x * 2.0 + y, x * 2.0 + y * 5.0), 2_f64.sqrt()), // end to end
        ] {
            assert!((distance(&a, &b) - expected).abs() < 1e-15, "{a:?} {b:?}");
            assert!((distance(&b, &a) - expected).abs() < 1e-15, "{b:?} {a:?}");
        }
    }

    #[test]
    fn nearly_parallel_segments_keep_their_accuracy() {
        // Crossing at the height h: the answer is h however small the angle between them.
        for angle in [1e-2_f64, 1e-4, 1e-6, 1e-7, 1e-8, 1e-10, 1e-13, 0.0] {
            for h in [0.3, 1e-3, 0.0] {
                let turned = v(angle.cos(), angle.sin(), 0.0);
                let b = Segment(v(0.1, 0.0, h) - turned, v(0.1, 0.0, h) + turned * 0.7);
                let found = distance(&Segment(-Vec3::X, Vec3::X), &b);
                // Where rounding hides the crossing, an end is within the angle of the other segment.
                assert!((found - h).abs() < 1e-15 + smaller(1e-8, angle), "{angle} {h}: {found}");
            }
        }
    }

    #[test]
    fn a_cut_takes_at_most_half_from_each_end() {
        let s = Segment(Vec3::zero(), Vec3::X);
        let Segment(a, b) = s.without([0.2, 0.1]);
        assert!((a - Vec3::X * 0.2).norm() < 1e-16 && (b - Vec3::X * 0.9).norm() < 1e-15);
        let Segment(a, b) = s.without([0.7, 0.7]);
        assert!((a - Vec3::X * 0.5).norm() == 0.0 && (b - a).norm() == 0.0);
        let Segment(a, b) = s.without([0.0, 3.0]);
        assert!(a == Vec3::zero() && b == Vec3::X * 0.5);
    }

    /// The cube [0, 1]³ with its middle and a point of a face and of an edge, which are no corners.
    fn cube() -> Hull {
        let mut points = vec![v(0.5, 0.5, 0.5), v(0.5, 0.3, 0.0), v(1.0, 0.4, 1.0)];
        for i in 0..8 {
            points.push(v(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)));
        }
        Hull::of(&points)
    }

    #[test]
    fn a_solid_has_its_facets_and_corners_only() {
        let Hull(facets) = cube();
        assert_eq!(facets.len(), 6);
        assert!(facets.iter().all(|f| f.corners.len() == 4 && f.height(v(0.5, 0.5, 0.5)) < -0.49));
        assert!(facets.iter().all(|f| f.depth(v(0.5, 0.5, 0.5)) > 0.0));
    }

    #[test]
    fn distance_from_a_solid_is_that_of_the_nearest_point() {
        let to_cube = |p: Vec3<f64>| {
            (p - p.map(|x| x.clamp(0.0, 1.0))).norm() // the point of the cube next to p
        };
        let cube = cube();
        let ends =
            [v(0.4, 0.3, 2.0), v(1.5, 1.6, 1.7), v(2.0, 0.5, 0.5), v(-0.7, 1.2, 0.1), v(0.5, 0.5, 0.4)];
        for a in ends {
            for b in ends {
                let s = Segment(a, b);
                assert!((cube.distance(&s) - by_search(&s, to_cube)).abs() < 1e-3, "{s:?}");
            }
        }
        assert_eq!(cube.distance(&Segment(v(0.4, 0.4, 0.4), v(0.6, 0.6, 0.5))), 0.0, "inside");
    }

    #[test]
    fn plates_lines_and_points_are_bodies_too() {
        let plate = Hull::of(&[
            v(0.0, 0.0, 1.0),
            v(2.0, 0.0, 1.0),
            v(2.0, 1.0, 1.0),
            v(0.0, 1.0, 1.0),
            v(1.0, 0.5, 1.0),
        ]);
        assert_eq!(plate.0[0].corners.len(), 4);
        assert_eq!(plate.distance(&Segment(v(1.0, 0.5, 0.0), v(1.2, 0.6, 0.7))), 1.0 - 0.7, "below");
        assert_eq!(plate.distance(&Segment(v(1.0, 0.5, 0.0), v(1.2, 0.6, 2.0))), 0.0, "through it");
        assert_eq!(plate.distance(&Segment(v(3.0, 0.5, 0.0), v(3.0, 0.6, 2.0))), 1.0, "beside it");
        let line = Hull::of(&[v(0.0, 0.0, 0.0), v(1.0, 1.0, 0.0), v(3.0, 3.0, 0.0)]);
        assert!((line.distance(&Segment(v(2.0, 2.0, 1.0), v(2.0, 2.0, 4.0))) - 1.0).abs() < 1e-15);
        let point = Hull::of(&[v(0.0, 0.0, 2.0), v(0.0, 0.0, 2.0)]);
        assert_eq!(point.distance(&Segment(-Vec3::X, Vec3::X)), 2.0);
    }

    #[test]
    fn derivatives_are_those_of_the_distance() {
        let lift = |p: Vec3<f64>, d: Vec3<f64>| {
            Vec3::new(Dual::new(p.x, d.x), Dual::new(p.y, d.y), Dual::new(p.z, d.z))
        };
        let (a, b, d) = (v(0.4, 0.3, 2.0), v(1.5, 1.6, 1.7), v(0.3, -0.2, 0.9));
        let cube = cube();
        let at = |t: f64| cube.distance(&Segment(a, b + d * t));
        let rate = cube.distance(&Segment(lift(a, Vec3::zero()), lift(b, d))).d;
        assert!(((at(1e-6) - at(-1e-6)) / 2e-6 - rate).abs() < 1e-8);
    }
}
