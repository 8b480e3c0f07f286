//! Steps from poses to other lengths, many side by side in lanes \[T41\], \[T65\]: where each leads to first
//! order, and the way itself, followed to its end.

use crate::forward_kinematics::newton::{LegTarget, step_of, system};
use crate::forward_kinematics::newton_lanes::{ARRIVED, BEGINNING, GOING, NewtonStep, Piece, Pieces, newton};
use crate::kinematics::leg;
use crate::limits::margins::LegCache;
use crate::model::limit::Limit;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::numerics::gauss::solve_all;
use crate::spatial::packed_poses::{Poses, get, load, put, store};
use crate::spatial::{Mat3, Pose, Vec3};
use crate::workspace::fit_orientation::{ON_LIMIT, margins};

/// Shortest pieces of the way to a neighbour: what needs shorter ones is taken to end there. Near a
/// singularity poses go by the root of the lengths, so that the end is known to an eighth of what one step
/// makes there.
const PIECES: u32 = 64;

/// Share of a predicted step within which a known pose is the one that the step leads to.
const PREDICTED: f64 = 0.25;

/// Position of the marker in platform axes, in characteristic lengths: off every symmetry that a platform may
/// have.
const MARKER: Vec3<f64> = Vec3 { x: 0.53, y: 0.31, z: 0.79 };

/// A bit for every lane.
const ALL: u32 = (1 << WIDTH) - 1;

/// Actuated legs at most.
pub(super) const AXES: usize = 6;

/// Position of the marker point that identifies a pose.
pub(super) fn marker(mech: &Mechanism, pose: &Pose<f64>) -> Vec3<f64> {
    pose.o + pose.rotation * (MARKER * mech.characteristic_length)
}

/// Region of admissible poses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room<'a> {
    pub mech: &'a Mechanism,
    /// Least and greatest coordinates of o, m.
    pub bounds: &'a [[f64; 2]; 3],
}

impl Room<'_> {
    /// Whether a pose is in the bounds and keeps all limits. The lengths of a node on the stroke's end are
    /// there up to rounding.
    pub(super) fn holds(&self, pose: &Pose<f64>) -> bool {
        self.joints_hold(pose) > 0.0 && self.others_hold(pose)
    }

    /// 1 for poses in the bounds that keep the limits of joints, with no leg backwards.
    #[inline(always)]
    fn joints_hold<V: Lanes>(&self, pose: &Pose<V>) -> V {
        let mut inside = V::one();
        let o = pose.o.array();
        for k in 0..3 {
            let [low, high] = self.bounds[k];
            inside = V::select(V::lit(low).at_most(o[k]), inside, V::zero());
            inside = V::select(o[k].at_most(V::lit(high)), inside, V::zero());
        }
        inside = V::select(leg::all_ahead(self.mech, pose), inside, V::zero());
        let mut seen = LegCache::default();
        for limit in &self.mech.limits {
            if is_of_joint(limit) {
                let margin = limit.bound.margin(limit.of_joint(self.mech, pose, &mut seen));
                inside = V::select(V::lit(-ON_LIMIT).at_most(margin), inside, V::zero());
            }
        }
        inside
    }

    /// Whether a pose keeps the limits that are tested one pose at a time.
    fn others_hold(&self, pose: &Pose<f64>) -> bool {
        let limits = &self.mech.limits;
        limits.iter().all(is_of_joint)
            || margins(self.mech, pose)
                .iter()
                .zip(limits)
                .all(|(margin, limit)| is_of_joint(limit) || *margin >= -ON_LIMIT)
    }
}

fn is_of_joint(limit: &Limit) -> bool {
    limit.status() != Status::Ok
}

/// For poses side by side, where steps lead to first order.
#[derive(Clone, Debug, Default)]
pub(super) struct Predicted {
    /// Of the marker, for both directions of each axis.
    markers: [[[Row; 3]; 2]; AXES],
    /// Tolerance for the marker of the pose that a step leads to, m.
    within: [[Row; 2]; AXES],
}

