for (const player of document.querySelectorAll(".player:not(.predictive)")) {
  const film = JSON.parse(player.querySelector(".data").textContent), canvas = player.querySelector("canvas");
  const context = canvas.getContext("2d"), triangles = film.triangles, frames = film.time.length;
  const measured = shorts(film.measured), points = measured.length / frames / 3;
  const models = film.models.map((m) => ({ title: m.title, rms: m.rms, vertices: shorts(m.vertices),
    predicted: m.predicted ? shorts(m.predicted) : null, heat: bytes(m.heat) }));
  const outlines = film.outlines.map(shorts);
  const count = models[0].heat.length / frames;
  const stops = [[233, 235, 230], [243, 211, 156], [229, 143, 79], [185, 59, 34], [94, 20, 18]];
  const colours = Array.from({ length: 256 }, (_, i) => {
    const x = (i / 255) * 4, k = Math.min(3, Math.floor(x)), f = x - k;
    return "rgb(" + stops[k].map((a, c) => Math.round(a + f * (stops[k + 1][c] - a))).join() + ")";
  });
  const eye = film.view[2];
  let azimuth = Math.atan2(eye[1], eye[0]), elevation = Math.asin(eye[2]), frame = film.worst;

  function camera() {
    const ca = Math.cos(azimuth), sa = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);
    return [[-sa, ca, 0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]];
  }
  function project(data, start, number, rows, spot) {
    const out = new Float32Array(number * 3);
    for (let i = 0; i < number; i++) {
      const x = data[start + 3 * i], y = data[start + 3 * i + 1], z = data[start + 3 * i + 2];
      const gone = x === -32768, [r, u, t] = rows;
      out[3 * i] = gone ? NaN : spot.x + spot.s * (r[0] * x + r[1] * y + r[2] * z);
      out[3 * i + 1] = spot.y - spot.s * (u[0] * x + u[1] * y + u[2] * z);
      out[3 * i + 2] = t[0] * x + t[1] * y + t[2] * z;
    }
    return out;
  }
  const first = camera(), low = [1e9, 1e9], high = [-1e9, -1e9];
  for (const data of [measured, ...models.map((m) => m.vertices)]) {
    for (let i = 0; i < data.length; i += 3) {
      if (data[i] === -32768) continue;
      for (let a = 0; a < 2; a++) {
        const at = first[a][0] * data[i] + first[a][1] * data[i + 1] + first[a][2] * data[i + 2];
        low[a] = Math.min(low[a], at); high[a] = Math.max(high[a], at);
      }
    }
  }
  function draw() {
    const width = canvas.width / models.length, rows = camera();
    context.clearRect(0, 0, canvas.width, canvas.height);
    models.forEach((model, m) => {
      const scale = Math.min((0.9 * width) / (high[0] - low[0]), (0.84 * canvas.height) / (high[1] - low[1]));
      const spot = { s: scale, x: width * (m + 0.5) - (scale * (low[0] + high[0])) / 2, y: canvas.height * 0.54 + (scale * (low[1] + high[1])) / 2 };
      context.save();
      context.beginPath(); context.rect(width * m, 0, width, canvas.height); context.clip();
      const mesh = project(model.vertices, frame * count * 3, count, rows, spot);
      context.strokeStyle = "rgba(31,38,45,0.35)"; context.lineWidth = 1;
      for (const line of outlines) {
        const seen = project(line, 0, line.length / 3, rows, spot);
        context.beginPath();
        for (let p = 0; p < line.length; p += 3) context.lineTo(seen[p], seen[p + 1]);
        context.stroke();
      }
      if (!triangles.length) {  // a rope: a line through its vertices
        context.lineCap = "round"; context.lineWidth = 7;
        for (let v = 0; v + 1 < count; v++) {
          const heat = (model.heat[frame * count + v] + model.heat[frame * count + v + 1]) / 2;
          context.strokeStyle = colours[Math.round(heat)]; context.beginPath();
          context.moveTo(mesh[3 * v], mesh[3 * v + 1]); context.lineTo(mesh[3 * v + 3], mesh[3 * v + 4]); context.stroke();
        }
      }
      const order = [];
      for (let k = 0; k < triangles.length; k += 3) {
        order.push([mesh[3 * triangles[k] + 2] + mesh[3 * triangles[k + 1] + 2] + mesh[3 * triangles[k + 2] + 2], k]);
      }
      order.sort((a, b) => a[0] - b[0]);
      context.lineWidth = 0.6; context.strokeStyle = "rgba(31,38,45,0.3)"; context.lineJoin = "round";
      for (const [, k] of order) {
        let heat = 0;
        context.beginPath();
        for (let c = 0; c < 3; c++) {
          const v = triangles[k + c];
          heat += model.heat[frame * count + v] / 3;
          context.lineTo(mesh[3 * v], mesh[3 * v + 1]);
        }
        context.closePath(); context.fillStyle = colours[Math.round(heat)]; context.fill(); context.stroke();
      }
      const real = project(measured, frame * points * 3, points, rows, spot);
      if (model.predicted) {
        const told = project(model.predicted, frame * points * 3, points, rows, spot);
        context.strokeStyle = "rgba(31,38,45,0.6)"; context.lineWidth = 1; context.beginPath();
        for (let p = 0; p < points; p++) {
          if (Number.isNaN(real[3 * p])) continue;
          context.moveTo(told[3 * p], told[3 * p + 1]); context.lineTo(real[3 * p], real[3 * p + 1]);
        }
        context.stroke();
      }
      context.fillStyle = "#1f262d";
      for (let p = 0; p < points; p++) {
        if (Number.isNaN(real[3 * p])) continue;
        context.beginPath(); context.arc(real[3 * p], real[3 * p + 1], 2.6, 0, 7); context.fill();
      }
      const letters = Math.max(19, (12 * canvas.width) / (canvas.clientWidth || canvas.width));
      context.font = letters.toFixed(0) + "px system-ui, sans-serif"; context.textAlign = "center";
      const off = model.rms[frame];
      context.fillText(model.title + ": points " + (off >= 10 ? off.toFixed(0) : off.toFixed(1)) + " " + film.unit + " away", width * (m + 0.5), 32);
      context.restore();
    });
  }
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    azimuth -= event.movementX * 0.01;
    elevation = Math.max(-1.5, Math.min(1.5, elevation + event.movementY * 0.01));
    draw();
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  playback(player, film, (k) => { frame = k; draw(); });
}
