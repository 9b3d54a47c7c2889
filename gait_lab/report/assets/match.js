"use strict";
// The replay of a match. One time for the whole page: picture, cards, list and line follow it.
const data = JSON.parse(document.getElementById("data").textContent);
const find = (id) => document.getElementById(id);
const made = (parent, tag, name = "", text = "") => {
  const node = document.createElement(tag);
  if (name) node.className = name;
  if (text) node.textContent = text;
  parent.appendChild(node);
  return node;
};
const UNKNOWN = -32768, JUMP = 0.3, LASTS = 4;
const colors = { red: 0xd23c32, blue: 0x2f6fe0 };
const teams = ["red", "blue"];

// -- numbers ---------------------------------------------------------------------------------------

function unpacked({ i16, step }) {
  const bytes = Uint8Array.from(atob(i16), (c) => c.charCodeAt(0));
  const whole = new Int16Array(bytes.buffer), values = new Float32Array(whole.length);
  for (let k = 0; k < whole.length; k++) values[k] = whole[k] === UNKNOWN ? NaN : whole[k] * step;
  return values;
}
const revive = (value) => {
  if (Array.isArray(value)) return value.map(revive);
  if (value === null || typeof value !== "object") return value;
  if ("i16" in value) return unpacked(value);
  return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, revive(each)]));
};
const rolling = unpacked(data.rolling), bodies = revive(data.bodies), kinds = revive(data.kinds);
const minds = revive(data.minds), times = data.times, texts = data.texts;
const begin = data.begin, end = times[times.length - 1];

/** Number of the last element that is not after a value. */
function last(values, value, of = (each) => each) {
  let low = 0, high = values.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (of(values[middle]) <= value) low = middle; else high = middle - 1;
  }
  return low;
}
const changed = (list, index) => list[last(list, index, (each) => each[0])][1];
const minutes = (t) => `${Math.floor(t / 60)}:${String(Math.floor(t % 60)).padStart(2, "0")}`;
const words = (text) => text.replaceAll("_", " ");

/** Two moments of the motion around a time, and the share of the way between them. */
function moment(time) {
  const at = Math.min(Math.max((time - begin) / data.period, 0), data.count - 1);
  const row = Math.floor(at), next = Math.min(row + 1, data.count - 1);
  return { row, next, share: at - row };
}
function ballAt(time) {
  const { row, next, share } = moment(time), a = [], b = [];
  for (let k = 0; k < 3; k++) { a.push(rolling[3 * row + k]); b.push(rolling[3 * next + k]); }
  const put = Math.hypot(b[0] - a[0], b[1] - a[1]) > JUMP;
  return a.map((value, k) => (put ? value : value + share * (b[k] - value)));
}
/** The ball without its haste, for cameras. */
function ballAround(time, reach = 1) {
  const sum = [0, 0];
  for (let k = -5; k <= 5; k++) {
    const place = ballAt(time + (reach * k) / 5);
    sum[0] += place[0] / 11; sum[1] += place[1] / 11;
  }
  return sum;
}

// -- the pitch -------------------------------------------------------------------------------------

const view = find("view");
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
renderer.outputEncoding = THREE.sRGBEncoding;
renderer.shadowMap.enabled = true;
renderer.shadowMap.type = THREE.PCFSoftShadowMap;
view.insertBefore(renderer.domElement, view.firstChild);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0x20262c);
const color = (rgb) => new THREE.Color(...rgb).convertSRGBToLinear();
const painted = (value) => new THREE.Color(value).convertSRGBToLinear();
const [length, width] = data.carpet;
const size = Math.hypot(length, width);

scene.add(new THREE.HemisphereLight(0xffffff, 0x56644f, 0.75));
const sun = new THREE.DirectionalLight(0xffffff, 0.75);
sun.position.set(-0.25 * length, -0.5 * width, size);
sun.castShadow = true;
sun.shadow.mapSize.set(2048, 2048);
Object.assign(sun.shadow.camera, { left: -size / 2, right: size / 2, top: size / 2, bottom: -size / 2,
  near: 0.1, far: 2 * size });
sun.shadow.bias = -0.0006;
scene.add(sun);

function added(geometry, material, parent = scene) {
  const mesh = new THREE.Mesh(geometry, material);
  parent.add(mesh);
  return mesh;
}
const floor = added(new THREE.PlaneGeometry(6 * size, 6 * size),
  new THREE.MeshLambertMaterial({ color: painted(0x3a4249) }));
