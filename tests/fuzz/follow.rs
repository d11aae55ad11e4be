//! The checks that an input must pass, and its allowed outcomes.

use super::bytes;
use super::harness::Random;
use super::values;
use rand::{RngExt, SeedableRng};
use simpulse::engine::broadphase::BroadPhaseKind;
use simpulse::engine::constraints::kernels::motion::{Integrator, RotationUpdate};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::VARIANTS;
use simpulse::engine::world::{Order, Settings, World};
use simpulse::lab::capture::capture;
use simpulse::lab::chart::Style;
use simpulse::lab::converge::{self, ConvergeOptions};
use simpulse::lab::error::Error;
use simpulse::lab::metrics::Observation;
use simpulse::lab::overrides::{self, Override};
use simpulse::lab::reference::certify::reference;
use simpulse::lab::reference::frozen::Frozen;
use simpulse::lab::scenes::{self, Scene};
use simpulse::lab::units;
use std::path::Path;

/// Scenes with more shapes are read but not run: any shape may touch any other.
const MOST_SHAPES: usize = 1500;
/// Problems with more contacts and joint rows are read but not solved.
const MOST_CONTACTS: usize = 12;
/// Steps with more contacts and joint rows are not frozen, because their files are large.
const MOST_FROZEN: usize = 300;
/// Length limit of a message (characters).
const LONGEST_MESSAGE: usize = 600;
const STEPS: u64 = 3;

/// A scene is either rejected with a one-line message, or it survives a round trip through JSON, runs, and
/// all its measured errors are finite.
pub fn scene(input: &[u8], salt: u64) -> Result<String, String> {
    let text = String::from_utf8_lossy(input);
    let path = Path::new("fuzz.json");
    let scene = match Scene::from_json(&text, path) {
        Ok(scene) => scene,
        Err(error) => return refused(&error, "fuzz.json: "),
    };
    if scene.name.chars().any(char::is_control) {
        return Err(format!("accepted name: {:?} is not for tables", scene.name));
    }
    let json = scene.to_json();
    let back = Scene::from_json(&json, path).map_err(|e| format!("own JSON: refused, {e}"))?;
    // Float equality treats −0 as 0, but the texts differ.
    if back != scene || back.to_json() != json {
        return Err("own JSON: another scene came back".to_string());
    }
    let shapes: usize = scene.bodies.iter().map(|b| b.shapes.len()).sum();
    if shapes > MOST_SHAPES {
        return Ok("accepted: large".to_string());
    }
    let settings = settings(salt);
    let solver = settings.solver.name;
    if let Err(error) = scene.runs_on(settings.solver) {
        return match scene.build(settings) {
            Err(_) => Ok(format!("accepted: not held, {solver}")),
            Ok(_) => Err(format!("build: accepted what it cannot hold, {error}")),
        };
    }
    let mut world = scene.build(settings).map_err(|e| format!("build: refused a valid scene, {e}"))?;
    let ending = steps(&mut world, salt % STEPS)?;
    let c = &world.counts;
    let sizes = [shapes, c.pairs, c.contacts, c.points].map(|n| n.checked_ilog2().map_or(0, |n| n + 1));
    Ok(format!(
        "accepted: {ending}, {sizes:?}, {} colors, overflow {}, {:?}, {solver}",
        c.colors,
        c.overflow > 0,
        world.features()
    ))
}

/// Random settings of a run, covering everything that a run can choose.
fn settings(salt: u64) -> Settings {
    let mut random = Random::seed_from_u64(salt);
    let mut settings = Settings::new(bytes::one(&mut random, &VARIANTS));
    settings = settings.exactly(bytes::one(&mut random, &LaneWidth::ALL));
    if random.random_ratio(1, 5) {
        (settings.order, settings.width) = (Order::Natural, LaneWidth::W1);
    }
    settings.broadphase = bytes::one(&mut random, &BroadPhaseKind::ALL);
    settings.integrator =
        if random.random_ratio(1, 5) { Integrator::ExplicitEuler } else { Integrator::default() };
    settings.rotation =
        if random.random_ratio(1, 5) { RotationUpdate::Normalized } else { RotationUpdate::default() };
    settings.record_impulses = true;
    settings.observe_rule = random.random();
    settings
}

