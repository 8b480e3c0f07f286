//! Sensitivity of pose and constraints, with their rates, to coordinates and geometry.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::kinematics::coordinate_sets::{MAX_COORDINATES, Set, Values};
use crate::kinematics::dependent_coordinates::{Dependent, System, residual};
use crate::model::mechanism::{MAX_CONSTRAINTS, Mechanism};
use crate::number::lanes::Lanes;
use crate::number::real::{Constant, Dual, Jet, Mask, Real, Trig};
use crate::number::work::Work;
use crate::numerics::gauss::solve_all;
use crate::spatial::Vec3;

/// How pose and constraints, with their rates and second rates, vary with one number of the set or of the
/// geometry, the other numbers and all rates kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variation<V> {
    /// Columns of R, then o: values, rates, second rates.
    pub pose: [[Vec3<V>; 4]; 3],
    /// The independent constraints in pure numbers, likewise.
    pub constraints: [System<V>; 3],
}

impl<V: Real> Variation<V> {
    #[inline(always)]
    fn none() -> Self {
        Variation { pose: [[Vec3::zero(); 4]; 3], constraints: [[V::zero(); MAX_CONSTRAINTS]; 3] }
    }

    /// With the number's rate (order 1) or second rate (order 2) instead: `∂x'/∂q' = ∂x/∂q`,
    /// `∂x''/∂q' = 2 ∂x'/∂q`, `∂x''/∂q'' = ∂x/∂q`.
    #[must_use]
    #[inline(always)]
    pub(crate) fn by_rate(&self, order: usize) -> Self {
        let mut rates = Variation::none();
        for from in 0..3 - order {
            let share = if order == 1 && from == 1 { 2.0 } else { 1.0 };
            for k in 0..4 {
                rates.pose[from + order][k] = self.pose[from][k] * V::lit(share);
            }
            for k in 0..MAX_CONSTRAINTS {
                rates.constraints[from + order][k] = self.constraints[from][k].scale(share);
            }
        }
        rates
    }

    /// The sum with so much of another.
    #[must_use]
    #[inline(always)]
    pub(crate) fn and(mut self, other: &Self, share: V) -> Self {
        for order in 0..3 {
            for k in 0..4 {
                self.pose[order][k] = self.pose[order][k] + other.pose[order][k] * share;
            }
            for k in 0..MAX_CONSTRAINTS {
                let sum = self.constraints[order][k];
                self.constraints[order][k] = other.constraints[order][k].mul_add(share, sum);
            }
        }
        self
    }
}

/// Variation of the coordinates' map with a number of the set, or with one of the mechanism.
pub(crate) struct Varying<'a, V> {
    pub mech: &'a Mechanism<Dual<f64>>,
    pub set: &'a Set<Dual<f64>>,
    pub q: &'a Values<Jet<V>>,
    /// The number of the set.
    pub number: Option<usize>,
}

impl<V: Lanes> Work<V> for Varying<'_, V> {
    type Result = Variation<V>;

    #[inline(always)]
    fn run(self) -> Variation<V> {
        let mut q = [Outlined::zero(); MAX_COORDINATES];
        for k in 0..MAX_COORDINATES {
            let (Jet { x, d, dd }, zero) = (self.q[k], V::zero());
            q[k] = Outlined(Jet::new(Dual::new(x, zero), Dual::new(d, zero), Dual::new(dd, zero)));
        }
        if let Some(k) = self.number {
            q[k].0.x.d = V::one();
        }
        let pose = self.set.pose(self.mech, &q);
        let (values, mut all) = (residual(self.mech, &pose), Variation::none());
        let [x, y, z] = pose.rotation.0;
        let vectors = [x, y, z, pose.o];
        for k in 0..4 {
            let Vec3 { x: Outlined(x), y: Outlined(y), z: Outlined(z) } = vectors[k];
            all.pose[0][k] = Vec3::new(x.x.d, y.x.d, z.x.d);
            all.pose[1][k] = Vec3::new(x.d.d, y.d.d, z.d.d);
            all.pose[2][k] = Vec3::new(x.dd.d, y.dd.d, z.dd.d);
        }
        for k in 0..MAX_CONSTRAINTS {
            let Outlined(Jet { x, d, dd }) = values[k];
            (all.constraints[0][k], all.constraints[1][k], all.constraints[2][k]) = (x.d, d.d, dd.d);
        }
        all
    }
}

/// How dependent coordinates, with their rates and second rates, follow whatever varies, so that the
/// constraints are kept \[T56\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImplicitSensitivity<V: Real> {
    dependent: Dependent,
    /// With each dependent number.
    by: [Variation<V>; MAX_CONSTRAINTS],
    /// The inverse of ∂g/∂y, column by column.
    inverse: [System<V>; MAX_CONSTRAINTS],
    /// Its pivot ratio, one where nothing depends.
    pub pivots: V::Value,
}