floor.position.z = -0.01;
const carpet = added(new THREE.PlaneGeometry(length, width),
  new THREE.MeshLambertMaterial({ color: color(data.green) }));
carpet.receiveShadow = true;
const corners = data.markings.flatMap(([a, b, c, d]) =>
  [a, b, c, a, c, d].flatMap(([x, y]) => [x, y, 0.002]));
const lines = new THREE.BufferGeometry();
lines.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
lines.computeVertexNormals();
added(lines, new THREE.MeshLambertMaterial({ color: 0xf4f4f4, side: THREE.DoubleSide }))
  .receiveShadow = true;

function netting() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 32;
  const pen = canvas.getContext("2d");
  pen.strokeStyle = "#fff";
  pen.lineWidth = 3;
  pen.strokeRect(0, 0, 32, 32);
  const texture = new THREE.CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  return texture;
}
for (const each of data.fixtures) {
  const [a, b, c] = each.size;
  if (each.net) {
    // A plane in the two longer directions, with a mesh of 8 cm.
    const [, one, two] = [0, 1, 2].sort((i, j) => each.size[i] - each.size[j]);
    const texture = netting();
    const plane = new THREE.PlaneGeometry(each.size[one], each.size[two]);
    texture.repeat.set(each.size[one] / 0.08, each.size[two] / 0.08);
    const mesh = added(plane, new THREE.MeshBasicMaterial({ map: texture, transparent: true,
      opacity: 0.55, side: THREE.DoubleSide, depthWrite: false }));
    const axis = (k) => new THREE.Vector3().setComponent(k, 1);
    const out = axis(one).cross(axis(two));
    mesh.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(axis(one), axis(two), out));
    mesh.position.set(...each.position);
    continue;
  }
  const shape = each.kind === "box" ? new THREE.BoxGeometry(a, b, c)
    : new THREE.CylinderGeometry(a, a, b, 20).rotateX(Math.PI / 2);
  const mesh = added(shape, new THREE.MeshLambertMaterial({ color: color(each.color) }));
  mesh.position.set(...each.position);
  mesh.quaternion.set(...each.quaternion);
  mesh.castShadow = true;
}
const ball = added(new THREE.SphereGeometry(data.ball.radius, 24, 16),
  new THREE.MeshLambertMaterial({ color: color(data.ball.color) }));
ball.castShadow = true;

// -- robots ----------------------------------------------------------------------------------------

function placed({ position, quaternion }) {
  return new THREE.Matrix4().compose(new THREE.Vector3(...position),
    new THREE.Quaternion(...quaternion), new THREE.Vector3(1, 1, 1));
}
/** One mesh per joint of a kind of robot, in the colours of a team. */
function meshes(kind, team) {
  const palette = kind.palette.map((text) => painted(text)), jersey = painted(colors[team]);
  const parts = kind.nodes.map(() => ({ at: [], paint: [] }));
  for (let f = 0; f < kind.node.length; f++) {
    const part = parts[kind.node[f]], index = kind.paint[f];
    const paint = index < 0 ? jersey : palette[index];
    for (let k = 0; k < 9; k++) part.at.push(kind.vertex[9 * f + k]);
    for (let k = 0; k < 3; k++) part.paint.push(paint.r, paint.g, paint.b);
  }
  const material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide });
  return parts.map(({ at, paint }) => {
    if (!at.length) return null;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(at, 3));
    geometry.setAttribute("color", new THREE.Float32BufferAttribute(paint, 3));
    geometry.computeVertexNormals();
    return new THREE.Mesh(geometry, material);
  });
}
const robots = data.robots.map((facts, index) => {
  const kind = kinds[facts.kind], nodes = [];
  meshes(kind, facts.team).forEach((mesh, k) => {
    const { parent, position, quaternion, axis } = kind.nodes[k], node = new THREE.Group();
    node.position.set(...position);
    node.rest = new THREE.Quaternion(...quaternion);
    node.axis = new THREE.Vector3(...axis).normalize();
    node.quaternion.copy(node.rest);
    (k ? nodes[parent] : scene).add(node);
    if (mesh) { mesh.castShadow = true; mesh.robot = index; node.add(mesh); }
    nodes.push(node);
  });
  const label = made(find("labels"), "div", facts.team, facts.name);
  return { ...facts, index, kind, nodes, body: bodies[index], label, torso: placed(kind.torso) };
});
const pose = { a: new THREE.Quaternion(), b: new THREE.Quaternion(), place: new THREE.Vector3(),
  matrix: new THREE.Matrix4(), one: new THREE.Vector3(1, 1, 1), turn: new THREE.Quaternion() };

