"use strict";
// Asks what the rig does thirty times a second, and draws the last seconds of it.
(() => {
  const start = JSON.parse(document.getElementById("start").textContent);
  const get = (id) => document.getElementById(id);
  const SECONDS = 5, EVERY = 1000 / 30;
  const rows = [...start.signals, ...start.commands].map(panel);
  const times = [];
  let busy = false;

  function panel(signal) {
    const box = document.createElement("figure");
    const caption = document.createElement("figcaption"), name = document.createElement("span"), value = document.createElement("b");
    name.textContent = signal.name;
    caption.append(name, value);
    const canvas = document.createElement("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${signal.name} over the last ${SECONDS} seconds`);
    box.append(caption, canvas);
    get("panels").append(box);
    return { signal, value, canvas, values: [] };
  }

  async function post(what, body) {
    const answer = await fetch(what, { method: "POST", body: JSON.stringify(body) });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  }

  async function look() {
    if (busy) return;
    busy = true;
    try {
      show(await post("now", {}));
    } catch {
      say("The rig is no longer served.", "gone");
    }
    busy = false;
  }

  function say(text, kind) {
    get("state").textContent = text;
    get("state").className = kind;
  }

  function show(now) {
    times.push(now.t);
    [...now.values, ...now.commands].forEach((value, k) => rows[k].values.push(value));
    while (times.length && times[0] < now.t - SECONDS) {
      times.shift();
      rows.forEach((row) => row.values.shift());
    }
    const words = { on: "On", off: "Off", tripped: `Tripped: ${now.trip}` };
    say(words[now.state] + (now.watchdog ? "; the client is silent, the watchdog holds the command at 0" : ""), now.state);
    get("on").disabled = now.state !== "off";
    get("off").disabled = now.state !== "on";
    get("reset").disabled = now.state !== "tripped";
    get("counts").textContent = `${now.periods} periods, ${now.missed} readings a period late, ${now.dropped} datagrams dropped`;
    rows.forEach(draw);
  }

  function draw(row) {
    const last = row.values[row.values.length - 1];
    row.value.textContent = `${last.toPrecision(4)}${row.signal.unit === "1" ? "" : " " + row.signal.unit}`;
    const ratio = window.devicePixelRatio || 1, wide = row.canvas.clientWidth, high = row.canvas.clientHeight;
    row.canvas.width = wide * ratio;
    row.canvas.height = high * ratio;
    const pen = row.canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    pen.scale(ratio, ratio);
    let low = Math.min(...row.values), top = Math.max(...row.values);
    const room = Math.max((top - low) * 0.1, Math.abs(top) * 0.01, 1e-3);
    low -= room;
    top += room;
    const x = (t) => wide * (1 - (times[times.length - 1] - t) / SECONDS), y = (v) => high * (1 - (v - low) / (top - low));
    pen.strokeStyle = style.getPropertyValue("--stop");
    for (const end of row.signal.limits) if (end > low && end < top) line(pen, [[0, y(end)], [wide, y(end)]], 1);
    pen.strokeStyle = style.getPropertyValue("--line");
    line(pen, row.values.map((v, k) => [x(times[k]), y(v)]), 1.5);
    pen.fillStyle = style.getPropertyValue("--soft");
    pen.font = "11px system-ui, sans-serif";
    pen.fillText((top - room).toPrecision(3), 2, 11);
    pen.fillText((low + room).toPrecision(3), 2, high - 3);
  }

  function line(pen, points, width) {
    pen.lineWidth = width;
    pen.beginPath();
    points.forEach(([px, py], k) => (k ? pen.lineTo(px, py) : pen.moveTo(px, py)));
    pen.stroke();
  }

  for (const what of ["on", "off", "reset"]) get(what).addEventListener("click", () => post("switch", { to: what }).catch(() => {}));
  setInterval(look, EVERY);
})();
