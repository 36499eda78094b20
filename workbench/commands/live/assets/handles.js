"use strict";
// Corner frequencies as tags above the Bode plot, dragged along its axis.
const Handles = (() => {
  const bode = document.getElementById("bode"), chart = bode.querySelector(".chart");
  const ROW = 15, TOP = 24;
  let held = null;

  const hertz = (slider, value) => (slider.corner === "Hz" ? value * slider.to_hz : 1 / (2 * Math.PI * value * slider.to_hz));
  const value = (slider, f) => (slider.corner === "Hz" ? f / slider.to_hz : 1 / (2 * Math.PI * f * slider.to_hz));
  const words = (slider) => `${slider.part.replace(/([a-z])([A-Z])/g, "$1 $2").toLowerCase()} ${slider.name.split(".").pop().replaceAll("_", " ")}`;
  const cornered = (sliders, numbers) => sliders.filter((slider) => slider.corner && numbers(slider) > 0);

  // A tag at the left edge begins at its corner, one at the right edge ends there.
  function place(tag, slider, row, f) {
    const { xaxis, yaxis2, height, margin } = chart._fullLayout;
    const inside = Math.min(Math.max(xaxis.d2p(f), 0), xaxis._length), top = TOP + row * ROW;
    tag.textContent = `${words(slider)} ${f.toPrecision(3)} Hz`;
    tag.dataset.hertz = f;
    tag.style.top = `${top}px`;
    tag.style.setProperty("--x", `${xaxis._offset + inside}px`);
    tag.style.setProperty("--share", inside / xaxis._length);
    tag.style.setProperty("--drop", `${height - margin.b - yaxis2._length - top - ROW}px`);
  }

  function show(sliders, numbers, move) {
    const tags = cornered(sliders, numbers);
    const there = new Map([...bode.querySelectorAll(".handle")].map((tag) => [tag.dataset.name, tag]));
    tags.forEach((slider, row) => {
      let tag = there.get(slider.name);
      if (!tag) bode.append((tag = made(slider, move)));
      there.delete(slider.name);
      place(tag, slider, row, hertz(slider, numbers(slider)));
    });
    there.forEach((tag) => tag.remove());
  }

  function made(slider, move) {
    const tag = document.createElement("button");
    tag.type = "button";
    tag.className = "handle";
    tag.dataset.name = slider.name;
    tag.title = `${slider.meaning}: drag, or arrow keys`;
    const to = (f) => move(slider, Math.min(Math.max(value(slider, f), slider.bounds[0]), slider.bounds[1]));
    const at = (event) => {
      const { xaxis } = chart._fullLayout;
      return xaxis.p2d(event.clientX - bode.getBoundingClientRect().left - xaxis._offset);
    };
    tag.addEventListener("pointerdown", (event) => { held = tag; tag.setPointerCapture(event.pointerId); tag.classList.add("held"); event.stopPropagation(); });
    tag.addEventListener("pointermove", (event) => { if (held === tag) to(at(event)); });
    for (const end of ["pointerup", "pointercancel"])
      tag.addEventListener(end, () => { held = null; tag.classList.remove("held"); });
    tag.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: 1 / 1.03, ArrowRight: 1.03 }[event.key];
      if (step) { to(Number(tag.dataset.hertz) * step); event.preventDefault(); }
    });
    return tag;
  }

  const count = (sliders, numbers) => cornered(sliders, numbers).length;
  return { show, count };
})();
