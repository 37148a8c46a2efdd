"use strict";
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const shorts = (text) => new Int16Array(bytes(text).buffer);

// Button, slider and clock of a figure; show(frame) draws one frame.
function playback(figure, film, show) {
  const slider = figure.querySelector("input"), button = figure.querySelector("button"), output = figure.querySelector("output");
  const frames = film.time.length;
  let frame = film.worst, timer = 0;
  function draw() {
    show(frame);
    slider.value = frame;
    output.textContent = film.time[frame].toFixed(2) + " s";
  }
  function stop() { clearTimeout(timer); timer = 0; button.textContent = "Play"; }
  function next() {
    const step = frame + 1 < frames ? 1000 * (film.time[frame + 1] - film.time[frame]) : 800;
    timer = setTimeout(() => { frame = (frame + 1) % frames; draw(); next(); }, Math.max(16, step));
  }
  slider.max = frames - 1;
  slider.addEventListener("input", () => { stop(); frame = Number(slider.value); draw(); });
  button.addEventListener("click", () => { if (timer) { stop(); } else { button.textContent = "Pause"; next(); } });
  addEventListener("resize", draw);
  draw();
}
