"use strict";
// Draws a frame of a run on a canvas, and curves over time, and nothing else: no state, no controls.
//
// A run is `{ header fields, frames }` with the header of src/lab/recording/mod.rs. A frame is
// `{ poses, points, values }`: poses hold x, y (m) and angle (rad) of every body in turn; a point is
// `{ a, b, x, y, separation, ix, iy }` with the impulse on body b. A frame may have `depths`, the deepest overlap (m) of
// each body, and `islands`, a number for each; points may have a `color`, a number.
//
// Paths are long and few: what has the same colors is filled and stroked together.
const drawing = (() => {
  const LIGHT = {
    ramp: [[243, 245, 248], [253, 228, 160], [245, 155, 75], [204, 61, 51], [107, 16, 48]],
    paper: "#fff", ink: "#1f2933", edge: "#52606d", fixed: "#d3d8de", moved: "#d9d2e9", body: "#e3ebf5", small: "#b8c4d2", grid: "#e4e7eb", force: "#0072b2", bad: "#fbe9e3",
  };
  const DARK = {
    ramp: [[38, 49, 61], [110, 52, 48], [204, 81, 51], [245, 165, 75], [255, 240, 180]],
    paper: "#14181d", ink: "#e4e7eb", edge: "#9aa5b1", fixed: "#3e4c59", moved: "#3d3557", body: "#26313d", small: "#52606d", grid: "#323f4b", force: "#7cc4f5", bad: "#3b2420",
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
    if (unit === "%") return `${value < 0.001 ? value.toExponential(0).replace("-", "−") : Number(value.toPrecision(2))} %`;
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

  // Angles between successive hues that no short list of numbers repeats (degrees), and their number.
  const HUE = 137.5, HUES = 24;
  const hue = (number) => `hsl(${(HUE * (number % HUES)) % 360} ${isDark.matches ? "45% 42%" : "60% 74%"})`;

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
  // Where a scene is on a canvas: pixels per meter, and the place of the scene's origin (pixels).
  function placement(canvas, { box }, { zoom, x, y }) {
    const w = canvas.clientWidth, h = canvas.clientHeight;
    const scale = 0.86 * zoom * Math.min(w / Math.max(box[2] - box[0], 1e-9), (h - STRIP) / Math.max(box[3] - box[1], 1e-9));
    const left = 0.5 * w - scale * (0.5 * (box[0] + box[2]) + x), top = 0.5 * (h - STRIP) + scale * (0.5 * (box[1] + box[3]) + y);
    return { scale, left, top, w, h };
  }
  // From the scene to the canvas, and back.
  const toCanvas = ({ scale, left, top }, [x, y]) => [left + scale * x, top - scale * y];
  const toScene = ({ scale, left, top }, [x, y]) => [(x - left) / scale, (top - y) / scale];

  // Moves the picture with a pointer.
  function pan(canvas, all, view, e) {
    const { scale } = placement(canvas, all, view);
    view.x -= e.movementX / scale;
    view.y += e.movementY / scale;
  }

  // Zooms by a wheel; what is under the pointer stays there.
  function zoom(canvas, all, view, e) {
    e.preventDefault();
    const at = [e.offsetX, e.offsetY], [x, y] = toScene(placement(canvas, all, view), at);
    view.zoom = clamp(view.zoom * Math.exp(-0.0015 * e.deltaY), 0.02, 1e5);
    const [u, v] = toScene(placement(canvas, all, view), at);
    view.x += x - u;
    view.y += y - v;
  }

  // A frame of a run. `all` are the measures; `view` has `zoom`, `x` and `y` (m, from the middle of the box),
  // and what is shown: `forces`, `depths`, `joints`.
  function scene(canvas, run, frame, all, view) {
    const [c, w, h] = clear(canvas);
    if (!(w > 0)) return;
    const { ink, paper } = theme(), place = placement(canvas, all, view), { scale } = place;
    const to = (at) => toCanvas(place, at);
    shapes(c, run, frame, all, view, place);
    if (view.joints) joints(c, run, frame, all, scale, to);
    if (view.forces || view.colors) points(c, frame, all, view, scale, to);
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

  // Number of shapes in a path. The time of a path grows faster than its length.
  const TOGETHER = 16;
  // Bodies are small below this size (pixels) if there are more than these, and have gaps of this width (pixels).
  const SMALL = 9, MANY = 2000, GAP = 0.9;
  // Shades of a depth.
  const SHADES = 32;

  function shapes(c, { shapes: all, kinds }, { poses, points, depths, islands }, { size, thickness, deepest }, view, place) {
    const { edge, fixed, moved, body: plain, small: empty } = theme();
    const { scale } = place;
    const depth = depths || new Float64Array(kinds.length);
    if (!depths) for (const p of points) for (const i of [p.a, p.b]) depth[i] = Math.max(depth[i], -p.separation);
    c.lineJoin = "round";
    c.lineWidth = clamp(0.03 * size * scale, 0.5, 1.2);
    const shown = view.depths && deepest > 0, thin = thickness * scale < 3;
    const tones = (low) => Array.from({ length: SHADES + 1 }, (_, i) => ramp(low + (1 - low) * i / SHADES));
    const [insides, borders] = [tones(0), tones(0.3)];
    // Borders of many small bodies take as long as their insides: gaps take their place.
    const small = !thin && size * scale < SMALL && all.length > MANY, shrink = small ? 1 - GAP / (size * scale) : 1;
    const batches = new Map();
    // Cosine and sine of each angle, in pixels per meter.
    const turns = new Float64Array(2 * kinds.length);
    for (let i = 0; i < kinds.length; i++) {
      const own = kinds[i] === "d" ? scale * shrink : scale;
      turns[2 * i] = own * Math.cos(poses[3 * i + 2]);
      turns[2 * i + 1] = own * Math.sin(poses[3 * i + 2]);
    }
    for (const shape of all) {
      const { body } = shape, kind = kinds[body];
      if (kind !== "s" && !isSeen(shape, poses, place)) continue;
      const tone = shown ? Math.round(SHADES * Math.min(Math.max(depth[body], 0) / deepest, 1)) : 0;
      // What is too thin for an inside shows its color on its border.
      const border = kind === "d" && shown && thin && depth[body] > 0 ? borders[tone] : edge;
      const inside = kind === "s" ? fixed : kind === "k" ? moved
        : view.islands && islands ? hue(islands[body]) : shown && (tone || !small) ? insides[tone] : small ? empty : plain;
      const key = inside + border;
      let batch = batches.get(key);
      if (!batch) batches.set(key, batch = { inside, border: small && kind === "d" ? null : border, list: [] });
      batch.list.push(shape);
    }
    for (const { inside, border, list } of batches.values()) {
      c.fillStyle = inside;
      if (border) c.strokeStyle = border;
      for (let i = 0; i < list.length; i += TOGETHER) {
        c.beginPath();
        for (let k = i; k < Math.min(i + TOGETHER, list.length); k++) outline(c, list[k], poses, turns, place);
        c.fill();
        if (border) c.stroke();
      }
    }
  }

  // Whether a shape is on the canvas.
  function isSeen(shape, poses, { scale, left, top, w, h }) {
    shape.reach ??= shape.radius + largest(shape.points, (p) => Math.hypot(...p));
    const x = left + scale * poses[3 * shape.body], y = top - scale * poses[3 * shape.body + 1], r = scale * shape.reach;
    return x + r > 0 && x - r < w && y + r > 0 && y - r < h;
  }

  // Adds a closed outline to the path: that of the vertices, with an arc around each if there is a radius.
  function outline(c, { body, points, radius }, poses, turns, { scale, left, top }) {
    const ox = left + scale * poses[3 * body], oy = top - scale * poses[3 * body + 1];
    const cos = turns[2 * body], sin = turns[2 * body + 1], r = radius * Math.hypot(cos, sin), n = points.length;
    const x = (p) => ox + cos * p[0] - sin * p[1], y = (p) => oy - sin * p[0] - cos * p[1];
    if (n === 1) {
      const cx = x(points[0]), cy = y(points[0]);
      c.moveTo(cx + r, cy);
      c.arc(cx, cy, r, 0, 2 * Math.PI);
      c.moveTo(cx, cy);
      c.lineTo(cx + radius * cos, cy - radius * sin);
      return;
    }
    if (r === 0) {
      c.moveTo(x(points[0]), y(points[0]));
      for (let i = 1; i < n; i++) c.lineTo(x(points[i]), y(points[i]));
      return c.closePath();
    }
    // y points down, so clockwise here.
    const at = points.map((p) => [x(p), y(p)]);
    const normal = ([ax, ay], [bx, by]) => Math.atan2(bx - ax, ay - by);
    at.forEach(([px, py], i) => {
      const from = normal(at[(i + n - 1) % n], at[i]);
      if (i === 0) c.moveTo(px + r * Math.cos(from), py + r * Math.sin(from));
      c.arc(px, py, r, from, normal(at[i], at[(i + 1) % n]), true);
    });
    c.closePath();
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

  // Contact points, dark or in their own color, and impulses as arrows; an impact is cut at three bodies' widths.
  function points(c, { points: all }, { size, carried }, view, scale, to) {
    const { ink, force } = theme();
    const dot = (view.colors ? 2 : 1) * clamp(0.05 * size * scale, 0.6, 3);
    const dots = new Map();
    for (const p of all) {
      const color = view.colors && p.color >= 0 ? hue(p.color) : ink;
      if (!dots.has(color)) dots.set(color, []);
      dots.get(color).push(p);
    }
    for (const [color, list] of dots) {
      c.fillStyle = color;
      c.beginPath();
      for (const p of list) {
        const [x, y] = to([p.x, p.y]);
        c.rect(x - dot, y - dot, 2 * dot, 2 * dot);
      }
      c.fill();
    }
    if (!view.forces) return;
    const unit = 1.1 * size * scale / carried, most = 3 * size * scale, arrows = [];
    for (const p of all) {
      const length = unit * Math.hypot(p.ix, p.iy), cut = unit * Math.min(1, most / Math.max(length, 1e-9));
      if (length * cut >= 1.5 * unit) arrows.push([...to([p.x, p.y]), cut * p.ix, -cut * p.iy]);
    }
    const heads = (draw) => {
      c.beginPath();
      for (const [x, y, dx, dy] of arrows) {
        const length = Math.hypot(dx, dy), head = Math.min(6, 0.5 * length), u = dx / length, v = dy / length;
        draw(x, y, x + dx - head * u, y + dy - head * v, x + dx, y + dy, 0.4 * head * u, 0.4 * head * v);
      }
    };
    c.strokeStyle = c.fillStyle = force;
    c.lineWidth = Math.min(1.4, 0.6 + 0.02 * size * scale);
    heads((x, y, hx, hy) => { c.moveTo(x, y); c.lineTo(hx, hy); });
    c.stroke();
    heads((x, y, hx, hy, tx, ty, u, v) => { c.moveTo(tx, ty); c.lineTo(hx - v, hy + u); c.lineTo(hx + v, hy - u); });
    c.fill();
  }

  // A curve on a logarithmic scale from `low` to `high` in the box from `left`, `top` to `right`, `bottom`, below its
  // `name` and a `text`. `line` holds x (pixels) and value of each point, `mark` is one of them or null. Above `limit`,
  // if there is one, the box is red.
  function strip(c, { left, top, right, bottom }, { name, text, color, low, high, line, mark, limit }) {
    const { ink, grid, bad } = theme();
    const up = (v) => bottom - (bottom - top) * clamp(Math.log(Math.max(v, low) / low) / Math.log(high / low), 0, 1);
    if (limit > 0 && limit < high) {
      c.fillStyle = bad;
      c.fillRect(left, top, right - left, up(limit) - top);
    }
    c.strokeStyle = grid;
    c.lineWidth = 1;
    for (let d = Math.ceil(Math.log10(low)); d <= Math.log10(high); d++) stroke(c, [left, up(10 ** d)], [right, up(10 ** d)]);
    // The darkest color of a solver is that of text.
    c.strokeStyle = color === "#222222" ? ink : color;
    c.lineWidth = 1.6;
    stroke(c, ...line.map(([x, value]) => [x, up(value)]));
    label(c, { left, top, right }, name, text);
    if (!mark) return;
    c.beginPath();
    c.arc(mark[0], up(mark[1]), 3, 0, 7);
    c.fill();
  }

  // Texts above a strip, at its left and its right. Without room, what is in parentheses at the end of a name goes.
  function label(c, { left, top, right }, name, text) {
    c.fillStyle = theme().ink;
    const width = (words) => c.measureText(words).width;
    if (width(name) + width(text) > right - left - 8) name = name.replace(/ \(.*\)$/, "");
    c.textAlign = "left";
    c.fillText(name, left, top - 4);
    c.textAlign = "right";
    c.fillText(text, right, top - 4);
    c.textAlign = "left";
  }

  return { isDark, theme, si, clear, clamp, stroke, strip, label, measures, placement, toCanvas, toScene, pan, zoom, scene };
})();