impl Predicted {
    pub(super) fn marker(&self, axis: usize, direction: usize, k: usize) -> [f32; 3] {
        self.markers[axis][direction].map(|row| row[k] as f32)
    }

    pub(super) fn within(&self, axis: usize, direction: usize, k: usize) -> f32 {
        self.within[axis][direction][k] as f32
    }
}

/// Predicts, from at most [`WIDTH`] poses, the ends of steps by the first Newton step. `changes` are those of
/// the squared lengths, for both directions of each axis.
pub(super) fn predict(
    mech: &Mechanism,
    poses: &[Pose<f64>],
    changes: &[[Row; 2]; AXES],
    predicted: &mut Predicted,
) {
    let mut rows = [[0.0; WIDTH]; 12];
    for k in 0..WIDTH {
        put(&mut rows, k, &poses[k.min(poses.len() - 1)]);
    }
    lanes::dispatch(Prediction { mech, poses: &rows, changes, predicted });
}

struct Prediction<'a> {
    mech: &'a Mechanism,
    poses: &'a Poses,
    changes: &'a [[Row; 2]; AXES],
    predicted: &'a mut Predicted,
}

impl Task for Prediction<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Prediction { mech, poses, changes, predicted } = self;
        let scale = mech.characteristic_length;
        let axes = mech.actuated().count();
        let mut k = 0;
        while k < WIDTH {
            let pose: Pose<V> = load(poses, k);
            let mut unit = [[V::zero(); AXES]; AXES];
            for i in 0..AXES {
                unit[i][i] = V::one();
            }
            // One elimination for all directions: only one length changes in each.
            let columns = solve_all(system(mech, &pose, &[LegTarget::none(); 6]).matrix, unit).x;
            let arm = pose.rotation * Vec3::<V>::lift(MARKER * scale);
            for axis in 0..axes {
                for direction in 0..2 {
                    let change = V::load(&changes[axis][direction][k..]).scale(0.5 / (scale * scale));
                    let (mut x, mut square) = (columns[axis], V::zero());
                    for e in &mut x {
                        *e = *e * change;
                        square = square + *e * *e;
                    }
                    let step = step_of(mech, x, V::one());
                    let marker = pose.o + step.v + Mat3::cayley(step.omega) * arm;
                    let [rows_x, rows_y, rows_z] = &mut predicted.markers[axis][direction];
                    marker.x.store(&mut rows_x[k..]);
                    marker.y.store(&mut rows_y[k..]);
                    marker.z.store(&mut rows_z[k..]);
                    square.sqrt().scale(PREDICTED * scale).store(&mut predicted.within[axis][direction][k..]);
                }
            }
            k += V::WIDTH;
        }
    }
}

/// A way from a pose to the lengths of a neighbour, by the squares of lengths.
#[derive(Clone, Debug)]
pub(super) struct Way {
    /// By which its owner knows it.
    pub step: usize,
    to: [f64; 6],
    /// The axis along which lengths change, and the square there at the beginning.
    axis: usize,
    from: f64,
    /// The last pose on it that is inside, and its share of the way in shortest pieces.
    pose: Pose<f64>,
    share: u32,
    /// Length of the next piece to try, in shortest pieces.
    piece: u32,
}

/// Event on a path.
#[derive(Clone, Copy, Debug)]
pub(super) enum Met {
    /// A pose at the end of a piece, with its o.
    Place(Vec3<f64>),
    /// The pose with the lengths that the way leads to: its end.
    Pose(Pose<f64>),
    /// A limit, or the bounds: its end.
    Limit,
    /// Its end, too.
    Singularity,
}

impl Way {
    pub(super) fn new(step: usize, pose: Pose<f64>, axis: usize, from: f64, to: [f64; 6]) -> Self {
        Way { step, to, axis, from, pose, share: 0, piece: PIECES }
    }

