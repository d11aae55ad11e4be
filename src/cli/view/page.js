// The page of `simpulse view`. The program sends the stage (what is there and how it is set) as JSON and its state after
// the newest step as bytes, see src/lab/view/frame.rs; the page sends requests (src/lab/view/request.rs), and
// `shown` for every frame, after which it is sent another one.
(() => {
  const { si, theme } = drawing;
  const get = (id) => document.getElementById(id);
  const element = (tag, attributes, parent) => {
    const made = Object.assign(document.createElement(tag), attributes);
    if (parent) parent.append(made);
    return made;
  };

  const view = { zoom: 1, x: 0, y: 0, depths: true, forces: true, colors: false, islands: false, joints: true };
  // Steps that the strips show, and the phases of a step as they are shown.
  const WINDOW = 600;
  const GROUPS = [
    ["contacts", "#0072b2", ["pairs", "collide"]],
    ["prepare", "#e69f00", ["color", "prepare"]],
    ["solve", "#009e73", ["warm start", "solve", "relax", "position", "restitution"]],
    ["move", "#9aa5b1", ["integrate", "store"]],
  ];
  const CURVES = [["overlap", "m"], ["force error (% of a body's weight)", "%"], ["speed", "m/s"]];

  let stage = null, all = null, start = null, panes = [], newest = null, waiting = 0, drawn = [];
  let playing = true, speed = 1, asked = null, impulses = [], counted = 0;

  const socket = new WebSocket(`ws://${location.host}${location.pathname}socket`);
  socket.binaryType = "arraybuffer";
  const send = (what) => { if (socket.readyState === 1) socket.send(JSON.stringify(what)); };
  const play = (on) => send({ do: "play", on, speed: Number(get("speed").value) });
  socket.onclose = () => { get("said").textContent = "The program has ended, or the page is open elsewhere."; };
  socket.onmessage = ({ data }) => {
    if (typeof data !== "string") {
      newest = data;
      if (waiting++ === 0) requestAnimationFrame(show);
      return;
    }
    const told = JSON.parse(data);
    if (told.stage !== undefined) build(told);
    if (told.text !== undefined) copy(told.text);
    if (told.replay) download();
  };

  // A frame in the form of draw.js for every pane, and the status.
  function decode(buffer) {
    const [number, step, length] = new Uint32Array(buffer, 0, 3);
    const status = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 12, length)));
    let at = 12 + length;
    status.frames = status.panes.map(() => {
      const [bodies, deep, count, islands] = new Uint32Array(buffer, at, 4);
      at += 16;
      const floats = (length) => new Float32Array(buffer, (at += 4 * length) - 4 * length, length);
      const poses = floats(3 * bodies), depths = deep ? floats(deep) : null, raw = floats(8 * count);
      const points = Array.from({ length: count }, (_, i) => ({
        a: raw[8 * i], b: raw[8 * i + 1], x: raw[8 * i + 2], y: raw[8 * i + 3], separation: raw[8 * i + 4],
        ix: raw[8 * i + 5], iy: raw[8 * i + 6], color: raw[8 * i + 7],
      }));
      const found = { poses, depths, points, islands: islands ? new Uint32Array(buffer, at, islands) : null };
      at += 4 * islands;
      return found;
    });
    return { number, step, ...status };
  }

  function show() {
    const frames = waiting, state = decode(newest);
    waiting = 0;
    if (stage && state.number === stage.stage) {
      note(state);
      draw(state);
    }
    for (let i = 0; i < frames; i++) send({ do: "shown" });
  }

  // Keeps what the strips show.
  function note(state) {
    page.state = state;
    if (asked && state.grabs >= asked.grabs) asked.held = state.held;
    state.panes.forEach((own, k) => {
      const { history } = panes[k], last = history[history.length - 1];
      if (last && last.step > state.step) history.length = 0;
      if (last && last.step === state.step) return;
      const [overlap, error, motion] = own.last;
      const groups = GROUPS.map(([, , names]) => names.reduce((sum, name) => sum + own.phase_ns[stage.phases.indexOf(name)], 0));
      history.push({ step: state.step, values: [overlap, 100 * error, motion], groups, ns: own.step_ns });
      while (history[0].step < state.step - WINDOW) history.shift();
    });
    const now = performance.now();
    drawn.push(now);
    while (drawn[0] < now - 1000) drawn.shift();
    const largest = Math.max(0, ...state.frames.flatMap((f) => f.points.reduce((most, p) => Math.max(most, Math.hypot(p.ix, p.iy)), 0)));
    if (largest > 0) impulses.push(largest);
    if (impulses.length > 120) impulses.shift();
  }

  function draw(state) {
    if (!state) return;
    if (!all) {
      const limit = stage.limits[0];
      all = { ...drawing.measures([{ ...stage, frames: [state.frames[0]] }]), deepest: limit };
      page.all = all;
      start = [...all.box];
    }
    if (view.zoom === 1 && view.x === 0 && view.y === 0 && (!playing || counted % 10 === 0)) follow(state.frames);
    all.carried = [...impulses].sort((a, b) => a - b)[impulses.length >> 1] || 1;
    // The eye follows bodies, not curves: every third frame has them.
    const whole = !playing || ++counted % 3 === 0;
    const ranges = !whole ? null : CURVES.map((_, i) => {
      const values = panes.flatMap(({ history }) => history.map((h) => h.values[i])).filter((v) => v > 0);
      const limit = scaled(i, stage.limits[i]) || 0;
      const high = values.reduce((a, b) => Math.max(a, b), Math.max(limit, 1e-12));
      return [Math.max(values.reduce((a, b) => Math.min(a, b), high), 1e-6 * high), 1.5 * high];
    });
    const slowest = panes.flatMap(({ history }) => history.map((h) => h.ns)).sort((a, b) => a - b);
    const most = 1.2 * (slowest[Math.floor(0.98 * slowest.length)] || 1);
    state.panes.forEach((own, k) => {
      const pane = panes[k];
      drawing.scene(pane.picture, stage, state.frames[k], all, view);
      if (ball && ball.pane === k) aim(pane.picture);
      if (whole) strips(pane, state, ranges, most);
      pane.lanes.textContent = ` · ${own.lanes} lane${own.lanes > 1 ? "s" : ""}`;
      pane.verdict.textContent = own.verdict + (own.since > 0 ? ` (since step ${own.since})` : "") + (own.pushes ? ` · ${own.pushes} pushes` : "");
      pane.verdict.className = own.good ? "verdict good" : "verdict";
    });
    ({ playing, speed } = state);
    get("play").textContent = playing ? "▮▮" : "▶";
    get("record").className = state.recording ? "on" : "";
    get("record").textContent = state.recording ? "■ stop" : "● record";
    get("said").textContent = state.said;
    const rate = playing ? ` · ${drawn.length} frames/s` : "";
    get("clock").textContent = `step ${state.step} · ${(state.step * stage.dt).toFixed(2)} s${rate}`;
  }

  // Grows the picture with what moves out of it, except for a tenth of the bodies: what flies off does.
  const FARTHEST = 5;
  function follow(frames) {
    const { box, size } = all, far = FARTHEST * Math.max(start[2] - start[0], start[3] - start[1], size);
    const moving = [...stage.kinds].flatMap((kind, i) => (kind === "d" ? [i] : [])), spared = Math.floor(moving.length / 10);
    for (const { poses } of frames) {
      for (const k of [0, 1]) {
        const sorted = Float32Array.from(moving, (i) => poses[3 * i + k]).sort();
        if (!sorted.length) return;
        box[k] = Math.min(box[k], Math.max(sorted[spared] - size, start[k] - far));
        box[k + 2] = Math.max(box[k + 2], Math.min(sorted[sorted.length - 1 - spared] + size, start[k + 2] + far));
      }
    }
  }

  const scaled = (i, limit) => (i === 1 && limit !== null ? 100 * limit : limit);

  function strips({ strips: canvas, history, color }, { step }, ranges, most) {
    const [c, w, h] = drawing.clear(canvas);
    if (!(w > 0) || !history.length) return;
    const row = h / (CURVES.length + 1), left = 6, right = w - 6, first = Math.max(step, WINDOW) - WINDOW;
    const across = (s) => left + (right - left) * (s - first) / WINDOW;
    const last = history[history.length - 1];
    c.font = "11px system-ui, sans-serif";
    const box = (i) => ({ left, right, top: i * row + 17, bottom: (i + 1) * row - 3 });
    CURVES.forEach(([name, unit], i) => {
      const limit = scaled(i, stage.limits[i]), [low, high] = ranges[i];
      const text = si(last.values[i], unit) + (limit ? `, limit ${si(limit, unit)}` : "");
      const line = history.map((p) => [across(p.step), p.values[i]]);
      drawing.strip(c, box(i), { name, text, color, low, high, line, mark: null, limit });
    });
    // Time of a step, a band for each group of phases.
    const { top, bottom } = box(CURVES.length), up = (ns) => bottom - (bottom - top) * Math.min(ns / most, 1);
    const sum = (p, g) => p.groups.slice(0, g + 1).reduce((a, b) => a + b, 0);
    for (let g = GROUPS.length - 1; g >= 0; g--) {
      c.fillStyle = GROUPS[g][1];
      c.beginPath();
      c.moveTo(across(history[0].step), bottom);
      for (const p of history) c.lineTo(across(p.step), up(sum(p, g)));
      c.lineTo(across(last.step), bottom);
      c.fill();
    }
    const recent = history.slice(-60), mean = (of) => recent.reduce((total, p) => total + of(p), 0) / recent.length;
    const wide = w > 560, time = si(1e-9 * mean((p) => p.ns), "s");
    drawing.label(c, box(CURVES.length), "", wide ? `${time} a step, with measurement on` : `${time} a step`);
    let x = left;
    GROUPS.forEach(([name, tone], g) => {
      const share = Math.round(100 * mean((p) => p.groups[g]) / Math.max(mean((p) => p.ns), 1));
      const text = wide ? `${name} ${share} %` : name;
      c.fillStyle = tone;
      c.fillRect(x, top - 12, 8, 8);
      c.fillStyle = theme().ink;
      c.fillText(text, x + 11, top - 4);
      x += 19 + c.measureText(text).width;
    });
  }

  // Panes and controls of a stage; controls that are in use keep their state.
  function build(told) {
    const isNew = !stage || stage.scene !== told.scene || stage.panes.length !== told.panes.length;
    const others = stage && (stage.shapes.length !== told.shapes.length || isNew);
    stage = told;
    if (isNew || !panes.length) {
      [all, impulses] = [null, []];
      Object.assign(view, { zoom: 1, x: 0, y: 0 });
      view.forces = stage.bodies <= 1000;
      get("panes").replaceChildren();
      panes = told.panes.map((own, k) => pane(k));
      get("panes").className = `of${panes.length}`;
      shows();
      document.title = `${stage.scene} – simpulse view`;
    } else if (others) {
      stage.shapes.forEach((s) => { delete s.reach; });
    }
    get("title").replaceChildren(stage.scene, " ", element("span", { textContent: about() }));
    get("scissors").hidden = !stage.joints.length;
    get("poke").checked = stage.poke !== null;
    get("pokeseed").value = stage.poke ?? get("pokeseed").value;
    told.panes.forEach((own, k) => caption(panes[k], own));
    knobs();
    page.stage = stage;
  }

  function about() {
    const every = stage.measured_every > 1 ? ` · errors of every ${stage.measured_every}th step` : "";
    return `${stage.bodies} moving bodies, steps of ${si(stage.dt, "s")}${every}`;
  }

  function pane(k) {
    const figure = element("figure", {}, get("panes"));
    const made = { figure, caption: element("figcaption", {}, figure), verdict: element("p", { className: "verdict" }, figure),
      picture: element("canvas", { className: "picture" }, figure), strips: element("canvas", { className: "strips" }, figure), history: [] };
    const box = element("details", {}, figure);
    element("summary", { textContent: "Setting" }, box);
    made.knobs = element("div", { className: "knobs" }, box);
    const copies = element("div", { className: "copies" }, box);
    for (const [what, name] of [["command", "copy the command"], ["rust", "copy Rust"], ["scene", "copy the scene file"]]) {
      element("button", { textContent: name, onclick: () => send({ do: "text", what, pane: k }) }, copies);
    }
    pointer(made.picture, k);
    return made;
  }

  function caption(made, own) {
    made.color = own.color;
    made.figure.style.setProperty("--own", own.color);
    made.figure.classList.toggle("ink", own.color === "#222222");
    made.caption.replaceChildren(element("b", { textContent: own.solver }), ` · ${own.setting}`, made.lanes = element("span"));
    // While a slider is dragged, it stays.
    if (made.knobs.contains(document.activeElement) && made.knobs.childElementCount) return;
    const k = stage.panes.indexOf(own);
    made.knobs.replaceChildren();
    const budget = (name, value) => {
      own.budget[name] = value;
      send({ do: "budget", pane: k, budget: own.budget });
    };
    slider(made.knobs, "substeps", own.budget.substeps, [1, 32], 1, "", (v) => budget("substeps", v));
    for (const kind of own.sweeps) {
      const name = `${kind}_iterations`;
      slider(made.knobs, `${kind} sweeps per substep`, own.budget[name], [kind === "velocity" ? 1 : 0, 64], 1, "", (v) => budget(name, v));
    }
    for (const p of own.parameters) {
      const [low, high] = [Math.max(p.range[0], p.default / 16), Math.min(p.range[1], Math.max(4 * p.default, 1))];
      const made2 = slider(made.knobs, p.name.replaceAll("_", " "), p.value, [low, high], "any", p.unit, (value) => send({ do: "parameter", pane: k, name: p.name, value }));
      made2.title = `${p.meaning}; default ${p.default} ${p.unit}`;
    }
    const treat = { do: "treatment", pane: k, frozen: own.frozen.value, impacts: own.impacts.value, threads: own.threads };
    choice(made.knobs, "frozen contacts", own.frozen, (frozen) => send(Object.assign(treat, { frozen })));
    choice(made.knobs, "impacts", own.impacts, (impacts) => send(Object.assign(treat, { impacts })));
    if (own.processors > 1) slider(made.knobs, "threads", own.threads, [1, own.processors], 1, "", (threads) => send(Object.assign(treat, { threads })));
  }

  // A slider with a number beside it.
  function slider(parent, name, value, [low, high], step, unit, change) {
    const wrap = element("label", {}, parent);
    element("span", { textContent: name }, wrap);
    const range = element("input", { type: "range", min: low, max: high, step }, wrap);
    const number = element("input", { type: "number", step, value: Number(Number(value).toPrecision(5)) }, wrap);
    range.value = value;
    element("span", { className: "unit", textContent: unit }, wrap);
    range.setAttribute("aria-label", name);
    const set = (v) => { if (Number.isFinite(v)) change(v); };
    range.oninput = () => { number.value = Number(Number(range.value).toPrecision(3)); set(Number(number.value)); };
    number.onchange = () => { range.value = number.value; set(Number(number.value)); };
    return wrap;
  }

  function choice(parent, name, { value, choices }, change) {
    const wrap = element("label", {}, parent);
    element("span", { textContent: name }, wrap);
    const select = element("select", {}, wrap);
    const is = (other) => JSON.stringify(other) === JSON.stringify(value);
    const known = choices.some(([, other]) => is(other)) ? choices : [...choices, ["as given", value]];
    known.forEach(([text, other], i) => element("option", { textContent: text, value: i, selected: is(other) }, select));
    select.onchange = () => change(known[select.value][1]);
  }

  // What is drawn.
  function shows() {
    get("shows").replaceChildren();
    const box = (name, text, title) => {
      const wrap = element("label", { title }, get("shows"));
      element("input", { type: "checkbox", checked: view[name], id: `show-${name}`, onchange: (e) => { view[name] = e.target.checked; asks(); } }, wrap);
      wrap.append(text);
    };
    box("depths", "overlap", `color of a body: its deepest overlap, full at the limit of ${si(stage.limits[0], "m")}`);
    box("forces", "impulses", "contact points, and arrows for their impulses");
    box("colors", "colors", "contact points in the color with which they are solved at the same time");
    box("islands", "islands", "bodies that are connected have one color");
    if (stage.joints.length) box("joints", "joints", "joints");
    asks();
  }

  function asks() {
    send({ do: "show", depths: view.depths, points: view.forces || view.colors, islands: view.islands });
    draw(page.state);
  }

  // Controls of the scene.
  function knobs() {
    const parent = get("knobs");
    if (parent.contains(document.activeElement)) return;
    parent.className = "knobs";
    parent.replaceChildren();
    const change = (name) => (value) => send({ do: "scene", [name]: value });
    const { size, seed, friction, gravity } = stage;
    if (size) slider(parent, size.meaning, size.value, [size.min, Math.min(size.max, 8 * size.value)], 1, "", change("size"));
    if (seed !== null) slider(parent, "seed", seed, [0, 100], 1, "", change("seed"));
    slider(parent, "friction ×", friction.value, friction.range, 0.05, "", change("friction"));
    slider(parent, "gravity", gravity.value, [-10, 30], 0.5, "m/s²", change("gravity"));
    element("span", { className: "unit", textContent: "a change starts again" }, parent);
  }

  // The pointer on a picture: pull, drop, throw, cut, or move the picture.
  let ball = null;
  const hand = () => document.querySelector("#hands input:checked").value;
  const placement = (canvas) => drawing.placement(canvas, all, view);
  const place = (canvas, e) => drawing.toScene(placement(canvas), [e.offsetX, e.offsetY]);
  function pointer(canvas, k) {
    canvas.addEventListener("pointerdown", (e) => {
      if (!all) return;
      try { canvas.setPointerCapture(e.pointerId); } catch { /* a pointer of a script */ }
      const at = place(canvas, e);
      if (hand() === "drag") {
        asked = { grabs: (page.state.grabs || 0) + 1, held: null };
        send({ do: "grab", pane: k, at });
      }
      if (hand() === "box") send({ do: "drop", at });
      if (hand() === "ball") ball = { pane: k, from: at, to: at };
      if (hand() === "cut") send({ do: "cut", pane: k, at, reach: 12 / placement(canvas).scale });
    });
    canvas.addEventListener("pointermove", (e) => {
      if (!e.buttons || !all) return;
      if (ball) {
        ball.to = place(canvas, e);
        draw(page.state);
      } else if (asked && asked.held !== false) {
        send({ do: "move", at: place(canvas, e) });
      } else if (hand() === "drag") {
        drawing.pan(canvas, all, view, e);
        draw(page.state);
      }
    });
    const end = () => {
      if (asked) send({ do: "release" });
      // As far in a second as three times the arrow.
      if (ball) send({ do: "throw", at: ball.from, velocity: [0, 1].map((i) => 3 * (ball.to[i] - ball.from[i])) });
      [asked, ball] = [null, null];
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("wheel", (e) => {
      if (!all) return;
      drawing.zoom(canvas, all, view, e);
      draw(page.state);
    }, { passive: false });
  }

  // The arrow of a throw.
  function aim(canvas) {
    const c = canvas.getContext("2d"), to = (at) => drawing.toCanvas(placement(canvas), at);
    c.strokeStyle = theme().force;
    c.lineWidth = 2;
    drawing.stroke(c, to(ball.from), to(ball.to));
  }

  async function copy(text) {
    Object.assign(get("text"), { hidden: false, textContent: text });
    try { await navigator.clipboard.writeText(text); } catch { /* it is shown in any case */ }
  }

  async function download() {
    const bytes = await (await fetch("replay.html")).blob();
    const link = element("a", { href: URL.createObjectURL(bytes), download: `${stage.scene.replace(/\W+/g, "-")}.html` });
    page.downloads += 1;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  get("play").onclick = () => play(!playing);
  get("forth").onclick = () => send({ do: "step" });
  get("reset").onclick = () => send({ do: "reset" });
  get("speed").onchange = () => play(playing);
  get("fit").onclick = () => { all = null; Object.assign(view, { zoom: 1, x: 0, y: 0 }); draw(page.state); };
  get("record").onclick = () => send({ do: "record", on: get("record").className !== "on" });
  const poke = () => send({ do: "poke", seed: get("poke").checked ? Math.max(0, Math.round(get("pokeseed").value)) : null });
  get("poke").onchange = poke;
  get("pokeseed").onchange = poke;
  document.addEventListener("keydown", (e) => {
    if (["INPUT", "SELECT", "BUTTON", "SUMMARY"].includes(e.target.tagName) || e.ctrlKey || e.metaKey) return;
    const act = { " ": () => play(!playing), ArrowRight: () => send({ do: "step" }), r: () => send({ do: "reset" }) }[e.key];
    if (act) { act(); e.preventDefault(); }
  });
  new ResizeObserver(() => draw(page.state)).observe(get("panes"));
  drawing.isDark.addEventListener("change", () => draw(page.state));

  // For tests: the last frame, and how it is drawn.
  const page = { state: null, stage: null, all: null, view, send, downloads: 0,
    place: (at, k = 0) => drawing.toCanvas(placement(panes[k].picture), at) };
  window.page = page;
})();
