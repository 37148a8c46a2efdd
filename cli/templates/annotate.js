"use strict";
// What a person does, and what the page says to it.

const $ = (id) => document.getElementById(id);
const told = { [SEEN]: "seen", [HIDDEN]: "hidden", [ABSENT]: "not in view", [UNDECIDED]: "" };
const round = (x) => Math.round(x * 1000) / 1000;
let press = null;      // what the mouse button holds: {k, x, y, moved, gesture}
let gestures = 0, ended = false;

function show(message) {
  if (message) { $("banner").firstElementChild.textContent = message; $("banner").hidden = false; }
  if (message === null) $("banner").hidden ||= $("banner").firstElementChild.textContent.startsWith("Not saved");
  const waiting = model.dirty.size || model.posting, count = model.count(), all = model.state.frames.length;
  $("saved").textContent = !$("banner").hidden && waiting ? "not saved" : waiting ? "saving …" : "saved";
  $("saved").classList.toggle("bad", Boolean(!$("banner").hidden && waiting));
  $("bar").max = all; $("bar").value = count;
  $("share").textContent = `${count} of ${all} frames`;
  const { recording, number } = model.now;
  $("frame").textContent = `${recording}, frame ${number} (${model.frame + 1} of ${all})`;
  $("previous").disabled = model.frame === 0; $("next").disabled = model.frame === all - 1;
  $("copy").disabled = model.frame === 0; $("undo").disabled = !model.done.length;
  $("hidden").disabled = $("absent").disabled = model.active < 0;
  [...$("keypoints").children].forEach((row, k) => {
    const button = row.firstElementChild, flag = model.points()[k].flag;
    button.setAttribute("aria-pressed", k === model.active);
    button.querySelector("i").className = flag === SEEN ? "" : flag === HIDDEN ? "hidden" : "empty";
    button.querySelector(".told").textContent = told[flag];
  });
  $("hint").replaceChildren(...hint(count === all));
  view.draw(); view.strip(); view.prefetch();
}

function hint(all) {
  if (model.active >= 0) {
    const dot = document.createElement("i");
    dot.style.background = colour(model.active);
    const placed = model.points()[model.active].flag >= HIDDEN;
    return [dot, `${placed ? "Drag" : "Click"} ${model.names[model.active]}${placed ? ", or click its new place" : ""}`];
  }
  if (all) return ["All frames are annotated: Done"];
  return ["Frame finished: → for the next, or drag a keypoint"];
}

function rows() {
  model.names.forEach((name, k) => {
    const row = document.createElement("li"), button = document.createElement("button");
    button.style.setProperty("--colour", colour(k));
    for (const [tag, of, text] of [["i", "empty", ""], ["span", "name", name], ["span", "told", ""], ["kbd", "", k < 10 ? (k + 1) % 10 : ""]]) {
      const part = document.createElement(tag);
      part.className = of; part.textContent = text; part.hidden = tag === "kbd" && k > 9;
      button.append(part);
    }
    button.title = name;
    button.onclick = () => choose(k);
    row.append(button); $("keypoints").append(row);
  });
}

function choose(k) { model.active = k; view.cross = null; $("keypoints").children[k].scrollIntoView({ block: "nearest" }); show(); }
function go(frame) { view.cross = null; const { width, height } = model.now; model.go(frame); if (width !== model.now.width || height !== model.now.height) view.fit(); show(); }

// Place the active keypoint; the next undecided one follows.
function place(p, flag) {
  if (model.active < 0 || !view.inside(p)) return;
  const k = model.active, first = model.points()[k].flag === UNDECIDED;
  model.set(k, { u: round(p.u), v: round(p.v), flag });
  view.cross = null;
  if (first) model.active = model.undecided(k + 1);
  show();
}

function mark(flag) { // without a place of its own
  const k = model.active;
  if (k < 0) return;
  const point = model.points()[k];
  if (flag === HIDDEN && point.u === null) {
    const at = view.cross || view.cursor;
    if (at && view.inside(at)) place(at, HIDDEN);
    return;
  }
  if (flag === HIDDEN) model.set(k, { flag: point.flag === HIDDEN ? SEEN : HIDDEN });
  else {
    model.set(k, { u: null, v: null, flag });
    if (flag === ABSENT) model.active = model.undecided(k + 1);
  }
  show();
}

