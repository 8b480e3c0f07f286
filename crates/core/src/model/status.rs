//! The outcome of one state of a batch.

/// Small integers, the same in Python.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum Status {
    #[default]
    Ok = 0,
    /// The coordinates have no pose: |cos γ| > 1 [Eq. 5].
    NoBranch = 1,
    /// The coordinates are singular: two branches meet, rates are not determined.
    Fold = 2,
    /// The iteration for the dependent coordinates did not converge.
    NotConverged = 3,
    /// The Jacobian is singular, or a leg has no frame.
    Singular = 4,
    /// A leg is longer or shorter than its stroke allows; the numbers stand.
    OutOfStroke = 5,
    /// The pose, twist or acceleration breaks a constraint of the mechanism.
    OffConstraint = 6,
    /// Not a number, infinite, or not a pose.
    InvalidInput = 7,
    /// The dependent coordinates came out on another branch than those of the state before.
    BranchJump = 8,
    /// A leg leans further from a joint's cone axis than the cone allows; the numbers stand.
    OutOfCone = 9,
    /// The lengths have a pose, but not in the assembly mode of the guess; the pose stands.
    ModeJump = 10,
    /// A revolute joint or a rod rotates beyond its range; the numbers stand.
    OutOfAngle = 11,
    /// The strut of a slider is too short to reach its rail.
    OutOfReach = 12,
    /// The pose has the coordinates of its legs, but the strut of a slider leans to the other side; the pose
    /// stands.
    OtherBranch = 13,
    /// The legs contradict one another: nothing has all that is asked of them.
    Inconsistent = 14,
    /// A leg points backwards from a fixed joint: its length would be negative.
    Backwards = 15,
}

impl Status {
    pub const ALL: [Status; 16] = [
        Status::Ok,
        Status::NoBranch,
        Status::Fold,
        Status::NotConverged,
        Status::Singular,
        Status::OutOfStroke,
        Status::OffConstraint,
        Status::InvalidInput,
        Status::BranchJump,
        Status::OutOfCone,
        Status::ModeJump,
        Status::OutOfAngle,
        Status::OutOfReach,
        Status::OtherBranch,
        Status::Inconsistent,
        Status::Backwards,
    ];

    /// Whether there are numbers all the same: the pose is one, but beyond what the machine can reach.
    #[must_use]
    #[inline(always)]
    pub fn stands(self) -> bool {
        matches!(self, Status::Ok | Status::OutOfStroke | Status::OutOfCone | Status::OutOfAngle)
    }

    /// Meaning of the status, and a remedy.
    #[must_use]
    pub fn message(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::NoBranch => {
                "no pose has these coordinates: the constraint leaves no real dependent coordinate (|cos γ| \
                 > 1, Eq. 5); change them together, or use natural coordinates"
            }
            Status::Fold => {
                "the coordinates do not determine the motion here: two of their branches meet (of the \
                 paper's where γ = 0 or 180°), or they depend on one another at every pose; the mechanism \
                 need not be singular, other coordinates may pass: `polypod info` lists independent ones"
            }
            Status::NotConverged => {
                "no pose was found from the guess; give a guess nearer to the pose or check that it exists"
            }
            Status::Singular => {
                "singular: a leg has no length or lies along the axis of its joint, or the Jacobian does not \
                 determine forces and velocities at this pose"
            }
            Status::OutOfStroke => {
                "a leg is outside its stroke; the numbers stand, the machine cannot reach the pose"
            }
            Status::OffConstraint => {
                "the pose, twist or acceleration breaks a constraint of the mechanism; give only as many \
                 coordinates as it has degrees of freedom, so that the others follow (mech.state makes pose, \
                 twist and acceleration)"
            }
            Status::BranchJump => {
                "between the state before and this one the dependent coordinates passed a fold and came out \
                 on another branch; take smaller steps, or coordinates without this fold"
            }
            Status::OutOfCone => {
                "a joint rotates beyond its cone limit; the numbers stand, the machine cannot reach the pose"
            }
            Status::ModeJump => {
                "on the way from the guess to these lengths its assembly mode ends in a singularity; the \
                 pose has the lengths but lies in another mode: give a guess in the mode that is meant, or \
                 ask for all assembly modes"
            }
            Status::OutOfAngle => {
                "a revolute joint or a rod rotates beyond its range; the numbers stand, the machine cannot \
                 reach the pose"
            }
            Status::OutOfReach => {
                "the strut of a slider is too short: from this pose it reaches its rail nowhere"
            }
            Status::OtherBranch => {
                "the pose has the coordinates of its legs, but the strut of a slider leans to the other \
                 side of the perpendicular to its rail than its branch says; give a guess nearer to the \
                 pose that is meant"
            }
            Status::Inconsistent => {
                "the legs contradict one another: no pose nearby has all these lengths, or no motion all \
                 these rates or accelerations; more legs are actuated than the platform has degrees of \
                 freedom, so that they must agree (1e-6)"
            }
            Status::Backwards => {
                "a leg points backwards from its fixed joint (F), so that its length would be negative: the \
                 machine cannot be there; give a pose or a guess on the side of home"
            }
            Status::InvalidInput => {
                "the input holds NaN or infinity, or its rotation is not a rotation matrix"
            }
        }
    }
}
