//! `report.html`: a study on one page that needs no network, made from the study's files.
//!
//! ```text
//! study.json ──► StudyFile ──► sections of paragraphs, tables, charts ─┐
//! verify.json ──► VerifyFile ───────────────────────────────────────────┼─► page
//! replay-*.rec ──► recording::page::fragment ───────────────────────────┘
//! ```

pub mod charts;
mod matrix;

use super::doc::{self, DocBlock, DocCell, DocTable, Tone};
use super::style::Style;
use super::{answer, by_scene, ensemble, sweep};
use crate::engine::clock::Phase;
use crate::lab::chart::figure::FigureStyle;
use crate::lab::chart::{THEME, legend};
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::picture::svg::escaped;
use crate::lab::recording::Header;
use crate::lab::recording::page::{MOST, RecordingPanel, SCRIPT, STYLE, fragment};
use crate::lab::recording::read::read_file;
use crate::lab::report::study_file::StudyFile;
use crate::lab::study::Record;
use crate::lab::study::curve::solvers_of;
use crate::lab::units::{bodies, count, digits};
use matrix::VerifyFile;
use std::path::{Path, PathBuf};

/// Name of the page in the folder of a study.
pub const NAME: &str = "report.html";

/// File name of recording number `i` of a study.
fn recording_name(i: usize) -> String {
    format!("replay-{}.rec", i + 1)
}

/// Replaces the recordings in a study's folder; returns their paths.
pub fn write_recordings(folder: &Path, recordings: &[Vec<u8>]) -> Result<Vec<PathBuf>, Error> {
    let mut paths = Vec::new();
    for i in 0..MOST {
        let path = folder.join(recording_name(i));
        match recordings.get(i) {
            Some(bytes) => {
                files::write(&path, bytes)?;
                paths.push(path);
            }
            None if path.exists() => std::fs::remove_file(&path).map_err(Error::io(&path))?,
            None => {}
        }
    }
    Ok(paths)
}

/// Writes the page of a study into its folder, with the folder's `verify.json` and recordings if they exist;
/// returns the path of the page.
///
/// Errors: invalid files of these names.
pub fn write(folder: &Path, study: &StudyFile) -> Result<PathBuf, Error> {
    let matrix_path = folder.join("verify.json");
    let matrix: Option<VerifyFile> = if matrix_path.exists() { Some(read_json(&matrix_path)?) } else { None };
    let recordings = recordings_of(folder)?;
    let path = folder.join(NAME);
    files::write(&path, page(study, matrix.as_ref(), &recordings).as_bytes())?;
    Ok(path)
}

/// Writes every chart of a study into `figures` in its folder; returns their paths.
pub fn write_figures(folder: &Path, records: &[Record], style: &FigureStyle) -> Result<Vec<PathBuf>, Error> {
    let folder = folder.join("figures");
    files::prepare_folder(&folder)?;
    let names: Vec<(&str, Style)> =
        solvers_of(records).into_iter().map(|name| (name, Style::of(name))).collect();
    let write = |(name, chart)| {
        let path = folder.join(format!("{name}.svg"));
        files::write(&path, style.svg(&chart, &names).as_bytes()).map(|()| path)
    };
    charts::figures(records).into_iter().map(write).collect()
}

/// The recordings in a study's folder, with their headers. Errors: an invalid file.
pub fn recordings_of(folder: &Path) -> Result<Vec<(Vec<u8>, Header)>, Error> {
    let paths = (0..MOST).map(|i| folder.join(recording_name(i))).filter(|path| path.exists());
    let read = |path: PathBuf| read_file(&path).map(|(bytes, recording)| (bytes, recording.header));
    paths.map(read).collect()
}

fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let text = std::fs::read(path).map_err(Error::io(path))?;
    serde_json::from_slice(&text).map_err(|e| Error::Format { path: path.into(), message: e.to_string() })
}

/// A section of the page: its anchor, its title, and its content.
type Section = (&'static str, &'static str, Vec<DocBlock>);

fn plain(text: &str) -> DocBlock {
    DocBlock::Text(Tone::Plain, text.to_string())
}