impl<V: Lanes> ImplicitSensitivity<V> {
    #[inline(always)]
    pub(crate) fn at(
        mech: &Mechanism<Dual<f64>>,
        set: &Set<Dual<f64>>,
        q: &Values<Jet<V>>,
        given: &[bool],
    ) -> Self {
        let dependent = Dependent::of(set, given);
        let mut unit = [[V::zero(); MAX_CONSTRAINTS]; MAX_CONSTRAINTS];
        for k in 0..MAX_CONSTRAINTS {
            unit[k][k] = V::one();
        }
        let (mut matrix, mut by) = (unit, [Variation::none(); MAX_CONSTRAINTS]);
        for (column, &i) in dependent.numbers().iter().enumerate() {
            by[column] = V::apart(Varying { mech, set, q, number: Some(i) });
            for row in 0..mech.independent.len() {
                matrix[row][column] = by[column].constraints[0][row];
            }
        }
        let solved = solve_all(matrix, unit);
        let pivots = if dependent.count == 0 { V::one() } else { solved.pivots };
        ImplicitSensitivity { dependent, by, inverse: solved.x, pivots }
    }

    /// Variation completed by the dependent coordinates, G_y δy = -δg, then by their rates and second rates
    /// in the same way.
    #[must_use]
    #[inline(always)]
    pub(crate) fn with(&self, mut all: Variation<V>) -> Variation<V> {
        for order in 0..3 {
            let mut step = [V::zero(); MAX_CONSTRAINTS];
            for k in 0..MAX_CONSTRAINTS {
                let off = all.constraints[order][k];
                for i in 0..MAX_CONSTRAINTS {
                    step[i] = (-self.inverse[k][i]).mul_add(off, step[i]);
                }
            }
            for k in 0..self.dependent.count {
                all = all.and(&self.by[k].by_rate(order), step[k]);
            }
        }
        all
    }
}

/// The number that it is: rates and second rates along a motion, with a derivative of each.
type Parts<V> = Jet<Dual<V>>;

#[derive(Clone, Copy, Debug)]
struct Outlined<V>(Parts<V>);

/// Functions of one or two numbers that are called.
macro_rules! called {
    ($($work:ident($a:ident, $b:ident) -> $result:ty: $value:expr;)*) => {$(
        struct $work<'a, V>(&'a Parts<V>, &'a Parts<V>);

        impl<V: Lanes> Work<V> for $work<'_, V> {
            type Result = $result;

            #[inline(always)]
            fn run(self) -> $result {
                let $work(&$a, &$b) = self;
                $value
            }
        }
    )*};
}
called! {
    Product(a, b) -> Parts<V>: a * b;
    Quotient(a, b) -> Parts<V>: a / b;
    Root(a, _b) -> Parts<V>: a.sqrt();
    SineAndCosine(a, _b) -> (Parts<V>, Parts<V>): a.sin_cos();
    ArcCosine(a, _b) -> Parts<V>: a.acos();
    Angle(y, x) -> Parts<V>: y.atan2(x);
}

impl<V: Lanes> Add for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Outlined(self.0 + b.0)
    }
}

impl<V: Lanes> Sub for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Outlined(self.0 - b.0)
    }
}

impl<V: Lanes> Mul for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Outlined(V::apart(Product(&self.0, &b.0)))
    }
}

impl<V: Lanes> Div for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Outlined(V::apart(Quotient(&self.0, &b.0)))
    }
}

impl<V: Lanes> Neg for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Outlined(-self.0)
    }
}

impl<V: Lanes> Real for Outlined<V> {
    type Value = V;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Outlined(Jet::lit(x))
    }
    #[inline(always)]
    fn value(self) -> V {
        self.0.value()
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Outlined(V::apart(Root(&self.0, &self.0)))
    }
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        Outlined(self.0.scale(x))
    }
    #[inline(always)]
    fn select(choose: Mask<Self>, a: Self, b: Self) -> Self {
        Outlined(Jet::select(choose, a.0, b.0))
    }
}

impl<V: Lanes> Trig for Outlined<V> {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = V::apart(SineAndCosine(&self.0, &self.0));
        (Outlined(sine), Outlined(cosine))
    }
    #[inline(always)]
    fn acos(self) -> Self {
        Outlined(V::apart(ArcCosine(&self.0, &self.0)))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        Outlined(V::apart(Angle(&self.0, &x.0)))
    }
}

impl<V: Lanes> Constant<Outlined<V>> for Dual<f64> {
    #[inline(always)]
    fn lift(self) -> Outlined<V> {
        Outlined(self.lift())
    }
}
