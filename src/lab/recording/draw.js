"use strict";
// Draws a frame of a run on a canvas, and nothing else: no state, no controls.
//
// A run is `{ header fields, frames }` with the header of src/lab/recording/mod.rs. A frame is
// `{ poses, points, values }`: poses hold x, y (m) and angle (rad) of every body in turn; a point is
// `{ a, b, x, y, separation, ix, iy }` with the impulse on body b.
const drawing = (() => {
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
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const median = (list) => list.sort((a, b) => a - b)[Math.floor(list.length / 2)] || 1;
  // A spread of a long list would overflow the stack.
  const largest = (list, of) => list.reduce((most, item) => Math.max(most, of(item)), 0);

  const ramp = (share) => {
    const colors = theme().ramp;
    const place = clamp(share, 0, 1) * (colors.length - 1);
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

  // The context of a canvas in CSS pixels, cleared, with its width and height.
  function clear(canvas) {
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

  // Corners of everything that moves at the start, and of what it hangs on.
  function bounds(runs) {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (const { shapes, kinds, frames, joints } of runs) {
      const hinges = joints.flatMap(({ bodies, anchors }) => [0, 1].map((k) => ({ body: bodies[k], points: [anchors[k]], radius: 0, hinge: true })));
      const any = /[dk]/.test(kinds);
      for (const { body, points, radius, hinge } of [...shapes, ...hinges]) {
        if (any && kinds[body] === "s" && !hinge) continue;
        for (const point of points) {
          const [px, py] = placed(frames[0].poses, body, point);
          box[0] = Math.min(box[0], px - radius);
          box[1] = Math.min(box[1], py - radius);
          box[2] = Math.max(box[2], px + radius);
          box[3] = Math.max(box[3], py + radius);
        }
      }
    }
    return box.every(Number.isFinite) ? box : [-1, -1, 1, 1];
  }

  // A point of a body's frame at its place in the scene (m).
  function placed(poses, body, [u, v]) {
    const [x, y, angle] = poses.subarray(3 * body, 3 * body + 3);
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    return [x + c * u - s * v, y + s * u + c * v];
  }

  // What all frames of some runs are drawn with, so that they compare: the typical size and thickness of a
  // body (m), the deepest overlap (m), and the impulse (N·s) that an arrow of a body's size stands for: what
  // the median frame carries.
  function measures(runs) {
    const moving = runs[0].shapes.filter((s) => runs[0].kinds[s.body] !== "s");
    const size = median(moving.map(({ points, radius }) => {
      const extent = (k) => 2 * radius + Math.max(...points.map((p) => p[k])) - Math.min(...points.map((p) => p[k]));
      return Math.sqrt(extent(0) * extent(1));
    }));
    const thickness = median(moving.map(({ points, radius }) => {
      // Across the first edge; a segment or a point has its radius only.
      if (points.length < 3) return 2 * radius;
      const [[px, py], [qx, qy]] = points, edge = Math.hypot(qx - px, qy - py);
      return 2 * radius + Math.min(edge, largest(points, ([x, y]) => Math.abs((qx - px) * (y - py) - (qy - py) * (x - px)) / edge));
    }));
    const frames = runs.flatMap((r) => r.frames);
    const deepest = largest(frames, (f) => largest(f.points, (p) => -p.separation));
    const carried = median(frames.map((f) => largest(f.points, (p) => Math.hypot(p.ix, p.iy))).filter((v) => v > 0));
    return { box: bounds(runs), size, thickness, deepest, carried };
  }

  // Below the scene, for the bar of a round length.
  const STRIP = 30;
  // Pixels per meter on a canvas of this size.
  const scaleOf = ({ box }, { zoom }, w, h) =>
    0.86 * zoom * Math.min(w / Math.max(box[2] - box[0], 1e-9), (h - STRIP) / Math.max(box[3] - box[1], 1e-9));

  // A frame of a run. `all` are the measures; `view` has `zoom`, `x` and `y` (m, from the middle of the box),
  // and what is shown: `forces`, `depths`, `joints`.
  function scene(canvas, run, frame, all, view) {
    const [c, w, h] = clear(canvas);
    if (!(w > 0)) return;
    const { ink, paper } = theme(), { box } = all;
    const scale = scaleOf(all, view, w, h);
    const cx = 0.5 * (box[0] + box[2]) + view.x, cy = 0.5 * (box[1] + box[3]) + view.y;
    const to = ([x, y]) => [0.5 * w + scale * (x - cx), 0.5 * (h - STRIP) - scale * (y - cy)];
    shapes(c, run, frame, all, view, scale, to);
    if (view.joints) joints(c, run, frame, all, scale, to);
    if (view.forces) forces(c, frame, all, scale, to);
    // A bar of a round length.
    const most = 0.25 * w / scale, power = 10 ** Math.floor(Math.log10(most));
    const meters = [5, 2, 1].map((n) => n * power).find((n) => n <= most) || power;
    c.fillStyle = paper;
    c.fillRect(0, h - STRIP, w, STRIP);
    c.strokeStyle = c.fillStyle = ink;
    c.lineWidth = 1.5;
    stroke(c, [12, h - 14], [12, h - 10], [12 + meters * scale, h - 10], [12 + meters * scale, h - 14]);
    c.font = "11px system-ui, sans-serif";
    c.fillText(si(meters, "m").replace(/(\.\d*?)0+ /, "$1 ").replace(". ", " "), 14, h - 16);
  }

  function stroke(c, ...path) {
    c.beginPath();
    path.forEach(([x, y]) => c.lineTo(x, y));
    c.stroke();
  }

  function shapes(c, { shapes: all, kinds }, { poses, points }, { size, thickness, deepest }, { depths }, scale, to) {
    const { edge, fixed, moved, body: plain } = theme();
    const depth = new Float64Array(kinds.length);
    for (const p of points) for (const i of [p.a, p.b]) depth[i] = Math.max(depth[i], -p.separation);
    c.lineJoin = "round";
    c.lineWidth = clamp(0.03 * size * scale, 0.5, 1.2);
    const shown = depths && deepest > 0, thin = thickness * scale < 3;
    for (const { body, points: corners, radius } of all) {
      const at = corners.map((corner) => to(placed(poses, body, corner)));
      const r = radius * scale, share = depth[body] / deepest;
      const kind = kinds[body];
      // What is too thin for an inside shows its color on its border.
      c.strokeStyle = kind === "d" && shown && thin && depth[body] > 0 ? ramp(0.3 + 0.7 * share) : edge;
      c.fillStyle = kind === "s" ? fixed : kind === "k" ? moved : shown ? ramp(share) : plain;
      c.beginPath();
      if (at.length === 1) {
        const [[x, y]] = at, angle = poses[3 * body + 2];
        c.arc(x, y, r, 0, 2 * Math.PI);
        c.moveTo(x, y);
        c.lineTo(x + r * Math.cos(angle), y - r * Math.sin(angle));
      } else {
        // Around the vertices of the core, an arc at each; y points down, so clockwise here.
        const n = at.length;
        const normal = ([ax, ay], [bx, by]) => Math.atan2(bx - ax, ay - by);
        at.forEach(([x, y], i) => c.arc(x, y, r, normal(at[(i + n - 1) % n], at[i]), normal(at[i], at[(i + 1) % n]), true));
        c.closePath();
      }
      c.fill();
      c.stroke();
    }
  }

  // A line between the anchors, or along the axis if there is one, and a circle or a square at that of b.
  const DASHED = ["spring", "motor", "mouse"], SQUARE = ["prismatic", "weld", "motor"];
  function joints(c, { joints: list, kinds }, { poses }, { size }, scale, to) {
    const s = clamp(0.3 * size * scale, 3, 12);
    c.strokeStyle = "#7a3e9d";
    c.fillStyle = "#fbf7fd";
    c.lineWidth = clamp(0.18 * s, 0.7, 1.8);
    for (const { mark, bodies, anchors, axis } of list) {
      const ends = [0, 1].map((k) => to(placed(poses, bodies[k], anchors[k])));
      const [[ax, ay], [bx, by]] = ends;
      c.setLineDash(DASHED.includes(mark) ? [s, s] : []);
      if (axis[0] || axis[1]) {
        const [cos, sin] = [Math.cos(poses[3 * bodies[0] + 2]), Math.sin(poses[3 * bodies[0] + 2])];
        const [u, v] = [cos * axis[0] - sin * axis[1], -(sin * axis[0] + cos * axis[1])];
        const way = u * (bx - ax) + v * (by - ay);
        stroke(c, ...[Math.min(way, 0) - s, Math.max(way, 0) + s].map((t) => [ax + t * u, ay + t * v]));
      } else if (mark !== "weld") {
        stroke(c, ...ends);
      }
      c.setLineDash([]);
      // A hinge is connected to the centers of its dynamic bodies.
      for (const [k, i] of mark === "revolute" ? bodies.entries() : []) if (kinds[i] === "d") stroke(c, to(placed(poses, i, [0, 0])), ends[k]);
      if (mark === "mouse") continue;
      c.beginPath();
      if (SQUARE.includes(mark)) c.rect(bx - 0.5 * s, by - 0.5 * s, s, s);
      else c.arc(bx, by, (mark === "distance" || mark === "spring" ? 0.3 : 0.5) * s, 0, 2 * Math.PI);
      c.fill();
      c.stroke();
    }
  }

  // Contact points, and impulses as arrows; an impact is cut at three bodies' widths.
  function forces(c, { points }, { size, carried }, scale, to) {
    const { ink, force } = theme();
    const unit = 1.1 * size * scale / carried, dot = clamp(0.05 * size * scale, 0.6, 3);
    for (const p of points) {
      const [x, y] = to([p.x, p.y]);
      const cut = Math.min(1, 3 * size * scale / Math.max(unit * Math.hypot(p.ix, p.iy), 1e-9));
      const [dx, dy] = [unit * cut * p.ix, -unit * cut * p.iy];
      const length = Math.hypot(dx, dy);
      c.fillStyle = ink;
      c.fillRect(x - dot, y - dot, 2 * dot, 2 * dot);
      if (length < 1.5) continue;
      const head = Math.min(6, 0.5 * length), [u, v] = [dx / length, dy / length];
      const [hx, hy] = [x + dx - head * u, y + dy - head * v];
      c.strokeStyle = c.fillStyle = force;
      c.lineWidth = Math.min(1.4, 0.6 + 0.02 * size * scale);
      stroke(c, [x, y], [hx, hy]);
      c.beginPath();
      c.moveTo(x + dx, y + dy);
      c.lineTo(hx - 0.4 * head * v, hy + 0.4 * head * u);
      c.lineTo(hx + 0.4 * head * v, hy - 0.4 * head * u);
      c.fill();
    }
  }

  return { isDark, theme, si, clear, clamp, stroke, measures, scaleOf, scene, STRIP };
})();