/// The sections of a study.
fn sections(
    study: &StudyFile,
    matrix: Option<&VerifyFile>,
    recordings: &[(Vec<u8>, Header)],
) -> Vec<Section> {
    let records = &study.records[..];
    let solvers = solvers_of(records);
    let legend = || DocBlock::Html(legend(solvers.iter().map(|s| (*s, Style::of(s)))));
    let machine = ("machine", "Machine, settings and command", machine(study));
    if let Some(swept) = records.iter().find_map(|r| r.swept) {
        let lead = format!(
            "Time and errors against {}, one curve per solver. A mark is a setting at its fastest lane width; hollow marks are in file order. Bars are the quartiles of the blocks of steps. The shaded side is within the scene’s tolerance. Settings that fail are in the strip “fails” at the top and break the curve. The settings of a scene were timed interleaved.",
            swept.name
        );
        let mut blocks = vec![plain(&lead), legend()];
        for scene in charts::scenes(records) {
            blocks.push(DocBlock::Heading(scene[0].scene.clone(), by_scene::scene_line(scene)));
            blocks.push(DocBlock::Charts("four", charts::sweep(scene, swept)));
            blocks.push(plain(&sweep::reached(scene)));
            let folded = "All settings of this scene".to_string();
            blocks.push(DocBlock::Table(DocTable { folded, ..by_scene::scene_table(scene).0 }));
        }
        return vec![("sweep", "Sweep", blocks), machine];
    }
    let mut answer = answer::blocks(records, &study.environment, study.steps());
    answer.push(DocBlock::Text(Tone::Soft, study.budgets()));
    // Below the table with the answer of each scene.
    let first = answer.iter().position(|block| matches!(block, DocBlock::Table(_))).map_or(0, |i| i + 1);
    answer.insert(first, DocBlock::Table(by_scene::every_solver(records)));
    answer.insert(first, DocBlock::Table(ensemble::table(records)));
    let overview = match charts::overview(records) {
        Some(chart) => vec![
            plain(
                "Small marks: every setting on every scene, in parallel order, at its fastest lane width. Large marks: a solver’s cheapest settings within 2, 1, 0.5, 0.1 and 0.01 times the tolerances of each scene, the larger the stricter, geometric mean over scenes. Names stand at 1 × and say on how many scenes the solver is good enough; hollow marks omit the others. Lower left is better; settings that fail are in the strip “fails” at the right.",
            ),
            legend(),
            DocBlock::Charts("one", vec![chart]),
        ],
        None => vec![plain("No setting holds on any scene.")],
    };
    let mut made =
        vec![("answer", "The answer", answer), ("overview", "Speed against error over all scenes", overview)];
    if let Some((_, first)) = recordings.first() {
        let lead = format!(
            "{} is where the solvers differ most, among scenes small enough to play. Bodies are colored by their deepest overlap; arrows are impulses.",
            first.scene
        );
        let panel = |(bytes, header): &(Vec<u8>, Header)| RecordingPanel {
            bytes: bytes.clone(),
            color: Style::of(&header.solver).color.into(),
            header: header.clone(),
        };
        let panels: Vec<RecordingPanel> = recordings.iter().map(panel).collect();
        let player = DocBlock::Html(fragment(&panels, 0.6));
        made.push(("replay", "Where the solvers differ most: a replay", vec![plain(&lead), player]));
    }
    let mut by_scenes = vec![
        plain(
            "A mark is a setting at its fastest lane width; larger marks are larger budgets, hollow ones file order. Beside those of the front stands the budget, substeps × sweeps. Bars are the quartiles of its blocks of steps. The gray line is the front: settings that no other beats in time and error. The shaded side is within the scene’s tolerance. What fails is at the right edge. Point at a mark for its numbers.",
        ),
        legend(),
    ];
    for scene in charts::scenes(records) {
        let (table, notes) = by_scene::scene_table(scene);
        let folded = "All settings of this scene".to_string();
        by_scenes.extend([
            DocBlock::Heading(scene[0].scene.clone(), bodies(scene[0].bodies)),
            DocBlock::Charts("three", charts::precision(scene)),
            DocBlock::Table(DocTable { folded, ..table }),
            DocBlock::Text(Tone::Bad, notes),
        ]);
    }
    by_scenes.push(DocBlock::Text(Tone::Soft, by_scene::LEGEND.to_string()));
    made.push(("scenes", "Scene by scene", by_scenes));
    let profiles = vec![
        plain(
            "The share of scenes that a solver solves within a factor of the fastest. Upper left is better. Lines that coincide are drawn beside each other.",
        ),
        legend(),
        DocBlock::Charts("three", charts::profiles(records)),
        DocBlock::Table(by_scene::profile_table(records)),
    ];
    made.push(("profiles", "Performance profiles", profiles));
    let compared = by_scene::treatment_tables(records);
    if !compared.is_empty() {
        let tables = compared.into_iter().map(DocBlock::Table).collect();
        made.push(("treatments", "Impacts, frozen contacts and orders", tables));
    }
    let lanes = charts::over_lanes(records);
    if !lanes.is_empty() {
        let lead = "Each solver at the middle one of its budgets in parallel order: speed-up over one lane, and the share of lanes that hold a contact.";
        made.push(("lanes", "Lanes", vec![plain(lead), legend(), DocBlock::Charts("four", lanes)]));
    }
    let lead = "Each solver at the middle one of its budgets and its fastest lane width: median time of each phase (µs), and its share.";
    let phases = std::iter::once(plain(lead)).chain(phases(records)).collect();
    made.push(("phases", "Time per phase", phases));
    let lead = "Constraint sweeps per step, of every kind; settings that hold, in parallel order.";
    let iterations = DocBlock::Charts("four", charts::iterations(records));
    made.push(("iterations", "Iterations against error", vec![plain(lead), legend(), iterations]));
    let cases = match matrix {
        Some(found) => matrix::matrix(found),
        None => vec![plain(
            "Not run. `simpulse verify --json > DIR/verify.json` and then `simpulse study --from DIR` adds it here.",
        )],
    };
    made.push(("verify", "Hard cases with known reference values", cases));
    made.push(machine);
    made
}

