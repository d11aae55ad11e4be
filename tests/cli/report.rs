//! The page of a study.

use crate::browser::drive;
use crate::{refused, succeeds};
use serde_json::json;
use std::path::Path;

fn study(folder: &Path) {
    let options = "--scenes stack:3,card_house,incline_slip --lanes 1,8 --steps 60 --repeats 1";
    succeeds(folder, &format!("study {options} --out r"));
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
    succeeds(path, "study --from r");
    assert_eq!(std::fs::read_to_string(&page).unwrap(), first);
    std::fs::write(path.join("r/verify.json"), succeeds(path, "verify --cases B2 --json")).unwrap();
    succeeds(path, "study --from r");
    let with = std::fs::read_to_string(&page).unwrap();
    assert!(with.contains("B2.box") && with.contains("background:#") && !with.contains("Not run."));
    refused(path, "study --from nowhere", &["nowhere"]);
    std::fs::write(path.join("r/replay-1.rec"), "step,time,body").unwrap();
    refused(path, "study --from r", &["replay-1.rec", "is no recording"]);
    std::fs::write(path.join("r/study.json"), "[]").unwrap();
    refused(path, "study --from r", &["study.json"]);
}

/// Finds texts that extend beyond their plot, and pairs of axis labels that touch; `extra` adds more.
fn texts(page: &Path, extra: &str) -> Option<serde_json::Value> {
    let script = r#"
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
        const count = (selector) => document.querySelectorAll(selector).length;
        const empty = plots.filter((s) => s.getBoundingClientRect().height < 40).length;
        const wide = document.body.scrollWidth - document.body.clientWidth;
        const links = [...document.querySelectorAll("nav a, th a")].filter((a) => !document.querySelector(a.getAttribute("href"))).length;
        return { plots: plots.length, outside, touching, empty, wide, links, "#;
    let found = drive(page, "", &format!("{script}{extra} }};"))?;
    for (name, value) in [
        ("outside", json!([])),
        ("touching", json!([])),
        ("empty", json!(0)),
        ("wide", json!(0)),
        ("links", json!(0)),
    ] {
        assert_eq!(found[name], value, "{name}: {found}");
    }
    Some(found)
}

#[test]
fn the_page_of_a_sweep_is_whole_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), "study --quick --scenes stack:12,mass_ratio --sweep substeps=1,2,4,8,16 --out r");
    let found = texts(
        &folder.path().join("r/report.html"),
        "curves: count(\"svg.chart polyline[stroke-width='2']\")",
    );
    let Some(found) = found else { return };
    // Time and three errors on two scenes, with a curve or two for most of seven solvers.
    assert_eq!(found["plots"], 2 * 4, "{found}");
    assert!(found["curves"].as_u64().unwrap() >= 8 * 5, "{found}");
}

#[test]
fn the_page_is_whole_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path());
    let extra = "titles: count('svg title'), time: (() => {
        const { player } = document.querySelector('.replay');
        player.seek(0);
        player.step(5);
        return player.state.time / player.tick;
    })()";
    let Some(found) = texts(&folder.path().join("r/report.html"), extra) else { return };
    // One plot of all scenes, two or three per scene, three profiles, two of lanes, phases, two of
    // iterations.
    assert!(found["plots"].as_u64().unwrap() >= 25 && found["titles"].as_u64().unwrap() > 300, "{found}");
    assert!((found["time"].as_f64().unwrap() - 5.0).abs() < 1e-6, "{found}");
}

