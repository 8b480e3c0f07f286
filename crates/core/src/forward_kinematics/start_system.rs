//! Start system of the homotopy, in Study's coordinates \[T75\].
//!
//! In Study's coordinates of a pose, `x = (q, p)` with the dual part `p = o q/2Λ`, each equation of
//! [`forward`](crate::forward_kinematics::newton) is homogeneous: of degree two, or four for a rod whose legs
//! are at an angle. Products of as many linear forms have their solutions where one form of each vanishes: on
//! lines that meet Study's quadric `q·p = 0` twice. As such products change into the equations, every regular
//! solution of those is the end of a path.

use crate::forward_kinematics::homotopy::Family;
use crate::forward_kinematics::newton::{LegTarget, System, system};
use crate::forward_kinematics::path_point::{C, PathPoint};
use crate::kinematics::rows::{self, Row};
use crate::model::mechanism::{Constraint, ConstraintKind, Mechanism};
use crate::number::complex::Complex;
use crate::number::lanes::Lanes;
use crate::number::real::Real;
use crate::number::slices::pairs;
use crate::numerics::gauss::solve_all;
use crate::numerics::random::Random;
use crate::spatial::{Mat3, Pose, Vec3};

/// The most forms in a product.
const MOST: usize = 4;

/// A linear form of Study's coordinates.
type Form = [C; 8];

/// Products of linear forms that change into the equations of a mechanism.
#[derive(Clone, Debug)]
pub struct Products<'a> {
    mech: &'a Mechanism,
    asked: [LegTarget<C>; 6],
    /// For each equation, as many as its degree.
    forms: [Vec<Form>; 6],
}

impl<'a> Products<'a> {
    /// Random ones.
    #[must_use]
    pub fn new(mech: &'a Mechanism, asked: [LegTarget<C>; 6], draw: &mut Random) -> Self {
        let degree = |row| match row {
            Row::Leg(_) => 2,
            // An idle spin needs no more than one pose of each orbit, which is a line of Study's coordinates.
            Row::Idle(_) => 1,
            Row::Constraint(c) => degree(c),
        };
        let mut forms: [Vec<Form>; 6] = Default::default();
        for (forms, degree) in forms.iter_mut().zip(rows::of(mech).map(degree)) {
            forms.resize_with(degree, || std::array::from_fn(|_| draw.complex()));
        }
        Products { mech, asked, forms }
    }

    /// All poses where each of the products vanishes.
    #[must_use]
    pub fn solutions(&self) -> Vec<Pose<C>> {
        let degrees = self.forms.each_ref().map(Vec::len);
        let choices = (0..degrees.iter().product()).map(|mut number: usize| {
            degrees.map(|degree| {
                let choice = number % degree;
                number /= degree;
                choice
            })
        });
        choices.flat_map(|choice| self.on_line(&std::array::from_fn(|i| self.forms[i][choice[i]]))).collect()
    }

    /// The two points of Study's quadric where six forms vanish.
    fn on_line(&self, forms: &[Form; 6]) -> [Pose<C>; 2] {
        // Two points of the line, from two more equations: any that are independent of the others will do.
        let mut draw = Random(0x9E37_79B9_7F4A_7C15);
        let mut rows = [[C::zero(); 8]; 8];
        for (i, row) in rows.iter_mut().enumerate() {
            *row = forms.get(i).copied().unwrap_or_else(|| std::array::from_fn(|_| draw.complex()));
        }
        let unit = |k: usize| std::array::from_fn(|i| C::lit(if i == k { 1.0 } else { 0.0 }));
        let [a, b] = solve_all(rows, [unit(6), unit(7)]).x;
        // q·p of a + s b, by powers of s.
        let product = |x: &Form, y: &Form| (0..4).fold(C::zero(), |sum, i| sum + x[i] * y[4 + i]);
        let (constant, linear, square) =
            (product(&a, &a), product(&a, &b) + product(&b, &a), product(&b, &b));
        let root = (linear * linear - (constant * square).scale(4.0)).sqrt();
        [root, -root].map(|root| {
            let s = (root - linear) / square.scale(2.0);
            let x: Form = std::array::from_fn(|i| a[i] + s * b[i]);
            self.pose(&x)
        })
    }

    /// `o = 2Λ p q*/(q·q)`.
    fn pose(&self, x: &Form) -> Pose<C> {
        let [w, i, j, k, a, b, c, d] = *x;
        let (u, v) = (Vec3::new(i, j, k), Vec3::new(b, c, d));
        let square = w * w + u.dot(u);
        let o = (v * w - u * a - v.cross(u)) * (C::lit(2.0 * self.mech.characteristic_length) / square);
        PathPoint { q: [w, i, j, k], o }.pose()
    }