function pose_robot(robot, { row, next, share }) {
  const { position: p, quaternion: q, joint } = robot.body, count = robot.kind.joints;
  if (Math.hypot(p[3 * next] - p[3 * row], p[3 * next + 1] - p[3 * row + 1]) > JUMP) share = 0;
  const mixed = (values, width, k) =>
    values[width * row + k] + share * (values[width * next + k] - values[width * row + k]);
  pose.place.set(mixed(p, 3, 0), mixed(p, 3, 1), mixed(p, 3, 2));
  pose.a.fromArray(q, 4 * row);
  pose.a.slerp(pose.b.fromArray(q, 4 * next), share).normalize();
  robot.kind.nodes.forEach(({ joint: number }, k) => {
    if (number < 0) return;
    const node = robot.nodes[k];
    pose.turn.setFromAxisAngle(node.axis, mixed(joint, count, number));
    node.quaternion.copy(node.rest).multiply(pose.turn);
  });
  // The base is where it brings the torso to its place.
  const base = robot.nodes[0], torso = robot.nodes[robot.kind.torso.node];
  base.position.set(0, 0, 0);
  base.quaternion.identity();
  base.updateMatrixWorld(true);
  const from = pose.matrix.copy(torso.matrixWorld).multiply(robot.torso).invert();
  from.premultiply(new THREE.Matrix4().compose(pose.place, pose.a, pose.one));
  from.decompose(base.position, base.quaternion, base.scale);
  base.updateMatrixWorld(true);
  robot.at = pose.place.clone();
}

// -- plans, beliefs, the way of the ball -----------------------------------------------------------

const TRAIL = 60;
const trail = new THREE.InstancedMesh(new THREE.CircleGeometry(0.022, 12),
  new THREE.MeshBasicMaterial({ color: painted(0xffd873), transparent: true, opacity: 0.85 }), TRAIL);
trail.frustumCulled = false;
scene.add(trail);
function flat(value, opacity) {
  return new THREE.MeshBasicMaterial({ color: painted(value), transparent: true, opacity,
    side: THREE.DoubleSide, depthWrite: false });
}
function arrow(value, opacity, thick) {
  const shape = new THREE.Shape();
  const points = [[0.1, -thick], [0.5, -thick], [0.5, -2.6 * thick], [0.68, 0], [0.5, 2.6 * thick],
    [0.5, thick], [0.1, thick]];
  points.forEach(([x, y], k) => (k ? shape.lineTo(x, y) : shape.moveTo(x, y)));
  return added(new THREE.ShapeGeometry(shape), flat(value, opacity));
}
function ring(value, opacity, tip) {
  const group = new THREE.Group();
  added(new THREE.RingGeometry(0.12, 0.145, 32), flat(value, opacity), group);
  if (tip) {
    const shape = new THREE.Shape();
    shape.moveTo(0.15, -0.06); shape.lineTo(0.24, 0); shape.lineTo(0.15, 0.06);
    added(new THREE.ShapeGeometry(shape), flat(value, opacity), group);
  }
  scene.add(group);
  return group;
}
const OTHERS = data.robots.length;
for (const robot of robots) {
  const tint = colors[robot.team];
  robot.plan = arrow(tint, 0.95, 0.022);
  robot.second = arrow(0xffffff, 0.4, 0.014);
  robot.ring = ring(tint, 0.85, true);
  robot.ghost = added(new THREE.SphereGeometry(data.ball.radius, 16, 12), flat(tint, 0.5));
}
const others = Array.from({ length: OTHERS }, () => ring(0xffffff, 0.8, false));

