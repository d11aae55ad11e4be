//! The page of a study.

use crate::browser::{count, drive, or_skip, screenshot};
use crate::{refused, solver_color, succeeds};
use std::path::Path;

fn study(folder: &Path) {
    let scenes = "stack:3,card_house,incline_slip";
    let args =
        ["study", "--scenes", scenes, "--lanes", "1,8", "--steps", "60", "--repeats", "1", "--out", "r"];
    succeeds(folder, &args);
}

#[test]
fn the_page_is_made_again_from_the_records() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    study(path);
    let page = path.join("r/report.html");
    let first = std::fs::read_to_string(&page).unwrap();
    assert!(first.contains("id=\"scene-stack-3\"") && first.contains("class=\"replay\""));
    assert!(first.contains("Not run. <code>simpulse verify"));
    std::fs::remove_file(&page).unwrap();
    succeeds(path, &["report", "r"]);
    assert_eq!(std::fs::read_to_string(&page).unwrap(), first);
    let matrix = succeeds(path, &["verify", "--cases", "B2", "--json"]);
    std::fs::write(path.join("r/verify.json"), matrix).unwrap();
    succeeds(path, &["report", "r"]);
    let with = std::fs::read_to_string(&page).unwrap();
    assert!(with.contains("B2.box") && with.contains("background:#") && !with.contains("Not run."));
    refused(path, &["report", "nowhere"], &["nowhere"]);
    std::fs::write(path.join("r/study.json"), "[]").unwrap();
    refused(path, &["report", "r"], &["study.json"]);
}

/// Finds texts that extend beyond their plot, and pairs of axis labels that touch.
const TEXTS: &str = r#"
    const plots = [...document.querySelectorAll("svg[role=img]")];
    const outside = [], touching = [];
    for (const svg of plots) {
        const [, , w, h] = svg.getAttribute("viewBox").split(" ").map(Number);
        for (const text of svg.querySelectorAll("text")) {
            if (text.getAttribute("transform")) continue;
            const b = text.getBBox();
            if (b.x < -1 || b.y < -1 || b.x + b.width > w + 1 || b.y + b.height > h + 1) outside.push(text.textContent);
        }
        const labels = [...svg.querySelectorAll("text:not([transform])")].map((t) => [t.getBBox(), t.textContent]);
        for (const [i, [a, one]] of labels.entries()) for (const [b, other] of labels.slice(i + 1)) {
            if (Math.abs(a.y - b.y) < 8 && a.x < b.x + b.width && b.x < a.x + a.width) touching.push(one + "|" + other);
        }
    }
"#;

#[test]
fn the_page_of_a_sweep_is_whole_in_a_browser() {
    let Some(browser) = or_skip("the_page_of_a_sweep_is_whole_in_a_browser") else { return };
    let folder = tempfile::tempdir().unwrap();
    let sweep = ["study", "--quick", "--scenes", "stack:12,mass_ratio", "--sweep", "substeps=1,2,4,8,16"];
    succeeds(folder.path(), &[&sweep[..], &["--out", "r"]].concat());
    let page = folder.path().join("r/report.html");
    let script = format!(
        r#"{TEXTS}
        return {{
            plots: plots.length, outside, touching, curves: document.querySelectorAll("svg.chart polyline[stroke-width='2']").length,
            wide: document.body.scrollWidth - document.body.clientWidth,
        }};"#
    );
    let found = drive(&browser, &page, "", &script);
    for name in ["errors", "outside", "touching"] {
        assert_eq!(found[name], serde_json::json!([]), "{name}: {found}");
    }
    // Time and three errors on two scenes, with a curve or two for most of seven solvers.
    assert_eq!((found["plots"].as_u64(), found["wide"].as_i64()), (Some(2 * 4), Some(0)), "{found}");
    assert!(found["curves"].as_u64().unwrap() >= 8 * 5, "{found}");
}

#[test]
fn the_page_is_whole_in_a_browser() {
    let Some(browser) = or_skip("the_page_is_whole_in_a_browser") else { return };
    let folder = tempfile::tempdir().unwrap();
    study(folder.path());
    let page = folder.path().join("r/report.html");
    let script = format!(
        r#"{TEXTS}
        const player = document.querySelector(".replay").player;
        player.seek(0);
        player.step(5);
        return {{
            plots: plots.length, outside, touching, empty: plots.filter((s) => s.getBoundingClientRect().height < 40).length,
            titles: document.querySelectorAll("svg title").length,
            links: [...document.querySelectorAll("nav a, th a")].filter((a) => !document.querySelector(a.getAttribute("href"))).length,
            wide: document.body.scrollWidth - document.body.clientWidth,
            time: player.state.time, tick: player.tick,
        }};"#
    );
    let found = drive(&browser, &page, "", &script);
    assert_eq!(found["errors"], serde_json::json!([]), "{found}");
    for (name, value) in [
        ("outside", serde_json::json!([])),
        ("touching", serde_json::json!([])),
        ("empty", 0.into()),
        ("links", 0.into()),
        ("wide", 0.into()),
    ] {
        assert_eq!(found[name], value, "{name}: {found}");
    }
    // One plot of all scenes, two or three per scene, three profiles, two of lanes, phases, two of
    // iterations.
    assert!(found["plots"].as_u64().unwrap() >= 25 && found["titles"].as_u64().unwrap() > 300, "{found}");
    let ratio = found["time"].as_f64().unwrap() / found["tick"].as_f64().unwrap();
    assert!((ratio - 5.0).abs() < 1e-6, "{found}");

    let pixels = screenshot(&browser, &page, "", [1300, 2000]);
    // The shaded area within tolerance, the band of failures, and markers of pgs.
    for (what, color, least) in [
        ("within", [0xea, 0xf5, 0xf0], 20_000),
        ("band", [0xf3, 0xe3, 0xdc], 3000),
        ("pgs", solver_color("pgs"), 100),
    ] {
        let found = count(&pixels, color);
        assert!(found >= least, "{what}: {found} pixels");
    }
}