    /// The product of the forms of an equation, a pure number, and its derivative by (v/Λ, ω).
    #[inline(always)]
    fn product<V: Lanes>(
        &self,
        i: usize,
        at: &StudyCoordinates<Complex<V>>,
    ) -> (Complex<V>, [Complex<V>; 6]) {
        let (mut value, mut row) = (Complex::one(), [Complex::zero(); 6]);
        for (count, form) in self.forms[i].iter().enumerate() {
            let (mut factor, mut along) = (Complex::zero(), [Complex::zero(); 6]);
            for (k, c) in form.iter().enumerate() {
                let c = lift(*c);
                factor = factor + c * at.x[k];
                for j in 0..6 {
                    along[j] = along[j] + c * at.changes[j][k];
                }
            }
            // Two forms divided by q·q do not vary with the size of q.
            let share = if count % 2 == 1 { at.share } else { Complex::one() };
            for j in 0..6 {
                row[j] = (row[j] * factor + value * along[j]) * share;
            }
            value = value * factor * share;
        }
        (value, row)
    }
}

impl Family for Products<'_> {
    fn mech(&self) -> &Mechanism {
        self.mech
    }

    fn spins(&self) -> bool {
        false
    }

    #[inline(always)]
    fn at<V: Lanes>(&self, place: &PathPoint<Complex<V>>, t: V) -> (System<Complex<V>>, [Complex<V>; 6]) {
        let mut asked = [LegTarget::none(); 6];
        for (asked, LegTarget { place, square }) in pairs(&mut asked, self.asked) {
            *asked = LegTarget { place: lift(place), square: lift(square) };
        }
        let mut system = system(self.mech, &place.pose(), &asked);
        let coordinates = StudyCoordinates::of(place, self.mech.characteristic_length);
        let (share, rest) = (Complex::new(t, V::zero()), Complex::new(V::one() - t, V::zero()));
        let mut rates = [Complex::zero(); 6];
        for i in 0..6 {
            let (value, row) = self.product(i, &coordinates);
            if self.forms[i].len() == 1 {
                (system.residual[i], system.matrix[i]) = (value, row);
                continue;
            }
            rates[i] = value - system.residual[i];
            system.residual[i] = system.residual[i] * share + value * rest;
            for j in 0..6 {
                system.matrix[i][j] = system.matrix[i][j] * share + row[j] * rest;
            }
        }
        (system, rates)
    }
}

/// Study's coordinates of a pose, and their derivatives by (v/Λ, ω).
struct StudyCoordinates<T> {
    x: [T; 8],
    changes: [[T; 8]; 6],
    /// `1/(q·q)`.
    share: T,
}

impl<T: Real> StudyCoordinates<T> {
    #[inline(always)]
    fn of(place: &PathPoint<T>, length: f64) -> Self {
        let (q, o) = (place.q, place.o.scale(1.0 / length));
        let join = |q: [T; 4], p: [T; 4]| [q[0], q[1], q[2], q[3], p[0], p[1], p[2], p[3]];
        let mut changes = [[T::zero(); 8]; 6];
        for (k, e) in Mat3::identity().0.into_iter().enumerate() {
            let turned = half(e, q);
            changes[k] = join([T::zero(); 4], turned);
            changes[3 + k] = join(turned, half(o, turned));
        }
        let square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        StudyCoordinates { x: join(q, half(o, q)), changes, share: T::one() / square }
    }
}

/// Half the product of the quaternions (0, a) and q.
#[inline(always)]
fn half<T: Real>(a: Vec3<T>, q: [T; 4]) -> [T; 4] {
    let (a, u) = (a.scale(0.5), Vec3::new(q[1], q[2], q[3]));
    let Vec3 { x, y, z } = a * q[0] + a.cross(u);
    [-a.dot(u), x, y, z]
}

#[inline(always)]
fn lift<V: Lanes>(c: C) -> Complex<V> {
    Complex::new(V::lit(c.re), V::lit(c.im))
}