function show_marks(index) {
  const options = { plans: find("see-plans").checked, beliefs: find("see-beliefs").checked };
  const place = ballAt(time);
  for (const robot of robots) {
    const mind = minds[robot.index], told = tell(robot, index), mine = robot.index === chosen;
    const near = mine || (chosen < 0 && told.role === "striker");
    const [way, , other] = mind.plan.subarray(4 * index, 4 * index + 4);
    const shows = options.plans && near && told.phase === "playing" && !told.penalty;
    robot.plan.visible = shows && told.plan !== "" && !Number.isNaN(way);
    robot.second.visible = shows && told.second !== "" && !Number.isNaN(other);
    robot.plan.position.set(place[0], place[1], 0.006);
    robot.plan.rotation.z = way;
    robot.second.position.set(place[0], place[1], 0.005);
    robot.second.rotation.z = other;
    const [x, y, yaw] = mind.believed.subarray(3 * index, 3 * index + 3);
    robot.ring.visible = options.beliefs && !Number.isNaN(x) && (chosen < 0 || mine);
    robot.ring.position.set(x, y, 0.004);
    robot.ring.rotation.z = yaw;
    const [u, v] = mind.ball.subarray(2 * index, 2 * index + 2);
    robot.ghost.visible = options.beliefs && !Number.isNaN(u) && (chosen < 0 ? near : mine);
    robot.ghost.position.set(u, v, data.ball.radius);
  }
  const seen = chosen < 0 || !options.beliefs ? [] : changed(minds[chosen].others, index);
  others.forEach((each, k) => {
    each.visible = k < seen.length;
    if (each.visible) each.position.set(...seen[k], 0.004);
  });
  trail.visible = find("see-trail").checked;
  const matrix = new THREE.Matrix4();
  for (let k = 0; k < TRAIL; k++) {
    const [x, y] = ballAt(time - 0.1 * (k + 1));
    const scale = time - 0.1 * (k + 1) < begin ? 0 : 1 - k / TRAIL;
    matrix.makeScale(scale, scale, scale).setPosition(x, y, 0.003);
    trail.setMatrixAt(k, matrix);
  }
  trail.instanceMatrix.needsUpdate = true;
}

// -- cameras ---------------------------------------------------------------------------------------

const camera = new THREE.PerspectiveCamera(38, 1, 0.03, 60);
camera.up.set(0, 0, 1);
const orbit = new THREE.OrbitControls(camera, renderer.domElement);
orbit.enabled = false;
orbit.maxPolarAngle = 0.495 * Math.PI;
orbit.minDistance = 0.3;
orbit.maxDistance = 3 * size;
orbit.addEventListener("change", () => redraw());
const about_x = new THREE.Quaternion(1, 0, 0, 0);

function followed(index) {
  if (chosen >= 0) return robots[chosen];
  const place = ballAt(time);
  const gap = ({ at }) => Math.hypot(at.x - place[0], at.y - place[1]);
  return robots.reduce((best, each) => (gap(each) < gap(best) ? each : best));
}
function aim(from, to, fov) {
  camera.up.set(0, 0, 1);
  camera.position.set(...from);
  camera.fov = fov;
  camera.lookAt(...to);
}
/** A field of view that is as wide on a narrow picture as on a wide one. */
const wide = (fov) => (camera.aspect >= 1.4 ? fov
  : 2 * Math.atan(Math.tan((fov * Math.PI) / 360) * (1.4 / camera.aspect)) * (180 / Math.PI));
function place_camera(index) {
  const kind = find("camera").value;
  if (kind === "free") return;
  if (kind === "top") {
    camera.up.set(0, 1, 0);
    camera.fov = 38;
    const tan = Math.tan((19 * Math.PI) / 180);
    const high = Math.max(width / 2, length / 2 / camera.aspect) / tan;
    camera.position.set(0, 0, 1.04 * high);
    camera.lookAt(0, 0, 0);
    return;
  }
  const [x, y] = ballAround(time);
  if (kind === "tv") {
    aim([0.7 * x, -width / 2 - 1.2, 2], [0.85 * x, 0.5 * y, 0.05], wide(44));
  } else if (kind === "red" || kind === "blue") {
    const side = kind === "red" ? -1 : 1;
    aim([side * (length / 2 + 1.4), 0.15 * y, 1.9], [0.5 * x + 0.1 * side * length, 0.5 * y, 0], wide(44));
  } else {
    const robot = followed(index);
    if (kind === "chase") {
      const rows = minds[robot.index].pose;
      let c = 0, s = 0;
      for (let k = -4; k <= 4; k++) {
        const yaw = rows[3 * Math.min(Math.max(index + k, 0), times.length - 1) + 2];
        c += Math.cos(yaw); s += Math.sin(yaw);
      }
      const turn = Math.hypot(c, s) || 1, { x: a, y: b } = robot.at;
      aim([a - (1.25 * c) / turn, b - (1.25 * s) / turn, 0.95],
        [a + (0.5 * c) / turn, b + (0.5 * s) / turn, 0.15], wide(48));
    } else if (robot.kind.eye) {
      const eye = robot.kind.eye;
      pose.matrix.copy(robot.nodes[eye.node].matrixWorld).multiply(placed(eye));
      pose.matrix.decompose(camera.position, camera.quaternion, pose.place);
      camera.quaternion.multiply(about_x);  // an optical frame looks along z, y points down
      camera.fov = (2 * Math.atan(Math.tan(eye.fov / 2) / camera.aspect) * 180) / Math.PI;
    }
  }
}
function choose_camera(kind) {
  find("camera").value = kind;
  orbit.enabled = kind === "free";
  if (kind === "free") {
    camera.up.set(0, 0, 1);
    const [x, y] = ballAround(time);
    orbit.target.set(0.9 * x, 0.55 * y, 0.1);
    orbit.update();
  }
  show(time);
}
find("camera").onchange = (event) => choose_camera(event.target.value);

