"""The paper's sentences, each with its measures and a verdict."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from polypod.answers.answer import Array
from polypod.answers.kinematics import State
from polypod.answers.singularity import NEAR_SINGULAR
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.paper.section4 import PRINTED
from polypod.paper.sentences.forces import coupled_share, parallel_wrench, printed_share, redundant_forces
from polypod.paper.sentences.isotropy import (
    HEIGHTS,
    LevelIsotropy,
    horizontal_velocities,
    isotropy,
    level_isotropy,
)
from polypod.paper.sentences.joints import base_joints, base_reactions
from polypod.paper.sentences.poses import level_poses, quantile, upright_poses
from polypod.paper.sentences.reach import (
    circle,
    interrupted,
    largest_ball,
    level_reach,
    mirror_difference,
    reach,
    sphere,
    tilts_at_home,
)
from polypod.paper.sentences.sentence import (
    Sentence,
    Verdict,
    kilo,
    known,
    median_and_tail,
    percent,
    size,
    span,
    spread,
    tens,
    with_error,
)
from polypod.paper.sentences.smoothness import SERIES, across_singularity, ends_of, steps_along
from polypod.solution.solve import states_along
from polypod.workspaces.workspace import Workspace

TURNED = "lu-3spu-2rpu-r-turned"
"""The built-in mechanism that is the paper's with three base joints rotated, for comparison."""

MIRRORED_AT = 0.6
"""Height of o at which the symmetry of the workspace is measured, m."""

CONES = (30, 45)
"""Half-angles that an S joint may allow, degrees."""

_LEVEL_SPACING = 0.05
"""Of the level poses at which the constraint wrench is looked at, m."""


@dataclass(frozen=True)
class Judged:
    """What the sentences are judged on: two mechanisms, poses of each, a motion, a workspace."""

    mech: Mechanism
    """The paper's."""
    turned: Mechanism
    """With base joints rotated."""
    motion: Motion
    """Of the paper's mechanism, from rest to rest."""
    workspace: Workspace
    """Reachable positions of the paper's mechanism."""

    @cached_property
    def poses(self) -> Array:
        """(N, 4, 4): random upright ones of the paper's mechanism."""
        return upright_poses(self.mech)

    @cached_property
    def turned_poses(self) -> Array:
        """(N, 4, 4): of the other one."""
        return upright_poses(self.turned)

    @cached_property
    def both(self) -> tuple[tuple[Mechanism, Array], tuple[Mechanism, Array]]:
        """Each mechanism with its poses."""
        return (self.mech, self.poses), (self.turned, self.turned_poses)

    @cached_property
    def state(self) -> State:
        """Along the motion."""
        return states_along(self.mech, self.motion)

    @cached_property
    def moving(self) -> tuple[Array, Array, Array]:
        """Pose, twist and acceleration along the motion."""
        return self.state.pose, self.state.twist, self.state.acceleration


def judge(of: Judged) -> tuple[Sentence, ...]:
    """All sentences, by subject; takes about two seconds."""
    parts = (_isotropy, _workspace, _shape, _joints, _smoothness, _coupled, _correct, _stiffness, _other)
    return tuple(sentence for part in parts for sentence in part(of))


def isotropy_markdown(of: Judged) -> str:
    """Isotropy with the platform level at several heights, both mechanisms: median and least over X-Y."""

    def cells(found: LevelIsotropy) -> str:
        pairs = (f"{np.median(part):.2f}, {np.min(part):.2f}" for part in (found.kept_level, found.free))
        return f"{len(found.pose)} | {' | '.join(pairs)}"

    lines = [
        "| Z / mm | poses | kept level | free to rotate | turned: poses | kept level | free to rotate |",
        "|---|---|---|---|---|---|---|",
    ]
    for height in HEIGHTS:
        both = (cells(level_isotropy(mech, height)) for mech in (of.mech, of.turned))
        lines.append(f"| {1e3 * height:.0f} | {' | '.join(both)} |")
    return "\n".join(lines)


