"""The page: the contents of a report, in the template, with all that a browser needs to show it."""

from __future__ import annotations

import base64
import hashlib
import json
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from polypod.files.text import replacing
from polypod.mechanism import Mechanism
from polypod.report import figures, groups
from polypod.report.charts import Chart, Series
from polypod.report.content import Along, Content, Progress, gather, path_of_o
from polypod.report.data import data_tables
from polypod.report.decimate import POINTS, spans
from polypod.report.inputs import MotionSource, versions
from polypod.report.reactions import reactions_table
from polypod.report.space import workspace_figure
from polypod.report.words import actuators_table, glance, outcomes, warnings, workspace_words
from polypod.summary import tables
from polypod.workspaces.workspace import Workspace


def report_html(
    mech: Mechanism,
    motion: MotionSource | None = None,
    *,
    samples: int | None = None,
    workspace: Workspace | bool = True,
    step: float | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> str:
    """One HTML page on a mechanism, and on its motion if there is one; it needs no network and no other file.

    Args:
        mech: the mechanism.
        motion: a motion file or a built-in motion's name, a `Motion`, or a `Solution` of one.
        samples: solve at so many instants evenly over the motion instead of at its own.
        workspace: whether to find the reachable workspace; or one that is there already.
        step: width of the workspace's cells, m; by default the widest bounds have 64.
        command: the command line that is shown for reproduction.
        progress: called now and then with the number of states solved and the number of all.

    Raises:
        MotionError: everything wrong with the motion's file.
        UnknownNameError: no such motion.
        WorkspaceError: a step with which no workspace is found. Without one the page says why there is none.
    """
    content = gather(mech, motion, samples=samples, workspace=workspace, step=step, progress=progress)
    return render(content, command)


def write_report(
    mech: Mechanism,
    path: str | PathLike[str],
    motion: MotionSource | None = None,
    **more: Any,
) -> None:
    """Writes the page of `report_html` to a file, which appears whole or not at all.

    Args:
        mech: the mechanism.
        path: the file; it is overwritten.
        motion: as for `report_html`.
        more: the other arguments of `report_html`.

    >>> import polypod as pp
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> pp.write_report(mech, "report.html", "lu-3spu-2rpu-r", samples=21, workspace=False)
    """
    save(report_html(mech, motion, **more), path)


def save(html: str, path: str | PathLike[str]) -> None:
    """Writes a page."""
    with replacing(Path(path)) as temporary:
        temporary.write_text(html, encoding="utf-8")


def render(content: Content, command: str = "") -> str:
    """The page with a content."""
    # Names come from files and may hold anything: all texts are escaped but those made as Markup.
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(_asset("page.html.jinja"))
    series = Series()
    script, plotly = Markup(_asset("page.js")), Markup(get_plotlyjs())
    parts = {
        "content": content,
        "facts": content.facts,
        "glance": glance(content),
        "warnings": warnings(content),
        "mechanism": _mechanism(content),
        "motion": None if content.along is None else _motion(content.mech, content.along, series),
        "workspace": _workspace(content),
        "paper": [(title, _markdown(text)) for title, text in content.paper],
        "versions": versions(),
        "command": command,
    }
    return template.render(
        **parts,
        points=POINTS,
        decimated=series.decimated,
        data={"times": series.times, "charts": series.charts, "marks": _marks(content)},
        style=Markup(_asset("page.css")),
        script=script,
        plotly=plotly,
        hashes=[_hash(plotly), _hash(script)],
    )


def _asset(name: str) -> str:
    return (files("polypod") / "report" / name).read_text(encoding="utf-8")


def _hash(script: str) -> str:
    """Hash of a script for the page's security policy, so that no other one runs."""
    return base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")


def _markdown(text: str) -> Markup:
    """Markdown with tables as HTML; tags in it stay text."""
    return Markup(MarkdownIt("commonmark", {"html": False}).enable("table").render(text))


# --- parts --------------------------------------------------------------------------------------------------


def _mechanism(content: Content) -> dict[str, Any]:
    facts, mech = content.facts, content.mech
    return {
        "picture": figures.mechanism_picture(mech),
        "topology": figures.topology_picture(mech),
        "legs": tables.legs_table(facts),
        "data": data_tables(mech),
        "mobility": [tables.mobility_table(facts), tables.accounting_table(facts)],
        "links": tables.topology_table(facts),
        "constraints": tables.constraints_table(facts),
        "coordinates": tables.coordinates_table(facts),
        "centre": tables.centre_table(facts),
        "limits": tables.limits_table(facts),
    }


def _motion(mech: Mechanism, along: Along, series: Series) -> dict[str, Any]:
    solution, facts = along.solution, along.facts
    data = solution.dataset

    def shown(charts: list[Chart]) -> list[dict[str, Any]]:
        return [series.add(chart) for chart in charts]

    return {
        "facts": facts,
        "tables": tables.motion_tables(facts),
        "note": tables.coupled_note(facts),
        "outcome": outcomes(facts),
        "outcomes": tables.outcomes_table(facts),
        "poses": figures.poses_picture(mech, solution),
        "fig4": shown(groups.motion_charts(solution)),
        "actuators": actuators_table(along.actuators, mech),
        "actuator_charts": shown(groups.actuator_charts(mech, solution)),
        "reactions": reactions_table(along.reactions),
        "reaction_charts": shown(groups.reaction_charts(mech, along.reactions)),
        "undetermined": bool(along.reactions.undetermined.any()),
        "singularity_charts": shown(groups.singularity_charts(mech, solution)),
        "legs": [
            (name, shown(groups.leg_charts(data, i, drive.links)))
            for i, (name, drive) in enumerate(zip(mech.leg_names, mech.drives, strict=True))
        ],
        "source": along.source,
    }


def _workspace(content: Content) -> dict[str, Any]:
    found = content.workspace
    if found is None:
        return {"why": content.no_workspace}
    path = None if content.along is None else path_of_o(content.along.solution)
    facts = found.facts()
    of_o = found.names == ("x", "y", "z")
    return {
        "why": "",
        "words": workspace_words(facts),
        **({"figure": json.loads(workspace_figure(found, path))} if of_o else {}),
        "picture": figures.workspace_picture(found),
        "extents": tables.extents_table(facts),
        "extent_limits": tables.extent_limits_table(facts),
        "ends": tables.ends_table(facts),
    }


def _marks(content: Content) -> list[dict[str, Any]]:
    """Spans of time to mark in every chart, with the neighbours of the states that are meant."""
    if content.along is None:
        return []
    data = content.along.solution.dataset
    time = data["time"].to_numpy()
    return [
        {"kind": kind, "from": float(time[max(a - 1, 0)]), "to": float(time[min(b + 1, len(time) - 1)])}
        for kind, flags in zip(("none", "beyond"), groups.marks(data), strict=True)
        for a, b in spans(flags)
    ]
