//! Limits of many states.

use super::block::{self, Answers, At, Codes, Operation};
use super::checks::solved;
use super::dynamics::Loads;
use super::{States, Table, redundant};
use crate::dynamics::inverse_dynamics;
use crate::limits::margins::{Binding, Seen};
use crate::model::limit::Measure;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;

/// Signed slack of every limit, the same relative to the limit's scale, the number of the limit that binds, and 1 where
/// all are kept \[T35\]. Forces are those of the motion; where they are not determined their margins are NaN and no limit
/// binds.
#[must_use]
pub fn limits(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let count = mech.limits.len();
    let fields =
        [("margins", vec![count]), ("relative", vec![count]), ("binding", vec![]), ("within", vec![])];
    if mech.is_redundant() {
        return redundant::limits(mech, states, loads, fields);
    }
    let forces = mech.limits.iter().any(|limit| matches!(limit.measure, Measure::Force { .. }));
    block::table(&Limits { mech, states, loads, forces }, states.len(), fields)
}

struct Limits<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
    /// Whether there are limits of forces.
    forces: bool,
}

impl Operation<4> for Limits<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 4>) -> Codes<V> {
        let (mech, [margins, relatives, binding, within]) = (self.mech, Answers::fields());
        let (platform, load, mut codes) = self.states.loaded_at(mech, self.loads, at);
        let mut forces = [V::lit(f64::NAN); 6];
        if self.forces {
            let (f, pivots) = inverse_dynamics::inverse_dynamics(mech, &platform, load);
            let determined = solved(mech, &f, pivots, Codes::<V>::ok()).are(Status::Ok);
            for k in 0..6 {
                forces[k] = V::select(determined, f[k], forces[k]);
            }
            codes = codes.but(determined, Status::Singular);
        }
        let (mut seen, mut binds, mut kept) = (Seen::default(), Binding::default(), V::one());
        for (k, limit) in mech.limits.iter().enumerate() {
            let margin = limit.margin_at(mech, &platform.pose, &forces, &mut seen);
            let relative = margin / V::lit(limit.scale);
            answers.put(margins, k, [margin]);
            answers.put(relatives, k, [relative]);
            binds = binds.or(k, relative);
            let holds = V::zero().at_most(margin);
            kept = V::select(holds, kept, V::zero());
            if limit.status() != Status::Ok {
                codes = codes.unless(holds, limit.status());
            }
        }
        answers.put(binding, 0, [binds.limit]);
        answers.put(within, 0, [kept]);
        codes
    }
}