def _isotropy(of: Judged) -> Iterator[Sentence]:
    levels = [[level_isotropy(mech, height) for height in HEIGHTS] for mech in (of.mech, of.turned)]
    kept = [np.concatenate([at.kept_level for at in found]) for found in levels]
    free = [np.concatenate([at.free for at in found]) for found in levels]
    tilted = [known(isotropy(horizontal_velocities(mech, poses))) for mech, poses in of.both]
    heights = f"Z = {1e3 * HEIGHTS[0]:.0f} to {1e3 * HEIGHTS[-1]:.0f} mm"
    yield Sentence(
        "1, 4, 8",
        "isotropy horizontal motion",
        (
            (
                "norm of the leg rates for o moving horizontally, platform kept level: the least over the "
                f"greatest of all directions; {heights}",
                spread(kept[0]),
            ),
            ("the same, base joints turned", spread(kept[1])),
            (
                "horizontal speed of o for leg rates of one norm, platform level but free to rotate: the "
                f"least over the greatest; {heights}",
                spread(free[0]),
            ),
            ("the same, base joints turned", spread(free[1])),
            ("the same at random poses, median", with_error(quantile(tilted[0], 0.5))),
            ("the same, base joints turned", with_error(quantile(tilted[1], 0.5))),
        ),
        Verdict.FALSE,
        "nearly true at the Z axis with the platform kept level, but not with base joints turned. Else one "
        "direction is about twice as fast, and four times or more as compliant, as the other",
    )


def _workspace(of: Judged) -> Iterator[Sentence]:
    home = of.mech.home[:3, 3]
    flat, every = (1e3 * level_reach(of.mech, directions) for directions in (circle(), sphere()))
    tilt = np.degrees(tilts_at_home(of.mech))
    near = [float(np.mean(mech.conditioning(poses).sigma_min < NEAR_SINGULAR)) for mech, poses in of.both]
    free_flat, free_every = (reach(of.workspace, home, directions) for directions in (circle(), sphere()))
    step = 1e3 * (of.workspace.axes[0][1] - of.workspace.axes[0][0])
    yield Sentence(
        "1, 8",
        "large moving workspace in any direction",
        (
            (
                "way of o straight from the centre pose, any orientation, horizontally "
                f"(grid of {step:.0f} mm)",
                f"{tens(free_flat.min())} to {tens(free_flat.max())} mm",
            ),
            ("the same in all directions", f"{tens(free_every.min())} to {tens(free_every.max())} mm"),
            ("radius of the largest ball of positions", f"{tens(largest_ball(of.workspace)[1])} mm"),
            ("way of o with the platform kept level, horizontally", f"{span(flat)} mm"),
            ("the same in all directions", f"{span(every)} mm"),
            ("tilt that o at the centre pose allows, over all azimuths", f"{tilt[0]:.1f} to {tilt[1]:.1f}°"),
            (f"random poses with σ_min below {NEAR_SINGULAR}", percent(near[0], len(of.poses))),
            ("the same, base joints turned", percent(near[1], len(of.turned_poses))),
        ),
        Verdict.PARTLY,
        "horizontally about twice the stroke of 200 mm, downwards more, upwards half of it. A part is next "
        "to singularities, all level poses among it",
    )


def _shape(of: Judged) -> Iterator[Sentence]:
    in_oyz, in_oxz = mirror_difference(of.workspace, MIRRORED_AT)
    yield Sentence(
        "4",
        "W is also symmetry in OXZ plane",
        (
            (
                f"reach from the Z axis at Z = {1e3 * MIRRORED_AT:.0f} mm: greatest difference to the mirror "
                "image in OXZ",
                f"{1e3 * in_oxz:.0f} mm",
            ),
            ("the same in OYZ", f"{1e3 * in_oyz:.1f} mm"),
        ),
        Verdict.FALSE,
        "the plane of symmetry is OYZ, as it is of the mechanism",
    )
    cut = float(of.workspace.extents[2, 1]) - PRINTED[2]
    yield Sentence(
        "4",
        "an upper surface … and a lower surface",
        (
            ("vertical lines on which W is interrupted", f"{100 * interrupted(of.workspace):.0f} %"),
            ("the same above the cut at the printed height", f"{100 * interrupted(of.workspace, cut):.0f} %"),
        ),
        Verdict.TRUE,
        "above the cut; next to the base the rim overhangs",
    )