// A press chooses a robot; a drag of the television's picture frees the camera.
let pressed = null;
renderer.domElement.addEventListener("pointerdown", (event) => {
  pressed = [event.clientX, event.clientY];
}, true);
renderer.domElement.addEventListener("pointermove", (event) => {
  const far = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 6;
  if (far && find("camera").value !== "free") {
    choose_camera("free");
    pressed = null;
  }
});
renderer.domElement.addEventListener("pointerup", (event) => {
  const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 6;
  pressed = null;
  if (!still) return;
  const box = renderer.domElement.getBoundingClientRect(), ray = new THREE.Raycaster();
  ray.setFromCamera({ x: (2 * (event.clientX - box.left)) / box.width - 1,
    y: 1 - (2 * (event.clientY - box.top)) / box.height }, camera);
  const hit = ray.intersectObjects(scene.children, true)
    .find((each) => each.object.robot !== undefined);
  choose(hit && hit.object.robot !== chosen ? hit.object.robot : -1);
});

// -- words -----------------------------------------------------------------------------------------

function game(index) {
  const [phase, set_play, kicking, red, blue] = changed(data.games, index);
  return { phase: texts[phase], set_play: texts[set_play], kicking: texts[kicking], red, blue };
}
function tell(robot, index) {
  const [state, role, penalty, change, plan, second, path] = changed(minds[robot.index].words, index);
  return { state: texts[state], role: texts[role], penalty: texts[penalty], change: texts[change],
    plan: texts[plan], second: texts[second], path: path.map((each) => texts[each]),
    phase: game(index).phase };
}
const cards = robots.map((robot) => {
  const card = made(find("robots"), "div", `card ${robot.team}`), head = made(card, "h2");
  made(head, "b", "", robot.name);
  const parts = { card, state: made(head, "span") };
  for (const name of ["doing", "path", "change", "plan", "off"]) parts[name] = made(card, "p", name);
  card.onclick = () => choose(chosen === robot.index ? -1 : robot.index);
  return parts;
});
function fill_cards(index) {
  robots.forEach((robot, k) => {
    const card = cards[k], told = tell(robot, index), mind = minds[k];
    const put = (name, text) => {
      if (card[name].textContent !== text) card[name].textContent = text;
      card[name].hidden = !text;
    };
    put("state", [told.role, words(told.state), told.penalty && `off: ${words(told.penalty)}`]
      .filter(Boolean).join(", "));
    put("doing", told.path.length ? told.path[told.path.length - 1] : "");
    put("path", told.path.slice(0, -1).join(" \u203a "));
    card.path.title = card.path.textContent;
    put("change", told.change);
    const seconds = (at) => `${mind.plan[4 * index + at].toFixed(1)} s`;
    put("plan", told.phase !== "playing" || !told.plan ? "" :
      `plan: ${words(told.plan)}, goal in ${seconds(1)}` +
      (told.second && `; else ${words(told.second)}, ${seconds(3)}`));
    const [x, y] = mind.pose.subarray(3 * index), [u, v] = mind.believed.subarray(3 * index);
    const [p, q] = mind.ball.subarray(2 * index), [a, b] = ballAt(times[index]);
    put("off", Number.isNaN(u) ? "" : `own place ${Math.hypot(u - x, v - y).toFixed(2)} m off, ` +
      (Number.isNaN(p) ? "knows no ball" : `the ball ${Math.hypot(p - a, q - b).toFixed(2)} m`));
  });
}

