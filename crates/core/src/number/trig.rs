//! Sine, cosine, arc cosine and the angle of a point, from the operations of [`Ordered`] alone.
//!
//! One source for single numbers and for lanes: no branch, no table, and nothing that could be fused, so that
//! an angle is the same bits on every width and every platform. The polynomials are minimax fits of the
//! relative error (Remez), with the coefficients rounded to doubles from the lowest power on; the error of
//! each fit is given with it.

// Digits that name one double are not for reading.
#![allow(clippy::unreadable_literal)]

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};

use crate::number::real::{Ordered, Real, Trig};

/// π = `PI (1 + PI_REST)`.
const PI_REST: f64 = 3.8981718325193755e-17;

/// π/2 in three parts. The first two have 36 and 33 digits, so that their products with n < 2^17 are exact.
const HALF_PI: [f64; 3] = [1.5707963267923333, 2.563344151689835e-12, -9.531611933980011e-23];

/// Sizes from which on neighbouring doubles are half a radian apart: an angle that large says nothing.
const LARGEST: f64 = (1_u64 << 51) as f64;

/// `sin r = r - r z P(z)`, z = r², |r| ≤ π/4: to 2^-57.8.
const SIN: [f64; 6] = [
    0.1666666666666663,
    -0.00833333333332184,
    0.00019841269829358888,
    -2.7557313537356746e-06,
    2.5050733884216663e-08,
    -1.5895382534736776e-10,
];

/// `cos r = 1 - z/2 + z² P(z)`, z = r², |r| ≤ π/4: to 2^-63.9.
const COS: [f64; 6] = [
    0.041666666666666595,
    -0.0013888888888873316,
    2.48015872889744e-05,
    -2.7557314206531533e-07,
    2.0875703693706085e-09,
    -1.13586492610742e-11,
];

/// `atan t = t + t z P(z)`, z = t², |t| ≤ 3/8: to 2^-57.5.
const ATAN: [f64; 10] = [
    -0.3333333333333283,
    0.19999999999824825,
    -0.1428571426451664,
    0.11111109839041394,
    -0.09090865106380368,
    0.07691362781706848,
    -0.06653592198946655,
    0.05764896405200572,
    -0.04591058956676155,
    0.024416971504184443,
];

/// atan 1/2 as a multiple of 2^-51, and the rest.
const ATAN_HALF: [f64; 2] = [0.46364760900080615, -3.281237377829614e-17];

/// 2^200: points farther out than this are brought nearer before coordinates are added, all others moved
/// away.
const FAR: f64 = (1_u128 << 100) as f64 * (1_u128 << 100) as f64;

/// 2^-1000, less than the rounding of any coordinate so moved but zero: it makes 0/0 a zero.
const NOTHING: f64 = 1.0 / (FAR * FAR * FAR * FAR * FAR);

/// `asin s = s + s z P(z)`, z = s², |s| ≤ 1/2: to 2^-59.5.
const ASIN: [f64; 13] = [
    0.1666666666666676,
    0.07499999999970866,
    0.044642857174561686,
    0.030381942709790888,
    0.022372214939042324,
    0.017351612775719383,
    0.013980812586796823,
    0.0113989678241329,
    0.010779997914209197,
    0.003707138240753696,
    0.021706289533485714,
    -0.02099836693232398,
    0.03262881823998464,
];

/// Sine and cosine of an angle in radians.
///
/// Within 1 ulp for |x| up to 1e5, beyond that those of an angle within |x| 2^-53 of it; NaN from 2^51 on,
/// where the double itself is no nearer to the angle than a quarter of a radian.
#[inline(always)]
pub fn sin_cos<T: Ordered>(x: T) -> (T, T) {
    let one = T::one();
    let x = T::select(T::lit(LARGEST).greater(x.abs()), x, T::lit(f64::NAN));

    // x = n π/2 + r - low. The first difference is exact, so is the rounding of the second that goes into the
    // rest.
    let n = nearest(x.scale(FRAC_2_PI));
    let first = x - n.scale(HALF_PI[0]);
    let second = n.scale(HALF_PI[1]);
    let near = first - second;
    let rest = (second - (first - near)) + n.scale(HALF_PI[2]);
    let r = near - rest;
    let low = rest - (near - r);

    let z = r * r;
    let half = z.scale(0.5);
    let sin = r - (low * (one - half) + r * z * polynomial(z, SIN));
    let top = one - half;
    let cos = top + (((one - top) - half) + (z * z * polynomial(z, COS) + low * r));

    // The quarter turn, of -2, -1, 0, 1, 2.
    let quarter = n - nearest(n.scale(0.25)).scale(4.0);
    let odd = T::lit(0.5).greater((quarter.abs() - one).abs());
    let below = (quarter - T::lit(0.5)).abs().greater(one);
    let left = (quarter + T::lit(0.5)).abs().greater(one);
    let (s, c) = (T::select(odd, cos, sin), T::select(odd, sin, cos));
    (T::select(below, -s, s), T::select(left, -c, c))
}

