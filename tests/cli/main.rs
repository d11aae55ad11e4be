//! The program from the user's point of view: what it rejects, what a small study produces, pictures, recordings and
//! documents. Pages are tested in a real browser if there is one.

mod advise;
mod browser;
mod documents;
mod replay;
mod report;
mod socket;
mod view;

use simpulse::engine::solvers::VARIANTS;
use simpulse::lab::report::study_file::StudyFile;
use simpulse::lab::report::{answer, columns};
use simpulse::lab::study::DEFAULT_SOLVERS;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The program with these words, in a folder.
fn command(folder: &Path, words: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_simpulse"));
    command.current_dir(folder).args(words.split_whitespace());
    command
}

fn simpulse(folder: &Path, words: &str) -> Output {
    command(folder, words).output().unwrap()
}

/// Starts the program and sends it a signal as soon as `is_ready`, or it ends.
#[cfg(unix)]
fn interrupted(folder: &Path, words: &str, signal: &str, is_ready: impl Fn() -> bool) -> Output {
    let mut child = command(folder, words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !is_ready() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Standard error without progress and without the line that warns of a build that does not use the CPU's lanes.
fn errors(output: &Output) -> String {
    let lines = text(&output.stderr)
        .lines()
        .filter(|line| !["this CPU has ", "progress: "].iter().any(|own| line.starts_with(own)));
    lines.map(|line| format!("{line}\n")).collect()
}

/// Runs the program with these words; it must succeed. Returns standard output.
fn succeeds(folder: &Path, words: &str) -> String {
    let output = simpulse(folder, words);
    assert_eq!(output.status.code(), Some(0), "{words}: {}", text(&output.stderr));
    text(&output.stdout).to_string()
}

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Whether `word` occurs in `text` as a separate word: `nan` on its own, but not in `dominant`.
fn has_word(text: &str, word: &str) -> bool {
    let lower = text.to_lowercase();
    lower.split(|c: char| !c.is_ascii_alphanumeric()).any(|part| part == word)
}

/// Checks for exit code 2, one line on standard error that begins with `error:` and contains `parts`, no
/// standard output, and no new file.
fn refused(folder: &Path, words: &str, parts: &[&str]) {
    let before = entries(folder);
    let output = simpulse(folder, words);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}: {message}");
    assert!(message.starts_with("error: ") && message.trim_end().lines().count() == 1, "{words}: {message}");
    for part in parts {
        assert!(message.contains(part), "{words}: '{part}' is not in: {message}");
    }
    assert!(output.stdout.is_empty(), "{words}: {}", text(&output.stdout));
    assert_eq!(entries(folder), before, "{words}");
}

#[test]
fn a_scene_in_pixels_is_told_to_set_its_length_unit() {
    let folder = tempfile::tempdir().unwrap();
    for (unit, is_told) in [("1", true), ("100", false)] {
        let bodies = r#"[{"type": "dynamic", "position": [0, 0], "shapes": [{"circle": {"radius": 50}}]}]"#;
        let scene = format!(r#"{{"name": "x", "steps": 1, "length_unit": {unit}, "bodies": {bodies}}}"#);
        std::fs::write(folder.path().join("x.json"), scene).unwrap();
        let told = errors(&simpulse(folder.path(), "run x.json"));
        assert_eq!(told.contains("set \"length_unit\""), is_told, "{told}");
    }
}

#[test]
fn copies_have_errors_by_the_names_of_a_single_run() {
    let folder = tempfile::tempdir().unwrap();
    let errors = |request: &str| {
        let json: serde_json::Value = serde_json::from_str(&succeeds(folder.path(), request)).unwrap();
        json["errors"].as_object().unwrap().clone()
    };
    let (one, all) =
        (errors("run stack:2@1 --steps 30 --json"), errors("run stack:2 --copies 1 --steps 30 --json"));
    assert_eq!(all.len(), 5);
    for (name, figure) in all {
        assert_eq!((&figure["mean"], &figure["copies"][0]), (&one[&name], &one[&name]), "{name}");
    }
}

#[test]
fn bad_requests_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let table: &[(&str, &[&str])] = &[
        ("run staack", &["unknown scene 'staack'", "'stack'"]),
        ("run stack:x", &["'x'", "stack"]),
        ("run stack:0", &["'0'"]),
        ("list arhc --json", &["'arch'"]),
        (
            "run stack:2 --solver softstep",
            &["'softstep'", "'soft_step'", "[possible values: projection, pgs, "],
        ),
        ("run stack:2 --lanes 5", &["lanes", "5", "1, 4, 8, 16"]),
        ("converge stack:2 --lanes 3", &["lanes", "3", "1, 4, 8, 16"]),
        ("profile stack:2 --seconds nan", &["seconds", "NaN"]),
        ("verify --cases B9.gapp", &["'B9.gapp'", "'B9.gap'"]),
        ("verify --random dropz:17", &["'dropz'", "'drops'"]),
        ("verify --random 0", &["--random", "'0'", "1000000"]),
        ("verify --keep failed", &["--random"]),
        ("verify --list --frozen off", &["--list", "--frozen"]),
        ("verify --list --substeps 4", &["--list", "--substeps"]),
        ("verify --cases A5 --random 5", &["--cases", "--random"]),
        ("verify --list --random 5", &["--list", "--random"]),
        ("verify --cases A5 --pace 3", &["--cases", "--pace"]),
        ("verify --list --seed 2", &["--list", "--seed"]),
        ("verify --solvers pgs --without all", &["pgs", "shim"]),
        ("torture", &["simpulse verify --random N"]),
        ("completions tcsh", &["tcsh", "bash", "fish", "zsh"]),
        ("scene", &["simpulse list SCENE"]),
        ("list solvers --seed 2", &["seed", "solvers"]),
        ("run stack:2@7 --seed 5", &["seed", "5", "'stack:2@7'", "7", "'stack:2'"]),
        ("list stack:2@7 --seed 5", &["seed", "5", "'stack:2@7'", "7"]),
        ("profile stack:2@7 --seed 5", &["seed", "5", "'stack:2@7'", "7"]),
        ("run stack:2 --order natral", &["'natral'", "file", "'parallel'"]),
        ("run stack:2 --order natural --lanes 8", &["lanes", "8"]),
        ("run stack:2 --substeps 0", &["substeps", "0"]),
        ("run stack:2 --substeps 10001", &["substeps", "10001"]),
        ("run stack:2 --solver soft_step --set contact_hertz=-3", &["contact_hertz", "-3"]),
        ("study --set contact_hertz=nan", &["contact_hertz", "NaN"]),
        ("--quick --scenes staack", &["unknown scene 'staack'", "'stack'"]),
        ("study --scenes=", &["--scenes: the list is empty"]),
        ("study --solvers=", &["--solvers: the list is empty"]),
        ("study --lanes=", &["--lanes: the list is empty"]),
        ("study --scenes arch,,stack", &["--scenes: a value between the commas is empty"]),
        ("verify --cases=", &["--cases: the list is empty"]),
        ("run arch --lanes=", &["--lanes: the value is empty"]),
        ("study --sweep contact-herz=30", &["'contact_herz'", "'contact_hertz'", "mass_ratio"]),
        ("study --sweep dt=", &["list of values of dt is empty"]),
        ("study --sweep dt=5furlongs", &["'furlongs'", "ms"]),
        ("study --solvers pgs --sweep contact-hertz=30", &["pgs", "soft_step"]),
        ("study --scenes arch --sweep mass-ratio=10", &["'arch'", "mass_ratio"]),
        ("study --scenes mass_ratio --sweep mass-ratio=0", &["'0'", "1 to 10000"]),
        ("run stack:2 --substeps -1", &["-1"]),
        ("run stack:2 --substeps 4.5", &["4.5"]),
        ("run stack:2 --solver pgs --velocity-iterations 0", &["velocity_iterations", "pgs"]),
        ("run stack:2 --dt 0", &["dt", "0"]),
        ("run stack:2 --dt -0.1", &["dt", "-0.1"]),
        ("run stack:2 --dt nan", &["dt"]),
        ("run stack:2 --poke x", &["--poke", "'x'"]),
        ("run stack:2 --poke 1 --record r.html", &["--poke", "--record"]),
        ("run stack:2 --steps 0", &["steps", "0"]),
        ("run stack:2 --every 0 --state s.csv", &["every", "0"]),
        ("run stack:2 --every 5", &["every", "--state"]),
        ("run stack:2 --state a.csv --contacts a.csv", &["same file"]),
        ("run stack:2 --contacts a.csv --joints a.csv", &["--joints", "file as --contacts"]),
        ("run missing.json", &["missing.json"]),
        ("run stack:2 --state no/such/folder/s.csv", &["no/such/folder/s.csv"]),
        ("run stack:2 --statte s.csv", &["--statte"]),
        ("study --scenes stack:2,pyramidd", &["'pyramidd'", "'pyramid'"]),
        ("study --solvers pgs,sof_step", &["'sof_step'", "'soft_step'"]),
        ("study --lanes 1,2", &["lanes", "'2'"]),
        ("study --substeps 2,0", &["substeps", "0"]),
        ("study --velocity-iterations 0", &["velocity_iterations", "0"]),
        ("study --scenes stack,stack:20", &["scenes", "'stack:20'"]),
        ("study --repeats 0", &["repeats", "0"]),
        ("study --steps 0", &["steps", "0"]),
        ("study --tolerance penetration=5", &["tolerance", "'5'", "unit"]),
        ("study --tolerance penetraton=5mm", &["'penetraton'", "'penetration'"]),
        ("study --tolerance 5mm", &["tolerance", "'5mm'"]),
        ("studdy", &["studdy"]),
    ];
    for (args, parts) in table {
        refused(folder.path(), args, parts);
    }
}

#[test]
fn bad_scene_files_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let body = |shape: &str| {
        format!(r#"{{"name":"x","bodies":[{{"type":"dynamic","position":[0,0],"shapes":[{shape}]}}]}}"#)
    };
    let files = [
        ("malformed.json", "{".to_string(), "line 1"),
        ("key.json", r#"{"name":"x","bodies":[],"gravitty":[0,0]}"#.to_string(), "gravitty"),
        (
            "concave.json",
            body(r#"{"polygon":{"points":[[0,0],[2,0],[0.5,0.5],[0,2]]}}"#),
            "bodies[0].shapes[0]",
        ),
    ];
    for (name, content, _) in &files {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    for (name, _, part) in &files {
        refused(folder.path(), &format!("run {name} --state s.csv"), &[name, part]);
        refused(folder.path(), &format!("study --scenes {name} --quick"), &[name, part]);
    }
}

#[test]
fn a_trace_has_the_phases_of_every_step_without_gaps() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let printed = succeeds(path, "run smash --steps 40 --trace t.json");
    assert!(printed.contains("wrote t.json"), "{printed}");
    let trace: serde_json::Value =
        serde_json::from_slice(&std::fs::read(path.join("t.json")).unwrap()).unwrap();
    let all: Vec<&serde_json::Value> = trace["traceEvents"].as_array().unwrap().iter().collect();
    let spans: Vec<_> = all.iter().filter(|e| e["ph"] == "X").collect();
    let is_step = |e: &serde_json::Value| e["name"].as_str().unwrap().starts_with("step ");
    let number = |e: &serde_json::Value, name: &str| e[name].as_f64().unwrap();
    assert_eq!(spans.iter().filter(|e| is_step(e)).count(), 40);
    let mut end = 0.0;
    for step in spans.chunk_by(|_, next| !is_step(next)) {
        assert!(is_step(step[0]) && (number(step[0], "ts") - end).abs() < 1e-6 && step.len() > 5);
        for phase in &step[1..] {
            assert!((number(phase, "ts") - end).abs() < 1e-6 && number(phase, "dur") > 0.0, "{phase}");
            end += number(phase, "dur");
        }
        assert!((number(step[0], "ts") + number(step[0], "dur") - end).abs() < 1e-6);
    }
    refused(path, "run smash --trace no/such/t.json", &["no/such/t.json"]);
    refused(path, "run smash --trace t.csv --state t.csv", &["same file"]);
    refused(path, "run smash --trace t2.json --every 2", &["every"]);
}

#[test]
fn a_poked_run_says_what_the_pushes_did() {
    let folder = tempfile::tempdir().unwrap();
    let run = |options: &str| -> serde_json::Value {
        serde_json::from_str(&succeeds(folder.path(), &format!("run stack:6 --steps 600 --json {options}")))
            .unwrap()
    };
    let (still, poked) = (run(""), run("--poke 5"));
    assert!(still["poked"].is_null());
    assert_eq!((&poked["holds"], &poked["poked"]["seed"]), (&"yes".into(), &5.into()));
    // In 5 s, one every 0.1 to 0.5 s.
    assert!((10..=50).contains(&poked["poked"]["pushes"].as_u64().unwrap()), "{poked}");
    let [rms, most] =
        ["displaced_rms_m", "displaced_max_m"].map(|name| poked["poked"][name].as_f64().unwrap());
    assert!(0.0 < rms && rms <= most && most < 0.1, "{poked}");
    assert_eq!(poked["bits_equal"], true);
    assert_eq!(run("--poke 5")["poked"], poked["poked"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_before_the_study() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("taken"), "").unwrap();
    // The default study would take much longer than this test is allowed to.
    refused(folder.path(), "study --out taken", &["taken"]);
    refused(folder.path(), "study --out taken/below", &["taken"]);
}

#[test]
fn a_run_that_diverges_says_where_and_when_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scene = r#"{"name":"fast","bodies":[
        {"type":"static","position":[0,0],"shapes":[{"circle":{"radius":1}}]},
        {"type":"dynamic","position":[5,0],"velocity":[200000,0],"shapes":[{"circle":{"radius":1}}]}]}"#;
    std::fs::write(folder.path().join("fast.json"), scene).unwrap();
    let output = simpulse(folder.path(), "run fast.json --state s.csv --every 1");
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(
        message.contains("step 1") && message.contains("body 1") && message.contains("2.000e5"),
        "{message}"
    );
    assert_eq!(entries(folder.path()), ["fast.json"]);

    let table = &succeeds(folder.path(), "study --scenes fast.json --quick --lanes 1 --out r");
    assert!(table.contains("fast: no setting holds"), "{table}");
    let tables = std::fs::read_to_string(folder.path().join("r/tables.txt")).unwrap();
    assert!(tables.contains("failed") && tables.contains("diverged at step 1: body 1"), "{tables}");
    assert!(!has_word(table, "nan") && !has_word(table, "inf"));
}

#[test]
fn a_small_study_leaves_whole_files() {
    let folder = tempfile::tempdir().unwrap();
    let options = "--scenes stack:3,bounce --standard --lanes 1,8 --steps 40 --repeats 1 --out a/b";
    let answer = succeeds(folder.path(), &format!("study {options}"));
    let out = folder.path().join("a/b");
    let kept: Vec<String> = entries(&out).into_iter().filter(|n| !n.starts_with("replay-")).collect();
    let names = ["report.html", "study.csv", "study.json", "tables.txt", "tidy.csv"];
    assert_eq!(kept, names);

    let mut reader = csv::Reader::from_path(out.join("study.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    // Two scenes, one of which bounces and also runs with waves of impacts; × all solvers of the default
    // list × 3 budgets × (natural order and 2 widths).
    assert_eq!(rows.len(), 3 * DEFAULT_SOLVERS.len() * 3 * 3);
    for row in &rows {
        for name in [
            "mean_step_us",
            "median_step_us",
            "longest_step_us",
            "penetration_max_m",
            "residual_rms_lighter_weights",
            "momentum",
            "sweeps",
            "occupancy",
        ] {
            let value: f64 = row[column(name)].parse().unwrap();
            assert!(value.is_finite() && value >= 0.0, "{name} {value}");
        }
        assert_eq!(&row[column("bits_equal")], "true");
    }
    let csv_text = std::fs::read_to_string(out.join("study.csv")).unwrap();

    let json_text = std::fs::read_to_string(out.join("study.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json_text).unwrap();
    assert_eq!(json["records"].as_array().unwrap().len(), rows.len());
    for key in ["cpu", "compiler", "target_features", "version"] {
        assert!(!json["environment"][key].is_null(), "{key}");
    }
    assert!(json["environment"]["compiler"].as_str().unwrap().starts_with("rustc 1."));
    assert_eq!(json["settings"]["repeats"], 1);

    for text in [csv_text.as_str(), &json_text, &answer] {
        assert!(!has_word(text, "nan") && !has_word(text, "inf"), "{text}");
    }
    assert!(answer.contains("The cheapest setting that is good enough") && answer.lines().count() <= 60);

    // The printed answer follows from the records alone.
    let study = StudyFile::read(&out).unwrap();
    assert!(answer.starts_with(&answer::text(&study.records, &study.environment, Some(40))), "{answer}");
}

/// The answer fits on one page for the default study too, whatever the number of solvers.
#[test]
fn the_answer_comes_first_and_fills_a_page_at_most() {
    let folder = tempfile::tempdir().unwrap();
    let output = simpulse(folder.path(), "--quick --scenes stack:3,bounce,arch --lanes 8");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(errors(&output).is_empty(), "{}", text(&output.stderr));
    let answer = text(&output.stdout);
    let tables = std::fs::read_to_string(folder.path().join("results/tables.txt")).unwrap();
    assert!(answer.lines().count() <= 60 && answer.contains("Ranking over all 3 scenes"), "{answer}");
    assert!(tables.contains("speed-up: over 1 lane") && tables.contains("Performance profiles"));
    let widest = answer.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(120), "{answer}");
}

#[test]
fn a_sweep_leaves_a_curve_per_solver() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("o");
    let words =
        "--quick --scenes stack:3 --solvers pgs,soft_step,tgs_soft --sweep contact-hertz=60,15,30 --out o";
    let output = simpulse(folder.path(), words);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(errors(&output), "skipped, without contact_hertz: pgs\n");
    let shown = text(&output.stdout);
    let lines = shown.lines().filter(|line| line.starts_with("soft_step ") || line.starts_with("tgs_soft "));
    assert_eq!(lines.count(), 2 * 3, "{shown}");

    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("--sweep contact-hertz=60,15,30") && page.contains("contact_hertz"), "{page}");
    let study = StudyFile::read(&out).unwrap();
    let values: Vec<f64> = study.records.iter().filter_map(|r| Some(r.swept?.value)).collect();
    assert_eq!(values, [15.0, 15.0, 30.0, 30.0, 60.0, 60.0]);
    // A softer contact sags more.
    let depth = |i: usize| study.records[i].errors.unwrap().penetration_max();
    assert!(depth(0) > depth(2), "{} {}", depth(0), depth(2));

    // The step changes, the duration does not.
    succeeds(folder.path(), "study --scenes stack:2 --solvers pgs --sweep dt=10ms,0.02 --out dt");
    let study = StudyFile::read(&folder.path().join("dt")).unwrap();
    let runs: Vec<(f64, u64)> = study.records.iter().map(|r| (r.dt, r.errors.unwrap().steps)).collect();
    assert_eq!(runs, [(0.01, 500), (0.02, 250)]);

    // Repeating the sweep gives the same errors.
    let compared = simpulse(folder.path(), "compare o o --json");
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(compared["pairs"].as_array().unwrap().len(), 6);
}

/// The header of a CSV file.
fn header(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap().lines().next().unwrap().to_string()
}

#[test]
fn every_csv_header_is_documented() {
    let folder = tempfile::tempdir().unwrap();
    for words in [
        "study --quick --scenes stack:2 --solvers pgs --lanes 1 --out o",
        "converge stack:3 --step 20 --solvers pgs --repeats 0 --out o",
        "run stack:2 --steps 3 --state o/state.csv --contacts o/contacts.csv",
        "run four_bar --steps 3 --joints o/joints.csv",
    ] {
        succeeds(folder.path(), words);
    }
    let files = entries(&folder.path().join("o"));
    let written: Vec<&String> = files.iter().filter(|name| name.ends_with(".csv")).collect();
    assert_eq!(written.len(), columns::SHEETS.len(), "{written:?}");
    for name in written {
        let header = header(&folder.path().join("o").join(name));
        let names: Vec<&str> = header.split(',').collect();
        let documented = columns::SHEETS.iter().any(|sheet| sheet.documents(&names));
        assert!(documented, "{name}: {header}");
    }
    let shown = simpulse(folder.path(), "list columns");
    assert!(
        text(&shown.stdout).contains("penetration_judged_m")
            && text(&shown.stdout).contains("tangent_impulse")
    );
}

#[test]
fn data_is_printed_as_json_where_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let json = |words: &str| -> serde_json::Value {
        let output = simpulse(folder.path(), words);
        let shown = text(&output.stdout);
        serde_json::from_str(shown)
            .unwrap_or_else(|e| panic!("{words}: {e}: {shown}{}", text(&output.stderr)))
    };
    assert_eq!(json("run stack:2 --steps 9 --json")["errors"]["steps"], 9);
    assert_eq!(json("list solvers --json").as_array().unwrap().len(), VARIANTS.len());
    assert_eq!(json("list arch --json")["name"], "arch");
    assert_eq!(json("list schema")["title"], "simpulse scene");
    assert!(json("list columns --json")[0]["columns"].is_array());
    assert!(json("list scenes --json").is_array());
    assert!(json("verify --list --json").as_array().unwrap().len() > 50);
    let cells = json("verify --cases A0 --solvers pgs --json");
    assert_eq!(cells["results"][0]["passed"], true);
    let converge = "converge stack:3 --solvers pgs --repeats 0 --json";
    assert!(json(converge)["gauss_seidel_rate"].as_f64().unwrap() < 1.0);
    let frozen = json("converge stack:3 --freeze s.frozen --json");
    assert!(frozen["certificate"].is_object(), "{frozen}");
    let profile = "profile stack:5 --seconds 0.2 --settle 3 --json";
    assert!(json(profile)["phases"][0]["limit"].is_string());
    let features =
        json("study --scenes stack:2 --solvers pgs --features all --repeats 1 --out features --json");
    let records = features["records"].as_array().unwrap();
    let at = |i: usize, key: &str| records[i]["sample"]["load"][key].as_f64().unwrap();
    // A stack needs no restitution, and records with it are larger.
    assert!(records.len() == 2 && at(0, "bytes_per_contact") < at(1, "bytes_per_contact"));
    assert_eq!((at(0, "contacts"), &records[0]["errors"]), (at(1, "contacts"), &records[1]["errors"]));
    let sizes =
        json("study --scenes stack --solvers pgs --sweep size=2,4 --repeats 1 --steps 20 --out sizes --json");
    assert_eq!(sizes["records"][1]["bodies"].as_u64(), Some(5));
    let advise =
        "advise stack:3 --max-penetration 20mm --steps 40 --repeats 1 --solvers pgs,soft_step --json";
    assert!(json(advise)["trials"].is_array());
    let study = "--quick --scenes stack:2 --solvers pgs --lanes 1 --json";
    assert_eq!(json(study)["records"].as_array().unwrap().len(), 3 * 2);
}

#[test]
fn advice_ends_with_the_command_that_repeats_it() {
    let folder = tempfile::tempdir().unwrap();
    let words = "advise stack:3 --max-penetration 20mm --steps 40 --repeats 1 --solvers soft_step";
    let output = simpulse(folder.path(), words);
    let last = text(&output.stdout).lines().last().unwrap();
    let command = last.strip_prefix("to run it: simpulse ").unwrap_or_else(|| panic!("{last}"));
    let run = succeeds(folder.path(), command);
    assert!(run.contains("soft_step"), "{run}");
}

#[test]
fn shells_complete_options_and_their_values() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let output = simpulse(folder.path(), &format!("completions {shell}"));
        let script = text(&output.stdout);
        for word in ["--solvers", "soft_step", "converge", "--freeze"] {
            let word = if shell == "fish" { word.trim_start_matches("--") } else { word };
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

/// A disc of 1 kg hinged to the world at its center, with a motor too weak for its target speed; another disc
/// on a slack spring; and two bodies that do not collide.
const MACHINE: &str = r#"{"name":"machine","bodies":[
    {"type":"static","position":[0,0],"shapes":[{"circle":{"radius":0.1}}]},
    {"type":"dynamic","position":[0,0],"shapes":[{"circle":{"radius":1},"density":0.3183098861837907}]},
    {"type":"dynamic","position":[9,0],"shapes":[{"circle":{"radius":1},"density":0.3183098861837907}]}],
    "joints":[
    {"revolute":{"a":0,"b":1,"motor":{"speed":50,"max":0.25},"limits":[-1,99],"break_load":[9,9]}},
    {"distance":{"a":0,"b":2,"anchor_a":[9,0],"length":0,"spring":{"hertz":0,"damping_ratio":0},"break_load":[9,9]}},
    {"filter":{"a":1,"b":2}}]}"#;