// -- the line --------------------------------------------------------------------------------------

const SYMBOLS = {
  goal: ["goal", "M7 0A7 7 0 1 1 6.99 0ZM7 4.5L9.4 6.2 8.5 9H5.5L4.6 6.2Z"],
  kick: ["kick", "M7 4A3 3 0 1 1 6.99 4Z"],
  fall: ["fall", "M1 2H13L7 13Z"],
  out: ["ball out, or put to the middle", "M2 2H12V12H2Z"],
  penalty: ["robot taken off", "M4 0H10V14H4Z"],
  lost: ["robot takes one half for the other", "M7 0L14 7 7 14 0 7Z"],
  whistle: ["kick-off, end of a half", "M6 0H8V14H6Z"],
};
function symbol(kind, team = "") {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 14 14");
  svg.setAttribute("class", `mark ${kind} ${team}`);
  const path = document.createElementNS(svg.namespaceURI, "path");
  path.setAttribute("d", SYMBOLS[kind][1]);
  svg.appendChild(path);
  return svg;
}
for (const [kind, [text]] of Object.entries(SYMBOLS)) {
  made(find("symbols"), "dt").appendChild(symbol(kind));
  made(find("symbols"), "dd", "", text);
}
const share = (t) => `${(100 * Math.min(Math.max((t - times[0]) / (end - times[0]), 0), 1)).toFixed(3)}%`;
function bar(parent, from, to, name) {
  const node = made(find(parent), "i", name);
  node.style.left = share(from);
  node.style.width = `calc(${share(to)} - ${share(from)})`;
  return node;
}
const phases = data.games.map(([index]) => ({ from: times[index], ...game(index) }));
phases.forEach((each, k) => {
  const to = k + 1 < phases.length ? phases[k + 1].from : end;
  bar("phases", each.from, to, each.phase).title = words(each.phase);
});
data.duels.forEach(([from, to]) => { bar("ball", from, to, "duel").title = "duel"; });
data.touches.forEach(([t, team, name]) => { bar("ball", t, t, teams[team]).title = name; });
const items = data.events.map((event) => {
  if (event.kind !== "whistle") {
    const mark = symbol(event.kind, event.team);
    mark.style.left = share(event.time);
    mark.appendChild(document.createElementNS(mark.namespaceURI, "title")).textContent = event.text;
    find("marks").appendChild(mark);
  }
  const item = made(find("events"), "li"), button = made(item, "button");
  made(button, "time", "", minutes(event.time));
  button.appendChild(symbol(event.kind, event.team));
  const text = made(button, "span", "", event.text);
  if (event.why) made(text, "small", "", event.why);
  button.onclick = () => show(event.time - 2);
  return item;
});
function drag(event) {
  const box = find("line").getBoundingClientRect();
  show(times[0] + ((event.clientX - box.left) / box.width) * (end - times[0]));
}
find("line").onpointerdown = (event) => { find("line").setPointerCapture(event.pointerId); drag(event); };
find("line").onpointermove = (event) => { if (event.buttons) drag(event); };
find("line").setAttribute("aria-valuemax", end);

/** Seconds of play in the present half, as on the board. */
function played(index) {
  let half = 1, seconds = 0;
  for (let k = 0; k < phases.length; k++) {
    const to = k + 1 < phases.length ? phases[k + 1].from : end;
    if (phases[k].from > times[index]) break;
    if (phases[k].phase === "playing") seconds += Math.min(to, times[index]) - phases[k].from;
    if (phases[k].phase === "finished" && k + 1 < phases.length && phases[k + 1].from <= times[index]) {
      half = 2; seconds = 0;
    }
  }
  return `half ${half}, ${minutes(seconds)} of play`;
}

// -- time ------------------------------------------------------------------------------------------

