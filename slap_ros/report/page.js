"use strict";
(() => {
  const data = JSON.parse(document.getElementById("frames").textContent);
  const player = document.querySelector(".player");
  if (!player) return;
  const play = player.querySelector("[data-play]");
  const slider = player.querySelector("[data-step]");
  const readout = player.querySelector("[data-readout]");
  const speed = player.querySelector("[data-speed]");
  const pictures = [...document.querySelectorAll("svg[data-view]")].map((svg) => {
    const run = data.runs[svg.dataset.run];
    const shapes = [];
    for (const g of svg.querySelectorAll("[data-shape]")) shapes[g.dataset.shape] = g;
    return { svg, run, shapes, view: run.views[svg.dataset.view], label: svg.getAttribute("aria-label").replace(/, first step$/, "") };
  });
  const captions = [...document.querySelectorAll("[data-caption]")];
  const cursors = [...document.querySelectorAll("[data-cursor]")];
  let started = null; // when playing began, and at which step

  function draw(picture, step) {
    const { run, shapes, view } = picture;
    const shown = Math.min(step, run.last);
    const frame = Math.max(0, run.frames.findLastIndex((at) => at <= shown));
    view.shapes.forEach((shape, i) => {
      const paths = shape.poses[shape.at[frame]];
      paths.forEach((d, k) => shapes[i].children[k].setAttribute("d", d));
    });
    picture.svg.append(...view.orders[view.orderAt[frame]].map((i) => shapes[i]));
    picture.svg.setAttribute("aria-label", `${picture.label}, step ${shown}`);
  }

  function caption(run, step) {
    if (step >= run.last) return `Step ${run.last}, the end`;
    const span = run.spans.find(([start, end]) => start <= step && step < end);
    return `Step ${step} of ${run.last}${span ? ", " + span[2] : ""}`;
  }

  function show(step) {
    slider.value = step;
    slider.setAttribute("aria-valuetext", `step ${step} of ${data.last}`);
    readout.textContent = `${step} / ${data.last}`;
    for (const picture of pictures) draw(picture, step);
    for (const p of captions) p.textContent = caption(data.runs[p.dataset.caption], step);
    for (const line of cursors) {
      const at = Math.min(step, data.runs[line.dataset.cursor].last);
      line.hidden = false;
      line.style.left = `${data.last ? (100 * at) / data.last : 0}%`;
    }
  }

  function pause() {
    started = null;
    play.textContent = "Play";
  }

  function tick(now) {
    if (!started) return;
    const passed = Math.max(0, now - started.at); // ms; a frame's time may lie before the click
    const steps = Math.floor((passed / 1000 / data.period) * Number(speed.value));
    const step = Math.min(started.step + steps, data.last);
    if (step !== Number(slider.value)) show(step);
    if (step >= data.last) pause();
    else requestAnimationFrame(tick);
  }

  function begin() {
    const step = Number(slider.value) >= data.last ? 0 : Number(slider.value);
    show(step);
    started = { at: performance.now(), step };
    play.textContent = "Pause";
    requestAnimationFrame(tick);
  }

  play.addEventListener("click", () => (started ? pause() : begin()));
  slider.addEventListener("input", () => {
    pause();
    show(Number(slider.value));
  });
  speed.addEventListener("change", () => {
    if (started) started = { at: performance.now(), step: Number(slider.value) };
  });
  addEventListener("beforeprint", () => {
    pause();
    show(0);
  });
  document.documentElement.classList.add("scripted");
  player.hidden = false;
  show(0);
})();
