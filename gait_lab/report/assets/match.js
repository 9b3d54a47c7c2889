"use strict";
// The replay of a match: the pitch from above, the goals on the time line, each robot's state.
const data = JSON.parse(document.getElementById("data").textContent);
const find = (id) => document.getElementById(id);
const frames = data.frames, end = frames[frames.length - 1].t;
const colors = { red: "#e0483e", blue: "#3f7df0" };
const svg = find("pitch");
const [halfLength, halfWidth] = data.carpet.map((size) => size / 2);
svg.setAttribute("viewBox", `${-halfLength} ${-halfWidth} ${2 * halfLength} ${2 * halfWidth}`);

function add(parent, name, attributes) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  parent.appendChild(node);
  return node;
}

// The field's y points up; that of the picture points down.
for (const corners of data.markings) {
  add(svg, "polygon", { points: corners.map(([x, y]) => `${x},${-y}`).join(" "), fill: "#f2f2f2" });
}
for (const [x, y] of data.posts) add(svg, "circle", { cx: x, cy: -y, r: 0.05, fill: "#ffffff" });
const ball = add(svg, "circle", { r: 0.05, fill: "#ff7a0f", stroke: "#7a3300", "stroke-width": 0.01 });
const robots = {}, rows = {};
for (const { name, team } of data.robots) {
  const group = add(svg, "g", {});
  add(group, "ellipse", { rx: 0.09, ry: 0.16, fill: colors[team], stroke: "#111", "stroke-width": 0.01 });
  add(group, "path", { d: "M0.1,-0.05 L0.2,0 L0.1,0.05 Z", fill: "#111" });
  const label = add(svg, "text", { "font-size": 0.11, fill: "#fff", "text-anchor": "middle" });
  label.textContent = name;
  robots[name] = { group, label };
  const row = find("robots").tBodies[0].insertRow();
  rows[name] = [0, 1, 2, 3].map(() => row.insertCell());
  rows[name][0].textContent = name;
  rows[name][0].style.color = colors[team];
}
for (const goal of data.goals) {
  const mark = document.createElement("i");
  mark.style.left = `${(100 * goal.t) / end}%`;
  mark.style.background = colors[goal.team];
  mark.title = `${goal.team} (${goal.player || "unknown"}) at ${goal.t.toFixed(1)} s`;
  mark.onclick = () => show(Math.max(0, goal.t - 5));
  find("goals").appendChild(mark);
}

let time = 0, playing = false, last = 0;
function show(at) {
  time = Math.min(Math.max(at, 0), end);
  let low = 0, high = frames.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (frames[middle].t <= time) low = middle; else high = middle - 1;
  }
  const frame = frames[low], next = frames[Math.min(low + 1, frames.length - 1)];
  const share = next.t > frame.t ? (time - frame.t) / (next.t - frame.t) : 0;
  const between = (a, b) => a + share * (b - a);
  ball.setAttribute("cx", between(frame.ball[0], next.ball[0]));
  ball.setAttribute("cy", -between(frame.ball[1], next.ball[1]));
  for (const [name, robot] of Object.entries(frame.robots)) {
    const then = next.robots[name];
    const x = between(robot[0], then[0]), y = between(robot[1], then[1]);
    const turn = Math.atan2(Math.sin(then[2] - robot[2]), Math.cos(then[2] - robot[2]));
    const heading = ((robot[2] + share * turn) * 180) / Math.PI;
    const down = robot[3] === "fallen" || robot[3] === "getting_up";
    robots[name].group.setAttribute("transform", `translate(${x} ${-y}) rotate(${-heading})`);
    robots[name].group.setAttribute("opacity", down ? 0.45 : 1);
    robots[name].label.setAttribute("x", x);
    robots[name].label.setAttribute("y", -y - 0.2);
    [robot[4], robot[3], robot[5]].forEach((text, i) => { rows[name][i + 1].textContent = text; });
  }
  find("score").textContent = `red ${frame.score[0]} : ${frame.score[1]} blue, ${frame.phase}`;
  find("slider").value = time;
  find("clock").textContent = `${time.toFixed(1)} s`;
  find("now").style.left = `${(100 * time) / end}%`;
}
function step(now) {
  if (!playing) return;
  show(time + ((now - last) / 1000) * Number(find("rate").value));
  last = now;
  if (time >= end) toggle(); else requestAnimationFrame(step);
}
function toggle() {
  playing = !playing;
  find("play").textContent = playing ? "\u25a0" : "\u25b6";
  if (playing) { if (time >= end) show(0); last = performance.now(); requestAnimationFrame(step); }
}
find("slider").max = end;
find("slider").oninput = (event) => show(Number(event.target.value));
find("play").onclick = toggle;
document.addEventListener("keydown", (event) => {
  if (event.code === "Space") { event.preventDefault(); toggle(); }
});
show(0);