#[test]
fn a_run_writes_what_its_joints_bear() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("machine.json"), MACHINE).unwrap();
    let run = "run machine.json --solver pgs --steps 8 --joints j.csv --every 4 --all";
    let printed = succeeds(folder.path(), run);
    let figure = |name: &str| -> f64 {
        let found = printed.lines().find_map(|l| l.trim().strip_prefix(name));
        let found = found.unwrap_or_else(|| panic!("{name}: {printed}"));
        found.split_whitespace().next().unwrap().parse().unwrap()
    };
    assert!(figure("joint_residual_rms_lighter_weights") < 1e-5);
    assert!((figure("joint_motor_load_max") - 1.0).abs() < 1e-3);
    let sheet = std::fs::read_to_string(folder.path().join("j.csv")).unwrap();
    let lines: Vec<Vec<&str>> = sheet.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines[0], columns::JOINTS.names());
    let line = |step: &str, joint: &str| lines.iter().find(|l| l[0] == step && l[1] == joint).unwrap();
    let at = |line: &[&str], name: &str| -> Option<f64> {
        let cell = line[columns::JOINTS.names().iter().position(|n| *n == name).unwrap()];
        (!cell.is_empty()).then(|| cell.parse().unwrap())
    };
    assert_eq!(lines.len(), 1 + 2 * 3);
    let hinge = line("8", "0");
    assert_eq!(hinge[2..5], ["revolute", "0", "1"]);
    let close = |name: &str, expected: f64| {
        let found = at(hinge, name).unwrap();
        assert!((found - expected).abs() < 1e-4 * expected.abs() + 1e-6, "{name}: {found} is not {expected}");
    };
    let dt = 1.0 / 60.0;
    // 1 kg under 10 m/s², above the break load. The motor gives its maximum torque and turns the disc of
    // ½ kg·m².
    close("rigid_1", 0.0);
    close("rigid_2", 10.0 * dt);
    close("motor", 0.25 * dt);
    close("lower", 0.0);
    close("upper", 0.0);
    close("force", 10.0);
    close("torque", 0.25);
    close("angle", 0.25 / 0.5 * dt * dt * 36.0);
    close("gap", 0.0);
    for none in ["rigid_angle", "spring_1", "spring_2", "spring_angle"] {
        assert_eq!(at(hinge, none), None, "{none}");
    }
    assert_eq!(hinge.last(), Some(&"true"));
    // A spring without stiffness carries no load, and its anchors separate by the distance of the fall.
    let spring = line("4", "1");
    assert_eq!(
        (at(spring, "spring_1"), at(spring, "force"), spring.last()),
        (Some(0.0), Some(0.0), Some(&"false"))
    );
    assert!((at(spring, "translation").unwrap() - 10.0 * dt * dt * 10.0).abs() < 1e-5, "{spring:?}");
    assert_eq!(line("4", "2")[2..5], ["filter", "1", "2"]);
}