def _joints(of: Judged) -> Iterator[Sentence]:
    found = base_joints(of.mech, of.poses)
    revolute, spherical = (np.array([kind == letter for kind in found.kinds]) for letter in "RS")
    cone = np.degrees(found.cone)
    within = [
        float(np.mean(np.all(found.off_axis[:, spherical] < np.radians(angle), axis=-1))) for angle in CONES
    ]
    yield Sentence(
        "2",
        "larger rotation angle",
        (
            (
                "rotation asked of R1 and R3 over the random poses",
                f"{span(np.degrees(found.rotation[revolute]))}°",
            ),
            ("half-angle of the cone asked of S2, S4 and S5", f"{span(cone[spherical])}°"),
            ("the same of S joints in place of R1 and R3", f"{span(cone[revolute])}°"),
            *(
                (f"random poses that S joints with {angle}° allow", percent(share, len(of.poses)))
                for angle, share in zip(CONES, within, strict=True)
            ),
        ),
        Verdict.OPEN,
        "no joint is given. R and S joints are asked for alike; the S joints that are left limit the poses",
    )
    pull, couple = base_reactions(of.mech, *of.moving)
    rest = np.zeros((len(of.poses), 6))
    random = base_reactions(of.mech, of.poses, rest, rest)[0]
    often = [quantile(known(random[:, which].max(axis=-1)), 0.95).value for which in (revolute, spherical)]
    most = [pull[:, which].max() for which in (revolute, spherical)]
    yield Sentence(
        "2",
        "larger capability of pulling force",
        (
            ("greatest pull along the built-in motion, R joints", f"{kilo(most[0])} kN"),
            ("the same, S joints", f"{kilo(most[1])} kN"),
            ("pull that 95 % of the random poses stay below, R joints", f"{kilo(often[0])} kN"),
            ("the same, S joints", f"{kilo(often[1])} kN"),
            ("greatest couple along the motion, R joints", f"{kilo(couple[:, revolute].max())} kN m"),
        ),
        Verdict.OPEN,
        "no joint is given. The S joints are pulled more; the R joints bear couples besides",
    )


def _smoothness(of: Judged) -> Iterator[Sentence]:
    steps, ends = steps_along(of.mech, of.motion), ends_of(of.mech, of.motion)
    ratios = np.array([step.ratio for step in steps.values()])
    pole = across_singularity(of.mech, of.state.pose[0], of.poses)
    forces = ", ".join(f"{force / 1e6:.0f}" for force in pole.forces)
    before = ", ".join(f"{1e3 * time:g}" for time in pole.before)
    yield Sentence(
        "7",
        "varied smoothly",
        (
            (
                "largest step between samples of the built-in motion over that at half the interval (2: "
                f"continuous; 1: a jump), {len(SERIES)} series",
                span(ratios, ".2f"),
            ),
            (
                "that step at 0.01 s over the range of its series",
                f"at most {100 * max(step.coarse for step in steps.values()):.1f} %",
            ),
            (
                "at its ends: leg rates, leg accelerations, forces less those at rest; over the greatest",
                size(max(ends.rates, ends.accelerations, ends.forces)),
            ),
            (
                f"greatest active force {before} ms before a smooth motion crosses a singularity",
                f"{forces} MN",
            ),
        ),
        Verdict.PARTLY,
        "where a motion stays clear of singularities. Across one, within the strokes, forces have a pole",
    )