/// Takes the steps and freezes one of them. Returns how the run ended.
fn steps(world: &mut World, frozen_step: u64) -> Result<String, String> {
    let mut observation = Observation::new(world);
    for step in 0..STEPS {
        if step == frozen_step {
            freeze(world)?;
        }
        if let Err(divergence) = world.step() {
            return one_line(&divergence.to_string()).map(|_| "diverged".to_string());
        }
        let b = &world.bodies;
        let columns = [
            ("position", [&b.position_x, &b.position_y]),
            ("rest of the position", [&b.position_x_lo, &b.position_y_lo]),
            ("rotation", [&b.rotation_cos, &b.rotation_sin]),
            ("velocity", [&b.velocity_x, &b.velocity_y]),
            ("spin", [&b.angular_velocity; 2]),
        ];
        for (name, columns) in columns {
            if columns.iter().any(|column| column.iter().any(|x| !x.is_finite())) {
                return Err(format!("state: {name} is not finite, but the step did not diverge"));
            }
        }
        observation.observe(world);
        if let Some(blow_up) = observation.blown_up() {
            return one_line(&blow_up.to_string()).map(|_| "blown up".to_string());
        }
    }
    let errors = format!("{:?}", observation.errors());
    match errors.split(", ").find(|field| field.contains("NaN") || field.contains("inf")) {
        Some(field) => Err(format!("errors: {field}")),
        None => Ok("ran".to_string()),
    }
}

/// The problem of the coming step survives a round trip through its file, or an error states why it cannot.
fn freeze(world: &mut World) -> Result<(), String> {
    let frozen = Frozen { problem: capture(world, "fuzz"), reference: None };
    if frozen.problem.unknowns() > MOST_FROZEN {
        return Ok(());
    }
    match frozen.to_text() {
        Ok(text) => same_frozen(&frozen, &text),
        Err(error) => refused(&error, "").map(drop),
    }
}

fn same_frozen(frozen: &Frozen, text: &str) -> Result<(), String> {
    let back = Frozen::from_text(text, Path::new("x")).map_err(|e| format!("own file: refused, {e}"))?;
    let same = back == *frozen && back.to_text().is_ok_and(|again| again == text);
    if same { Ok(()) } else { Err("own file: another problem came back".to_string()) }
}

/// A frozen problem is either rejected with a one-line message, or it survives a round trip. It can then be
/// solved and measured, or an error states why not.
pub fn frozen(input: &[u8], salt: u64) -> Result<String, String> {
    let text = String::from_utf8_lossy(input);
    let frozen = match Frozen::from_text(&text, Path::new("fuzz.frozen")) {
        Ok(frozen) => frozen,
        Err(error) => return refused(&error, "fuzz.frozen: "),
    };
    let again = frozen.to_text().map_err(|e| format!("own file: not written, {e}"))?;
    same_frozen(&frozen, &again)?;
    let Frozen { problem, reference: known } = &frozen;
    if problem.unknowns() > MOST_CONTACTS {
        return Ok("accepted: large".to_string());
    }
    let solution = match reference(problem) {
        Ok(found) => {
            found.check(problem).map_err(|why| format!("reference: does not hold, {why}"))?;
            format!("{:?} {:?}", found.certificate.method, found.certificate.uniqueness)
        }
        Err(why) => {
            one_line(&why.to_string())?;
            "no reference".to_string()
        }
    };
    let mut random = Random::seed_from_u64(salt);
    let solvers = vec![bytes::one(&mut random, &VARIANTS)];
    let options = ConvergeOptions {
        solvers,
        max_iterations: 6,
        rounds: 0,
        baseline: false,
        ..ConvergeOptions::default()
    };
    let curves = match converge::converge(problem, known.as_ref(), &options) {
        Ok(report) => {
            converge::table::text(&report);
            converge::plot::svg(&report, &|_| Style::at(0));
            let written = [converge::table::csv(&report), converge::table::json(&report)];
            for text in written {
                text.map_err(|e| format!("report: not written, {e}"))?;
            }
            "curves".to_string()
        }
        Err(error) => refused(&error, "")?,
    };
    let (contacts, rows) = (problem.contacts.len(), problem.joint_rows());
    Ok(format!("accepted: {solution}, {curves}, {contacts} contacts, {rows} rows"))
}