#[test]
fn a_run_writes_its_columns_at_the_steps_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let output = succeeds(folder.path(), "run stack:3 --steps 25 --every 10 --state s.csv --contacts c.csv");
    let all = succeeds(folder.path(), "run stack:3 --steps 25 --all");
    for phase in ["pairs", "collide", "prepare", "solve", "relax", "integrate", "store", "penetration"] {
        assert!(all.contains(phase), "{phase}");
    }
    // Without --all: eight figures in three groups.
    let figures = output.lines().filter(|line| line.starts_with("  ")).count();
    assert_eq!(figures, 8, "{output}");
    let state = std::fs::read_to_string(folder.path().join("s.csv")).unwrap();
    let lines: Vec<&str> = state.lines().collect();
    assert_eq!(lines[0], "step,time,body,x,y,angle,vx,vy,omega");
    // Steps 10 and 20 of the ground and three boxes.
    assert_eq!(lines.len(), 1 + 2 * 4);
    let first: Vec<&str> = lines[2].split(',').collect();
    assert_eq!((first[0], first[2], first.len()), ("10", "1", 9));
    assert!((first[1].parse::<f64>().unwrap() - 10.0 / 60.0).abs() < 1e-15);

    let contacts = std::fs::read_to_string(folder.path().join("c.csv")).unwrap();
    let mut lines = contacts.lines();
    let header = "step,body_a,body_b,feature,px,py,nx,ny,separation,normal_impulse,tangent_impulse";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|c| c.parse().unwrap()).collect()).collect();
    // Two points under each of three boxes, at two steps.
    assert_eq!(rows.len(), 2 * 3 * 2);
    // The ground carries three boxes of 10 N for 1/60 s. The columns settle by millimeters, which changes the
    // load by less than a tenth.
    let ground: f64 = rows.iter().filter(|r| r[0] == 20.0 && r[1] == 0.0).map(|r| r[9]).sum();
    assert!((ground - 0.5).abs() < 0.05, "{ground}");
    // The points under the lowest box are its corners, on the ground.
    for row in rows.iter().filter(|r| r[1] == 0.0) {
        assert!((row[4].abs() - 0.5).abs() < 0.02 && row[5].abs() < 0.02 && row[7] == 1.0, "{row:?}");
    }
}