def _coupled(of: Judged) -> Iterator[Sentence]:
    load = of.mech.geometry["load"]
    in_millimetres = np.array([*load["force"], *(1e-3 * np.array(load["torque"]))])
    yield Sentence(
        "7",
        "couple-constrained forces are quite small",
        (
            (
                "greater of f_c1 and f_c3 over the greatest active force, sizes, along the built-in motion",
                spread(coupled_share(of.mech, *of.moving)),
            ),
            ("the same at rest at random poses", median_and_tail(coupled_share(of.mech, of.poses))),
            (
                "the same with T_o in N mm",
                median_and_tail(coupled_share(of.mech, of.poses, wrench=in_millimetres)),
            ),
            (
                "at random poses, base joints turned",
                median_and_tail(coupled_share(of.turned, of.turned_poses)),
            ),
        ),
        Verdict.FALSE,
        "mostly small, but anything up to several times the active forces; with T_o in N mm they are small",
    )
    found = redundant_forces(of.mech, *of.moving)
    yield Sentence(
        "2",
        "ς = 3 is for the redundant constraint",
        (
            ("redundant constraints, from ranks", f"{found.redundant}"),
            ("joints whose reactions they leave open", ", ".join(found.open_joints)),
            ("active forces that they leave open", "none" if found.active_determined else "some"),
            (
                "greatest open force along the built-in motion, no couples in U joints",
                f"{kilo(found.without_couples.max())} kN",
            ),
            ("the same, least sum of squares", f"{kilo(found.least.max())} kN"),
        ),
        Verdict.FALSE,
        "there are two. Active forces do not depend on them, but f_c1 and f_c3 do: the paper takes the "
        "couples in the U joints as zero",
    )


def _correct(of: Judged) -> Iterator[Sentence]:
    yield Sentence(
        "7, 8",
        "formulas … are correct",
        (
            (
                "f_c1 of the balance over that of Eq. 44 as printed, along the built-in motion",
                span(printed_share(of.mech, *of.moving), ".1f"),
            ),
        ),
        Verdict.PARTLY,
        "kinematics and Eq. 43 are; Eq. 1 and 44 are not, and Eq. 40 with other inertias is not",
    )
    force, torque = parallel_wrench(of.mech, level_poses(of.mech, of.mech.home[2, 3], _LEVEL_SPACING))
    yield Sentence(
        "3.2",
        "constrained wrench is the constrained torque",
        (
            ("size of c at level poses, where l ∥ L", size(force.max())),
            ("cosine of τ with L and with R1 there", size(torque.max())),
        ),
        Verdict.TRUE,
        "a torque, perpendicular to L and R1",
    )


def _stiffness(of: Judged) -> Iterator[Sentence]:
    at_home = [float(mech.conditioning(mech.home).sigma_min) for mech in (of.mech, of.turned)]
    random = [quantile(mech.conditioning(poses).sigma_min ** 2, 0.5) for mech, poses in of.both]
    yield Sentence(
        "1, 8",
        "rigidity … increased",
        (
            (
                "least stiffness over that of a leg at the centre pose, σ_min²; all else rigid, lengths in "
                "units of e",
                f"{at_home[0] ** 2:.1e}",
            ),
            ("the same, base joints turned", f"{at_home[1] ** 2:.1e}"),
            ("the same at random poses, median", with_error(random[0], ".1e")),
            ("the same, base joints turned", with_error(random[1], ".1e")),
        ),
        Verdict.OPEN,
        "no elasticity and no other machine is given. At the centre pose there is next to none",
    )
    yield Sentence(
        "8",
        "capability of the load bearing … increased",
        (
            (
                "leg forces (norm) over the load at the centre pose, worst load, 1/σ_min",
                f"{1 / at_home[0]:.0f}",
            ),
            ("the same, base joints turned", f"{1 / at_home[1]:.0f}"),
        ),
        Verdict.OPEN,
        "no other machine is given. At the centre pose it bears next to nothing",
    )


def _other(of: Judged) -> Iterator[Sentence]:
    mobility = of.mech.mobility()
    yield Sentence(
        "1, 8",
        "easy to be manufactured, simple in structure",
        (
            (
                "links, joints, redundant constraints",
                f"{mobility.links}, {mobility.joints}, {mobility.redundant}",
            ),
        ),
        Verdict.OPEN,
        "no measure of it is given. Redundant constraints ask for accurate parts",
    )
    yield Sentence("8", "potential applications", (), Verdict.OPEN, "no requirements are given")
