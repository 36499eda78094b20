// Scenes: lines in space that move; a take plays when its button is pressed, the slider moves through it.
document.querySelectorAll("figure.scene").forEach((figure) => {
  const scene = JSON.parse(figure.querySelector("script").textContent);
  const svg = figure.querySelector("svg > g"), slider = figure.querySelector("input"), clock = figure.querySelector("output");
  let take = Object.values(scene.takes)[0], running = 0;
  const frames = () => take.lines[0].length;
  const draw = (at) => {
    const k = Math.max(0, Math.min(frames() - 1, Math.round(at)));
    take.lines.forEach((line, i) => {
      const path = svg.children[i] || svg.appendChild(document.createElementNS(svg.namespaceURI, "path"));
      let d = "";
      for (let j = 0; j < line[k].length; j += 2) d += (j ? "L" : "M") + line[k][j] + " " + line[k][j + 1];
      path.setAttribute("d", d);
      path.setAttribute("stroke", take.looks[i][0]);
      path.setAttribute("stroke-width", take.looks[i][1]);
    });
    slider.value = k / Math.max(1, frames() - 1);
    clock.textContent = (k * scene.step).toFixed(2) + " s";
  };
  const play = () => {
    const mine = ++running, began = performance.now();
    const turn = (now) => {
      if (mine !== running) return;
      const k = (now - began) / 1000 / scene.step;
      draw(k);
      if (k < frames() - 1) requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  };
  figure.querySelectorAll("button").forEach((button) => button.addEventListener("click", () => {
    take = scene.takes[button.dataset.take];
    while (svg.children.length > take.lines.length) svg.lastChild.remove();
    play();
  }));
  slider.addEventListener("input", () => { running++; draw(slider.value * (frames() - 1)); });
  draw(scene.still);
});