#[test]
fn lists_and_scenes_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    let solvers = simpulse(folder.path(), "list solvers");
    let (list, parameters) = text(&solvers.stdout).split_once("\n\n").unwrap();
    assert_eq!(list.lines().count(), 1 + VARIANTS.len());
    for parameter in VARIANTS.iter().flat_map(|v| v.parameters) {
        assert!(
            parameters.contains(parameter.name) && parameters.contains(parameter.meaning),
            "{parameter:?}"
        );
    }
    let scenes = simpulse(folder.path(), "list scenes");
    assert_eq!(text(&scenes.stdout).lines().count(), simpulse::lab::scenes::CATALOG.len());

    // A printed scene can be read, and prints the same text again.
    let printed = simpulse(folder.path(), "list card_house --json").stdout;
    std::fs::write(folder.path().join("house.json"), &printed).unwrap();
    assert_eq!(simpulse(folder.path(), "list house.json --json").stdout, printed);

    let help = simpulse(folder.path(), "--help");
    assert_eq!(help.status.code(), Some(0));
    assert!(text(&help.stdout).contains("Examples:"));
}

#[test]
fn the_default_study_names_scenes_that_exist() {
    simpulse::lab::study::StudyPlan::default().check().unwrap();
    simpulse::lab::study::StudyPlan::quick().check().unwrap();
}

