"use strict";
// Plays the recordings of every `.replay` on the page, all of one replay at the same time.
// `#t=1.5&play=1&zoom=2` in the address sets the first replay's time (s), whether it plays, and its zoom.
(() => {
  const LIGHT = {
    ramp: [[243, 245, 248], [253, 228, 160], [245, 155, 75], [204, 61, 51], [107, 16, 48]],
    paper: "#fff", ink: "#1f2933", edge: "#52606d", fixed: "#d3d8de", moved: "#d9d2e9", body: "#e3ebf5", grid: "#e4e7eb", force: "#0072b2",
  };
  const DARK = {
    ramp: [[38, 49, 61], [110, 52, 48], [204, 81, 51], [245, 165, 75], [255, 240, 180]],
    paper: "#14181d", ink: "#e4e7eb", edge: "#9aa5b1", fixed: "#3e4c59", moved: "#3d3557", body: "#26313d", grid: "#323f4b", force: "#7cc4f5",
  };
  const isDark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => (isDark.matches ? DARK : LIGHT);
  const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];

  const ramp = (share) => {
    const colors = theme().ramp;
    const place = Math.min(Math.max(share, 0), 1) * (colors.length - 1);
    const i = Math.min(Math.floor(place), colors.length - 2);
    const mix = colors[i].map((v, k) => Math.round(v + (place - i) * (colors[i + 1][k] - v)));
    return `rgb(${mix})`;
  };

  const si = (value, unit) => {
    if (!(Math.abs(value) > 0)) return `0 ${unit}`;
    if (!unit) return value.toExponential(1).replace("e+", "e").replace("-", "−");
    const [scale, prefix] = PREFIXES.find(([s]) => Math.abs(value) >= 0.9995 * s) || PREFIXES[PREFIXES.length - 1];
    return `${(value / scale).toPrecision(3)} ${prefix}${unit}`;
  };

  // The file as it is described in src/lab/recording/mod.rs.
  async function decode(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    const magic = String.fromCharCode(...bytes.slice(0, 7));
    if (magic !== "SIMPREC" || view.getUint32(8, true) !== 1) throw new Error("not a recording of version 1");
    const stream = new Blob([bytes.slice(16)]).stream().pipeThrough(new DecompressionStream("deflate"));
    const payload = new Uint8Array(await new Response(stream).arrayBuffer());
    if (payload.length !== view.getUint32(12, true)) throw new Error("the recording is damaged");
    const data = new DataView(payload.buffer);
    const start = 4 + data.getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(payload.slice(4, start)));
    let at = start;
    const unsigned = () => {
      let value = 0, factor = 1, byte;
      do {
        byte = payload[at++];
        value += (byte & 127) * factor;
        factor *= 128;
      } while (byte > 127);
      return value;
    };
    const signed = () => {
      const value = unsigned();
      return value % 2 ? -(value + 1) / 2 : value / 2;
    };
    const bits = new DataView(new ArrayBuffer(4));
    const half = () => {
      bits.setUint32(0, data.getUint16(at, true) * 65536);
      at += 2;
      return bits.getFloat32(0);
    };
    const { quantum, frames: count, kinds, contacts, curves } = header;
    const bodies = kinds.length, last = new Float64Array(3 * bodies), frames = [];
    for (let f = 0; f < count; f++) {
      for (let k = 0; k < 3 * bodies; k++) last[k] += signed();
      const poses = new Float64Array(3 * bodies);
      for (let i = 0; i < bodies; i++) {
        poses[3 * i] = last[i] * quantum;
        poses[3 * i + 1] = last[bodies + i] * quantum;
        poses[3 * i + 2] = last[2 * bodies + i] * 2 * Math.PI / 2 ** 20;
      }
      const points = [];
      let x = 0, y = 0;
      for (let n = contacts ? unsigned() : 0; n > 0; n--) {
        const a = unsigned(), b = unsigned();
        x += signed();
        y += signed();
        const angle = unsigned() * 2 * Math.PI / 65536;
        const separation = signed() * quantum, normal = half(), tangent = half();
        const [nx, ny] = [Math.cos(angle), Math.sin(angle)];
        points.push({
          a, b, x: x * quantum, y: y * quantum, nx, ny, separation,
          ix: nx * normal + ny * tangent, iy: ny * normal - nx * tangent,
        });
      }
      const values = curves.map(() => {
        at += 4;
        return data.getFloat32(at - 4, true);
      });
      frames.push({ poses, points, values });
    }
    return { ...header, frames, span: header.dt * header.every };
  }

  const element = (tag, attributes, parent) => {
    const made = Object.assign(document.createElement(tag), attributes);
    if (parent) parent.append(made);
    return made;
  };

  // How far each body reaches from its middle.
  const reaches = ({ kinds, shapes }) => {
    const all = new Float64Array(kinds.length);
    for (const { body, points, radius } of shapes)
      for (const [u, v] of points) all[body] = Math.max(all[body], Math.hypot(u, v) + radius);
    return all;
  };

  // Corners of what moves at the start, and of what it hangs on.
  function bounds(recordings) {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (const { shapes, kinds, frames, joints = [] } of recordings) {
      const hinges = joints.flatMap(({ bodies, anchors }) => [0, 1].map((k) => ({ body: bodies[k], points: [anchors[k]], radius: 0, hinge: true })));
      const any = kinds.includes("d") || kinds.includes("k");
      for (const { body, points, radius, hinge } of [...shapes, ...hinges]) {
        if (any && kinds[body] === "s" && !hinge) continue;
        const [x, y, angle] = frames[0].poses.subarray(3 * body, 3 * body + 3);
        const [c, s] = [Math.cos(angle), Math.sin(angle)];
        for (const [u, v] of points) {
          const [px, py] = [x + c * u - s * v, y + s * u + c * v];
          box[0] = Math.min(box[0], px - radius);
          box[1] = Math.min(box[1], py - radius);
          box[2] = Math.max(box[2], px + radius);
          box[3] = Math.max(box[3], py + radius);
        }
      }
    }
    return box.every(Number.isFinite) ? box : [-1, -1, 1, 1];
  }

  const median = (list) => list.sort((a, b) => a - b)[Math.floor(list.length / 2)] || 1;

  function start(root, recordings) {
    const panels = [...root.querySelectorAll("figure")].map((figure, i) => ({
      recording: recordings[i],
      scene: figure.querySelector(".scene"),
      curves: figure.querySelector(".curves"),
      color: getComputedStyle(figure).getPropertyValue("--own").trim(),
    }));
    const end = Math.max(...recordings.map((r) => (r.frames.length - 1) * r.span));
    const tick = Math.min(...recordings.map((r) => r.span));
    const box = bounds(recordings);
    const largest = (of) => Math.max(...recordings.flatMap((r) => r.frames.map((f) => Math.max(0, ...f.points.map(of)))));
    const deepest = largest((p) => -p.separation);
    const size = median(recordings[0].shapes.filter((s) => recordings[0].kinds[s.body] !== "s").map((s) => {
      const xs = s.points.map((p) => p[0]), ys = s.points.map((p) => p[1]);
      const extent = (list) => 2 * s.radius + Math.max(...list) - Math.min(...list);
      return Math.sqrt(extent(xs) * extent(ys));
    }));
    const thickness = median(recordings[0].shapes.filter((s) => recordings[0].kinds[s.body] !== "s").map((s) => {
      const at = s.points, n = at.length;
      // Across the first edge; a segment or a point has its radius only.
      const [ux, uy] = n > 2 ? [at[1][0] - at[0][0], at[1][1] - at[0][1]] : [1, 0];
      const depths = n > 2 ? at.map(([x, y]) => Math.abs(ux * (y - at[0][1]) - uy * (x - at[0][0])) / Math.hypot(ux, uy)) : [0];
      return 2 * s.radius + Math.min(Math.max(...depths), n > 2 ? Math.hypot(ux, uy) : 0);
    }));
    // Arrows compare with what the median frame carries; an impact is cut at three bodies' widths.
    const carried = median(recordings.flatMap((r) => r.frames.map((f) => Math.max(0, ...f.points.map((p) => Math.hypot(p.ix, p.iy))))).filter((v) => v > 0));
    const state = { time: 0, playing: false, speed: 1, zoom: 1, x: 0, y: 0, forces: true, depths: true, joints: true };

    const frameOf = (r) => Math.min(Math.floor(state.time / r.span + 1e-6), r.frames.length - 1);

    function fit(canvas) {
      const ratio = window.devicePixelRatio || 1;
      const [w, h] = [canvas.clientWidth, canvas.clientHeight];
      if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
        canvas.width = Math.round(w * ratio);
        canvas.height = Math.round(h * ratio);
      }
      const context = canvas.getContext("2d");
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, w, h);
      return [context, w, h];
    }

    // As people draw them: a circle for a hinge, a line for a rod, a zigzag for a spring.
    function drawJoints(c, recording, poses, px, py, scale) {
      const { joints = [], kinds } = recording, reach = joints.length ? reaches(recording) : [];
      const s = Math.min(Math.max(0.3 * size * scale, 3), 12);
      c.strokeStyle = "#7a3e9d";
      c.fillStyle = "#fbf7fd";
      c.lineWidth = Math.min(Math.max(0.18 * s, 0.7), 1.8);
      for (const { mark, bodies, anchors, axis } of joints) {
        const place = (k) => {
          const [x, y, angle] = poses.subarray(3 * bodies[k], 3 * bodies[k] + 3);
          const [cos, sin] = [Math.cos(angle), Math.sin(angle)], [u, v] = anchors[k];
          return [px(x + cos * u - sin * v), py(y + sin * u + cos * v)];
        };
        const [[ax, ay], [bx, by]] = [place(0), place(1)];
        const turn = poses[3 * bodies[0] + 2], [dx, dy] = [bx - ax, by - ay];
        const stroke = (...path) => {
          c.beginPath();
          path.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
          c.stroke();
        };
        const ring = (corners, start, radius) => {
          c.beginPath();
          for (let k = 0; k < corners; k++) c.lineTo(bx + radius * Math.cos(start + 2 * Math.PI * k / corners), by + radius * Math.sin(start + 2 * Math.PI * k / corners));
          c.closePath();
          c.fill();
          c.stroke();
        };
        const along = () => {
          const u = Math.cos(turn) * axis[0] - Math.sin(turn) * axis[1], v = -(Math.sin(turn) * axis[0] + Math.cos(turn) * axis[1]);
          const way = u * dx + v * dy, [low, high] = [Math.min(way, 0) - s, Math.max(way, 0) + s];
          stroke([ax + low * u, ay + low * v], [ax + high * u, ay + high * v]);
          return Math.atan2(v, u);
        };
        if (mark === "spring") {
          const side = 0.5 * s / Math.max(Math.hypot(dx, dy), 1e-9), path = [[ax, ay], [ax + 0.1 * dx, ay + 0.1 * dy]];
          for (let k = 1; k < 10; k++) {
            const share = (k + 1) / 12, to = k % 2 ? -side : side;
            path.push([ax + share * dx - to * dy, ay + share * dy + to * dx]);
          }
          stroke(...path, [ax + 0.9 * dx, ay + 0.9 * dy], [bx, by]);
        } else if (mark === "prismatic") {
          ring(4, along() + Math.PI / 4, 0.7 * s);
        } else if (mark === "wheel") {
          along();
          ring(16, 0, 0.5 * s);
        } else if (mark === "weld") {
          ring(4, Math.PI / 4 - turn, 0.7 * s);
        } else {
          const dashed = mark === "motor" || mark === "mouse";
          c.setLineDash(dashed ? [s, s] : []);
          stroke([ax, ay], [bx, by]);
          c.setLineDash([]);
          for (const k of mark === "revolute" ? [0, 1] : []) {
            const i = bodies[k], [x, y] = poses.subarray(3 * i, 3 * i + 2);
            if (kinds[i] === "d" && Math.hypot(...anchors[k]) > 1.01 * reach[i]) stroke([px(x), py(y)], place(k));
          }
          if (mark === "motor") ring(4, 0, 0.6 * s);
          if (!dashed) ring(16, 0, (mark === "revolute" ? 0.5 : 0.3) * s);
        }
      }
    }

    // Below the scene, for the bar of a round length.
    const strip = 30;
    const scaleOf = (w, h) => 0.86 * state.zoom * Math.min(w / Math.max(box[2] - box[0], 1e-9), (h - strip) / Math.max(box[3] - box[1], 1e-9));

    function drawScene({ recording, scene }) {
      const { paper, ink, edge, fixed, moved, body: plain, force } = theme();
      const [c, w, h] = fit(scene);
      if (!(w > 0)) return;
      const scale = scaleOf(w, h);
      const cx = 0.5 * (box[0] + box[2]) + state.x, cy = 0.5 * (box[1] + box[3]) + state.y;
      const px = (x) => 0.5 * w + scale * (x - cx), py = (y) => 0.5 * (h - strip) - scale * (y - cy);
      const { poses, points } = recording.frames[frameOf(recording)];
      const depth = new Float64Array(recording.kinds.length);
      for (const p of points) {
        depth[p.a] = Math.max(depth[p.a], -p.separation);
        depth[p.b] = Math.max(depth[p.b], -p.separation);
      }
      c.lineJoin = "round";
      const thin = thickness * scale < 3;
      c.lineWidth = Math.min(Math.max(0.03 * size * scale, 0.5), 1.2);
      for (const { body, points: corners, radius } of recording.shapes) {
        const [x, y, angle] = poses.subarray(3 * body, 3 * body + 3);
        const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
        const at = corners.map(([u, v]) => [px(x + cos * u - sin * v), py(y + sin * u + cos * v)]);
        const r = radius * scale;
        const kind = recording.kinds[body];
        // What is too thin for an inside shows its color on its border.
        const bare = kind === "d" && state.depths && deepest > 0;
        c.strokeStyle = bare && thin && depth[body] > 0 ? ramp(0.3 + 0.7 * depth[body] / deepest) : edge;
        c.fillStyle = kind === "s" ? fixed : kind === "k" ? moved : state.depths && deepest > 0 ? ramp(depth[body] / deepest) : plain;
        c.beginPath();
        if (at.length === 1) {
          c.arc(at[0][0], at[0][1], r, 0, 2 * Math.PI);
          c.moveTo(at[0][0], at[0][1]);
          c.lineTo(at[0][0] + r * cos, at[0][1] - r * sin);
        } else if (radius > 0) {
          // Around the vertices of the core, an arc at each; y points down, so clockwise here.
          const n = at.length;
          at.forEach(([vx, vy], i) => {
            const [qx, qy] = at[(i + 1) % n], [ox, oy] = at[(i + n - 1) % n];
            const normal = (ax, ay, bx, by) => Math.atan2(bx - ax, -(by - ay));
            c.arc(vx, vy, r, normal(ox, oy, vx, vy), normal(vx, vy, qx, qy), true);
          });
          c.closePath();
        } else {
          at.forEach(([vx, vy], i) => (i ? c.lineTo(vx, vy) : c.moveTo(vx, vy)));
          c.closePath();
        }
        c.fill();
        c.stroke();
      }
      if (state.joints) drawJoints(c, recording, poses, px, py, scale);
      if (state.forces) {
        const unit = 1.1 * size * scale / carried;
        for (const p of points) {
          const [x, y] = [px(p.x), py(p.y)];
          const cut = Math.min(1, 3 * size * scale / Math.max(unit * Math.hypot(p.ix, p.iy), 1e-9));
          const [dx, dy] = [unit * cut * p.ix, -unit * cut * p.iy];
          const length = Math.hypot(dx, dy);
          const dot = Math.min(Math.max(0.05 * size * scale, 0.6), 3);
          c.fillStyle = ink;
          c.fillRect(x - dot, y - dot, 2 * dot, 2 * dot);
          if (length < 1.5) continue;
          const head = Math.min(6, 0.5 * length), [u, v] = [dx / length, dy / length];
          const [hx, hy] = [x + dx - head * u, y + dy - head * v];
          c.strokeStyle = c.fillStyle = force;
          c.lineWidth = Math.min(1.4, 0.6 + 0.02 * size * scale);
          c.beginPath();
          c.moveTo(x, y);
          c.lineTo(hx, hy);
          c.stroke();
          c.beginPath();
          c.moveTo(x + dx, y + dy);
          c.lineTo(hx - 0.4 * head * v, hy + 0.4 * head * u);
          c.lineTo(hx + 0.4 * head * v, hy - 0.4 * head * u);
          c.fill();
        }
      }
      // A bar of a round length.
      const most = 0.25 * w / scale, power = 10 ** Math.floor(Math.log10(most));
      const meters = [5, 2, 1].map((n) => n * power).find((n) => n <= most) || power;
      c.fillStyle = paper;
      c.fillRect(0, h - strip, w, strip);
      c.strokeStyle = c.fillStyle = ink;
      c.lineWidth = 1.5;
      c.beginPath();
      c.moveTo(12, h - 14);
      c.lineTo(12, h - 10);
      c.lineTo(12 + meters * scale, h - 10);
      c.lineTo(12 + meters * scale, h - 14);
      c.stroke();
      c.font = "11px system-ui, sans-serif";
      c.fillText(si(meters, "m").replace(/(\.\d*?)0+ /, "$1 ").replace(". ", " "), 14, h - 16);
    }

    // Limits of each curve over all recordings, so that panels compare.
    const ranges = recordings[0].curves.map((_, k) => {
      const values = recordings.flatMap((r) => r.frames.slice(1).map((f) => f.values[k] || 0)).filter((v) => v > 0);
      const high = Math.max(1e-30, ...values);
      return [Math.max(Math.min(high, ...values), 1e-5 * high), high * 1.3];
    });

    function drawCurves({ recording, curves, color }) {
      const { ink, grid } = theme();
      const [c, w, h] = fit(curves);
      if (!(w > 0)) return;
      const row = h / Math.max(recording.curves.length, 1), left = 6, right = w - 6;
      const across = (t) => left + (right - left) * t / Math.max(end, 1e-9);
      const now = frameOf(recording);
      c.font = "11px system-ui, sans-serif";
      recording.curves.forEach(({ name, unit }, k) => {
        const [low, high] = ranges[k], top = k * row + 16, bottom = (k + 1) * row - 4;
        const up = (v) => bottom - (bottom - top) * Math.log(Math.max(v, low) / low) / Math.log(high / low);
        c.strokeStyle = grid;
        c.lineWidth = 1;
        c.beginPath();
        for (let d = Math.ceil(Math.log10(low)); d <= Math.log10(high); d++) {
          c.moveTo(left, up(10 ** d));
          c.lineTo(right, up(10 ** d));
        }
        c.stroke();
        // The darkest color of a solver is that of text.
        c.strokeStyle = color === "#222222" ? ink : color;
        c.lineWidth = 1.6;
        c.beginPath();
        recording.frames.forEach((f, i) => i && (i > 1 ? c.lineTo(across(i * recording.span), up(f.values[k])) : c.moveTo(across(i * recording.span), up(f.values[k]))));
        c.stroke();
        c.fillStyle = ink;
        c.textAlign = "left";
        c.fillText(name, left, top - 4);
        c.textAlign = "right";
        c.fillText(`${si(recording.frames[now].values[k], unit)}   (log, to ${si(high / 1.3, unit)})`, right, top - 4);
        c.beginPath();
        c.arc(across(now * recording.span), up(recording.frames[now].values[k]), 3, 0, 7);
        c.fill();
      });
      c.strokeStyle = ink;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(across(state.time), 0);
      c.lineTo(across(state.time), h);
      c.stroke();
    }

    const controls = element("div", { className: "controls" }, root);
    const button = (label, title, act) => element("button", { type: "button", textContent: label, title, onclick: act }, controls);
    const back = button("←", "one step back (←)", () => step(-1));
    const play = button("▶", "play or pause (space)", () => toggle());
    const forth = button("→", "one step on (→)", () => step(1));
    back.className = "back";
    play.className = "play";
    forth.className = "forth";
    const slider = element("input", { type: "range", min: 0, max: Math.round(end / tick), step: 1, value: 0 }, controls);
    slider.setAttribute("aria-label", "time");
    const output = element("output", {}, controls);
    const speed = element("select", { className: "speed", title: "speed" }, controls);
    for (const times of [0.1, 0.25, 0.5, 1, 2, 4]) element("option", { value: times, textContent: `${times}×`, selected: times === 1 }, speed);
    const box2 = (label, name) => {
      const wrap = element("label", {}, controls);
      element("input", { type: "checkbox", checked: true, className: name, onchange: (e) => { state[name] = e.target.checked; draw(); } }, wrap);
      wrap.append(` ${label}`);
    };
    if (recordings.some((r) => r.contacts)) {
      box2("impulses", "forces");
      box2(`penetration (to ${si(deepest, "m")})`, "depths");
    }
    const marks = { revolute: "○ hinge", prismatic: "□ slider", distance: "— rod", spring: "⌇ spring", weld: "□ weld", wheel: "○ wheel", motor: "◇ motor", mouse: "┄ mouse" };
    const used = Object.keys(marks).filter((mark) => recordings.some((r) => (r.joints || []).some((j) => j.mark === mark)));
    if (used.length) box2(`joints (${used.map((mark) => marks[mark]).join(", ")})`, "joints");
    button("fit", "whole scene", () => { Object.assign(state, { zoom: 1, x: 0, y: 0 }); draw(); }).className = "fit";

    function draw() {
      panels.forEach((panel) => { drawScene(panel); drawCurves(panel); });
      const index = Math.round(state.time / tick);
      slider.value = index;
      output.textContent = `${state.time.toFixed(3)} s of ${end.toFixed(2)} s · step ${Math.round(state.time / recordings[0].dt)}`;
      play.textContent = state.playing ? "▮▮" : "▶";
    }
    function seek(time) {
      state.time = Math.min(Math.max(time, 0), end);
      draw();
    }
    function step(by) {
      state.playing = false;
      seek((Math.round(state.time / tick) + by) * tick);
    }
    let before = 0;
    function run(now) {
      if (!state.playing) return;
      seek(state.time + state.speed * Math.min((now - before) / 1000, 0.1));
      before = now;
      if (state.time >= end) state.playing = false;
      draw();
      requestAnimationFrame(run);
    }
    function toggle() {
      state.playing = !state.playing;
      if (state.playing && state.time >= end) state.time = 0;
      if (state.playing) {
        before = performance.now();
        requestAnimationFrame(run);
      }
      draw();
    }
    slider.oninput = () => { state.playing = false; seek(slider.value * tick); };
    speed.onchange = () => { state.speed = Number(speed.value); };
    root.tabIndex = 0;
    root.addEventListener("keydown", (e) => {
      if (e.target.tagName === "SELECT" || (e.target.tagName === "INPUT" && e.key !== " ")) return;
      const act = { " ": toggle, ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => seek(0), End: () => seek(end) }[e.key];
      if (act && e.target.tagName !== "BUTTON") { act(); e.preventDefault(); }
    });
    for (const { scene, curves } of panels) {
      scene.addEventListener("wheel", (e) => {
        e.preventDefault();
        const [w, h] = [scene.clientWidth, scene.clientHeight];
        const [x, y] = [e.offsetX - 0.5 * w, 0.5 * (h - strip) - e.offsetY];
        const old = scaleOf(w, h);
        state.zoom = Math.min(Math.max(state.zoom * Math.exp(-0.0015 * e.deltaY), 0.02), 1e5);
        // What is under the pointer stays there.
        const now = scaleOf(w, h);
        state.x += x / old - x / now;
        state.y += y / old - y / now;
        draw();
      }, { passive: false });
      scene.addEventListener("pointerdown", (e) => scene.setPointerCapture(e.pointerId));
      scene.addEventListener("pointermove", (e) => {
        if (!e.buttons) return;
        const scale = scaleOf(scene.clientWidth, scene.clientHeight);
        state.x -= e.movementX / scale;
        state.y += e.movementY / scale;
        draw();
      });
      curves.addEventListener("pointerdown", (e) => {
        state.playing = false;
        seek(end * (e.offsetX - 6) / Math.max(curves.clientWidth - 12, 1));
      });
    }
    // On paper the frame is scaled: a canvas of another size would be empty until the next frame.
    isDark.addEventListener("change", draw);
    new ResizeObserver(() => { if (!matchMedia("print").matches) draw(); }).observe(root);
    draw();
    return { state, seek, step, toggle, draw, end, tick, recordings };
  }

  async function load() {
    const parameters = new URLSearchParams(location.hash.slice(1));
    for (const [i, root] of [...document.querySelectorAll(".replay")].entries()) {
      try {
        const scripts = [...root.querySelectorAll("figure > script")];
        root.player = start(root, await Promise.all(scripts.map((s) => decode(s.textContent))));
        root.player.seek(root.dataset.start * root.player.end);
        if (i > 0) continue;
        const number = (name, or) => (Number.isFinite(parseFloat(parameters.get(name))) ? parseFloat(parameters.get(name)) : or);
        root.player.state.zoom = Math.max(number("zoom", 1), 0.02);
        root.player.seek(number("t", root.player.state.time));
        if (parameters.get("play") === "1") root.player.toggle();
      } catch (error) {
        element("p", { className: "failed", textContent: `This replay cannot be played: ${error.message}` }, root);
      }
      root.dataset.ready = "1";
    }
  }
  load();
})();
