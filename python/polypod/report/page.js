// The charts of a report: they share their time axis and a cursor. Nothing is fetched.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const LIGHT = {
    ink: "#262626", muted: "#5b6470", line: "#e4e6e9", page: "#ffffff", none: "#c9cdd3", beyond: "#fbe7bd",
    curves: ["#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#000000"],
  };
  const DARK = {
    ink: "#e6e8eb", muted: "#a2abb6", line: "#2c3138", page: "#15181c", none: "#3d444d", beyond: "#4a3d1b",
    curves: ["#3f97d8", "#e69f00", "#1fb58f", "#f0703a", "#dd92be", "#9ad4f7", "#f2f2f2"],
  };
  const DASHES = ["solid", "6px,2px", "2px,2px", "7px,2px,2px,2px"];
  const MARGIN = { l: 92, r: 10, t: 8, b: 40 };
  const HEIGHT = 230;
  const LETTER = 6.4; // width of a letter of a label, about
  const PRINTED = { width: 342, height: 205 };
  const FONT = 'system-ui, -apple-system, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif';
  // Named one by one, because some that are there by default lead to a service elsewhere.
  const CONFIG = {
    displaylogo: false, responsive: true,
    modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"], ["toImage"]],
  };
  const CONFIG_3D = {
    ...CONFIG, modeBarButtons: [["orbitRotation", "pan3d", "zoom3d", "resetCameraDefault3d"], ["toImage"]],
  };

  const darkness = window.matchMedia("(prefers-color-scheme: dark)");
  let printing = false;
  const theme = () => (darkness.matches && !printing ? DARK : LIGHT);

  function doubles(text) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Float64Array(bytes.buffer); // little-endian, as all browsers are
  }
  const times = data.times.map(doubles);
  const whole = extent();
  let range = [...whole];
  let now = null;

  /** First and last time of all charts; some room around a single instant. */
  function extent() {
    let [first, last] = [Infinity, -Infinity];
    for (const time of times) {
      first = Math.min(first, time[0]);
      last = Math.max(last, time[time.length - 1]);
    }
    return last > first ? [first, last] : [first - 0.5, first + 0.5];
  }

  const charts = [...document.querySelectorAll("[data-chart]")].map((figure) => {
    const about = data.charts[Number(figure.dataset.chart)];
    return {
      figure, about,
      node: figure.querySelector(".plot"),
      outputs: [...figure.querySelectorAll("output")],
      time: times[about.time],
      curves: null, made: false, following: 0, cursor: null,
    };
  });

  // --- drawing ----------------------------------------------------------------------------------------------

  function traces(chart, colors) {
    return chart.about.curves.map((curve, i) => {
      const values = chart.curves[i];
      // A value without neighbours makes no line.
      const dots = chart.about.dots || values.filter(Number.isFinite).length === 1;
      return {
        x: chart.time, y: values, type: "scatter", mode: dots ? "markers" : "lines", hoverinfo: "none",
        line: { color: colors.curves[curve.color], dash: DASHES[curve.dash], width: 1.6 },
        marker: { color: colors.curves[curve.color], size: chart.about.dots ? 3.5 : 7 }, connectgaps: false,
      };
    });
  }

  /** The label of a chart's values; in two lines if it is longer than the axis. */
  function label(chart) {
    const text = chart.about.label;
    const room = (printing ? PRINTED.height : HEIGHT) - MARGIN.t - MARGIN.b;
    const plain = text.replace(/<[^>]*>/g, "");
    if (LETTER * plain.length <= room) return text;
    // The last words, with the unit, go into the second line.
    const at = text.includes(", ") ? text.lastIndexOf(", ") + 2 : text.lastIndexOf(" / ") + 1;
    return at > 1 ? `${text.slice(0, at)}<br>${text.slice(at)}` : text;
  }

  function layout(chart, colors) {
    const axis = {
      gridcolor: colors.line, linecolor: colors.muted, tickcolor: colors.muted, zeroline: false, showline: true,
      ticks: "outside", ticklen: 3, tickfont: { size: 11 }, automargin: false,
    };
    const levels = chart.about.log ? [] : chart.about.levels;
    const least = chart.about.least; // smaller values are rounding: no axis is stretched for them
    const largest = (values) => values.reduce((most, value) => Math.max(most, Math.abs(value) || 0), 0);
    const size = Math.max(...chart.curves.map(largest));
    return {
      margin: MARGIN, showlegend: false, hovermode: "x", hoverdistance: -1, dragmode: "zoom",
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: FONT, size: 12, color: colors.ink },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colors.muted, activecolor: colors.ink },
      xaxis: { ...axis, range: [...range], title: { text: "time <i>t</i> / s", standoff: 6, font: { size: 11.5 } } },
      yaxis: {
        ...axis, type: chart.about.log ? "log" : "linear", exponentformat: "power", showexponent: "all",
        nticks: 6, ...(size < least ? { range: [-least, least] } : {}),
        title: { text: label(chart), standoff: 4, font: { size: 11.5 } },
      },
      shapes: [
        ...data.marks.map((mark) => ({
          type: "rect", xref: "x", yref: "paper", x0: mark.from, x1: mark.to, y0: 0, y1: 1, layer: "below",
          line: { width: 0 }, fillcolor: colors[mark.kind], opacity: 0.75,
        })),
        ...levels.map((level) => ({
          type: "line", xref: "paper", yref: "y", x0: 0, x1: 1, y0: level, y1: level,
          line: { color: colors.muted, width: 1, dash: "5px,4px" },
        })),
      ],
      ...(printing ? PRINTED : {}),
    };
  }

  function make(chart) {
    if (chart.made) return;
    chart.made = true;
    chart.curves = chart.about.curves.map((curve) => doubles(curve.values));
    const colors = theme();
    Plotly.newPlot(chart.node, traces(chart, colors), layout(chart, colors), CONFIG);
    chart.cursor = document.createElement("div");
    chart.cursor.className = "cursor";
    chart.cursor.style.top = `${MARGIN.t}px`;
    chart.cursor.style.bottom = `${MARGIN.b}px`;
    chart.cursor.hidden = true;
    chart.node.append(chart.cursor);
    chart.node.on("plotly_hover", (event) => point(event.points[0].x));
    chart.node.on("plotly_relayout", (change) => moved(chart, change));
    place(chart);
  }

  function redraw() {
    const colors = theme();
    for (const chart of charts) {
      if (chart.made && visible(chart)) Plotly.react(chart.node, traces(chart, colors), layout(chart, colors), CONFIG);
      place(chart);
    }
  }

  const visible = (chart) => chart.node.closest("details:not([open])") === null;

  // --- one time axis and one cursor for all -----------------------------------------------------------------

  function moved(source, change) {
    let to = null;
    if ("xaxis.range[0]" in change) to = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    else if ("xaxis.range" in change) to = [...change["xaxis.range"]];
    else if (change["xaxis.autorange"]) to = [...whole];
    // Another size or axis; or a chart that follows, which tells so, too: it must not lead in its turn.
    if (to === null || source.following > 0) {
      place(source);
      return;
    }
    range = to;
    for (const chart of charts) {
      if (chart.made && (chart !== source || change["xaxis.autorange"])) {
        chart.following += 1;
        Plotly.relayout(chart.node, { "xaxis.range": [...range] }).finally(() => {
          chart.following -= 1;
        });
      }
      place(chart);
    }
  }

  function nearest(time, t) {
    let [low, high] = [0, time.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle;
      else high = middle;
    }
    return t - time[low] <= time[high] - t ? low : high;
  }

  const readable = (value) =>
    Number.isFinite(value) ? String(Number(value.toPrecision(5))).replace("-", "−") : "none";

  function point(t) {
    now = t;
    for (const chart of charts) place(chart);
    const label = document.getElementById("time");
    label.hidden = false;
    label.textContent = `t = ${readable(t)} s`;
  }

  /** The cursor of a chart, and the numbers under it. */
  function place(chart) {
    if (!chart.made) return;
    const [first, last] = range;
    const inside = now !== null && now >= first && now <= last;
    chart.cursor.hidden = !inside;
    if (now === null) return;
    const width = chart.node.clientWidth - MARGIN.l - MARGIN.r;
    chart.cursor.style.left = `${MARGIN.l + (width * (now - first)) / (last - first)}px`;
    const at = nearest(chart.time, now);
    chart.outputs.forEach((output, i) => {
      output.value = readable(chart.curves[i][at]);
    });
  }

  // --- the workspace in space -------------------------------------------------------------------------------

  const space = document.getElementById("space");
  const through = document.getElementById("through");
  let figure = null;

  function spaceLayout() {
    const colors = theme();
    const scene = { ...figure.layout.scene };
    for (const name of ["xaxis", "yaxis", "zaxis"]) {
      scene[name] = { ...scene[name], color: colors.ink, gridcolor: colors.line, zerolinecolor: colors.line };
    }
    const legend = { ...figure.layout.legend };
    // Beside the picture where there is room, below it where there is not.
    if (space.clientWidth < 700) Object.assign(legend, { orientation: "h", y: -0.02, yanchor: "top" });
    return {
      ...figure.layout, scene, legend,
      paper_bgcolor: "rgba(0,0,0,0)", font: { family: FONT, size: 12, color: colors.ink },
    };
  }

  function spaceTraces() {
    const opacity = through.checked ? 0.35 : 1;
    // Black lines would be lost on a dark page.
    const lit = (line) => (line.color === "#000000" ? { ...line, color: theme().curves[6] } : line);
    return figure.data.map((trace) =>
      trace.type === "mesh3d" ? { ...trace, opacity } : { ...trace, line: lit(trace.line) },
    );
  }

  function redrawSpace() {
    Plotly.react(space, spaceTraces(), spaceLayout(), CONFIG_3D);
  }

  function makeSpace() {
    if (figure !== null) return;
    figure = JSON.parse(document.getElementById("figure").textContent);
    Plotly.newPlot(space, spaceTraces(), spaceLayout(), CONFIG_3D);
    through.addEventListener("change", redrawSpace);
  }

  // --- when -------------------------------------------------------------------------------------------------

  const seen = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        seen.unobserve(entry.target);
        if (entry.target === space) makeSpace();
        else make(charts.find((chart) => chart.node === entry.target));
      }
    },
    { rootMargin: "500px" },
  );
  for (const chart of charts) seen.observe(chart.node);
  if (space !== null) seen.observe(space);

  darkness.addEventListener("change", () => {
    redraw();
    if (figure !== null) redrawSpace();
  });
  window.addEventListener("beforeprint", () => {
    printing = true;
    for (const chart of charts) if (visible(chart)) make(chart);
    redraw();
  });
  window.addEventListener("afterprint", () => {
    printing = false;
    redraw();
    for (const chart of charts) if (chart.made && visible(chart)) Plotly.Plots.resize(chart.node);
  });
  window.addEventListener("resize", () => charts.forEach(place));
})();
