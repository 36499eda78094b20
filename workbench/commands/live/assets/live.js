"use strict";
// Numbers in, picture out: one request is under way at a time, and of those that wait only the newest is kept.
(() => {
  const start = JSON.parse(document.getElementById("start").textContent);
  const get = (id) => document.getElementById(id);
  const STILL = 250; // ms without a move, after which what takes longer is asked for
  const state = { controller: Object.keys(start.controllers)[0], scenario: start.scenarios[0], amplitude: start.amplitudes[0], moved: {}, rig: {} };
  const files = new Map(); // what the loops of the file do, by controller, scenario
  let newest = null, busy = false, still = 0, sines = null;
  let unseen = []; // times of the moves that no picture shows yet

  const sliders = () => start.controllers[state.controller];
  const movedNumbers = () => (state.moved[state.controller] ??= {});
  const isOfRig = (slider) => start.rigSliders.includes(slider);
  const store = (slider) => (isOfRig(slider) ? state.rig : movedNumbers());
  const key = (slider) => slider.name.replace(/^rig\./, "");
  const valueOf = (slider) => store(slider)[key(slider)] ?? slider.value;
  const question = () => ({ controller: state.controller, scenario: state.scenario, amplitude: state.amplitude, numbers: { ...movedNumbers() }, rig: { ...state.rig } });
  const rounded = (value) => Number(value.toPrecision(4));

  // A share 0 to 1 of the slider, and back. A logarithmic one from 0 has 0 at its left end, and four decades.
  const least = (slider) => slider.low || slider.high * 1e-4;
  function share(slider, value) {
    if (!slider.log) return (value - slider.low) / (slider.high - slider.low);
    if (value <= 0) return 0;
    const part = Math.log(value / least(slider)) / Math.log(slider.high / least(slider));
    return slider.low ? part : Math.max(0.02 + 0.98 * part, 0.02);
  }
  function fromShare(slider, part) {
    if (!slider.log) return slider.low + part * (slider.high - slider.low);
    if (!slider.low && part < 0.01) return 0;
    const inside = slider.low ? part : Math.max((part - 0.02) / 0.98, 0);
    return least(slider) * (slider.high / least(slider)) ** inside;
  }

  const rows = new Map();
  function row(slider) {
    const name = key(slider).split(".").pop().replaceAll("_", " ");
    const box = document.createElement("div");
    box.className = "number";
    box.innerHTML = '<label></label><input type="number" step="any"><span class="unit"></span><input type="range" min="0" max="1" step="0.001"><button type="button" class="back" title="as in the file">reset</button>';
    const [label, text, unit, range, back] = box.children;
    label.textContent = isOfRig(slider) ? slider.meaning : name;
    label.title = `${slider.meaning}; ${slider.bounds[0].toPrecision(4)} to ${slider.bounds[1].toPrecision(4)} ${slider.unit}`;
    text.id = `n-${slider.name}`;
    label.htmlFor = text.id;
    range.setAttribute("aria-label", `${slider.meaning} [${slider.unit}]`);
    unit.textContent = slider.unit === "1" ? "" : slider.unit;
    range.addEventListener("input", () => move(slider, rounded(fromShare(slider, Number(range.value)))));
    text.addEventListener("change", () => {
      const value = Number(text.value), inside = text.value !== "" && value >= slider.bounds[0] && value <= slider.bounds[1];
      box.classList.toggle("wrong", !inside);
      if (inside) { widen(slider, value); move(slider, value); } else say(`${slider.meaning}: ${slider.bounds[0]} to ${slider.bounds[1]} ${slider.unit}`, true);
    });
    back.addEventListener("click", () => move(slider, slider.value));
    rows.set(slider, { box, text, range });
    return box;
  }

  function widen(slider, value) {
    if (value >= slider.low && value <= slider.high) return;
    slider.low = value > 0 && slider.log ? Math.max(slider.bounds[0], Math.min(slider.low, value / 3)) : Math.min(slider.low, value);
    slider.high = Math.max(slider.high, Math.min(slider.bounds[1], value > 0 ? value * 3 : value));
  }

  function reflect(slider) {
    const { box, text, range } = rows.get(slider) ?? {};
    if (!box) return;
    const value = valueOf(slider);
    if (document.activeElement !== text || Number(text.value) !== value) text.value = value;
    range.value = share(slider, value);
    box.classList.toggle("moved", value !== slider.value);
    box.classList.remove("wrong");
  }

  function move(slider, value) {
    if (value === slider.value) delete store(slider)[key(slider)];
    else store(slider)[key(slider)] = Math.min(Math.max(rounded(value), slider.bounds[0]), slider.bounds[1]);
    reflect(slider);
    ask();
  }

  function listNumbers() {
    rows.clear();
    const box = get("numbers"), parts = new Map();
    box.replaceChildren();
    const group = (title, members) => {
      const head = document.createElement("h2");
      head.textContent = title;
      box.append(head, ...members.filter((slider) => !slider.plain).map(row));
      const plain = members.filter((slider) => slider.plain);
      if (!plain.length) return;
      const more = document.createElement("details"), summary = document.createElement("summary");
      summary.textContent = `${plain.length} at default: ${plain.map((slider) => key(slider).split(".").pop().replaceAll("_", " ")).join(", ")}`;
      more.append(summary, ...plain.map(row));
      box.append(more);
    };
    for (const slider of sliders()) {
      const place = slider.name.includes(".") ? slider.name.replace(/\.[^.]+$/, "") : "";
      if (!parts.has(place)) parts.set(place, []);
      parts.get(place).push(slider);
    }
    for (const members of parts.values()) group(members[0].part.replace(/([a-z])([A-Z])/g, "$1 $2"), members);
    if (start.rigSliders.length) group("Rig: nominal, the others in proportion", start.rigSliders);
    [...rows.keys()].forEach(reflect);
  }

  function say(text, bad = false) {
    put(get("status"), text);
    get("status").title = text;
    get("status").classList.toggle("bad", bad);
  }

  async function post(what, body) {
    const request = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
    const answer = await fetch(what, request).catch(() => { throw new Error("no answer: has jackbench live ended?"); });
    const table = answer.headers.get("Content-Type") === "application/json" ? await answer.json() : {};
    if (!answer.ok) throw new Error(table.error ?? (answer.status === 500 ? "a fault of jackbench: its terminal says where" : "refused: reload the page"));
    return table;
  }

  const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));

  function ask() {
    newest = question();
    unseen.push(window.event?.timeStamp ?? performance.now());
    clearTimeout(still);
    if (!busy) work();
  }

  // The newest question on its way; the moves that its picture will show.
  function sent() {
    if (!newest) return null;
    const asked = newest, moves = unseen;
    newest = null;
    unseen = [];
    return post("view", asked).then((answer) => ({ asked, moves, answer }), (error) => ({ error }));
  }

  // While a picture is drawn, the server is at the next one already.
  async function work() {
    busy = true;
    let next = sent();
    while (next) {
      const { asked, moves, answer, error } = await next;
      next = sent();
      if (error) say(error.message, true);
      else await show(asked, moves, answer);
      next ??= sent();
    }
    busy = false;
  }

  const WAITS = { compiler: "another structure of the loop: its machine code is being made", python: "computes in Python: the scenario follows when the numbers rest" };

  async function show(asked, moves, answer) {
    sines = null;
    draw(answer, asked);
    await painted();
    const late = moves.map((at) => performance.now() - at);
    say(WAITS[answer.waits] ?? `picture ${late.at(-1).toFixed(0)} ms after the move, ${answer.server_ms.toFixed(0)} ms of them to compute`);
    document.dispatchEvent(new CustomEvent("picture", { detail: { late, server: answer.server_ms } }));
    if (!newest) still = setTimeout(() => { Plots.settle(); after(asked); }, answer.waits === "compiler" ? 0 : STILL);
  }

  let afterBusy = false;
  async function after(asked) {
    if (afterBusy) { still = setTimeout(() => after(asked), STILL); return; }
    afterBusy = true;
    try {
      const answer = await post("after", asked);
      if (JSON.stringify(asked) === JSON.stringify(question()) && !busy) {
        sines = answer.after.sines;
        answer.hunting = answer.after.hunting;
        draw(answer, asked, true);
        limit(asked);
        say(`at rest${sines ? ": sines seen" : ""}${answer.hunting ? `${sines ? " and" : ":"} hunting looked at` : ""}`);
      }
    } catch (error) {
      say(error.message, true);
    }
    afterBusy = false;
  }

  // How soon anything could settle, by scenario and rig: seconds of solving, asked for when nothing else is.
  const limits = new Map();
  const limitPlace = (asked) => JSON.stringify([asked.scenario, asked.rig]);
  let limitBusy = false, drawn = null;
  async function limit(asked) {
    if (limitBusy || limits.has(limitPlace(asked))) return;
    limitBusy = true;
    const answer = await post("limit", asked).catch(() => ({ limit_s: null }));
    if (limits.size === 100) limits.delete(limits.keys().next().value);
    limits.set(limitPlace(asked), answer.limit_s);
    limitBusy = false;
    sentence(drawn.answer, drawn.asked);
    if (!busy) limit(drawn.asked); // of what was moved meanwhile
  }

  // How much of the time is shown: twice what the slowest rig takes, so that it does not change with every move.
  const shownTime = new Map();
  function timeShown(place, answer, resting) {
    if (answer.steps && (resting || !shownTime.has(place))) {
      const settling = answer.rows.map((entry) => entry.settling_s), slowest = Math.max(...settling);
      const nice = [0.05, 0.1, 0.2, 0.3, 0.5, 1, 2, 3, 5].find((seconds) => seconds >= 2 * slowest + answer.steps.arrives);
      shownTime.set(place, settling.includes(null) ? undefined : nice);
    }
    return shownTime.get(place);
  }

  function draw(answer, asked, resting = false) {
    drawn = { answer, asked };
    const place = `${asked.controller} ${asked.scenario}`;
    const untouched = !Object.keys(asked.numbers).length && !Object.keys(asked.rig).length;
    if (untouched) files.set(place, { ...files.get(place), ...(answer.steps ? { steps: answer.steps } : {}), linear: answer.linear });
    const file = untouched ? null : files.get(place);
    const common = { count: start.rigs.length, rigs: start.rigs, unit: start.signal.unit, signal: start.signal.name, limits: start.limits, revision: place, seconds: timeShown(place, answer, resting) };
    Plots.drawStep(answer.steps, { ...common, file: file?.steps });
    Plots.drawBode(answer.linear, sines, { ...common, file: file?.linear, rows: Handles.count(sliders(), valueOf), unstable: answer.rows[0].stable === false });
    Plots.drawNichols(answer.linear, common);
    Handles.show(sliders(), valueOf, move);
    tell(answer, asked);
  }

  const COLUMNS = [["stable", "stable"], ["settling_s", "settles [s]"], ["overshoot_percent", "over-\u200bshoot [%]"], ["peak", "peak"], ["ms", "Ms"], ["gain_margin_db", "gain margin [dB]"], ["phase_margin_deg", "phase margin [deg]"]];
  const digits = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(3))));

  function cell(answer, entry, name) {
    if (name === "stable") return entry.stable === undefined ? "–" : entry.stable ? "yes" : "no";
    if (name === "settling_s" && entry.tripped) return "trips";
    if (name === "settling_s" && entry.settling_s === null) return answer.steps.arrives == null ? "–" : `> ${digits(answer.steps.watched)}`;
    return digits(entry[name]);
  }

  // The rows are made once, and then only what changes in them.
  let cells = [], heads = "";
  function makeRows(titles) {
    const element = (kind, ...inside) => { const made = document.createElement(kind); made.append(...inside); return made; };
    get("rows").querySelector("thead").replaceChildren(element("tr", ...titles.map((text) => element("th", text))));
    cells = start.rigs.map((rig, lane) => {
      const swatch = element("i");
      swatch.style.background = Plots.colour(lane);
      const name = element("span", rig), others = titles.slice(1).map(() => element("td"));
      return { line: element("tr", element("td", swatch, name), ...others), name, others };
    });
    get("rows").querySelector("tbody").replaceChildren(...cells.map(({ line }) => line));
  }

  function tell(answer, asked) {
    const columns = COLUMNS.filter(([name]) => name !== "peak" || answer.rows.some((entry) => entry.peak != null));
    const titles = ["rig", ...columns.map(([name, title]) => (name === "peak" ? `peak [${start.signal.unit}]` : title))];
    if (titles.join() !== heads) makeRows(titles);
    heads = titles.join();
    answer.rows.forEach((entry, lane) => {
      const { name, others } = cells[lane];
      put(name, entry.rig + (answer.hunting?.[lane] ? " (hunts)" : ""));
      columns.forEach(([column], i) => {
        put(others[i], cell(answer, entry, column));
        others[i].classList.toggle("out", Boolean(entry.out?.includes(column)));
        others[i].title = (column === "settling_s" && entry.tripped) || "";
      });
    });
    sentence(answer, asked);
  }

  function put(element, text) {
    if (element.textContent !== text) element.textContent = text;
  }

  function worst(entries, name, pick) {
    const values = entries.filter((entry) => entry[name] != null);
    return values.length ? values.reduce((a, b) => (pick(a[name], b[name]) === a[name] ? a : b)) : null;
  }

  function sentence(answer, asked) {
    const entries = answer.rows, count = entries.length, nominal = entries[0], words = [];
    const stable = entries.filter((entry) => entry.stable).length;
    const known = entries.some((entry) => entry.stable !== undefined);
    if (known) words.push(stable === count ? `stable${count === 1 ? "" : ` on all ${count} rigs`}` : `unstable: ${entries.filter((entry) => !entry.stable).map((entry) => entry.rig).join(", ")}`);
    const add = (name, text, unit, pick) => {
      const least = worst(entries, name, pick);
      if (least === null) return;
      words.push(`${text} ${digits(nominal[name])}${unit}${digits(least[name]) === digits(nominal[name]) ? "" : ` (${least.rig}: ${digits(least[name])})`}`);
    };
    const never = answer.steps?.arrives == null ? [] : entries.filter((entry) => entry.settling_s === null);
    if (never.length) words.push(`not settled after ${digits(answer.steps.watched)} s: ${never.map((entry) => entry.rig).join(", ")}`);
    else add("settling_s", "settles", " s", Math.max);
    const soonest = limits.get(limitPlace(asked));
    if (soonest && nominal.settling_s) words.push(`${digits(nominal.settling_s / soonest)} times the limit of ${digits(soonest)} s`);
    add("overshoot_percent", "overshoot", " %", Math.max);
    add("peak", "peak", ` ${start.signal.unit}`, Math.max);
    add("ms", "Ms", "", Math.max);
    add("gain_margin_db", "gain margin", " dB", Math.min);
    add("phase_margin_deg", "phase margin", "°", Math.min);
    put(get("verdict"), words.join(" · "));
    get("verdict").title = words.join(" · ");
    get("verdict").classList.toggle("bad", known && stable < count);
    const hunting = entries.filter((_, lane) => answer.hunting?.[lane]).map((entry) => entry.rig);
    const missed = [...answer.missed, ...(hunting.length ? [`hunts: ${hunting.join(", ")}`] : [])];
    const goals = missed.length ? `Out of the goals: ${missed.join("; ")}` : answer.within[0];
    put(get("goals"), goals);
    get("goals").title = goals;
    get("goals").classList.toggle("bad", missed.length > 0);
    get("goals").classList.toggle("partly", !answer.within[1]);
  }

  function fill(id, values, text, set) {
    get(id).replaceChildren(...values.map((value) => new Option(text(value), value)));
    get(id).addEventListener("change", () => { set(get(id).value); ask(); });
  }

  fill("controller", Object.keys(start.controllers), String, (name) => { state.controller = name; listNumbers(); });
  fill("scenario", start.scenarios, String, (name) => (state.scenario = name));
  fill("amplitude", start.amplitudes, (size) => `${size} ${start.signal.unit}`, (size) => (state.amplitude = Number(size)));
  get("save").addEventListener("submit", async (event) => {
    event.preventDefault();
    const moved = Object.fromEntries(Object.entries(state.moved).filter(([, numbers]) => Object.keys(numbers).length));
    try {
      const { files: names } = await post("save", { ...question(), name: get("name").value, moved });
      say(`saved ${names.join(" and ")}; next: jackbench run ${names.at(-1)}`);
    } catch (error) {
      say(error.message, true);
    }
  });
  get("notes").append(...start.notes.map((text) => Object.assign(document.createElement("p"), { textContent: text })));
  listNumbers();
  ask();
})();