let time = times[0], playing = false, chosen = -1, before = 0, drawn = false, current = -1;
function redraw() {
  if (drawn) return;
  drawn = true;
  requestAnimationFrame(() => {
    drawn = false;
    renderer.render(scene, camera);
    const box = view.getBoundingClientRect();
    for (const robot of robots) {
      const point = robot.at.clone().setZ(robot.at.z + 0.3).project(camera);
      robot.label.hidden = point.z > 1;
      robot.label.style.transform = `translate(${((point.x + 1) / 2) * box.width}px, ` +
        `${((1 - point.y) / 2) * box.height}px) translate(-50%, -100%)`;
    }
  });
}
function show(at) {
  time = Math.min(Math.max(at, times[0]), end);
  const index = last(times, time), motion = moment(time), now = game(index);
  ball.position.set(...ballAt(time));
  robots.forEach((robot) => pose_robot(robot, motion));
  show_marks(index);
  place_camera(index);
  camera.updateProjectionMatrix();
  fill_cards(index);
  find("score").textContent = `red ${now.red} : ${now.blue} blue`;
  const play = now.set_play ? `${words(now.set_play)} for ${now.kicking}`
    : words(now.phase) + (now.kicking ? `, ${now.kicking} kicks off` : "");
  find("phase").textContent = `${play}; ${played(index)}`;
  find("clock").textContent = `${time.toFixed(1)} of ${end.toFixed(0)} s`;
  find("now").style.left = share(time);
  find("line").setAttribute("aria-valuenow", time.toFixed(1));
  point_out();
  redraw();
}
function point_out() {
  const events = data.events;
  const newest = events.length && events[0].time <= time ? last(events, time, (each) => each.time) : -1;
  if (newest !== current) {
    if (items[current]) items[current].className = "";
    current = newest;
    const item = items[current];
    if (item) {
      item.className = "on";
      const list = find("events");
      list.scrollTop = item.offsetTop - list.offsetTop - list.clientHeight / 2;
    }
  }
  const event = events[current], fresh = event && time - event.time < LASTS + (event.why ? 2 : 0);
  const text = fresh ? event.text : "";
  if (find("caption").firstChild?.textContent !== text) {
    find("caption").textContent = "";
    if (fresh) {
      made(find("caption"), "span", "", text);
      if (event.why) made(find("caption"), "small", "", event.why);
    }
  }
}
function choose(index) {
  chosen = index;
  robots.forEach((robot, k) => {
    robot.label.classList.toggle("chosen", k === chosen);
    cards[k].card.classList.toggle("chosen", k === chosen);
  });
  show(time);
}
function step(now) {
  if (!playing) return;
  show(time + ((now - before) / 1000) * Number(find("rate").value));
  before = now;
  if (time >= end) toggle(); else requestAnimationFrame(step);
}
function toggle() {
  playing = !playing;
  find("play").textContent = playing ? "\u25a0" : "\u25b6";
  if (!playing) return;
  if (time >= end) show(times[0]);
  before = performance.now();
  requestAnimationFrame(step);
}
function jump(way) {
  const stops = data.events.map((each) => each.time - 2);
  const next = way > 0 ? stops.find((each) => each > time + 0.05)
    : stops.filter((each) => each < time - 0.5).pop();
  if (next !== undefined) show(next);
}
find("play").onclick = toggle;
find("before").onclick = () => jump(-1);
find("after").onclick = () => jump(1);
for (const name of ["see-trail", "see-plans", "see-beliefs"]) find(name).onchange = () => show(time);
document.addEventListener("keydown", (event) => {
  if (event.target.tagName === "SELECT" || event.ctrlKey || event.metaKey || event.altKey) return;
  const far = event.shiftKey ? 5 : 1;
  const keys = { " ": toggle, ArrowLeft: () => show(time - far), ArrowRight: () => show(time + far),
    n: () => jump(1), p: () => jump(-1), c: () => {
      const list = find("camera");
      choose_camera(list.options[(list.selectedIndex + 1) % list.options.length].value);
    } };
  if (!keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
});
document.querySelectorAll("[data-tab]").forEach((button) => {
  button.onclick = () => {
    for (const each of document.querySelectorAll("[data-tab], .tab")) each.classList.remove("on");
    button.classList.add("on");
    find(button.dataset.tab).classList.add("on");
  };
});
function resize() {
  const { width: w, height: h } = view.getBoundingClientRect();
  renderer.setSize(w, h, false);
  camera.aspect = w / h;
  show(time);
}
new ResizeObserver(resize).observe(view);
// A page can be opened at a time: replay.html#t=31.5
show(Number(location.hash.replace("#t=", "")) || times[0]);