/// The angle of the point `(x, y)`, in [-π, π], within 1.6 ulp.
///
/// Signs of zeros count as in IEEE 754, and so does one infinite coordinate; NaN where both are infinite.
#[inline(always)]
pub fn atan2<T: Ordered>(y: T, x: T) -> T {
    let zero = T::zero();

    // The slope in the octant next to the x axis: short / long, neither so large nor so small that digits are
    // lost.
    let (a, b) = (y.abs(), x.abs());
    let steep = a.greater(b);
    let (short, long) = (T::select(steep, b, a), T::select(steep, a, b));
    let unit = T::select(long.greater(T::lit(FAR)), T::lit(1.0 / FAR), T::lit(FAR));
    let (short, long) = (short * unit, long * unit);

    // The angle from that of the slope 0, 1/2 or 1, by the slope t that the point has seen from there.
    let thrice = long.scale(3.0);
    let middle = short.scale(8.0).greater(thrice);
    let high = short.scale(4.0).greater(thrice);
    let of = |first: f64, second: f64, third: f64| {
        T::select(high, T::lit(third), T::select(middle, T::lit(second), T::lit(first)))
    };
    let weight = of(1.0, 2.0, 1.0);
    let across = weight * short - T::select(middle, long, zero);
    let along = weight * long + T::select(middle, short, zero);
    let t = across / (along + T::lit(NOTHING));
    let z = t * t;
    let turn = t + t * (z * polynomial(z, ATAN));
    let from = of(0.0, ATAN_HALF[0], FRAC_PI_4);
    let from_rest = of(0.0, ATAN_HALF[1], FRAC_PI_4 * PI_REST);

    // The octant: a multiple of π/2, and the angle from there to one side or the other. Both it and `from`
    // are multiples of 2^-51, so that their sum is exact.
    let forward = x.signum();
    let back = zero.greater(forward);
    let axis = T::select(steep, T::lit(FRAC_PI_2), T::select(back, T::lit(PI), zero));
    let sense = T::select(steep, -forward, forward);
    let angle = (axis + sense * from) + (sense * (turn + from_rest) + axis.scale(PI_REST));
    angle * y.signum()
}

/// The angle in [0, π] whose cosine is `x`, NaN beyond ±1. Within 1.5 ulp.
#[inline(always)]
pub fn acos<T: Ordered>(x: T) -> T {
    // acos x = π/2 - asin x; near the ends, where that cancels, acos |x| = 2 asin √((1 - |x|)/2).
    let size = x.abs();
    let end = size.greater(T::lit(0.5));
    let z = T::select(end, (T::one() - size).scale(0.5), x * x);
    let s = T::select(end, z.sqrt(), size);
    let asin = s + s * (z * polynomial(z, ASIN));

    let sign = x.signum();
    let side = T::select(T::zero().greater(x), T::lit(PI), T::zero());
    let axis = T::select(end, side, T::lit(FRAC_PI_2));
    let times = sign * T::select(end, T::lit(2.0), T::lit(-1.0));
    axis + (times * asin + axis.scale(PI_REST))
}

/// The nearest integer of a number below 2^51.
#[inline(always)]
fn nearest<T: Real>(x: T) -> T {
    // Numbers of this size have no digits after the point.
    let integers = T::lit(1.5 * (1_u64 << 52) as f64);
    (x + integers) - integers
}

/// `c_0 + c_1 z + c_2 z² + ...`. Even and odd powers are summed apart, which halves the wait for one another.
#[inline(always)]
fn polynomial<T: Real, const N: usize>(z: T, c: [f64; N]) -> T {
    let square = z * z;
    let (mut odd, mut even) = (T::lit(c[N - 1]), T::lit(c[N - 2]));
    for k in (0..N - 2).rev() {
        (odd, even) = (even, odd * square + T::lit(c[k]));
    }
    even + z * odd
}

