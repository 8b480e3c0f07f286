"""The paper's Tables I and III, Section 4 and sentences as Markdown; every number is measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from polypod.errors import MissingEngineError
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.paper.section4 import Section4, as_markdown
from polypod.paper.sentences.isotropy import SPACING
from polypod.paper.sentences.judgements import Judged, isotropy_markdown
from polypod.paper.sentences.poses import CONFIDENCE, SAMPLES
from polypod.paper.sentences.sentence import Sentence
from polypod.paper.sentences.sentence import as_markdown as sentences_as_markdown
from polypod.paper.table_i import fit_markdown, fit_table_i, table_i

COMPARED = 81
"""States of the motion that are compared with another engine."""


TABLE_II = (
    "Dimensions, masses, inertias and load are taken over as printed; they stand under "
    "[Mechanism](#mechanism) in the tables of joints, links, load and settings."
)
"""Table II, in a report."""


def table_i_markdown(mech: Mechanism) -> str:
    """Table I: orientations published, computed and fitted."""
    first, fit = table_i(mech), fit_table_i(mech)
    fitted = fit.orientations
    e, on_rod, other = 1e3 * fit.radii
    rms, largest = np.degrees([first.rms, fitted.rms]), np.degrees([first.largest, fitted.largest])
    skew = 1e3 * abs(first.lengths[0, 0] - first.lengths[0, 2])
    modes = first.modes.number.max()
    return f"""Of up to {modes} assembly modes in each row, the one above the base nearest to the print.

{fit_markdown(first, fit)}

- With Table II the 18 angles differ by {rms[0]:.2f}° rms, {largest[0]:.2f}° at most.
- Fitted: e = {e:.1f}, E_1 = {on_rod:.1f}, E_2 = {other:.1f} mm; then {rms[1]:.2f}° rms,
  {largest[1]:.2f}° at most.
- Row 1 is not symmetric, r_1 and r_3 differ by {skew:.2f} mm; yet φ_zX = 90° is printed.
"""


def section4_markdown(found: Section4, figure: str) -> str:
    """The workspace of Section 4: sizes printed and computed; `figure` says which one shows it."""
    facts = found.facts()
    flood = facts["flood"]
    share = 100 * flood["volume_error"] / flood["volume"]
    return f"""{as_markdown(facts)}

{figure} shows the first, coloured by what ends it. Its volume is
{flood["volume"]:.3f} m³, give or take {share:.1g} %. The paper steps the lengths by 10 mm; that takes longer.
"""


def sentences_markdown(of: Judged, sentences: Sequence[Sentence]) -> str:
    """The paper's qualitative sentences with measures, numbers and verdicts."""
    return f"""Random poses are {SAMPLES} upright ones within the strokes, uniform in the natural coordinates.
In brackets, or after ±, are intervals of {100 * CONFIDENCE:.0f} %; the greatest of the samples is no bound.
"Turned" is `{of.turned.name}`, the same machine with three base joints rotated.

{sentences_as_markdown(sentences)}

The first sentence at each height, over a grid of {1e3 * SPACING:.0f} mm in X and Y: median and least.

{isotropy_markdown(of)}
"""


def verdicts_markdown(sentences: Sequence[Sentence]) -> str:
    """The verdicts alone, as a list."""
    return "\n".join(f"- “{s.words}”: {s.verdict}; {s.reason}." for s in sentences) + "\n"


def table_iii_markdown(mech: Mechanism, motion: Motion, name: str) -> str:
    """Table III: errors against another engine along a motion, which is called `name`."""
    # The engines take their time to load.
    from polypod.verify import verify
    from polypod.verify.verdict import as_markdown as verification_markdown

    compared = motion
    if len(motion.time) > COMPARED:
        compared = motion.sample(np.linspace(motion.time[0], motion.time[-1], COMPARED))
    try:
        facts = verify(mech, compared).facts()
    except MissingEngineError as error:
        return f"Not compared with another engine: {error}\n"
    count, command = len(compared.time), f"polypod verify {mech.name} {name}"
    return f"""Errors at {count} instants of the motion; `{command}` compares at all.

{verification_markdown(facts)}
"""