function nudge(du, dv) {
  const k = model.active, p = k < 0 ? null : model.points()[k];
  if (k < 0) return;
  const from = p.u !== null ? p : view.cross || { u: (model.now.width - 1) / 2, v: (model.now.height - 1) / 2 };
  const to = clamp({ u: from.u + du, v: from.v + dv });
  if (p.u !== null) { view.cursor = to; model.set(k, { u: round(to.u), v: round(to.v) }, `nudge ${k} ${model.frame}`); }
  else view.cross = to;
  show();
}

function clamp(p) {
  const { width, height } = model.now;
  return { u: Math.max(-0.5, Math.min(width - 0.5, p.u)), v: Math.max(-0.5, Math.min(height - 0.5, p.v)) };
}

function copy() {
  if (model.frame === 0) return;
  const before = model.state.frames[model.frame - 1], { width, height } = model.now;
  if (before.width !== width || before.height !== height) return show("The previous frame is of another take of another size; its keypoints do not fit.");
  model.replace(before.points.map((p) => ({ ...p })));
  model.active = model.undecided(0);
  show();
}

function unfinished() {
  const all = model.state.frames.length;
  for (let k = 1; k <= all; k++) if (!model.finished((model.frame + k) % all)) return go((model.frame + k) % all);
}

async function end() {
  if (model.dirty.size || model.posting) return show("Not saved yet: wait a moment, then press Done again.");
  const answer = await fetch("done", { method: "POST", headers: { "Content-Type": "application/json" }, body: "{}" }).catch(() => null);
  if (!answer || !answer.ok) return show("muslin annotate does not answer; what it said it saved is saved.");
  ended = true;
  $("end-title").textContent = `${model.count()} of ${model.state.frames.length} frames are annotated, in ${model.state.file}`;
  $("command").textContent = model.state.next;
  $("end").showModal();
  $("end").oncancel = (event) => event.preventDefault();
}

function mouse() {
  const canvas = $("picture"), at = (event) => [event.offsetX, event.offsetY];
  canvas.onpointerdown = (event) => {
    canvas.focus();
    const [x, y] = at(event), k = view.near(x, y);
    if (event.button === 2) {
      if (k >= 0) { model.active = k; mark(HIDDEN); if (k >= 0) model.active = model.undecided(0); show(); }
      else place(view.pixel(x, y), HIDDEN);
      return;
    }
    canvas.setPointerCapture(event.pointerId);
    press = { k: event.button === 0 ? k : -1, pan: event.button === 1, x, y, moved: false, gesture: `drag ${gestures++}` };
    if (press.k >= 0) { model.active = k; const [px, py] = view.place(model.points()[k]); press.dx = px - x; press.dy = py - y; show(); }
  };
  canvas.onpointermove = (event) => {
    const [x, y] = at(event);
    view.cursor = view.pixel(x, y);
    if (!view.inside(view.cursor)) view.cursor = null;
    if (press) {
      if (!press.moved && Math.hypot(x - press.x, y - press.y) > 4) { press.moved = true; canvas.classList.add("drag"); }
      if (press.moved && press.k >= 0) {
        const p = clamp(view.pixel(x + press.dx, y + press.dy));
        view.cursor = p;
        model.set(press.k, { u: round(p.u), v: round(p.v) }, press.gesture);
      } else if (press.moved) { view.pan(x - (press.lastX ?? press.x), y - (press.lastY ?? press.y)); }
      if (press.moved) { press.lastX = x; press.lastY = y; }
    } else canvas.classList.toggle("over", view.near(x, y) >= 0);
    view.cross = null;
    view.draw();
  };
  canvas.onpointerup = (event) => {
    const [x, y] = at(event);
    canvas.classList.remove("drag");
    if (press && !press.moved && press.k < 0 && !press.pan) place(view.pixel(x, y), SEEN);
    else if (press && press.moved && press.k >= 0) { model.active = model.undecided(0) < 0 ? press.k : model.undecided(0); show(); }
    press = null;
  };
  canvas.onpointerleave = () => { if (!press) { view.cursor = null; view.draw(); } };
  canvas.onpointercancel = () => { press = null; };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); view.zoom(Math.exp(-event.deltaY * 0.0015), ...at(event)); view.draw(); }, { passive: false });
  $("strip").onclick = (event) => go(Math.floor(event.offsetX / $("strip").clientWidth * model.state.frames.length));
}