#[test]
fn a_scene_that_was_printed_falls_as_its_own_does() {
    let folder = tempfile::tempdir().unwrap();
    let printed = simpulse(folder.path(), "list stack:20 --json").stdout;
    std::fs::write(folder.path().join("st.json"), &printed).unwrap();
    let run = |scene: &str| {
        let words = format!("run {scene} --solver pgs --steps 1200 --json");
        serde_json::from_str::<serde_json::Value>(&succeeds(folder.path(), &words)).unwrap()
    };
    let (own, file) = (run("stack:20"), run("st.json"));
    for key in ["holds", "failed_step", "reference", "errors"] {
        assert_eq!(own[key], file[key], "{key}");
    }
    assert!(own["holds"] == "fell" && own["failed_step"].as_u64() > Some(1), "{}", own["holds"]);
    assert_eq!(own["bits_equal"], true);
    assert_eq!(own["impacts"], "own");
    // If a file states no conditions, the answer states that nothing was checked.
    let bare =
        r#"{"name":"b","bodies":[{"type":"dynamic","position":[0,0],"shapes":[{"circle":{"radius":1}}]}]}"#;
    std::fs::write(folder.path().join("bare.json"), bare).unwrap();
    let told = succeeds(folder.path(), "run bare.json --steps 5");
    assert!(told.contains("not checked: conditions and reference values"), "{told}");
}

