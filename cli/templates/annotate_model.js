"use strict";
// What is annotated, what can be undone, and what is not saved yet. Places are in muslin's pixels: (0, 0) is the middle
// of the upper left one.

const UNDECIDED = -1, ABSENT = 0, HIDDEN = 1, SEEN = 2;

const model = {
  state: null,      // what the server told: video, file, names, skeleton, frames, next
  frame: 0,         // number of the frame that is shown
  active: 0,        // the keypoint that a click places, -1 for none
  done: [],         // changes that can be undone: {frame, before, after}
  undone: [],
  dirty: new Set(), // frames with points that the server has not taken
  posting: false,
  listener: () => {},

  get now() { return this.state.frames[this.frame]; },
  get names() { return this.state.names; },
  points(frame = this.frame) { return this.state.frames[frame].points; },
  finished(frame) { return this.points(frame).every((p) => p.flag !== UNDECIDED); },
  begun(frame) { return this.points(frame).some((p) => p.flag !== UNDECIDED); },
  count() { return this.state.frames.filter((_, n) => this.finished(n)).length; },

  // The next keypoint from `from` on that is undecided, around the end; -1 if there is none.
  undecided(from) {
    const points = this.points();
    for (let k = 0; k < points.length; k++) {
      const at = (from + k) % points.length;
      if (points[at].flag === UNDECIDED) return at;
    }
    return -1;
  },

  go(frame) {
    const last = this.state.frames.length - 1;
    this.frame = Math.max(0, Math.min(last, frame));
    this.active = this.undecided(0);
    history.replaceState(null, "", "#" + this.now.recording + "/" + this.now.number);
    this.listener();
  },

  // Change keypoint k of the frame that is shown. Steps of one movement have the same `gesture` and are undone together.
  set(k, point, gesture = null) {
    const after = this.points().map((p, i) => (i === k ? { ...p, ...point } : p));
    this.replace(after, gesture);
  },

  replace(after, gesture = null) {
    const last = this.done[this.done.length - 1];
    const before = this.points();
    if (JSON.stringify(before) === JSON.stringify(after)) return;
    if (gesture !== null && last && last.gesture === gesture && last.frame === this.frame) last.after = after;
    else this.done.push({ frame: this.frame, before, after, gesture });
    this.undone = [];
    this.put(this.frame, after);
  },

  undo() { this.step(this.done, this.undone, "before"); },
  redo() { this.step(this.undone, this.done, "after"); },
  step(from, to, which) {
    const change = from.pop();
    if (!change) return;
    change.gesture = null;
    to.push(change);
    this.frame = change.frame;
    this.put(change.frame, change[which]);
    this.go(change.frame);
  },

  put(frame, points) {
    this.state.frames[frame].points = points;
    this.dirty.add(frame);
    this.listener();
    this.save();
  },

  // One post at a time; what changes meanwhile is posted after it. A failure keeps the points, and tries again.
  async save() {
    if (this.posting) return;
    this.posting = true;
    while (this.dirty.size) {
      const frame = this.dirty.values().next().value;
      this.dirty.delete(frame);
      const told = this.state.frames[frame];
      const sent = { frame, version: told.version, points: told.points };
      let answer, body;
      try {
        answer = await fetch("points", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(sent) });
        body = await answer.json();
      } catch {
        this.dirty.add(frame);
        this.listener("Not saved: muslin annotate does not answer. Is it still running? This page keeps your points and tries again.");
        await new Promise((wake) => setTimeout(wake, 2000));
        continue;
      }
      if (answer.ok) {
        told.version = body.version;
        this.listener(null);
      } else if (answer.status === 409) {
        // another tab was first: show its points, and keep ours one undo away
        const ours = told.points;
        this.state.frames[frame] = body.frame;
        this.dirty.delete(frame);
        this.undone = [];
        this.done.push({ frame, before: ours, after: body.frame.points, gesture: null });
        this.listener(`In another tab ${body.frame.recording}/${body.frame.number} was changed. Its points are shown now; Undo (z) brings yours back.`);
      } else {
        this.dirty.add(frame);
        this.listener(`Not saved: ${body.error}. This page keeps your points and tries again.`);
        await new Promise((wake) => setTimeout(wake, 2000));
      }
    }
    this.posting = false;
    this.listener();
  },
};
