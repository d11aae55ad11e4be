//! `simpulse view`: who may open its page, what a player does, and when it ends.

use crate::browser::visit;
use crate::socket::{connect, fetch};
use crate::{command, refused};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Child, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// A running program, which is ended with the test.
struct Program {
    child: Child,
    /// `127.0.0.1:PORT`
    host: String,
    /// `/TOKEN/`
    path: String,
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Program {
    fn start(words: &str) -> Program {
        let folder = std::env::temp_dir();
        let mut child = command(&folder, &format!("view {words}")).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").unwrap_or_else(|| panic!("{line}"));
        let (host, path) = address.split_once('/').unwrap();
        Program { child, host: host.into(), path: format!("/{path}") }
    }

    fn address(&self) -> String {
        format!("http://{}{}", self.host, self.path)
    }

    /// The page's connection.
    fn open(&self) -> Page {
        let origin = format!("http://{}", self.host);
        Page { socket: connect(&self.host, &format!("{}socket", self.path), Some(&origin)).unwrap() }
    }

    /// Waits until the program ends by itself.
    fn ends(&mut self) -> ExitStatus {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "still running");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

struct Page {
    socket: WebSocket<TcpStream>,
}

/// A frame: its step, its status, and x, y and angle of every body of every pane.
struct Seen {
    step: u32,
    status: Value,
    panes: Vec<Vec<[f32; 3]>>,
}

impl Page {
    fn send(&mut self, message: Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// The next frame, of which the page says that it is drawn if `drawn`.
    fn frame(&mut self, drawn: bool) -> Seen {
        loop {
            if let Message::Binary(bytes) = self.socket.read().unwrap() {
                if drawn {
                    self.send(json!({ "do": "shown" }));
                }
                return decoded(&bytes);
            }
        }
    }

    /// The first frame that `is` wanted.
    fn frame_where(&mut self, is: impl Fn(&Seen) -> bool) -> Seen {
        let start = Instant::now();
        loop {
            let seen = self.frame(true);
            if is(&seen) {
                return seen;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "step {}: {}", seen.step, seen.status);
        }
    }
}

fn decoded(bytes: &[u8]) -> Seen {
    let word = |i: usize| u32::from_le_bytes(bytes[i..i + 4].try_into().unwrap());
    let number = |i: usize| f32::from_bits(word(i));
    let length = word(8) as usize;
    let status: Value = serde_json::from_slice(&bytes[12..12 + length]).unwrap();
    let (mut at, mut panes) = (12 + length, Vec::new());
    for _ in status["panes"].as_array().unwrap() {
        let [bodies, depths, points, islands] = [0, 4, 8, 12].map(|k| word(at + k) as usize);
        at += 16;
        panes.push((0..bodies).map(|i| [0, 4, 8].map(|k| number(at + 12 * i + k))).collect());
        at += 12 * bodies + 4 * depths + 32 * points + 4 * islands;
    }
    assert_eq!(at, bytes.len());
    Seen { step: word(4), status, panes }
}

#[test]
fn only_its_own_page_is_let_in() {
    let program = Program::start("stack:2 --patience 30");
    let Program { host, path, .. } = &program;
    let own = ("Host", host.as_str());
    let get = |path: &str, headers: &[(&str, &str)]| fetch(host, &format!("GET {path}"), headers).0;
    let (status, head, body) = fetch(host, &format!("GET {path}"), &[own]);
    assert_eq!(status, 200);
    assert!(head.contains("default-src 'none'") && head.contains("nosniff") && body.contains("page.js"));
    assert!(!body.contains("//"), "{body}");
    let other = format!("{}/", path.replace(|c: char| c.is_ascii_digit(), "a"));
    let foreign = ("Origin", "http://example.com");
    let local = format!("http://{host}");
    for (path, headers, expected) in [
        (format!("{path}page.js"), vec![own], 200),
        (format!("{path}page.js"), vec![own, ("Origin", &local)], 200),
        // Without the token, with another one, and with a part of it.
        ("/".to_string(), vec![own], 403),
        ("/page.js".to_string(), vec![own], 403),
        (other, vec![own], 403),
        (path[..path.len() - 2].to_string() + "/", vec![own], 403),
        (path.trim_end_matches('/').to_string(), vec![own], 403),
        // Another page's script, and another name for this machine.
        (path.clone(), vec![own, foreign], 403),
        (path.clone(), vec![own, ("Origin", "null")], 403),
        (path.clone(), vec![("Host", "example.com")], 403),
        (path.clone(), vec![("Host", "127.0.0.1")], 403),
        (path.clone(), vec![], 400),
        (path.clone(), vec![own, ("Host", "example.com")], 400),
        // Nothing else is there.
        (format!("{path}Cargo.toml"), vec![own], 404),
        (format!("{path}../../etc/passwd"), vec![own], 404),
        (format!("{path}replay.html"), vec![own], 404),
    ] {
        assert_eq!(get(&path, &headers), expected, "{path} {headers:?}");
    }
    assert_eq!(fetch(host, &format!("POST {path}"), &[own]).0, 405);
    assert_eq!(get(&format!("{path}{}", "a".repeat(9000)), &[own]), 431);
    let socket = format!("{path}socket");
    for (path, origin) in [
        (socket.as_str(), None),
        (socket.as_str(), Some("http://example.com")),
        ("/socket", Some(local.as_str())),
    ] {
        assert!(connect(host, path, origin).unwrap_err().starts_with("HTTP/1.1 403"), "{path} {origin:?}");
    }
    assert!(connect(host, &socket, Some(&local)).is_ok());
}

#[test]
fn a_drag_moves_the_body_in_all_panes_which_are_in_step() {
    let program = Program::start("stack:3 --solvers soft_step,shim,pgs --patience 30");
    let mut page = program.open();
    let start = page.frame_where(|seen| seen.step > 5);
    // Positions are relative to the ground.
    let at = start.panes[1][3];
    page.send(json!({ "do": "grab", "pane": 1, "at": [at[0], at[1]] }));
    let held = page.frame_where(|seen| seen.status["held"] == true);
    page.send(json!({ "do": "move", "at": [at[0] + 4.0, at[1] + 1.0] }));
    let moved = page.frame_where(|seen| seen.step >= held.step + 90);
    assert_eq!(moved.panes.len(), 3);
    for bodies in &moved.panes {
        let [x, y, _] = bodies[3];
        assert!((x - at[0] - 4.0).abs() < 0.5 && (y - at[1] - 1.0).abs() < 0.5, "{x} {y} {at:?}");
        // Friction moves the others by much less.
        assert!((bodies[1][0] - at[0]).abs() < 1.0, "{bodies:?}");
    }
    page.send(json!({ "do": "release" }));
    page.frame_where(|seen| seen.status["held"] == false && seen.panes.iter().all(|b| b[3][1] < at[1]));
}

#[test]
fn a_page_that_draws_nothing_delays_nothing_and_sees_the_newest_state() {
    let program = Program::start("stack:3 --solvers soft_step,shim --patience 30");
    let mut page = program.open();
    // Two frames are sent ahead.
    let first = page.frame(false);
    let second = page.frame(false);
    assert!(second.step < 30, "{}", second.step);
    std::thread::sleep(Duration::from_secs(2));
    page.send(json!({ "do": "shown" }));
    let third = page.frame(false);
    assert!(third.step > second.step + 30, "{} {} {}", first.step, second.step, third.step);
}

#[test]
fn play_step_reset_and_limits() {
    let program = Program::start("stack:2 --solvers soft_step,pgs:velocity=4 --steps 20 --patience 30");
    let mut page = program.open();
    let seen = page.frame_where(|seen| seen.status["playing"] == false);
    assert_eq!(seen.step, 20);
    page.send(json!({ "do": "step" }));
    page.frame_where(|seen| seen.step == 21);
    page.send(json!({ "do": "reset" }));
    page.frame_where(|seen| seen.step == 0);
    let bad =
        json!({ "substeps": 0, "velocity_iterations": 1, "relax_iterations": 1, "position_iterations": 0 });
    page.send(json!({ "do": "budget", "pane": 0, "budget": bad }));
    page.frame_where(|seen| seen.status["said"].as_str().unwrap().contains("substeps"));
    page.send(json!({ "do": "scene", "size": 5 }));
    page.frame_where(|seen| seen.panes[0].len() == 6 && seen.status["said"] == "");
    page.send(json!({ "do": "drop", "at": [0.0, 12.0] }));
    page.frame_where(|seen| seen.panes.iter().all(|bodies| bodies.len() == 7));
    // What no page sends ends the connection, not the program.
    page.send(json!({ "do": "delete", "path": "/" }));
    while page.socket.read().is_ok() {}
    program.open().frame_where(|seen| seen.panes[0].len() == 7);
}

#[test]
fn it_ends_when_the_page_is_closed_for_its_patience_and_a_newer_page_takes_over() {
    let mut program = Program::start("stack:2 --patience 1");
    let mut first = program.open();
    first.frame(true);
    let mut second = program.open();
    while first.socket.read().is_ok() {}
    // Longer than its patience, while a page is open.
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1500) {
        second.frame(true);
    }
    assert!(program.child.try_wait().unwrap().is_none());
    drop(second);
    assert_eq!(program.ends().code(), Some(0));
    // Never opened.
    assert_eq!(Program::start("stack:2 --patience 1").ends().code(), Some(0));
}

#[test]
#[cfg(unix)]
fn a_signal_ends_it() {
    let mut program = Program::start("stack:2 --patience 30");
    program.open().frame(true);
    let pid = program.child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    assert_eq!(program.ends().code(), Some(130));
}

#[test]
fn bad_requests_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    for (options, parts) in [
        ("staack", &["'staack'", "'stack'"][..]),
        ("stack:2 --solvers pgs,softstep", &["softstep"]),
        ("stack:2 --solvers pgs,sor,tgs_ngs,soft_step,shim", &["5", "4"]),
        ("stack:2 --solvers pgs:substeps=0", &["substeps", "0"]),
        ("stack:2 --solvers pgs --solver shim", &["--solver"]),
        (&format!("stack:2 --port {port}"), &["127.0.0.1", &port.to_string()]),
        ("stack:2 --patience 0", &["patience", "0"]),
    ] {
        refused(folder.path(), &format!("view {options}"), parts);
    }
}

#[test]
fn a_player_in_a_real_browser() {
    let program = Program::start("stack:4 --solvers soft_step,shim --patience 60");
    let script = r#"
        await until(() => window.page && page.state && page.state.step > 10);
        const get = (id) => document.getElementById(id);
        const [left, right] = document.querySelectorAll("canvas.picture");
        const body = (pane, i) => [...page.state.frames[pane].poses.subarray(3 * i, 3 * i + 2)];
        const event = (name, at, buttons) => {
            const [x, y] = page.place(at), box = left.getBoundingClientRect();
            left.dispatchEvent(new PointerEvent(name, { clientX: box.left + 1 + x, clientY: box.top + 1 + y, buttons, bubbles: true }));
        };
        const color = (canvas) => {
            const d = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
            let sum = 0;
            for (let i = 0; i < d.length; i += 4) sum += [0xd3, 0xd8, 0xde].every((v, k) => Math.abs(d[i + k] - v) <= 2);
            return sum;
        };
        const shown = (id) => get(id).offsetParent !== null;
        const out = { ground: Math.min(color(left), color(right)), start: body(0, 4), no_joints: shown("hands") && !shown("scissors") };
        event("pointerdown", out.start, 1);
        await until(() => page.state.held);
        const goal = [out.start[0] + 3, out.start[1] + 1];
        event("pointermove", goal, 1);
        await until(() => [0, 1].every((k) => Math.hypot(body(k, 4)[0] - goal[0], body(k, 4)[1] - goal[1]) < 0.3));
        out.goal = goal; out.ends = [body(0, 4), body(1, 4)];
        event("pointerup", goal, 0);
        await until(() => !page.state.held);
        // Beside a body, the picture is moved.
        event("pointerdown", [-2.5, 3], 1);
        await pause(300);
        left.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 30, movementY: 0 }));
        out.panned = page.view.x < 0; event("pointerup", [0, 0], 0); get("fit").click();
        document.querySelector("[value=box]").click();
        event("pointerdown", [0, 7], 1); event("pointerup", [0, 7], 0);
        out.dropped = await until(() => page.state.frames.every((f) => f.poses.length === 18));
        get("play").click();
        await until(() => !page.state.playing);
        const step = page.state.step; get("forth").click();
        out.stepped = await until(() => page.state.step === step + 1);
        get("reset").click(); await until(() => page.state.step === 0);
        get("record").click(); await until(() => page.state.recording);
        get("play").click(); await until(() => page.state.step > 20);
        get("record").click(); out.recorded = await until(() => page.downloads === 1);
        [...document.querySelectorAll(".copies button")].forEach((b) => b.click());
        await until(() => !get("text").hidden); await pause(300);
        out.text = get("text").textContent.slice(0, 30);
        // The slider of the substeps.
        const range = document.querySelector(".knobs input[type=range]"); range.value = 9; range.dispatchEvent(new Event("input"));
        out.setting = await until(() => document.querySelector("figcaption").textContent.includes("9 sub"));
        out.offline = await fetch("http://127.0.0.1:1/").then(() => false, () => true);
        out.verdict = document.querySelector(".verdict").textContent;
        return out;
    "#;
    let Some(found) = visit(&program.address(), script) else { return };
    for name in ["no_joints", "panned", "dropped", "stepped", "recorded", "setting", "offline"] {
        assert_eq!(found[name], true, "{name}: {found}");
    }
    let number = |v: &Value| v.as_f64().unwrap();
    for end in found["ends"].as_array().unwrap() {
        let far: f64 = (0..2).map(|k| (number(&end[k]) - number(&found["goal"][k])).abs()).sum();
        assert!(far < 0.6, "{found}");
    }
    assert!(
        number(&found["ground"]) > 1000.0 && found["verdict"].as_str().unwrap().contains("good"),
        "{found}"
    );
    assert!(found["text"].as_str().unwrap().starts_with('{'), "{found}");
}

/// Prints how fast a large scene is drawn and stepped: `cargo test --release --test cli -- --ignored frames --nocapture`.
#[test]
#[ignore = "measures this machine"]
fn frames_of_a_large_scene() {
    let program = Program::start("large_pyramid --solvers soft_step,shim --patience 60");
    let script = r#"
        await until(() => window.page && page.state && page.state.step > 60);
        const step = page.state.step, start = performance.now();
        const found = [];
        for (let i = 0; i < 8; i++) { await pause(1000); found.push(document.getElementById("clock").textContent); }
        return { found, steps: 1000 * (page.state.step - step) / (performance.now() - start), panes: page.state.panes.map((p) => p.step_ns / 1e6) };
    "#;
    let Some(found) = visit(&program.address(), script) else { return };
    println!("{found:#}");
}