#[test]
fn what_a_solver_ignores_is_refused_with_who_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let relax = "run stack:2 --solver pgs --relax-iterations 3";
    refused(folder.path(), relax, &["--relax-iterations", "pgs", "soft_step"]);
    let hertz = "run stack:2 --solver pgs --set contact_hertz=60";
    refused(folder.path(), hertz, &["contact_hertz", "pgs", "soft_step"]);
    // If some solvers lack the parameter, a line names them.
    let output = simpulse(
        folder.path(),
        "study --quick --scenes stack:2 --solvers pgs,soft_step --lanes 1 --set contact_hertz=60",
    );
    assert_eq!(errors(&output), "contact_hertz has no effect on pgs\n");
}

#[test]
fn a_part_that_is_missing_and_a_folder_in_use_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for i in 1..=3 {
        let options = "--quick --scenes stack:2,stack:3,stack:4 --solvers pgs --lanes 1";
        succeeds(folder.path(), &format!("{options} --shard {i}/3 --out part-{i}"));
    }
    refused(folder.path(), "study --merge part-1 part-3", &["stack:3", "--partial"]);
    succeeds(folder.path(), "study --merge part-1,part-2,part-3 --out whole");

    let lock = simpulse::lab::files::Lock::of(&folder.path().join("whole")).unwrap();
    let words = "--quick --scenes stack:2 --solvers pgs --lanes 1 --out whole";
    refused(folder.path(), words, &["whole", "another study"]);
    drop(lock);

    // A folder of an older program version is rejected, and the version is named.
    std::fs::write(folder.path().join("whole/study.json"), r#"{"environment":{"version":"0.0.1"}}"#).unwrap();
    refused(folder.path(), "study --from whole", &["schema version 1", "0.0.1"]);
    refused(folder.path(), "report whole", &["simpulse study --from DIR"]);
}

