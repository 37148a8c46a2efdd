"use strict";
// What is drawn: the frame with its keypoints, the magnifier, the strip of all frames.

const COLOURS = ["#ff5a36", "#1fb6ff", "#ffd23f", "#3ddc84", "#e05cff", "#ff9f1c", "#00d5c8", "#ff6fae", "#9db4ff", "#b6e35a"];
const colour = (k) => COLOURS[k % COLOURS.length];
const AHEAD = 8, KEPT = 40, LENS = 8;

const view = {
  scale: 1, left: 0, top: 0, // one pixel of the frame on the page, and where its upper left corner is
  fitted: true,
  cursor: null,              // where the magnifier looks [px]
  cross: null,               // of the keyboard [px]
  pictures: new Map(),

  picture(number) {
    let image = this.pictures.get(number);
    if (!image) {
      image = new Image();
      image.src = `frame/${number}.png`;
      image.onload = () => { if (number === model.frame) this.draw(); };
    }
    this.pictures.delete(number); // the last that was used is the last to go
    this.pictures.set(number, image);
    if (this.pictures.size > KEPT) this.pictures.delete(this.pictures.keys().next().value);
    return image;
  },

  // Have the frames ready that are likely to be looked at next.
  prefetch() {
    const image = this.picture(model.frame);
    const go = () => {
      for (const k of [...Array(AHEAD).keys()].map((i) => model.frame + 1 + i).concat(model.frame - 1))
        if (k >= 0 && k < model.state.frames.length) this.picture(k);
      this.picture(model.frame);
    };
    if (image.complete) go(); else image.addEventListener("load", go, { once: true });
  },

  // A canvas at the resolution of the screen; its context draws in CSS pixels.
  context(canvas) {
    const ratio = window.devicePixelRatio || 1, { width, height } = canvas.getBoundingClientRect();
    const w = Math.max(1, Math.round(width * ratio)), h = Math.max(1, Math.round(height * ratio));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    return { pen, width, height };
  },

  fit() {
    const box = document.getElementById("picture").getBoundingClientRect(), { width, height } = model.now;
    this.scale = Math.min((box.width - 24) / width, (box.height - 24) / height);
    this.left = (box.width - width * this.scale) / 2;
    this.top = (box.height - height * this.scale) / 2;
    this.fitted = true;
  },

  zoom(factor, x, y) {
    const next = Math.max(0.05, Math.min(60, this.scale * factor));
    this.left = x - (x - this.left) * next / this.scale;
    this.top = y - (y - this.top) * next / this.scale;
    this.scale = next;
    this.fitted = false;
    this.keep();
  },

  pan(dx, dy) { this.left += dx; this.top += dy; this.fitted = false; this.keep(); },

  // Some of the frame stays in sight.
  keep() {
    const box = document.getElementById("picture").getBoundingClientRect(), { width, height } = model.now, edge = 60;
    this.left = Math.max(edge - width * this.scale, Math.min(box.width - edge, this.left));
    this.top = Math.max(edge - height * this.scale, Math.min(box.height - edge, this.top));
  },

  // From the page to the frame [px] and back; the half is because (0, 0) is the middle of a pixel.
  pixel(x, y) { return { u: (x - this.left) / this.scale - 0.5, v: (y - this.top) / this.scale - 0.5 }; },
  place(p) { return [this.left + (p.u + 0.5) * this.scale, this.top + (p.v + 0.5) * this.scale]; },
  inside(p) { return p.u >= -0.5 && p.v >= -0.5 && p.u <= model.now.width - 0.5 && p.v <= model.now.height - 0.5; },

  // The keypoint near a place of the page; the active one first.
  near(x, y) {
    let best = -1, least = 12;
    model.points().forEach((p, k) => {
      if (p.u === null) return;
      const [px, py] = this.place(p), d = Math.hypot(px - x, py - y) - (k === model.active ? 4 : 0);
      if (d < least) { best = k; least = d; }
    });
    return best;
  },

  draw() {
    const { pen, width, height } = this.context(document.getElementById("picture"));
    if (this.fitted) this.fit();
    const image = this.picture(model.frame), { width: w, height: h } = model.now;
    pen.imageSmoothingEnabled = this.scale < 3;
    if (image.complete && image.naturalWidth) pen.drawImage(image, this.left, this.top, w * this.scale, h * this.scale);
    else { pen.fillStyle = "#8886"; pen.fillRect(this.left, this.top, w * this.scale, h * this.scale); }
    const points = model.points();
    pen.lineWidth = 1.5;
    for (const [i, j] of model.state.skeleton) {
      if (points[i].u === null || points[j].u === null) continue;
      pen.strokeStyle = "#fffc"; pen.beginPath(); pen.moveTo(...this.place(points[i])); pen.lineTo(...this.place(points[j])); pen.stroke();
    }
    points.forEach((p, k) => { if (p.u !== null) this.mark(pen, ...this.place(p), k, p.flag, width); });
    if (this.cross) this.hair(pen, ...this.place(this.cross), 14);
    this.lens(image);
  },

  mark(pen, x, y, k, flag, width) {
    const r = k === model.active ? 9 : 7;
    for (const [line, style] of [[4.5, "#000a"], [2.2, colour(k)]]) {
      pen.lineWidth = line; pen.strokeStyle = style;
      pen.setLineDash(flag === HIDDEN ? [3.5, 3] : []);
      pen.beginPath(); pen.arc(x, y, r, 0, 7); pen.stroke();
      pen.setLineDash([]);
      pen.beginPath(); pen.arc(x, y, 0.6, 0, 7); pen.stroke();
    }
    pen.font = `600 12px ${getComputedStyle(document.body).fontFamily}`;
    const text = model.names[k], wide = pen.measureText(text).width + 10, from = x + r + 5 + wide < width ? x + r + 5 : x - r - 5 - wide;
    pen.textAlign = "left"; pen.textBaseline = "middle";
    pen.fillStyle = "#14181ccc"; pen.beginPath(); pen.roundRect(from, y - 9, wide, 18, 4); pen.fill();
    pen.fillStyle = colour(k); pen.fillText(text, from + 5, y + 0.5);
  },

  hair(pen, x, y, r) {
    for (const [line, style] of [[3, "#000b"], [1.2, "#fff"]]) {
      pen.lineWidth = line; pen.strokeStyle = style; pen.beginPath();
      for (const [a, b] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) { pen.moveTo(x + a * 3, y + b * 3); pen.lineTo(x + a * r, y + b * r); }
      pen.stroke();
    }
  },

  lens(image) {
    const { pen, width, height } = this.context(document.getElementById("lens"));
    const p = this.cross || this.cursor, where = document.getElementById("where");
    if (!p || !image.complete || !image.naturalWidth) {
      pen.fillStyle = getComputedStyle(document.body).color; pen.globalAlpha = 0.6; pen.font = "13px sans-serif"; pen.textAlign = "center";
      pen.fillText("magnifier", width / 2, height / 2); pen.globalAlpha = 1; where.textContent = "";
      return;
    }
    const scale = Math.max(LENS, 2 * this.scale);
    const at = (q) => [width / 2 + (q.u - p.u) * scale, height / 2 + (q.v - p.v) * scale];
    pen.imageSmoothingEnabled = false;
    pen.drawImage(image, ...at({ u: -0.5, v: -0.5 }), model.now.width * scale, model.now.height * scale);
    model.points().forEach((q, k) => {
      if (q.u === null) return;
      const [x, y] = at(q);
      for (const [line, style] of [[3.5, "#000a"], [1.8, colour(k)]]) { pen.lineWidth = line; pen.strokeStyle = style; pen.beginPath(); pen.arc(x, y, 6, 0, 7); pen.stroke(); }
    });
    this.hair(pen, width / 2, height / 2, 26);
    where.textContent = `right ${p.u.toFixed(1)}, down ${p.v.toFixed(1)} px`;
  },

  strip() {
    const { pen, width, height } = this.context(document.getElementById("strip"));
    const style = getComputedStyle(document.documentElement), frames = model.state.frames, cell = width / frames.length;
    frames.forEach((_, n) => {
      pen.fillStyle = style.getPropertyValue(model.finished(n) ? "--done" : model.begun(n) ? "--half" : "--todo");
      pen.fillRect(n * cell, 7, Math.max(0.5, cell - (cell > 3 ? 1 : 0)), height - 12);
    });
    const x = (model.frame + 0.5) * cell;
    pen.fillStyle = style.getPropertyValue("--ink");
    pen.beginPath(); pen.moveTo(x - 5, 0); pen.lineTo(x + 5, 0); pen.lineTo(x, 6); pen.fill();
    pen.fillRect(x - Math.max(1, cell / 2), height - 3, Math.max(2, cell), 3);
  },
};