/// Median time per phase: a table per scene, a line per solver, shaded by its share.
fn phases(records: &[Record]) -> Vec<DocBlock> {
    let used: Vec<Phase> = Phase::ALL
        .into_iter()
        .filter(|&p| records.iter().any(|r| r.sample.as_ref().is_some_and(|s| s.phase_ns[p as usize] > 0.0)))
        .collect();
    let table = |scene: &[Record]| {
        let mut head = vec!["solver", "setting"];
        head.extend(used.iter().map(|phase| phase.name()));
        let mut rows = DocTable { class: "phases", ..DocTable::new(scene[0].scene.clone(), 2, &head) };
        for record in solvers_of(records).into_iter().filter_map(|solver| charts::standard(scene, solver)) {
            let Some(sample) = &record.sample else { continue };
            let whole: f64 = sample.phase_ns.iter().sum();
            let broken = if record.holds() { "" } else { " ✗" };
            let cell = |&phase: &Phase| {
                let ns = sample.phase_ns[phase as usize];
                let share = (100.0 * ns / whole.max(1.0)).round();
                let css = format!("--share: {share}%");
                let time = if ns > 0.0 { digits(1e-3 * ns) } else { String::new() };
                DocCell { css, title: format!("{share} %"), ..time.into() }
            };
            let setting = DocCell::from(record.setting_text() + broken);
            rows.row([DocCell::solver(record.solver), setting].into_iter().chain(used.iter().map(cell)));
        }
        DocBlock::Table(rows)
    };
    charts::scenes(records).into_iter().map(table).collect()
}

/// The whole page.
fn page(study: &StudyFile, matrix: Option<&VerifyFile>, recordings: &[(Vec<u8>, Header)]) -> String {
    let sections = sections(study, matrix, recordings);
    let e = &study.environment;
    let head = format!(
        "{}, {}, {} settings · {}, {} lanes native · simpulse {}",
        count(charts::scenes(&study.records).len(), "scene"),
        count(solvers_of(&study.records).len(), "solver"),
        study.records.len(),
        e.cpu,
        e.native_lanes,
        e.version,
    );
    let top = [DocBlock::Text(Tone::Soft, head), DocBlock::Text(Tone::Bad, study.caution())];
    let link = |(id, title, _): &Section| format!("<a href=\"#{id}\">{title}</a> ");
    let body = |(id, title, blocks): &Section| {
        format!("<section id=\"{id}\">\n<h2>{title}</h2>\n{}</section>\n", doc::html(blocks))
    };
    let player = if recordings.is_empty() { "" } else { SCRIPT };
    let script = format!("<script>\n{}{player}</script>\n", include_str!("tables.js"));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>simpulse: contact solvers by speed and error\
         </title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{THEME}{}{STYLE}</style>\n</head>\n<body>\n\
         <h1>Which contact solver, how fast, and how wrong?</h1>\n{}<nav>{}</nav>\n{}{script}</body>\n</html>\n",
        include_str!("page.css"),
        doc::html(&top),
        sections.iter().map(link).collect::<String>(),
        sections.iter().map(body).collect::<String>(),
    )
}

