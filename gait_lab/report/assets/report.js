"use strict";
// One time for the whole page: the slider, the cursor in every plot and the replay follow it.
const report = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);

  const unpacked = data.arrays.map((text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  });
  const revive = (value) => {
    if (Array.isArray(value)) return value.map(revive);
    if (value === null || typeof value !== "object") return value;
    if ("$" in value) return unpacked[value.$];
    return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, revive(each)]));
  };

  const base = {
    font: { family: "system-ui, Segoe UI, Roboto, DejaVu Sans, sans-serif", size: 12, color: "#16202a" },
    margin: { l: 64, r: 18, t: 34, b: 40 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "#fff",
    hovermode: "x", hoverlabel: { font: { size: 12 } },
    legend: { orientation: "h", x: 0, y: 1, xanchor: "left", yanchor: "bottom",
      bgcolor: "rgba(0,0,0,0)", itemwidth: 30 },
  };
  const axis = { gridcolor: "#e9edf0", zerolinecolor: "#c9d0d6", linecolor: "#c9d0d6",
    showline: true, ticks: "outside", tickcolor: "#c9d0d6", ticklen: 4, automargin: true };
  const config = { displaylogo: false, responsive: true,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  const eventColor = { fall: "#b3243b", push: "#7a4fa3", alarm: "#e0a030" };

  const plots = [];
  const listeners = [];
  const state = { time: data.begin, playing: false, rate: 1, zooming: false };
  const timeAxes = (layout) => Object.keys(layout).filter((key) => key.startsWith("xaxis"));

  function marks(layout) {
    const shapes = [...(layout.shapes || [])];
    const notes = [];
    const axes = timeAxes(layout);
    for (const event of data.events || []) {
      axes.forEach((key, index) => {
        const x = key.replace("axis", "");
        shapes.push({ type: "line", xref: x, yref: `${layout[key].anchor} domain`,
          x0: event.time, x1: event.time, y0: 0, y1: 1, name: event.kind,
          line: { color: eventColor[event.kind], width: 1.5, dash: "dashdot" } });
        if (index === 0) notes.push({ xref: x, yref: `${layout[key].anchor} domain`,
          x: event.time, y: 1, text: event.text, showarrow: false, textangle: -90, xanchor: "right",
          yanchor: "top", font: { size: 10.5, color: eventColor[event.kind] } });
      });
    }
    return { shapes, annotations: notes };
  }

  function laidOut(figure) {
    const layout = { ...base, ...figure.layout };
    layout.margin = { ...base.margin, ...(figure.layout.margin || {}) };
    for (const key of Object.keys(layout)) {
      if (/^[xy]axis\d*$/.test(key)) layout[key] = { ...axis, ...layout[key] };
    }
    if (figure.time) {
      Object.assign(layout, marks(layout));
      for (const key of timeAxes(layout)) layout[key].range = range(figure);
    } else layout.hovermode = "closest";
    return layout;
  }

  function range(figure) {
    if (!figure.window) return [data.begin, data.end];
    const page = Math.floor((state.time - data.begin) / figure.window);
    const from = data.begin + page * figure.window;
    return [from, from + figure.window];
  }

  async function draw(figure) {
    const element = document.getElementById(figure.id);
    const layout = laidOut(figure);
    const traces = revive(figure.data);
    await Plotly.newPlot(element, traces, layout, config);
    // A trace with times for its points leads the last one, a dot, along itself.
    const lead = traces.find((trace) => trace.customdata);
    const plot = { figure, element, cursors: [], page: range(figure)[0], lead };
    plots.push(plot);
    if (!figure.time) return;
    plot.cursors = timeAxes(layout).map((key) => {
      const line = document.createElement("div");
      line.className = "cursor";
      element.appendChild(line);
      return { key, line };
    });
    element.addEventListener("click", (event) => {
      const full = element._fullLayout;
      const box = element.getBoundingClientRect();
      for (const key of timeAxes(layout)) {
        const x = event.clientX - box.left - full[key]._offset;
        const y = event.clientY - box.top;
        const dragged = event.target.closest(".modebar, .legend");
        if (!dragged && x >= 0 && x <= full[key]._length && y > full._size.t) {
          setTime(full[key].p2d(x));
          return;
        }
      }
    });
    element.on("plotly_relayout", (change) => zoomed(plot, change));
    element.on("plotly_afterplot", () => place(plot));
  }

  // A zoom in one time plot is a zoom in all of them.
  function zoomed(plot, change) {
    place(plot);
    if (state.zooming || plot.figure.window) return;
    const from = change["xaxis.range[0]"] ?? change["xaxis.range"]?.[0];
    const to = change["xaxis.range[1]"] ?? change["xaxis.range"]?.[1];
    if (change["xaxis.autorange"]) zoom(data.begin, data.end);
    else if (from !== undefined && to !== undefined) zoom(from, to);
  }

  async function zoom(from, to) {
    state.zooming = true;
    for (const plot of plots) {
      if (plot.figure.time && !plot.figure.window) {
        await Plotly.relayout(plot.element, { "xaxis.range": [from, to] });
      }
    }
    state.zooming = false;
  }

  function place(plot) {
    const full = plot.element._fullLayout;
    for (const { key, line } of plot.cursors) {
      const x = full[key], y = full[x.anchor.replace("y", "yaxis")];
      const at = x.d2p(state.time);
      const seen = at >= 0 && at <= x._length;
      line.style.display = seen ? "block" : "none";
      if (!seen) continue;
      line.style.left = `${x._offset + at}px`;
      line.style.top = `${y._offset}px`;
      line.style.height = `${y._length}px`;
    }
  }

  function follow(plot) {
    if (plot.figure.window) {
      const [from, to] = range(plot.figure);
      if (from !== plot.page) {
        plot.page = from;
        Plotly.relayout(plot.element, { "xaxis.range": [from, to] });
      }
    }
    if (plot.lead) {
      const row = search(plot.lead.customdata, state.time);
      const dot = plot.element.data.length - 1;
      Plotly.restyle(plot.element, { x: [[plot.lead.x[row]]], y: [[plot.lead.y[row]]] }, [dot]);
    }
    place(plot);
  }

  // Row of the last time that is not after t.
  function search(times, t) {
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= t) low = middle; else high = middle - 1;
    }
    return low;
  }

  const visible = new Set();
  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) visible.add(entry.target.id); else visible.delete(entry.target.id);
    }
    plots.forEach((plot) => visible.has(plot.element.id) && follow(plot));
  });

  const slider = document.getElementById("slider");
  const clock = document.getElementById("clock");
  const playButton = document.getElementById("play");

  function setTime(t) {
    state.time = Math.min(data.end, Math.max(data.begin, t));
    slider.value = state.time;
    clock.value = `${state.time.toFixed(2)} s`;
    plots.forEach((plot) => visible.has(plot.element.id) && follow(plot));
    listeners.forEach((listen) => listen(state.time));
  }

  function setPlaying(playing) {
    state.playing = playing;
    playButton.innerHTML = playing ? "&#9208;" : "&#9654;";
    playButton.setAttribute("aria-label", playing ? "stop" : "play");
    if (!playing) return;
    if (state.time >= data.end) setTime(data.begin);
    let last = performance.now();
    const step = (now) => {
      if (!state.playing) return;
      const next = state.time + 1e-3 * (now - last) * state.rate;
      last = now;
      setTime(next);
      if (next >= data.end) setPlaying(false);
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  function controls() {
    slider.min = data.begin;
    slider.max = data.end;
    slider.addEventListener("input", () => setTime(Number(slider.value)));
    playButton.addEventListener("click", () => setPlaying(!state.playing));
    document.getElementById("rate").addEventListener("change", (event) => {
      state.rate = Number(event.target.value);
    });
    document.getElementById("whole").addEventListener("click", () => zoom(data.begin, data.end));
    document.addEventListener("keydown", (event) => {
      if (/^(INPUT|SELECT|TEXTAREA|BUTTON)$/.test(event.target.tagName)) return;
      if (event.code === "Space") { event.preventDefault(); setPlaying(!state.playing); }
      if (event.code === "ArrowRight") setTime(state.time + 0.02);
      if (event.code === "ArrowLeft") setTime(state.time - 0.02);
    });
    document.getElementById("bar").hidden = !(data.end > data.begin);
  }

  async function start(first) {
    controls();
    state.time = data.show ?? data.begin;
    if (first) await first();
    for (const figure of data.figures) {
      await draw(figure);
      watcher.observe(document.getElementById(figure.id));
      await new Promise((done) => setTimeout(done, 0));  // the page stays alive meanwhile
    }
    setTime(state.time);
    document.documentElement.dataset.ready = "yes";
  }

  return { data, revive, search, start, setTime, setPlaying, listeners, state, plots };
})();
if (!report.data.replay) report.start();