    /// The squared lengths at the end of the next piece.
    fn ahead(&self) -> [f64; 6] {
        let next = f64::from(self.share + self.piece) / f64::from(PIECES);
        let mut ahead = self.to;
        ahead[self.axis] = (1.0 - next) * self.from + next * ahead[self.axis];
        ahead
    }

    /// Halves the next piece, if it is long enough.
    fn halve(&mut self) -> bool {
        let halved = self.piece > 1;
        self.piece /= 2;
        halved
    }

    /// Goes on from the end of a piece: to the end of the half of the way, of the quarter, ..., that begins
    /// there.
    fn arrive(&mut self, pose: Pose<f64>) {
        (self.pose, self.share) = (pose, self.share + self.piece);
        self.piece = 1 << self.share.trailing_zeros();
    }
}

/// Follows ways by Newton's method, and where that does not contract or leaves room or aspect, in halves,
/// each in the same manner \[T27\]. `tell` is told what is met, with the number of the way.
pub(super) fn follow(room: Room<'_>, ways: impl Iterator<Item = Way>, tell: impl FnMut(usize, Met)) {
    let mut crew = Crew {
        room,
        next: ways,
        ways: Vec::with_capacity(3 * WIDTH),
        free: Vec::new(),
        ready: Vec::new(),
        idle: ALL,
        lanes: [0; WIDTH],
        poses: [[0.0; WIDTH]; 12],
        ahead: [[0.0; WIDTH]; 6],
        pieces: [[0.0; WIDTH]; 3],
        arrived: 0,
        at: [0; WIDTH],
        arrivals: [[0.0; WIDTH]; 12],
        tell,
    };
    loop {
        if crew.fill() {
            crew.advance();
        } else if crew.arrived > 0 {
            crew.check();
        } else {
            return;
        }
    }
}

/// Ways that are followed side by side: a lane whose way has come to the end of a piece takes up another one.
struct Crew<'a, W, T> {
    room: Room<'a>,
    /// Ways that have not begun.
    next: W,
    /// The others, and places among them that are free.
    ways: Vec<Way>,
    free: Vec<usize>,
    /// Ways that wait for a lane.
    ready: Vec<usize>,
    /// Lanes without a way, as bits.
    idle: u32,
    /// The way in each lane, where it is, where its present piece leads, and how far that has come.
    lanes: [usize; WIDTH],
    poses: Poses,
    ahead: [Row; 6],
    pieces: Pieces,
    /// Number of ways whose piece has come to its end, which ways these are, and their poses there.
    arrived: usize,
    at: [usize; WIDTH],
    arrivals: Poses,
    tell: T,
}

