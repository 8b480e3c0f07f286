//! Limits of many states.

use super::block::{self, Answers, At, Codes, Working};
use super::checks::solved;
use super::dynamics::Loads;
use super::{States, Table};
use crate::dynamics::force_balance::ForceSolver;
use crate::limits::margins::{Binding, LegCache};
use crate::model::limit::Measure;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;

/// Signed slack of every limit, the same relative to the limit's scale, the number of the limit that binds,
/// and 1 where all are kept \[T35\]. Forces are those of the motion; where they are not determined their
/// margins are NaN and no limit binds.
#[must_use]
pub fn limits(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let count = mech.limits.len();
    let fields =
        [("margins", vec![count]), ("relative", vec![count]), ("binding", vec![]), ("within", vec![])];
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

impl Working<4> for Limits<'_> {
    type Room<V: Lanes> = ForceSolver<V>;

    fn room<V: Lanes>(&self) -> ForceSolver<V> {
        ForceSolver::new(self.mech)
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut ForceSolver<V>, at: At, answers: &mut Answers<'_, 4>) -> Codes<V> {
        let (mech, [margins, relatives, binding, within]) = (self.mech, Answers::fields());
        let (platform, load, mut codes) = self.states.loaded_at(mech, self.loads, at);
        if self.forces {
            let regular = room.solve_motion(mech, &platform, load);
            let determined = solved(mech, &platform.pose, &room.forces, regular, Codes::ok()).are(Status::Ok);
            for force in &mut room.forces {
                *force = V::select(determined, *force, V::lit(f64::NAN));
            }
            codes = codes.but(determined, Status::Singular);
        }
        let (mut seen, mut binds, mut kept) = (LegCache::default(), Binding::default(), V::one());
        for (k, limit) in mech.limits.iter().enumerate() {
            let margin = limit.margin_at(mech, &platform.pose, &room.forces, &mut seen);
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