/// Of a constraint in Study's coordinates.
fn degree(c: &Constraint) -> usize {
    let parallel = c.partner.turn.0 == Mat3::identity().0;
    if c.kind == ConstraintKind::E && !parallel { MOST } else { 2 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common;
    use crate::forward_kinematics::newton::FOLD_PIVOTS;
    use crate::number::order::largest;
    use crate::numerics::gauss::solve;

    fn dot(x: &[C], y: &[C]) -> C {
        x.iter().zip(y).fold(C::zero(), |sum, (&a, &b)| sum + a * b)
    }

    fn some_asked(draw: &mut Random) -> [LegTarget<C>; 6] {
        std::array::from_fn(|_| LegTarget { place: draw.complex(), square: draw.complex() })
    }

    #[test]
    fn products_vanish_at_their_solutions_and_there_only_once() {
        let mut draw = Random(7);
        for mech in common::mechanisms() {
            let products = Products::new(&mech, some_asked(&mut draw), &mut draw);
            let solutions = products.solutions();
            let rods = mech.independent.iter().filter(|c| degree(c) == 4).count();
            assert_eq!(solutions.len(), 128 << rods, "{}", mech.name);
            for pose in &solutions {
                let (System { residual, matrix }, _) = products.at(&PathPoint::of(pose), 0.0);
                let sizes = matrix.map(|row| largest(row.iter().map(|c| c.norm())));
                for (f, size) in residual.iter().zip(sizes) {
                    assert!(f.norm() < 1e-10 * size, "{}: {f:?} of {size}", mech.name);
                }
                assert!(solve(matrix, residual).pivots > FOLD_PIVOTS * 1e-3, "{}", mech.name);
            }
        }
    }

    #[test]
    fn matrices_and_rates_are_derivatives() {
        let (mut draw, t, h) = (Random(9), 0.3, 1e-5);
        for mech in common::mechanisms().into_iter().chain([common::pentapod(5, "platform", 3)]) {
            let products = Products::new(&mech, some_asked(&mut draw), &mut draw);
            let place =
                PathPoint { q: std::array::from_fn(|_| draw.complex()), o: draw.vector(Random::complex) };
            let (System { matrix, .. }, rates) = products.at(&place, t);
            let residual = |place: &PathPoint<C>, t: f64| products.at(place, t).0.residual;
            let close = |found: C, after: C, before: C, size: f64| {
                ((after - before).scale(0.5 / h) - found).norm() < 1e-6 * (1.0 + size)
            };
            for j in 0..6 {
                let unit = |h: f64| std::array::from_fn(|i| C::lit(if i == j { h } else { 0.0 }));
                let moved = |h: f64| residual(&(place + place.along(&mech, &unit(h))), t);
                let (after, before) = (moved(h), moved(-h));
                for i in 0..6 {
                    let size = largest(matrix[i].iter().map(|c| c.norm()));
                    // No rotation changes the residual of an idle spin's equation alone.
                    assert!(close(matrix[i][j], after[i], before[i], 10.0 * size), "{}: {i} {j}", mech.name);
                }
            }
            let (after, before) = (residual(&place, t + h), residual(&place, t - h));
            for i in 0..6 {
                assert!(close(-rates[i], after[i], before[i], rates[i].norm()), "{}: {i}", mech.name);
            }
        }
    }

    /// Two points of Study's quadric whose line lies in it.
    fn line_in_the_quadric(draw: &mut Random) -> [Form; 2] {
        let [q, p, turned]: [[C; 4]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| draw.complex()));
        let along = |p: [C; 4], q: [C; 4], share: C| std::array::from_fn::<C, 4, _>(|i| p[i] - q[i] * share);
        let p = along(p, q, dot(&p, &q) / dot(&q, &q));
        // Perpendicular to its own q, and as much along the first one as the other product is.
        let across = along(turned, q, dot(&turned, &q) / dot(&q, &q));
        let other: [C; 4] = std::array::from_fn(|_| draw.complex());
        let mut second = along(other, across, dot(&other, &across) / dot(&across, &across));
        let share = (dot(&across, &p) + dot(&q, &second)) / dot(&q, &q);
        second = along(second, q, share);
        let join = |q: [C; 4], p: [C; 4]| std::array::from_fn(|i| if i < 4 { q[i] } else { p[i - 4] });
        [join(q, p), join(across, second)]
    }

    #[test]
    fn equations_have_their_degree_in_studys_coordinates() {
        let mut draw = Random(11);
        for mech in common::mechanisms() {
            let asked = some_asked(&mut draw);
            let products = Products::new(&mech, asked, &mut draw);
            let [a, b] = line_in_the_quadric(&mut draw);
            let equations = |s: f64| {
                let x: Form = std::array::from_fn(|i| a[i] + b[i].scale(s));
                assert!(dot(&x[..4], &x[4..]).norm() < 1e-13);
                let square = dot(&x[..4], &x[..4]);
                let residual = system(&mech, &products.pose(&x), &asked).residual;
                let times = |i: usize| if products.forms[i].len() == MOST { square * square } else { square };
                std::array::from_fn::<C, 6, _>(|i| residual[i] * times(i))
            };
            for i in 0..6 {
                // The difference of the next order vanishes, that of the degree does not.
                let degree = products.forms[i].len();
                let mut values: Vec<C> = (0..=degree + 1).map(|s| equations(s as f64)[i]).collect();
                let size = largest(values.iter().map(|v| v.norm()));
                for _ in 0..degree {
                    values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
                }
                assert!(values[0].norm() > 1e-6 * size, "{}: equation {i}", mech.name);
                let rest = values[1] - values[0];
                assert!(rest.norm() < 1e-11 * size, "{}: equation {i} {rest:?} of {size}", mech.name);
            }
        }
    }
}
