"use strict";
// The three charts: scenario, closed loop, open loops.
const Plots = (() => {
  const INK = "#1f2328", SOFT = "#57606a", RULE = "#afb8c1", GRID = "#dfe3e8", GREY = "#8c959f", BAD = "#b42318";
  const PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#882255", "#332288", "#999933"];
  const CONFIG = { responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "", displayModeBar: false };
  const FONT = { family: "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif", size: 11, color: INK };
  const chart = (id) => document.querySelector(`#${id} .chart`);
  const touch = window.matchMedia("(pointer: coarse)").matches;

  const colour = (lane) => PALETTE[lane % PALETTE.length];

  function floats(text) {
    const letters = atob(text), bytes = new Uint8Array(letters.length);
    for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
    return new Float32Array(bytes.buffer);
  }

  function lanes(text, count) {
    const all = floats(text), k = all.length / count;
    return Array.from({ length: count }, (_, lane) => all.subarray(lane * k, (lane + 1) * k));
  }

  const axis = (title, more) => ({
    title: { text: title, standoff: 4, font: { size: 11, color: SOFT } }, showline: true, linecolor: RULE, mirror: true, exponentformat: "power",
    gridcolor: GRID, zeroline: false, ticklabeloverflow: "allow", tickfont: { color: SOFT, size: 10.5 }, ...more,
  });
  const line = (x, y, color, width, more) => ({ x, y, mode: "lines", line: { color, width, simplify: false }, hoverinfo: "skip", ...more });
  const hover = (template, name) => ({ hoverinfo: undefined, hovertemplate: `${template}<extra>${name}</extra>` });
  const TICKS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
  const layout = (revision, more) => ({
    margin: { l: 58, r: 12, t: 28, b: 36 }, font: FONT, paper_bgcolor: "#fff", plot_bgcolor: "#fff", showlegend: false, uirevision: revision,
    dragmode: touch ? false : "zoom", hovermode: "closest", ...more,
  });
  const heading = (wide, narrow) => ({ text: window.innerWidth > 900 ? wide : narrow, x: 0, xref: "paper", xanchor: "left", y: 1, yref: "container", yanchor: "top", pad: { t: 7 }, font: { size: 12, color: INK } });

  // While numbers move, only lines do: they are drawn into Plotly's own paths, which takes a twentieth of the time that
  // Plotly takes for the whole. It draws the whole where anything else changes, and once the numbers rest.
  const whole = new Map();
  function draw(id, data, layout) {
    data.forEach((trace, i) => (trace.uid = `${id}${i}`));
    const key = JSON.stringify([layout, data.map(({ line, mode }) => [line, mode])]);
    const before = whole.get(id);
    const entry = { key, data, layout, drawn: before?.key === key && sketched(chart(id), data) };
    whole.set(id, entry);
    if (!entry.drawn) Plotly.react(chart(id), data, layout, CONFIG);
  }

  function settle() {
    for (const [id, { drawn, data, layout }] of whole) if (drawn) Plotly.react(chart(id), data, layout, CONFIG);
    whole.forEach((entry) => (entry.drawn = false));
  }

  function sketched(plot, data) {
    const moving = data.filter((trace) => !trace.still);
    const paths = moving.map((trace) => plot.querySelectorAll(`.trace${trace.uid} .js-line`));
    if (moving.some((trace, i) => trace.mode !== "lines" || paths[i].length !== 1)) return false;
    const { xaxis, yaxis, yaxis2 } = plot._fullLayout;
    moving.forEach((trace, i) => paths[i][0].setAttribute("d", path(trace, xaxis, trace.yaxis === "y2" ? yaxis2 : yaxis)));
    return true;
  }

  function path({ x, y }, xaxis, yaxis) {
    let text = "", begins = true;
    for (let i = 0; i < x.length; i++) {
      const gap = !Number.isFinite(x[i]) || !Number.isFinite(y[i]);
      if (!gap) text += `${begins ? "M" : "L"}${xaxis.d2p(x[i]).toFixed(1)},${yaxis.d2p(y[i]).toFixed(1)}`;
      begins = gap;
    }
    return text || "M0,0";
  }

  // Axes around all that is drawn, each from those of its parts, as far as they are there.
  function around(...parts) {
    const [first, ...others] = parts.filter(Boolean);
    return first.map((_, i) => others.reduce((all, axes) => [Math.min(all[0], axes[i][0]), Math.max(all[1], axes[i][1])], first[i]));
  }

  // Nominal last, so that it lies above the others.
  const order = (count) => [...Array(count).keys()].reverse();
  const width = (lane) => (lane === 0 ? 2 : 1.1);

  function drawStep(steps, context) {
    const { count, unit, signal, file, revision, rigs, seconds } = context;
    document.getElementById("step").classList.toggle("stale", !steps);
    if (!steps) return;
    const t = floats(steps.t), sent = floats(steps.command_t), y = lanes(steps.y, count), command = lanes(steps.command, count);
    const data = [line(t, floats(steps.reference), GREY, 1, { line: { color: GREY, width: 1, dash: "dash" }, still: true })];
    if (file) data.push(line(floats(file.t), lanes(file.y, count)[0], GREY, 2.2, { still: true }));
    for (const lane of order(count)) {
      data.push(line(t, y[lane], colour(lane), width(lane), hover(`%{x:.3f} s, %{y:.4~g} ${unit}`, rigs[lane])));
      data.push(line(sent, command[lane], colour(lane), width(lane), { yaxis: "y2", ...hover("%{x:.3f} s, %{y:.3~g}", rigs[lane]) }));
    }
    const [range, commands] = around(steps.axes, file?.axes);
    const turned = steps.turned ? [{ text: steps.turned, x: 1, y: 0.37, xref: "paper", yref: "paper", xanchor: "right", yanchor: "bottom", showarrow: false, bgcolor: "rgba(255,255,255,0.8)", font: { color: BAD, size: 12 } }] : [];
    const band = [-1, 1].map((side) => ({ type: "line", x0: 0, x1: 1, xref: "x domain", y0: steps.end + side * steps.band, y1: steps.end + side * steps.band, line: { color: GREY, width: 1, dash: "dot" } }));
    draw("step", data, layout(revision, {
      title: heading(`${signal} on every rig; dotted: settled; grey: as in the file`, `${signal} on every rig; command`), shapes: band, annotations: turned,
      xaxis: axis("time [s]", { anchor: "y2", range: [0, Math.min(seconds ?? Infinity, t[t.length - 1])] }),
      yaxis: axis(`${signal} [${unit}]`, { domain: [0.36, 1], range }),
      yaxis2: axis("command [1]", { domain: [0, 0.28], range: commands }),
    }));
  }

  function drawBode(linear, sines, context) {
    const { file, revision, rows } = context;
    const data = [];
    const both = (f, gain, phase, make) => { data.push(make(f, gain, "y")); data.push(make(f, phase, "y2")); };
    if (file) both(floats(file.f), floats(file.gain), floats(file.phase), (x, y, yaxis) => line(x, y, GREY, 2.2, { yaxis, still: true }));
    if (linear) both(floats(linear.f), floats(linear.gain), floats(linear.phase), (x, y, yaxis) => line(x, y, colour(0), 2, { yaxis, ...hover(`%{x:.3~g} Hz, %{y:.3~g} ${yaxis === "y" ? "dB" : "deg"}`, "linear") }));
    if (sines) both(floats(sines.f), floats(sines.gain), floats(sines.phase), (x, y, yaxis) => ({ x, y, yaxis, mode: "lines+markers", line: { color: "#d55e00", width: 1 }, marker: { color: "#d55e00", size: 5 }, ...hover(`%{x:.3~g} Hz, %{y:.3~g} ${yaxis === "y" ? "dB" : "deg"}`, "sines") }));
    const unstable = context.unstable ? [{ text: "unstable: no linear response", x: 0.5, y: 0.8, xref: "paper", yref: "paper", showarrow: false, font: { color: BAD, size: 13 } }] : [];
    const [gains, phases] = around(linear?.axes ?? [[-32, 12], [-370, 20]], file?.axes, sines?.axes);
    const by = sines ? `; orange: sines of ${sines.amplitude}${sines.limited ? `, limited from ${sines.limited.toPrecision(3)} Hz` : ""}` : "";
    draw("bode", data, layout(revision, {
      title: heading(`closed loop, nominal: linear${by}`, `closed loop; ${by.slice(2)}`), annotations: unstable, margin: { l: 58, r: 12, t: 28 + 15 * rows, b: 36 },
      xaxis: axis("frequency [Hz]", { type: "log", anchor: "y2", range: [-1, Math.log10(200)], tickvals: TICKS, ticktext: TICKS.map(String) }),
      yaxis: axis("gain [dB]", { domain: [0.46, 1], range: gains }),
      yaxis2: axis("phase [deg]", { domain: [0, 0.42], range: phases, dtick: 90 }),
    }));
  }

  // |1/(1 + L)| = Ms, as a curve of L in degrees and dB.
  function sensitivityLine(ms) {
    const x = [], y = [];
    for (let i = 0; i <= 180; i++) {
      const angle = (2 * Math.PI * i) / 180, re = -1 + Math.cos(angle) / ms, im = Math.sin(angle) / ms;
      const phase = (Math.atan2(im, re) * 180) / Math.PI;
      x.push(phase > 0 ? phase - 360 : phase);
      y.push(20 * Math.log10(Math.hypot(re, im)));
    }
    return [x, y];
  }

  function drawNichols(linear, context) {
    const { count, limits, revision, rigs } = context;
    const data = [];
    for (const [ms, fill] of [[limits.ms_nominal, "rgba(180,35,24,0.06)"], [limits.ms, "rgba(180,35,24,0.12)"]]) {
      const [x, y] = sensitivityLine(ms);
      data.push(line(x, y, BAD, 0.8, { fill: "toself", fillcolor: fill, still: true }));
    }
    data.push({ x: [-180], y: [0], mode: "markers", marker: { color: BAD, size: 7, symbol: "cross" }, hoverinfo: "skip", still: true });
    if (linear) {
      for (const lane of order(count)) {
        const { gain, phase } = linear.open[lane];
        data.push(line(floats(phase), floats(gain), colour(lane), width(lane), hover(`%{x:.4~g} deg, %{y:.3~g} dB`, rigs[lane])));
      }
    }
    const [gains, phases] = linear?.open_axes ?? [[-32, 24], [-400, 0]];
    draw("nichols", data, layout(revision, {
      title: heading(`open loops at null; red: Ms above ${limits.ms_nominal} (nominal), ${limits.ms} (every rig)`, `open loops; red: Ms above ${limits.ms_nominal}, ${limits.ms}`),
      xaxis: axis("phase [deg]", { range: phases, dtick: 90 }), yaxis: axis("gain [dB]", { range: gains }),
    }));
  }

  return { colour, drawStep, drawBode, drawNichols, settle };
})();
