"""The independent model itself: its rates against differences, its forces against its energies."""

from __future__ import annotations

import numpy as np
import pytest

from support import oracle as o
from support.cases import FORCES, SEED, STENCIL, agree, any_case, each


@pytest.mark.parametrize("name", ["lu", "rod-lined", "rps-spr-upu", "5-ups-upu"])
def test_oracle_links_move_as_differences_of_positions_say(name):
    c = any_case(name)
    some = slice(1, 5)
    pose = (c.pose[0][some], c.pose[1][some])
    # A motion that starts as `along` and closes at every time; both differ by t³.
    V, A = o.feasible_motion(c.spec, pose, *np.random.default_rng(SEED).normal(size=(2, 4, 6)) * 0.3)

    def tables(pose, read):
        links = o.links_at(c.spec, pose)
        return np.stack(
            [np.concatenate([read(k.center)[:, None], read(k.frame)], axis=1) for k in links], axis=1
        )

    free = [
        k for k, leg in enumerate(c.spec["legs"]) if leg["base"]["joint"] + leg["platform"]["joint"] == "SS"
    ]
    skip = len(c.spec["rods"]) + 1
    kept = [i for i in range(skip + 2 * len(c.spec["legs"])) if (i - skip) // 2 not in free or i < skip]
    first, second = o.differentiate(
        lambda t: tables(o.close(c.spec, o.along(pose, V, A, t)), lambda jet: jet.x)[:, kept], 8e-3
    )
    motion = o.moving(pose, V, A)
    agree(first, tables(motion, lambda jet: jet.d)[:, kept], STENCIL)
    agree(second, tables(motion, lambda jet: jet.dd)[:, kept], STENCIL)


@each
def test_oracle_power_balances(name):
    """The oracle's own forces do the work that its energies ask for, but for friction."""
    c = any_case(name)
    f = o.active_forces(c.spec, c.pose, c.twist, c.acceleration)
    _, platform = o.generalised_force(c.spec, c.pose, c.twist, c.acceleration)
    _, _, dK, dP = o.energy(c.spec, c.pose, c.twist, c.acceleration)
    rates = np.concatenate([leg.length.d for leg in c.legs], axis=1)[:, o.actuated(c.spec)]
    V, spec = c.twist, c.spec
    load = np.sum(o.load_at(spec, c.pose) * V, axis=1)
    load -= spec["linear_damping"] * np.sum(V[:, :3] ** 2, axis=1)
    load -= spec["angular_damping"] * np.sum(V[:, 3:] ** 2, axis=1)
    work = f * rates
    friction = (1 / spec["efficiency"] - 1) * np.sum(platform * V, axis=1)
    balance = np.sum(work, axis=1) + load + friction - dK - dP
    size = np.sum(np.abs(work), axis=1) + np.abs(load) + np.abs(dK) + np.abs(dP)
    assert np.max(np.abs(balance) / size / c.condition) < FORCES
