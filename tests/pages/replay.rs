//! The page that plays recordings.

use crate::browser::{count, drive, or_skip, screenshot};
use crate::{solver_color, succeeds};
use std::path::{Path, PathBuf};

/// A page with two recordings of two seconds.
fn page(folder: &Path) -> PathBuf {
    for (solver, file) in [("pgs", "a.rec"), ("soft_step", "b.rec")] {
        let args =
            ["run", "pyramid:8", "--steps", "120", "--record-contacts", "--solver", solver, "--record", file];
        succeeds(folder, &args);
    }
    let text = succeeds(folder, &["replay", "a.rec", "b.rec", "-o", "r.html"]);
    assert!(text.contains("r.html (2 recordings"), "{text}");
    folder.join("r.html")
}

#[test]
fn the_controls_do_what_they_say() {
    let Some(browser) = or_skip("the_controls_do_what_they_say") else { return };
    let folder = tempfile::tempdir().unwrap();
    let found = drive(
        &browser,
        &page(folder.path()),
        "t=0.5&zoom=2",
        r#"
        const root = document.querySelector(".replay"), { state } = root.player;
        const get = (name) => root.querySelector("." + name);
        const out = { panels: root.querySelectorAll("canvas.scene").length, end: root.player.end,
            frames: root.player.recordings.map((r) => r.frames.length), t: state.time, zoom: state.zoom };
        const ink = () => [...root.querySelectorAll("canvas")].map((c) => {
            const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
            let sum = 0;
            for (let i = 3; i < d.length; i += 4) sum += d[i] > 0;
            return sum;
        });
        const hash = () => [...root.querySelectorAll("canvas.scene")].map((c) => c.toDataURL().length + c.toDataURL().slice(-4000)).join();
        out.ink = ink();
        get("forth").click(); out.forth = state.time;
        get("back").click(); get("back").click(); out.back = state.time;
        const slider = root.querySelector("input[type=range]");
        slider.value = 0; slider.dispatchEvent(new Event("input")); out.start = state.time; const first = hash();
        slider.value = 100; slider.dispatchEvent(new Event("input")); out.late = state.time; out.moved = hash() !== first;
        get("fit").click(); out.fit = state.zoom; const plain = hash();
        const scene = root.querySelector("canvas.scene");
        scene.dispatchEvent(new WheelEvent("wheel", { deltaY: -400, bubbles: true, cancelable: true }));
        out.wheel = state.zoom; out.zoomed = hash() !== plain;
        get("fit").click(); out.same = hash() === plain;
        scene.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 40, movementY: 10 }));
        out.panned = [state.x, state.y];
        get("fit").click();
        get("forces").click(); out.without = hash() !== plain;
        get("forces").click(); get("depths").click(); out.gray = hash() !== plain; get("depths").click();
        root.dispatchEvent(new KeyboardEvent("keydown", { key: "End" })); out.last = state.time;
        root.dispatchEvent(new KeyboardEvent("keydown", { key: "Home" })); out.home = state.time;
        get("play").click(); out.playing = state.playing;
        // However slow the machine; a browser that shows no frames plays none.
        out.ticks = 0;
        const tick = () => { out.ticks += 1; requestAnimationFrame(tick); };
        requestAnimationFrame(tick);
        for (let i = 0; i < 200 && !(state.time > 0); i++) await pause(50);
        get("play").click(); out.played = state.time; out.paused = state.playing;
        const curves = root.querySelector("canvas.curves");
        curves.dispatchEvent(new PointerEvent("pointerdown", { clientX: curves.getBoundingClientRect().left + 0.5 * curves.clientWidth }));
        out.picked = state.time;
        out.text = root.querySelector("output").textContent;
        return out;
        "#,
    );
    assert_eq!(found["errors"], serde_json::json!([]), "{found}");
    let number = |name: &str| found[name].as_f64().unwrap_or_else(|| panic!("{name}: {found}"));
    let near = |name: &str, value: f64| assert!((number(name) - value).abs() < 1e-6, "{name}: {found}");
    assert_eq!(found["frames"], serde_json::json!([121, 121]), "{found}");
    near("panels", 2.0);
    near("end", 2.0);
    near("t", 0.5);
    near("zoom", 2.0);
    near("forth", 0.5 + 1.0 / 60.0);
    near("back", 0.5 - 1.0 / 60.0);
    near("start", 0.0);
    near("late", 100.0 / 60.0);
    near("fit", 1.0);
    near("last", 2.0);
    near("home", 0.0);
    assert!(number("wheel") > 1.5 && (number("played") > 0.0 || number("ticks") < 3.0), "{found}");
    assert!((number("picked") - 1.0).abs() < 0.02, "{found}");
    for name in ["moved", "zoomed", "same", "without", "gray", "playing"] {
        assert_eq!(found[name], true, "{name}: {found}");
    }
    assert_eq!(found["paused"], false, "{found}");
    assert!(
        found["panned"][0].as_f64().unwrap() < 0.0 && found["panned"][1].as_f64().unwrap() > 0.0,
        "{found}"
    );
    // No canvas is empty.
    assert!(found["ink"].as_array().unwrap().iter().all(|n| n.as_u64().unwrap() > 1000), "{found}");
    assert!(found["text"].as_str().unwrap().contains("of 2.00 s"), "{found}");
}

#[test]
fn a_screenshot_shows_bodies_impulses_and_curves() {
    let Some(browser) = or_skip("a_screenshot_shows_bodies_impulses_and_curves") else { return };
    let folder = tempfile::tempdir().unwrap();
    let pixels = screenshot(&browser, &page(folder.path()), "t=1.5", [1300, 760]);
    // The ground, arrows, and the captions' colors of pgs and soft_step.
    for (what, color, least) in [
        ("ground", [0xd3, 0xd8, 0xde], 5000),
        ("impulses", [0x00, 0x72, 0xb2], 300),
        ("pgs", solver_color("pgs"), 80),
        ("soft_step", solver_color("soft_step"), 80),
    ] {
        let found = count(&pixels, color);
        assert!(found >= least, "{what}: {found} pixels");
    }
    // A screenshot at another time differs: the address sets the time.
    let start = screenshot(&browser, &folder.path().join("r.html"), "t=0", [1300, 760]);
    assert!(start != pixels);
}

#[test]
fn a_damaged_page_says_so() {
    let Some(browser) = or_skip("a_damaged_page_says_so") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = page(folder.path());
    let text = std::fs::read_to_string(&path).unwrap();
    // The Base64 text of the magic bytes begins with "U0lNUFJFQx".
    std::fs::write(&path, text.replacen("U0lNUFJFQx", "U0lNUFJFQy", 1).replacen("U0lNUF", "U0lNUE", 1))
        .unwrap();
    let found = drive(
        &browser,
        &path,
        "",
        r#"return { text: document.querySelector(".replay .failed").textContent };"#,
    );
    assert!(found["text"].as_str().unwrap().contains("cannot be played"), "{found}");
    assert_eq!(found["errors"], serde_json::json!([]), "{found}");
}