impl Trig for f64 {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }
    #[inline(always)]
    fn acos(self) -> Self {
        acos(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        atan2(self, x)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::number::lanes::tests::on_each_width;
    use crate::number::lanes::{Lanes, Task};
    use crate::numerics::random::Random;

    const MANY: usize = 200_000;

    /// How many doubles from one number to the other.
    fn ulps(a: f64, b: f64) -> u64 {
        let place = |x: f64| if x < 0.0 { -((-x).to_bits() as i64) } else { x.to_bits() as i64 };
        if a.is_nan() || b.is_nan() {
            u64::from(a.is_nan() != b.is_nan()) << 63
        } else {
            place(a).abs_diff(place(b))
        }
    }

    /// No farther from the standard library, itself at 0.5 to 1 ulp, than a number of doubles.
    fn near(what: &str, at: [f64; 2], ours: f64, known: f64, bound: u64) {
        assert!(ulps(ours, known) <= bound, "{what} at {at:?}: {ours:e}, not {known:e}");
    }

    fn check_sin_cos(x: f64) {
        let (s, c) = sin_cos(x);
        near("sin", [x, 0.0], s, x.sin(), 1);
        near("cos", [x, 0.0], c, x.cos(), 1);
    }

    fn check_atan2(y: f64, x: f64) {
        near("atan2", [y, x], atan2(y, x), y.atan2(x), 2);
    }

    fn check_acos(x: f64) {
        near("acos", [x, 0.0], acos(x), x.acos(), 2);
    }

    /// Both signs of numbers of every size.
    fn any_size(draw: &mut Random) -> f64 {
        draw.number() * (draw.number() * 1000.0).round().exp2()
    }

    #[test]
    fn angles_up_to_a_hundred_thousand() {
        let mut draw = Random(1);
        for _ in 0..MANY {
            let x = draw.number();
            check_sin_cos(x);
            check_sin_cos(x * 10.0);
            check_sin_cos(x * 1e5);
            check_sin_cos(x * (-draw.number().abs() * 1000.0).exp2());
        }
        // Next to the multiples of a quarter turn hardly a digit of the angle remains; between them octants
        // meet.
        for n in 0..130_000 {
            let x = f64::from(n) * FRAC_PI_4;
            for x in [x.next_down(), x, x.next_up()] {
                check_sin_cos(x);
                check_sin_cos(-x);
            }
        }
    }

    #[test]
    fn greater_angles_lose_digits_no_faster_than_their_spacing_grows() {
        let mut draw = Random(2);
        for _ in 0..MANY {
            let x = draw.number() * (17.0 + 33.9 * draw.number().abs()).exp2();
            let (s, c) = sin_cos(x);
            let bound = x.abs() * 0.5 * f64::EPSILON + f64::EPSILON;
            assert!((s - x.sin()).abs() <= bound && (c - x.cos()).abs() <= bound, "{x:e}: {s} {c}");
        }
        for x in [LARGEST, -LARGEST, 1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            assert!(sin_cos(x).0.is_nan() && sin_cos(x).1.is_nan(), "{x}");
        }
    }

    #[test]
    fn points_of_the_plane() {
        let mut draw = Random(3);
        for _ in 0..MANY {
            let (y, x) = (draw.number(), draw.number());
            check_atan2(y, x);
            check_atan2(y * 1e-8, x);
            check_atan2(y, x * 1e-8);
            check_atan2(any_size(&mut draw), any_size(&mut draw));
        }
        // Where the formula changes: slopes 3/8, 3/4, 1 and their inverses, and the powers of two.
        for slope in (0..60).map(|k| f64::from(-k).exp2()).chain([0.375, 0.75]) {
            for slope in [slope.next_down(), slope, slope.next_up()] {
                for scale in [1.0, 2.0_f64.powi(200).next_up(), 1e-290] {
                    for (y, x) in [(slope, 1.0), (1.0, slope), (-slope, 1.0), (slope, -1.0), (-1.0, -slope)] {
                        check_atan2(y * scale, x * scale);
                    }
                }
            }
        }
        let (small, large) = (f64::from_bits(1), f64::MAX);
        for size in [small, 3.0 * small, 5.0 * small, f64::MIN_POSITIVE, 0.3 * large, 0.7 * large, large] {
            for slope in [0.2, 0.34, 0.6, 1.0] {
                check_atan2(size * slope, size);
                check_atan2(-size, -size * slope);
                check_atan2(size, small);
                check_atan2(size, -large);
            }
        }
    }

    #[test]
    fn axes_and_infinities_have_the_signs_of_ieee_754() {
        let ends = [0.0, -0.0, 1.5, -1.5, f64::INFINITY, f64::NEG_INFINITY];
        for y in ends {
            for x in ends {
                let known = if y.is_infinite() && x.is_infinite() { f64::NAN } else { y.atan2(x) };
                let ours = atan2(y, x);
                assert!(
                    ours.to_bits() == known.to_bits() || (ours.is_nan() && known.is_nan()),
                    "{y} {x}: {ours}"
                );
            }
            assert!(atan2(y, f64::NAN).is_nan() && atan2(f64::NAN, y).is_nan());
        }
        for zero in [0.0_f64, -0.0] {
            let (s, c) = sin_cos(zero);
            assert!(s.to_bits() == zero.to_bits() && c == 1.0);
        }
    }

    #[test]
    fn cosines_up_to_one() {
        let mut draw = Random(4);
        for _ in 0..MANY {
            let x = draw.number();
            check_acos(x);
            let off = (-52.0 * draw.number().abs()).exp2();
            check_acos(1.0 - off);
            check_acos(off - 1.0);
            check_acos(x * off);
        }
        for x in [0.0, -0.0, 0.5, -0.5, 0.5_f64.next_up(), -0.5_f64.next_up(), 1.0, -1.0, f64::MIN_POSITIVE] {
            check_acos(x);
        }
        assert_eq!([acos(1.0), acos(-1.0)], [0.0, PI]);
        for x in [1.0_f64.next_up(), -1.0_f64.next_up(), f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            assert!(acos(x).is_nan(), "{x}");
        }
    }

    #[derive(Clone, Copy)]
    struct Functions<'a> {
        pairs: [&'a [f64]; 2],
        results: &'a RefCell<Vec<[Vec<f64>; 4]>>,
    }

    impl Task for Functions<'_> {
        #[inline(always)]
        fn run<V: Lanes>(self) {
            let mut results = [(); 4].map(|()| vec![0.0; self.pairs[0].len()]);
            for k in (0..self.pairs[0].len()).step_by(V::WIDTH) {
                let (y, x) = (V::load(&self.pairs[0][k..]), V::load(&self.pairs[1][k..]));
                let (s, c) = sin_cos(y);
                for (all, number) in results.iter_mut().zip([s, c, atan2(y, x), acos(x)]) {
                    number.store(&mut all[k..]);
                }
            }
            self.results.borrow_mut().push(results);
        }
    }

    #[test]
    fn lanes_are_doubles_bit_by_bit() {
        let ends = [0.0, -0.0, 1.0, -0.7, 4e15, f64::MAX, f64::from_bits(1), f64::INFINITY, f64::NAN];
        let mut draw = Random(5);
        let mut pairs: Vec<(f64, f64)> =
            ends.iter().flat_map(|&y| ends.map(|x| (y, x))).chain([(0.5, 0.5); 7]).collect();
        for _ in 0..MANY / 8 {
            pairs.push((draw.number() * 10.0, draw.number()));
            pairs.push((any_size(&mut draw), any_size(&mut draw)));
            pairs.push((draw.number() * 1e5, draw.number() * 1e-3));
            pairs.push((draw.number(), draw.number() * 3.0));
        }
        assert_eq!(pairs.len() % 8, 0);
        let (y, x): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
        let results = RefCell::new(Vec::new());
        on_each_width(Functions { pairs: [&y, &x], results: &results });
        let all = results.into_inner();
        assert!(all.len() > 1);
        // Which NaN it is is left open.
        let bits = |x: f64| if x.is_nan() { u64::MAX } else { x.to_bits() };
        for (width, results) in all.iter().enumerate() {
            for f in 0..4 {
                for (k, (&ours, &known)) in results[f].iter().zip(&all[0][f]).enumerate() {
                    assert_eq!(bits(ours), bits(known), "width {width}, function {f}, at {:?}", pairs[k]);
                }
            }
        }
    }
}
