// Plays the recordings of every `.replay` on the page, all of one replay at the same time.
// `#t=1.5&play=1&zoom=2` in the address sets the first replay's time (s), whether it plays, and its zoom.
(() => {
  const { si, clamp, theme, stroke } = drawing;

  // A recording as it is described in src/lab/recording/mod.rs, in the form of draw.js.
  async function decode(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const { header, frames } = await new Response(stream).json();
    const [length, separation, impulse] = header.units;
    const place = [length, length, 1e-4], touch = [1, 1, length, length, separation, impulse, impulse];
    // Frames hold what has changed since the one before, in units.
    let last = { poses: [], points: [] };
    const added = (changes, before) => changes.map((change, i) => change + (before[i] ?? 0));
    const frame = ({ poses, points, values }) => {
      last = { poses: added(poses, last.poses), points: added(points, last.points) };
      const touches = [];
      for (let i = 0; i < points.length; i += 7) {
        const [a, b, x, y, separation, ix, iy] = touch.map((unit, k) => unit * last.points[i + k]);
        touches.push({ a, b, x, y, separation, ix, iy });
      }
      return { poses: Float64Array.from(last.poses, (n, i) => n * place[i % 3]), points: touches, values };
    };
    return { ...header, frames: frames.map(frame), span: header.dt * header.every };
  }

  const element = (tag, attributes, parent) => {
    const made = Object.assign(document.createElement(tag), attributes);
    if (parent) parent.append(made);
    return made;
  };

  // What the joints of a scene look like.
  const MARKS = { revolute: "○ hinge", prismatic: "□ slider", distance: "— rod", spring: "┄ spring", weld: "□ weld", wheel: "○ wheel", motor: "□ motor", mouse: "┄ mouse" };

  function start(root, recordings) {
    const panels = [...root.querySelectorAll("figure")].map((figure, i) => ({
      recording: recordings[i],
      scene: figure.querySelector(".scene"),
      curves: figure.querySelector(".curves"),
      color: getComputedStyle(figure).getPropertyValue("--own").trim(),
    }));
    const end = Math.max(...recordings.map((r) => (r.frames.length - 1) * r.span));
    const tick = Math.min(...recordings.map((r) => r.span));
    const all = drawing.measures(recordings);
    const state = { time: 0, playing: false, speed: 1, zoom: 1, x: 0, y: 0, forces: true, depths: true, joints: true };

    const frameOf = (r) => Math.min(Math.floor(state.time / r.span + 1e-6), r.frames.length - 1);

    // Limits of each curve over all recordings, so that panels compare.
    const ranges = recordings[0].curves.map((_, k) => {
      const values = recordings.flatMap((r) => r.frames.slice(1).map((f) => f.values[k] || 0)).filter((v) => v > 0);
      const high = Math.max(1e-30, ...values);
      return [Math.max(Math.min(high, ...values), 1e-5 * high), high * 1.3];
    });

    function drawCurves({ recording, curves, color }) {
      const { ink } = theme();
      const [c, w, h] = drawing.clear(curves);
      if (!(w > 0)) return;
      const row = h / Math.max(recording.curves.length, 1), left = 6, right = w - 6;
      const across = (t) => left + (right - left) * t / Math.max(end, 1e-9);
      const now = frameOf(recording);
      c.font = "11px system-ui, sans-serif";
      recording.curves.forEach(([name, unit], k) => {
        const [low, high] = ranges[k], top = k * row + 16, bottom = (k + 1) * row - 4;
        const value = (i) => recording.frames[i].values[k];
        const line = recording.frames.slice(1).map((f, i) => [across((i + 1) * recording.span), f.values[k]]);
        const text = `${si(value(now), unit)}   (log, to ${si(high / 1.3, unit)})`;
        const mark = [across(now * recording.span), value(now)];
        drawing.strip(c, { left, top, right, bottom }, { name, text, color, low, high, line, mark });
      });
      c.strokeStyle = ink;
      c.lineWidth = 1;
      stroke(c, [across(state.time), 0], [across(state.time), h]);
    }

    const controls = element("div", { className: "controls" }, root);
    const button = (className, textContent, title, onclick) => element("button", { type: "button", className, textContent, title, onclick }, controls);
    button("back", "←", "one step back (←)", () => step(-1));
    const play = button("play", "▶", "play or pause (space)", () => toggle());
    button("forth", "→", "one step on (→)", () => step(1));
    const slider = element("input", { type: "range", min: 0, max: Math.round(end / tick), step: 1, value: 0 }, controls);
    slider.setAttribute("aria-label", "time");
    const output = element("output", {}, controls);
    const speed = element("select", { className: "speed", title: "speed" }, controls);
    for (const times of [0.1, 0.25, 0.5, 1, 2, 4]) element("option", { value: times, textContent: `${times}×`, selected: times === 1 }, speed);
    const option = (label, name) => {
      const wrap = element("label", {}, controls);
      element("input", { type: "checkbox", checked: true, className: name, onchange: (e) => { state[name] = e.target.checked; draw(); } }, wrap);
      wrap.append(` ${label}`);
    };
    if (recordings.some((r) => r.contacts)) {
      option("impulses", "forces");
      option(`overlap (to ${si(all.deepest, "m")})`, "depths");
    }
    const used = Object.keys(MARKS).filter((mark) => recordings.some((r) => r.joints.some((j) => j.mark === mark)));
    if (used.length) option(`joints (${used.map((mark) => MARKS[mark]).join(", ")})`, "joints");
    button("fit", "fit", "whole scene", () => { Object.assign(state, { zoom: 1, x: 0, y: 0 }); draw(); });

    function draw() {
      for (const panel of panels) {
        const { recording, scene } = panel;
        drawing.scene(scene, recording, recording.frames[frameOf(recording)], all, state);
        drawCurves(panel);
      }
      slider.value = Math.round(state.time / tick);
      output.textContent = `${state.time.toFixed(3)} s of ${end.toFixed(2)} s · step ${Math.round(state.time / recordings[0].dt)}`;
      play.textContent = state.playing ? "▮▮" : "▶";
    }
    function seek(time) {
      state.time = clamp(time, 0, end);
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
        drawing.zoom(scene, all, state, e);
        draw();
      }, { passive: false });
      scene.addEventListener("pointerdown", (e) => scene.setPointerCapture(e.pointerId));
      scene.addEventListener("pointermove", (e) => {
        if (!e.buttons) return;
        drawing.pan(scene, all, state, e);
        draw();
      });
      curves.addEventListener("pointerdown", (e) => {
        state.playing = false;
        seek(end * (e.offsetX - 6) / Math.max(curves.clientWidth - 12, 1));
      });
    }
    // On paper the frame is scaled: a canvas of another size would be empty until the next frame.
    drawing.isDark.addEventListener("change", draw);
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