/// Command-line words: parameters, limits, scene names.
pub fn word(input: &[u8], salt: u64) -> Result<String, String> {
    let text = String::from_utf8_lossy(input);
    let unit = bytes::one(&mut Random::seed_from_u64(salt), &["m", "s", "N", "", "m/s"]);
    let number = units::quantity("max", &text, unit);
    let set = text.parse::<Override>().and_then(|given| overrides::check(&VARIANTS, &[given]));
    let size = text.split_once(':').and_then(|(_, size)| size.parse::<u32>().ok());
    // Large scenes take long to build.
    let scene = if size.is_some_and(|size| size > 100) { None } else { Some(scenes::load(&text)) };
    let mut shape = String::new();
    for result in [number.map(drop), set, scene.map_or(Ok(()), |s| s.map(drop))] {
        shape += &match result {
            Ok(()) => "accepted; ".to_string(),
            Err(error) => refused(&error, "")?,
        };
    }
    Ok(shape)
}

/// Checks that a message is a single, meaningful line that begins with its file. Returns its words without
/// quoted parts.
fn refused(error: &Error, start: &str) -> Result<String, String> {
    let message = error.to_string();
    one_line(&message)?;
    let rest = message.strip_prefix(start).ok_or_else(|| format!("message: without its file, {message}"))?;
    if rest.len() < 8 {
        return Err(format!("message: says nothing, {message}"));
    }
    // Of the position, only the depth counts: names would make every message a new one.
    let (place, what) = rest.rsplit_once(": ").unwrap_or(("", rest));
    let mut words = format!("{} ", place.matches(['.', '[']).count().min(6));
    let mut quote = None;
    for c in what.chars() {
        match quote {
            Some(end) if c == end => quote = None,
            Some(_) => {}
            None if "`'\"".contains(c) => quote = Some(c),
            None if c.is_ascii_alphabetic() || c == ' ' => words.push(c),
            None => {}
        }
    }
    Ok(words)
}

fn one_line(message: &str) -> Result<(), String> {
    if let Some(c) = message.chars().find(|c| c.is_control()) {
        return Err(format!("message: {c:?} in {message:?}").chars().take(LONGEST_MESSAGE).collect());
    }
    match message.chars().count() {
        n if n > LONGEST_MESSAGE => Err(format!("message length: {n} characters")),
        _ => Ok(()),
    }
}

/// The second line of a frozen problem, or the whole text if there is only one line.
pub fn payload(text: &[u8]) -> &[u8] {
    let start = text.iter().position(|&b| b == b'\n').map_or(0, |i| i + 1);
    text[start..].strip_suffix(b"\n").unwrap_or(&text[start..])
}

/// A file with a header that matches the payload.
pub fn signed(payload: &[u8]) -> Vec<u8> {
    let payload = String::from_utf8_lossy(payload);
    let payload = payload.strip_suffix('\n').unwrap_or(&payload);
    // FNV-1a, implemented independently.
    let mut hash = 14_695_981_039_346_656_037_u64;
    for byte in payload.bytes() {
        hash = (hash ^ u64::from(byte)).wrapping_mul(1_099_511_628_211);
    }
    let bytes = payload.len();
    format!(
        "{{\"format\":\"simpulse-frozen\",\"version\":1,\"bytes\":{bytes},\"checksum\":\"fnv1a64:{hash:016x}\"}}\n{payload}\n"
    )
    .into_bytes()
}

/// A parent with a mutated header.
pub fn with_header(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    let text = bytes::pick(random, corpus);
    let end = text.iter().position(|&b| b == b'\n').unwrap_or(text.len());
    let mut whole = values::mutate_line(random, &text[..end]);
    whole.extend(&text[end..]);
    whole
}