/// Names and contents of a study's files that do not depend on times.
fn errors_of(folder: &Path) -> Vec<String> {
    let study = StudyFile::read(folder).unwrap();
    study.records.iter().map(|r| format!("{} {} {:?}", r.scene, r.budget_text, r.errors)).collect()
}

#[test]
fn no_study_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut kept = Vec::new();
    for (i, scene) in ["stack:2", "stack:2", "stack:3"].into_iter().enumerate() {
        let told = succeeds(path, &format!("--quick --solvers pgs --lanes 1 --out o --scenes {scene}"));
        let said = format!("the study that was there is now in o/previous/{i}");
        assert_eq!(told.contains(&said), i > 0, "{told}");
        kept.push(std::fs::read(path.join("o/study.json")).unwrap());
    }
    for (i, bytes) in kept[..2].iter().enumerate() {
        let place = path.join(format!("o/previous/{}", i + 1));
        assert_eq!(std::fs::read(place.join("study.json")).unwrap(), *bytes);
        assert!(place.join("report.html").exists());
    }
    // A merge that is typed wrongly replaces nothing either.
    let merged = simpulse(path, "study --merge o --out o");
    assert!(text(&merged.stdout).contains("o/previous/3"), "{}", text(&merged.stderr));
}

#[test]
fn a_study_goes_on_where_it_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let study =
        |out: &str| format!("--quick --solvers pgs --lanes 1 --scenes stack:2,stack:3,stack:4 --out {out}");
    succeeds(path, &study("whole"));
    refused(path, &study("none --resume"), &["none"]);
    // As if it had been stopped after the first scene.
    std::fs::create_dir(path.join("part")).unwrap();
    let mut part = StudyFile::read(&path.join("whole")).unwrap();
    part.records.retain(|r| r.scene == "stack:2");
    part.missing_scenes = vec!["stack:3".into(), "stack:4".into()];
    std::fs::write(path.join("part/study.json"), part.to_json().unwrap()).unwrap();
    refused(path, &study("part --resume --repeats 2"), &["repeats is 1 there, 2 here"]);
    succeeds(path, &study("part --resume"));
    assert_eq!(errors_of(&path.join("part")), errors_of(&path.join("whole")));
    let study = StudyFile::read(&path.join("part")).unwrap();
    assert!(study.missing_scenes.is_empty() && study.parts.len() == 2);
    assert_eq!(
        study.records[0].sample.as_ref().unwrap().mean_ns,
        part.records[0].sample.as_ref().unwrap().mean_ns
    );
    assert!(!path.join("part/previous").exists());
}