#[test]
fn rows_are_sorted_and_filtered_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path());
    let script = r#"
        const table = document.querySelector("table.filtered"), [body] = table.tBodies;
        const heads = [...table.tHead.rows[0].cells], box = document.querySelector("input.filter");
        const column = (i) => [...body.rows].filter((r) => r.offsetParent).map((r) => r.cells[i].textContent);
        const click = (i) => { heads[i].click(); return [column(i), heads[i].getAttribute("aria-sort")]; };
        const filter = (words) => {
            box.value = words; box.dispatchEvent(new Event("input"));
            return [...body.rows].filter((r) => r.offsetParent).map((r) => r.textContent);
        };
        const names = heads.map((h) => h.textContent), first = column(2);
        return { names, first, columns: names.map((_, i) => [column(i), click(i), click(i)]),
            marked: heads.filter((h) => h.hasAttribute("aria-sort")).length,
            some: filter("shim  ARCH house"), none: filter("shim no-such-word"), some2: filter("house shim"), all: filter("").length };
    "#;
    let Some(found) = drive(&folder.path().join("r/report.html"), "", script) else { return };
    let strings = |v: &serde_json::Value| -> Vec<String> { serde_json::from_value(v.clone()).unwrap() };
    let rows = strings(&found["first"]).len();
    assert_eq!(rows, 3 * 7, "{found}");
    // Numbers with prefixes by value, and rows without a number last.
    let number = |text: &str| -> Option<f64> {
        let end = text.find(|c: char| !c.is_ascii_digit() && !"-.e".contains(c)).unwrap_or(text.len());
        let scale = match text[end..].trim() {
            "mm" | "mm/s" => 1e-3,
            "µm" | "µm/s" => 1e-6,
            "nm" | "nm/s" => 1e-9,
            _ => 1.0,
        };
        text[..end].parse().ok().map(|x: f64| x * scale)
    };
    for (name, column) in strings(&found["names"]).iter().zip(found["columns"].as_array().unwrap()) {
        let [up, down] = [1, 2].map(|k| strings(&column[k][0]));
        assert_eq!((&column[1][1], &column[2][1]), (&json!("ascending"), &json!("descending")), "{name}");
        for (rows, sign) in [(&up, 1.0), (&down, -1.0)] {
            let mut same = [rows.clone(), strings(&column[0])];
            same.iter_mut().for_each(|rows| rows.sort());
            assert_eq!(same[0], same[1], "{name}");
            let is_sorted = match name.as_str() {
                "kind" | "scene" | "solver" => {
                    rows.is_sorted_by(|a, b| if sign > 0.0 { a <= b } else { a >= b })
                }
                "setting" | "verdict" => rows != &strings(&column[0]),
                _ => rows.is_sorted_by_key(|text| number(text).map_or(f64::INFINITY, |x| sign * x)),
            };
            assert!(is_sorted, "{name}: {rows:?}");
        }
    }
    assert_eq!((&found["marked"], &found["all"]), (&json!(1), &json!(rows)), "{found}");
    assert_eq!((strings(&found["some"]).len(), strings(&found["none"]).len()), (0, 0), "{found}");
    let some = strings(&found["some2"]);
    assert!(some.len() == 1 && some[0].contains("card_house") && some[0].contains("shim"), "{some:?}");
}

#[test]
fn errors_of_pairs_and_times_make_the_study_and_its_figures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let options = "study --scenes stack:2,incline_slip --quick --lanes 8 --solvers pgs,shim --repeats 1";
    succeeds(path, &format!("{options} --out whole"));
    for part in 1..=3 {
        succeeds(path, &format!("{options} --errors --shard {part}/3 --out p{part}"));
    }
    refused(path, "study --merge p1,p3 --out e", &["--shard 2/3", "--partial"]);
    succeeds(path, "study --merge p1,p2,p3 --out e");
    refused(path, &format!("{options} --steps 7 --times e --out t"), &["--times", "steps"]);
    refused(path, &format!("{options} --times whole --out t"), &["whole", "--errors"]);
    succeeds(path, &format!("{options} --times e --figure 85mm --poke 1 --out t"));
    let study = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(path.join(name).join("study.json")).unwrap()).unwrap()
    };
    let (whole, parts) = (study("whole"), study("t"));
    let records = |study: &serde_json::Value| -> Vec<String> {
        let of = |r: &serde_json::Value| {
            format!(
                "{} {} {} {} {} {}",
                r["scene"], r["solver"], r["budget_text"], r["lanes"], r["errors"], r["bits_equal"]
            )
        };
        let mut all: Vec<String> = study["records"].as_array().unwrap().iter().map(of).collect();
        all.sort();
        all
    };
    assert_eq!(records(&whole), records(&parts));
    assert!(parts["records"].as_array().unwrap().iter().any(|r| r["poked"]["steps"] == 3600));
    let figure = std::fs::read_to_string(path.join("t/figures/overview.svg")).unwrap();
    assert!(figure.contains("width=\"85mm\"") && !figure.contains("var(--"));
    refused(path, &format!("{options} --figure 85px"), &["'85px'"]);
    refused(path, &format!("{options} --seeds 5-1"), &["'5-1'"]);
    let text = succeeds(path, "study --scenes stack:2 --seeds 1-3 --quick --lanes 8 --solvers pgs --out s");
    assert!(text.contains("Means over seeds") && text.contains("3 of 3"), "{text}");
    assert!(std::fs::read_to_string(path.join("s/tidy.csv")).unwrap().contains("stacks,stack:2,pgs,"));
}