fn machine(study: &StudyFile) -> Vec<DocBlock> {
    let e = &study.environment;
    let mut facts = DocTable { class: "facts", ..DocTable::new("", 2, &[]) };
    for (name, value) in [
        ("processor", format!("{}, {} in use", e.cpu, e.processors)),
        ("system", format!("{} on {}", e.architecture, e.system)),
        ("compiler", e.compiler.clone()),
        ("instructions", e.target_features.join(" ")),
        ("native lanes", e.native_lanes.to_string()),
        ("version", format!("{}, commit {}", e.version, e.commit)),
        ("command", study.command.clone()),
    ] {
        facts.row([name.to_string(), value]);
    }
    let settings = escaped(&serde_json::to_string_pretty(&study.settings).unwrap_or_default());
    let settings = format!("<details><summary>Every setting</summary>\n<pre>{settings}</pre></details>\n");
    vec![DocBlock::Table(facts), DocBlock::Html(settings)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record, tolerances};
    use crate::lab::study::{Record, StudyPlan, TruthError};

    fn records() -> Vec<Record> {
        let truth = TruthError { quantity: "load of <ground>", unit: "N", expected: 100.0, error: Some(2e3) };
        let soft = |substeps, time, error| Record {
            solver: "soft_step",
            truth: Some(truth),
            speed_up: Some(3.0),
            tolerances: tolerances().percent(1e7),
            ..record(8, substeps, time, error)
        };
        vec![
            record(8, 1, 10.0, 0.1),
            record(8, 2, 20.0, 0.001),
            record(1, 2, 60.0, 0.001),
            fell(8, 4, 5.0, 0.0),
            failed(8),
            soft(1, 12.0, 0.05),
            soft(2, 25.0, 0.002),
        ]
    }

    fn read(records: &[Record]) -> StudyFile {
        let study = StudyFile::new(&StudyPlan::quick(), records.to_vec(), vec!["arch".into()]);
        StudyFile { command: "simpulse study --quick --scenes 'my scene.json'".into(), ..study }
    }

    /// Whether every opened element is closed, in order; cells and rows may close implicitly.
    fn is_balanced(page: &str) -> bool {
        let mut open: Vec<&str> = Vec::new();
        let optional = ["th", "td", "tr", "meta", "link", "input"];
        for part in page.split('<').skip(1) {
            let Some((tag, _)) = part.split_once('>') else { continue };
            let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap_or("");
            if optional.contains(&name) || tag.starts_with('!') || tag.ends_with('/') {
                continue;
            }
            if tag.starts_with('/') {
                if open.pop() != Some(name) {
                    return false;
                }
            } else {
                open.push(name);
            }
        }
        open.is_empty()
    }

    #[test]
    fn the_page_says_everything_and_loads_nothing() {
        let study = read(&records());
        let page = page(&study, None, &[]);
        for part in [
            "PARTIAL: without arch",
            "every solver on every scene",
            "fell at step 100",
            "blew up at step 7",
            "performance profiles",
            "lanes filled",
            "time per phase",
            "sweeps of a step",
            "speed-up over 1 lane",
            "load of &lt;ground&gt;",
            "2 kN",
            "simpulse study --quick --scenes",
            "media print",
            "simpulse verify --json &gt;",
        ] {
            assert!(page.to_lowercase().contains(&part.to_lowercase()), "{part}");
        }
        for outside in ["http://", "https://", "src=", "@import", "NaN", "<ground>"] {
            assert!(!page.contains(outside), "{outside}");
        }
        assert!(is_balanced(&page));
    }

    #[test]
    fn a_solver_looks_the_same_alone_and_among_others() {
        let all = records();
        let alone: Vec<Record> = all.iter().filter(|r| r.solver == "soft_step").cloned().collect();
        let Style { color, .. } = Style::of("soft_step");
        for records in [&all[..], &alone] {
            let page = page(&read(records), None, &[]);
            assert!(page.contains(&legend([("soft_step", Style::of("soft_step"))])[18..80]), "legend");
            assert!(page.contains(&format!("stroke=\"{}\"", color.to_uppercase())));
        }
        assert_ne!(Style::of("pgs"), Style::of("soft_step"));
    }

    #[test]
    fn the_matrix_is_colored_by_margin() {
        let json = r#"{"cases":[{"case":"A1","what":"slides","required":true}],"results":[
            {"case":"A1","solver":"a","passed":true,"margin":0.5,"measured":1,"reference":1,"tolerance":2},
            {"case":"A1","solver":"b","passed":false,"margin":"inf","reason":"diverged"},
            {"case":"A1","solver":"c","passed":null,"reason":"n/a"}]}"#;
        let text = doc::html(&matrix::matrix(&serde_json::from_str(json).unwrap()));
        for part in ["A1*", ">0.5<", "✗ ∞", "n/a", "measured 1, reference 1 ± 2"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(text.contains("background:#93c1dd"), "{text}");
    }

    #[test]
    fn what_is_no_matrix_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("verify.json"), "{\"cases\": 3}").unwrap();
        let message = write(folder.path(), &read(&records())).unwrap_err().to_string();
        assert!(message.contains("verify.json") && !message.contains('\n'), "{message}");
    }

    #[test]
    fn old_recordings_go_when_new_ones_come() {
        let folder = tempfile::tempdir().unwrap();
        write_recordings(folder.path(), &[vec![1], vec![2]]).unwrap();
        let paths = write_recordings(folder.path(), &[vec![3]]).unwrap();
        assert_eq!(paths, [folder.path().join("replay-1.rec")]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