#[cfg(unix)]
#[test]
fn what_a_stopped_study_has_finished_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let study = "study --scenes stack:2,pyramid:60 --solvers shim --steps 60 --out o";
    let output = interrupted(path, study, "-TERM", || path.join("o/report.html").exists());
    let message = text(&output.stderr);
    assert_eq!(
        (output.status.code(), message.contains("1 of 2 scenes are in o")),
        (Some(130), true),
        "{message}"
    );
    let study = StudyFile::read(&path.join("o")).unwrap();
    assert_eq!((study.scenes(), study.missing_scenes), (vec!["stack:2".into()], vec!["pyramid:60".into()]));
    assert!(entries(&path.join("o")).iter().all(|name| !name.starts_with('.')));
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_was_there_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("old")).unwrap();
    std::fs::write(path.join("old/replay-1.rec"), "of before").unwrap();
    for out in ["old", "new/inner"] {
        // The folder is in use as soon as the study has begun.
        let files = || std::fs::read_dir(path.join(out)).map_or(0, |all| all.count());
        let is_used = || files() > usize::from(out == "old");
        let study = format!("study --scenes pyramid:60 --solvers shim --out {out}");
        let output = interrupted(path, &study, "-INT", is_used);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(130), "{message}");
        assert!(message.contains("nothing written"), "{message}");
    }
    assert_eq!(std::fs::read_to_string(path.join("old/replay-1.rec")).unwrap(), "of before");
    assert_eq!(std::fs::read_dir(path.join("old")).unwrap().count(), 1);
    assert!(!path.join("new").exists());
}

#[test]
fn a_sweep_says_which_values_are_the_same_run() {
    let folder = tempfile::tempdir().unwrap();
    let words = "study --quick --scenes stack:2 --solvers soft_step --sweep contact-hertz=15,30,60,120";
    let text = succeeds(folder.path(), words);
    assert!(text.contains("30, 60, 120 Hz give the same run"), "{text}");
}