function key(event) {
  if (ended || $("help").open || event.altKey) return;
  const name = event.key.length === 1 ? event.key.toLowerCase() : event.key, step = event.shiftKey ? 10 : 1;
  const onButton = document.activeElement instanceof HTMLButtonElement, middle = [$("picture").clientWidth / 2, $("picture").clientHeight / 2];
  if (event.ctrlKey || event.metaKey) {
    if (name === "z") event.shiftKey ? model.redo() : model.undo(); else if (name === "y") model.redo(); else return;
    event.preventDefault(); return show();
  }
  const moves = { w: [0, -step], s: [0, step], a: [-step, 0], d: [step, 0] };
  if (name in moves) nudge(...moves[name]);
  else if (/^[0-9]$/.test(name)) { const k = (Number(name) + 9) % 10; if (k < model.names.length) choose(k); }
  else if (name === "Tab" && !onButton) { const n = model.names.length, k = model.active; choose(event.shiftKey ? (k < 0 ? n - 1 : (k + n - 1) % n) : (k + 1) % n); }
  else if (name === "Enter" && !onButton) { if (view.cross) place(view.cross, SEEN); else if (model.finished(model.frame)) go(model.frame + 1); }
  else if (name === "Escape") $("help-open").focus();
  else if (name === "ArrowRight") go(model.frame + step);
  else if (name === "ArrowLeft") go(model.frame - step);
  else if (name === "h") mark(HIDDEN);
  else if (name === "x") mark(ABSENT);
  else if (name === "Delete" || name === "Backspace") mark(UNDECIDED);
  else if (name === "c") copy();
  else if (name === "n") unfinished();
  else if (name === "z") { event.shiftKey ? model.redo() : model.undo(); show(); }
  else if (name === "f") { view.fit(); view.draw(); }
  else if (name === "+" || name === "=") { view.zoom(1.25, ...middle); view.draw(); }
  else if (name === "-") { view.zoom(0.8, ...middle); view.draw(); }
  else if (name === "?") $("help").showModal();
  else return;
  event.preventDefault();
}

async function start() {
  model.state = await (await fetch("state")).json();
  $("video").textContent = model.state.video; $("file").textContent = model.state.file;
  document.title = `${model.state.video}: annotate`;
  rows(); mouse();
  const press = { "help-open": () => $("help").showModal(), done: end, hidden: () => mark(HIDDEN), absent: () => mark(ABSENT), copy,
    undo: () => { model.undo(); show(); }, previous: () => go(model.frame - 1), next: () => go(model.frame + 1), unfinished };
  for (const id in press) $(id).addEventListener("click", press[id]);
  $("banner").lastElementChild.onclick = () => { $("banner").hidden = true; show(); };
  document.addEventListener("keydown", key);
  new ResizeObserver(() => { if (view.fitted) view.fit(); view.draw(); view.strip(); }).observe($("stage"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { view.draw(); view.strip(); });
  window.addEventListener("beforeunload", (event) => { if (model.dirty.size || model.posting) event.preventDefault(); });
  const asked = decodeURIComponent(location.hash.slice(1));
  const at = model.state.frames.findIndex((f) => `${f.recording}/${f.number}` === asked);
  const open = model.state.frames.findIndex((_, n) => !model.finished(n));
  model.go(at >= 0 ? at : Math.max(0, open));
  model.listener = show;
  $("picture").focus();
  show();
}

start().catch((error) => { $("banner").hidden = false; $("banner").firstElementChild.textContent = `The page could not start: ${error.message}`; });
