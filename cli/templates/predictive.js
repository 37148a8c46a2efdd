for (const player of document.querySelectorAll(".player.predictive")) {
  const film = JSON.parse(player.querySelector(".data").textContent), canvas = player.querySelector("canvas");
  const context = canvas.getContext("2d"), frames = film.time.length, axes = film.axes;
  const measured = shorts(film.measured), best = shorts(film.best), draws = film.draws.map(shorts);
  const dots = measured.length / frames / axes, count = best.length / frames / axes;

  function place(data, index, view, spot) {
    const at = index * axes;
    if (data[at] === -32768) return null;
    let x = 0, y = 0;
    for (let a = 0; a < axes; a++) { x += view.rows[0][a] * data[at + a]; y += view.rows[1][a] * data[at + a]; }
    return [spot.x + spot.s * x, spot.y - spot.s * y];
  }
  function wire(data, frame, view, spot) {
    context.beginPath();
    for (let k = 0; k < film.lines.length; k += 2) {
      const from = place(data, frame * count + film.lines[k], view, spot), to = place(data, frame * count + film.lines[k + 1], view, spot);
      context.moveTo(...from); context.lineTo(...to);
    }
    context.stroke();
  }
  function show(frame) {
    context.clearRect(0, 0, canvas.width, canvas.height);
    const width = canvas.width / film.views.length, letters = Math.max(18, (12 * canvas.width) / (canvas.clientWidth || canvas.width));
    const top = 2.4 * letters, room = canvas.height - top - 24;
    film.views.forEach((view, w) => {
      const spot = { x: 0, y: 0, s: 1 }, low = [1e9, 1e9], high = [-1e9, -1e9];
      for (const [data, number] of [[measured, dots], [best, count], ...draws.map((d) => [d, count])]) {
        for (let p = 0; p < number; p++) {
          const at = place(data, frame * number + p, view, spot);
          for (let a = 0; at && a < 2; a++) { low[a] = Math.min(low[a], at[a]); high[a] = Math.max(high[a], at[a]); }
        }
      }
      spot.s = Math.min((0.84 * width) / (view.size[0] + 1), room / (view.size[1] + 1));
      spot.x = width * (w + 0.5) - (spot.s * (low[0] + high[0])) / 2; spot.y = top + room / 2 - (spot.s * (low[1] + high[1])) / 2;
      context.save();
      context.beginPath(); context.rect(width * w, 0, width, canvas.height); context.clip();
      context.lineJoin = "round"; context.lineWidth = 1.6; context.strokeStyle = "rgba(222,160,130,0.55)";
      for (const draw of draws) wire(draw, frame, view, spot);
      context.lineWidth = 2; context.strokeStyle = "#c4532d";
      wire(best, frame, view, spot);
      if (film.paired) {
        context.strokeStyle = "rgba(31,38,45,0.55)"; context.lineWidth = 1; context.beginPath();
        for (let p = 0; p < dots; p++) {
          const real = place(measured, frame * dots + p, view, spot);
          if (!real) continue;
          context.moveTo(...real); context.lineTo(...place(best, frame * count + p, view, spot));
        }
        context.stroke();
      }
      context.fillStyle = "#1f262d";
      for (let p = 0; p < dots; p++) {
        const real = place(measured, frame * dots + p, view, spot);
        if (!real) continue;
        context.beginPath(); context.arc(real[0], real[1], 3.4, 0, 7); context.fill();
      }
      context.font = letters.toFixed(0) + "px system-ui, sans-serif"; context.textAlign = "center"; context.fillStyle = "#68717a";
      context.fillText(view.name, width * (w + 0.5), 1.3 * letters);
      context.restore();
    });
    context.font = letters.toFixed(0) + "px system-ui, sans-serif"; context.textAlign = "left"; context.fillStyle = "#1f262d";
    context.fillText(film.phase[frame], 16, canvas.height - 14);
  }
  playback(player, film, show);
}
