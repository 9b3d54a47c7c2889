"use strict";
// The robot in three dimensions. It stays in the middle; the floor moves below it.
(() => {
  const it = report.revive(report.data.replay);
  const element = document.getElementById("replay");
  const words = document.getElementById("now");
  const count = it.vertex.length / 3;
  const frame = it.links * 12;
  const REACH = 0.42, HEIGHT = 0.6, TILE = 0.1, PRINTS = 10;
  const colors = { left: "#c8553d", right: "#2f7f5f" };

  function mesh(row, center) {
    const x = new Float32Array(count), y = new Float32Array(count), z = new Float32Array(count);
    const p = it.poses, v = it.vertex, start = row * frame;
    for (let n = 0; n < count; n++) {
      const m = start + 12 * it.link[n], a = v[3 * n], b = v[3 * n + 1], c = v[3 * n + 2];
      x[n] = p[m] * a + p[m + 1] * b + p[m + 2] * c + p[m + 3] - center[0];
      y[n] = p[m + 4] * a + p[m + 5] * b + p[m + 6] * c + p[m + 7] - center[1];
      z[n] = p[m + 8] * a + p[m + 9] * b + p[m + 10] * c + p[m + 11];
    }
    return [x, y, z];
  }

  function floor(center) {
    const lines = [[], [], []];
    const add = (x0, y0, x1, y1) => {
      lines[0].push(x0, x1, null); lines[1].push(y0, y1, null); lines[2].push(0, 0, null);
    };
    const reach = REACH - 0.01;
    for (const axis of [0, 1]) {
      const first = Math.ceil((center[axis] - reach) / TILE);
      const last = Math.floor((center[axis] + reach) / TILE);
      for (let k = first; k <= last; k++) {
        const at = k * TILE - center[axis];
        if (axis === 0) add(at, -reach, at, reach); else add(-reach, at, reach, at);
      }
    }
    return lines;
  }

  function prints(time, center, left) {
    const lines = [[], [], []];
    const past = it.prints.filter((each) => each.t <= time).slice(-PRINTS);
    for (const each of past) {
      if (each.left !== left) continue;
      const [x, y, yaw] = each.pose;
      if (Math.hypot(x - center[0], y - center[1]) > REACH - 0.06) continue;
      const c = Math.cos(yaw), s = Math.sin(yaw), mirror = left ? 1 : -1;
      for (const [a, b] of [...it.outline, it.outline[0]]) {
        lines[0].push(x + c * a - s * mirror * b - center[0]);
        lines[1].push(y + s * a + c * mirror * b - center[1]);
        lines[2].push(0.002);
      }
      lines.forEach((line) => line.push(null));
    }
    return lines;
  }

  function pendulum(row, time, center) {
    const com = [0, 1, 2].map((k) => it.com[3 * row + k] - (k < 2 ? center[k] : 0));
    const phase = it.prints.findLast((each) => each.t <= time && time < each.end);
    const origin = phase && phase.origins.findLast((each) => each[0] <= time + 0.1);
    const lines = [[com[0]], [com[1]], [com[2]]];
    if (origin) {
      lines[0].push(origin[1] - center[0]);
      lines[1].push(origin[2] - center[1]);
      lines[2].push(0.004);
    }
    return lines;
  }

  function tell(row, time) {
    const phase = it.prints.findLast((each) => each.t <= time && time < each.end);
    const foot = phase ? `on the ${phase.left ? "left" : "right"} foot` : "";
    let commanded = "";
    if (it.speeds) {
      const n = report.search(it.speeds.time, time);
      const [x, y, yaw] = it.speeds.time[n] <= time ? it.speeds.value.slice(3 * n, 3 * n + 3) : [0, 0, 0];
      commanded = `commanded ${(100 * x).toFixed(0)}, ${(100 * y).toFixed(0)} cm/s, ` +
        `${(yaw * 180 / Math.PI).toFixed(0)}°/s`;
    }
    words.innerHTML = `<b>${time.toFixed(2)} s</b><br>${commanded}<br>${foot}`;
  }

  function scene(time) {
    const row = report.search(it.time, time);
    const center = [it.center[2 * row], it.center[2 * row + 1]];
    const parts = [mesh(row, center), floor(center), prints(time, center, true),
      prints(time, center, false), pendulum(row, time, center)];
    tell(row, time);
    return [0, 1, 2].map((k) => parts.map((part) => part[k]));
  }

  const line = (name, color, width) => ({ type: "scatter3d", mode: "lines", name, hoverinfo: "skip",
    showlegend: false, line: { color, width } });

  async function build() {
    const [x, y, z] = scene(report.state.time);
    const traces = [
      { type: "mesh3d", i: it.triangle[0], j: it.triangle[1], k: it.triangle[2], facecolor: it.color,
        flatshading: true, hoverinfo: "skip", name: "robot",
        lighting: { ambient: 0.62, diffuse: 0.75, specular: 0.12, roughness: 0.7, fresnel: 0.1,
          facenormalsepsilon: 0, vertexnormalsepsilon: 0 },
        lightposition: { x: 1500, y: -1200, z: 3000 } },
      line("floor", "#cfd6dc", 1.5),
      line("left soles", colors.left, 5),
      line("right soles", colors.right, 5),
      { type: "scatter3d", mode: "lines+markers", name: "pendulum", hoverinfo: "skip",
        showlegend: false, line: { color: "#0f7c94", width: 7 },
        marker: { size: [7, 5], color: ["#e0a030", "#0f7c94"] } },
    ].map((trace, n) => ({ ...trace, x: x[n], y: y[n], z: z[n] }));
    const bare = { visible: false, autorange: false };
    const layout = {
      margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", uirevision: "keep",
      scene: {
        xaxis: { ...bare, range: [-REACH, REACH] }, yaxis: { ...bare, range: [-REACH, REACH] },
        zaxis: { ...bare, range: [-0.01, HEIGHT] }, aspectmode: "manual",
        aspectratio: { x: 2 * REACH / HEIGHT, y: 2 * REACH / HEIGHT, z: 1 },
        camera: { eye: { x: 1.15, y: -1.15, z: 0.42 }, center: { x: 0, y: 0, z: -0.12 } },
      },
    };
    await Plotly.newPlot(element, traces, layout, { displaylogo: false, responsive: true,
      displayModeBar: false });
  }

  // One picture at a time: a slow machine skips frames and does not queue them.
  let drawing = false, wanted = null;
  async function show(time) {
    wanted = time;
    if (drawing) return;
    drawing = true;
    while (wanted !== null) {
      const now = wanted;
      wanted = null;
      const [x, y, z] = scene(now);
      await Plotly.restyle(element, { x, y, z }, [0, 1, 2, 3, 4]);
      await new Promise((done) => requestAnimationFrame(done));
    }
    drawing = false;
  }

  const seen = new IntersectionObserver((entries) => {
    it.visible = entries[entries.length - 1].isIntersecting;
    if (it.visible) show(report.state.time);
  });
  report.listeners.push((time) => { if (it.visible) show(time); });
  const glass = document.getElementById("glass");
  glass.addEventListener("click", () => {
    const through = glass.textContent === "see through";
    glass.textContent = through ? "solid" : "see through";
    Plotly.restyle(element, { opacity: through ? 0.3 : 1 }, [0]);
  });
  report.start(async () => { await build(); seen.observe(element); });
})();
