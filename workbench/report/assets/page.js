"use strict";
(() => {
  const PAPER_WIDTH = 640;
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const CONFIG = {
    responsive: true,
    displaylogo: false,
    showSendToCloud: false, // plotly's default offers to upload the data of a plot
    plotlyServerURL: "",
    displayModeBar: touch ? true : "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
    toImageButtonOptions: { format: "svg" },
  };

  // Ticks that a reader expects at the present zoom: 1, 2, 5, 10 on a log axis, multiples of `step` where there is one.
  function logTicks(low, high) {
    const decades = high - low;
    if (decades < 0.9) return { tickmode: "auto", dtick: null };
    const few = decades <= 4;
    const apart = few ? 1 : Math.ceil(decades / 8);
    const values = [];
    for (let power = Math.ceil(Math.floor(low) / apart) * apart; power <= high; power += apart)
      for (const digit of few ? [1, 2, 5] : [1]) values.push(Number(digit + "e" + power));
    const text = values.map((value) => (few ? String(value) : `10<sup>${Math.round(Math.log10(value))}</sup>`));
    return { tickmode: "array", tickvals: values, ticktext: text, "minor.showgrid": few };
  }

  function steppedTicks(low, high, step) {
    const span = Math.abs(high - low);
    const times = [1, 2, 4, 8, 16].find((n) => span <= 7 * n * step);
    return times && span > 1.5 * step
      ? { tickmode: "linear", tick0: 0, dtick: times * step }
      : { tickmode: "auto", dtick: null };
  }

  function setTicks(plot, steps) {
    const at = (object, path) => path.split(".").reduce((inner, key) => inner?.[key], object) ?? null;
    const change = {};
    for (const name of Object.keys(plot.layout).filter((key) => /^[xy]axis/.test(key))) {
      const axis = plot._fullLayout[name];
      const [low, high] = axis.range;
      const wanted = axis.type === "log" ? logTicks(low, high) : name in steps ? steppedTicks(low, high, steps[name]) : {};
      for (const [key, value] of Object.entries(wanted))
        if (JSON.stringify(at(plot.layout[name], key)) !== JSON.stringify(value)) change[name + "." + key] = value;
    }
    if (Object.keys(change).length) Plotly.relayout(plot, change);
  }

  function drawFigure(figure) {
    const plot = figure.querySelector(".plot");
    const { data, layout, steps } = JSON.parse(figure.querySelector("script").textContent);
    if (touch) layout.dragmode = false; // a finger scrolls the page; the tool bar zooms
    if (plot.clientWidth < 500) {
      layout.hovermode = "closest"; // the box with every curve would cover a narrow plot
      for (const trace of data.filter((one) => one.hovertemplate))
        trace.hovertemplate = `%{x:.5~g}: ${trace.hovertemplate}`;
    }
    Plotly.newPlot(plot, data, layout, CONFIG);
    setTicks(plot, steps);
    plot.on("plotly_relayout", () => setTicks(plot, steps));
    connectLegend(figure, plot);
  }

  function connectLegend(figure, plot) {
    const keys = [...figure.querySelectorAll(".keys button")];
    const show = (key, on) => key.setAttribute("aria-pressed", String(on));
    const isOn = (key) => key.getAttribute("aria-pressed") === "true";
    const apply = () => {
      const on = new Set(keys.filter(isOn).map((key) => key.dataset.name));
      Plotly.restyle(plot, { visible: plot.data.map((trace) => on.has(trace.legendgroup)) });
    };
    for (const key of keys) {
      key.addEventListener("click", () => { show(key, !isOn(key)); apply(); });
      key.addEventListener("dblclick", () => {
        const alone = keys.every((other) => other === key || !isOn(other));
        keys.forEach((other) => show(other, alone || other === key));
        apply();
      });
    }
  }

  function sortBy(table, column, header) {
    const up = header.getAttribute("aria-sort") !== "ascending";
    table.querySelectorAll("th").forEach((th) => th.removeAttribute("aria-sort"));
    header.setAttribute("aria-sort", up ? "ascending" : "descending");
    const key = (row) => {
      const cell = row.cells[column];
      const text = cell.textContent;
      return "v" in cell.dataset ? Number(cell.dataset.v) : text === "–" ? null : text;
    };
    const order = (a, b) => {
      if (a === null || b === null) return (a === null) - (b === null); // what does not exist stays last
      const less = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b), "en", { numeric: true });
      return up ? less : -less;
    };
    const body = table.tBodies[0];
    body.append(...[...body.rows].map((row) => [key(row), row]).sort((a, b) => order(a[0], b[0])).map((pair) => pair[1]));
  }

  document.querySelectorAll("figure.item:not(.scene)").forEach(drawFigure);
  document.querySelectorAll("table").forEach((table) =>
    table.querySelectorAll("th").forEach((header, column) =>
      header.querySelector("button").addEventListener("click", () => sortBy(table, column, header))));

  // Paper is narrower than most screens, and plots do not follow the print layout by themselves.
  const plots = () => [...document.querySelectorAll(".plot")];
  window.addEventListener("beforeprint", () => plots().forEach((plot) => Plotly.relayout(plot, { width: PAPER_WIDTH })));
  window.addEventListener("afterprint", () => plots().forEach((plot) => Plotly.relayout(plot, { width: null, autosize: true })));
})();