impl<W: Iterator<Item = Way>, T: FnMut(usize, Met)> Crew<'_, W, T> {
    /// Puts ways into empty lanes; whether there is one in any lane.
    fn fill(&mut self) -> bool {
        while self.idle != 0
            && let Some(i) = self.take()
        {
            let k = self.idle.trailing_zeros() as usize;
            self.idle &= self.idle - 1;
            self.begin(k, i);
        }
        self.idle != ALL
    }

    /// A way that waits or has not begun.
    fn take(&mut self) -> Option<usize> {
        if let Some(i) = self.ready.pop() {
            return Some(i);
        }
        let way = self.next.next()?;
        if let Some(i) = self.free.pop() {
            self.ways[i] = way;
            return Some(i);
        }
        self.ways.push(way);
        Some(self.ways.len() - 1)
    }

    /// Begins the next piece of a way in a lane.
    fn begin(&mut self, k: usize, i: usize) {
        let way = &self.ways[i];
        put(&mut self.poses, k, &way.pose);
        for (row, square) in self.ahead.iter_mut().zip(way.ahead()) {
            row[k] = square;
        }
        for (row, number) in self.pieces.iter_mut().zip(BEGINNING) {
            row[k] = number;
        }
        self.lanes[k] = i;
    }

    /// A Newton step in every lane.
    fn advance(&mut self) {
        let mut course = [GOING; WIDTH];
        let Crew { room, poses, ahead, pieces, .. } = self;
        lanes::dispatch(Advance { mech: room.mech, poses, ahead, pieces, course: &mut course });
        // Which lanes stop is as good as random: no branch on it.
        let mut stopped = !self.idle & ALL;
        for k in 0..WIDTH {
            stopped &= !(u32::from(course[k] == GOING) << k);
        }
        while stopped != 0 {
            let k = stopped.trailing_zeros() as usize;
            stopped &= stopped - 1;
            let i = self.lanes[k];
            if course[k] == ARRIVED {
                if self.arrived == WIDTH {
                    self.check();
                }
                for (row, arrival) in self.poses.iter().zip(&mut self.arrivals) {
                    arrival[self.arrived] = row[k];
                }
                self.at[self.arrived] = i;
                self.arrived += 1;
                self.idle |= 1 << k;
            } else if self.ways[i].halve() {
                self.begin(k, i);
            } else {
                self.end(i, Met::Singularity);
                self.idle |= 1 << k;
            }
        }
    }

    /// Tells those that have arrived inside from the others.
    fn check(&mut self) {
        let mut inside = [0.0; WIDTH];
        lanes::dispatch(Check { room: self.room, poses: &self.arrivals, inside: &mut inside });
        for k in 0..std::mem::take(&mut self.arrived) {
            let (i, pose) = (self.at[k], get(&self.arrivals, k));
            let way = &mut self.ways[i];
            if inside[k] > 0.0 && self.room.others_hold(&pose) {
                way.arrive(pose);
                if way.share == PIECES {
                    self.end(i, Met::Pose(pose));
                } else {
                    (self.tell)(way.step, Met::Place(pose.o));
                    self.ready.push(i);
                }
            } else if way.halve() {
                self.ready.push(i);
            } else {
                self.end(i, Met::Limit);
            }
        }
    }

    /// Tells the end of a way, and gives its place to another.
    fn end(&mut self, i: usize, met: Met) {
        (self.tell)(self.ways[i].step, met);
        self.free.push(i);
    }
}

/// Newton steps side by side, and what comes of the pieces.
struct Advance<'a> {
    mech: &'a Mechanism,
    poses: &'a mut Poses,
    ahead: &'a [Row; 6],
    pieces: &'a mut Pieces,
    course: &'a mut Row,
}

impl Task for Advance<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut k = 0;
        while k < WIDTH {
            let pose: Pose<V> = load(self.poses, k);
            let NewtonStep { next, size, sign, .. } = newton(self.mech, &pose, self.ahead, k);
            let mut piece = Piece::load(self.pieces, k);
            let (course, made) = piece.judge(size, sign);
            store(&chosen(made, &next, &pose), self.poses, k);
            piece.store(self.pieces, k);
            course.store(&mut self.course[k..]);
            k += V::WIDTH;
        }
    }
}

#[inline(always)]
fn chosen<V: Lanes>(choose: V::Mask, a: &Pose<V>, b: &Pose<V>) -> Pose<V> {
    let mut columns = [a.rotation.0[0], a.rotation.0[1], a.rotation.0[2], a.o];
    let others = [b.rotation.0[0], b.rotation.0[1], b.rotation.0[2], b.o];
    for i in 0..4 {
        let (c, d) = (columns[i], others[i]);
        columns[i] =
            Vec3::new(V::select(choose, c.x, d.x), V::select(choose, c.y, d.y), V::select(choose, c.z, d.z));
    }
    let [x, y, z, o] = columns;
    Pose { rotation: Mat3::from_columns(x, y, z), o }
}

struct Check<'a> {
    room: Room<'a>,
    poses: &'a Poses,
    inside: &'a mut Row,
}

impl Task for Check<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut k = 0;
        while k < WIDTH {
            let pose: Pose<V> = load(self.poses, k);
            self.room.joints_hold(&pose).store(&mut self.inside[k..]);
            k += V::WIDTH;
        }
    }
}
