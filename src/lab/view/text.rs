//! Texts of a session: commands, Rust, the scene file, and what the page is told about the scene.

use super::Session;
use super::pane::Pane;
use super::request::What;
use super::scene::{FRICTION, GRAVITY, Source};
use crate::engine::bodies::BodyKind;
use crate::engine::clock::Phase;
use crate::engine::constraints::Impacts;
use crate::engine::narrowphase::frozen::{FreezeLimits, Freezing};
use crate::lab::error::Error;
use crate::lab::overrides::decimal;
use crate::lab::recording::record::{self, Caption};
use crate::lab::report::style::Style;
use crate::lab::study::budget;
use serde_json::{Value, json};

/// Description of a pane for a recording.
pub(super) fn caption(source: &Source, pane: &Pane) -> Caption {
    let record = pane.record();
    Caption { scene: source.name.clone(), solver: record.solver.into(), setting: record.setting_text() }
}

impl Session {
    /// A text about a pane. Errors: no such pane.
    pub(super) fn text(&mut self, what: What, pane: usize) -> Result<String, Error> {
        let source = self.source.clone();
        let poke = self.poke;
        let pane = &*self.pane(pane)?;
        Ok(match what {
            What::Scene => pane.loaded.scene.to_json(),
            What::Rust => rust(pane),
            What::Command => {
                let changed = source.is_changed();
                let mut text = pane.record().command(if changed { "scene.json" } else { &source.name });
                let mut add = |option: &str, value: Option<String>| {
                    value.into_iter().for_each(|value| text += &format!(" --{option} {value}"));
                };
                add("seed", source.seed.filter(|_| !changed).map(|n| n.to_string()));
                add("steps", source.steps.map(|n| n.to_string()));
                add("dt", source.dt.map(|s| s.to_string()));
                add("poke", poke.map(|n| n.to_string()));
                if changed { text + "   # scene.json: the scene file" } else { text }
            }
        })
    }

    /// What does not change until bodies, joints or settings do: a JSON object for the page.
    pub fn stage_text(&self) -> String {
        let kinds: String = self.stage.kinds.iter().map(|kind| record::letter(*kind)).collect();
        let pane = &self.panes[0];
        let (size, seeded) = self.source.entry();
        let scene = &pane.loaded.scene;
        let now = self.source.name.split_once(':').and_then(|(_, n)| n.parse::<u32>().ok());
        json!({
            "stage": self.version,
            "scene": scene.name,
            "kinds": kinds,
            "shapes": self.stage.shapes.iter().map(record::shape).collect::<Vec<_>>(),
            "joints": self.stage.joints,
            "dt": scene.dt,
            "steps": scene.steps,
            "bodies": self.stage.kinds.iter().filter(|kind| **kind == BodyKind::Dynamic).count(),
            "measured_every": self.measured_every(),
            "size": size.map(|s| json!({ "min": s.min, "max": s.max, "value": now.unwrap_or(s.default), "meaning": s.meaning })),
            "poke": self.poke,
            "seed": seeded.then_some(self.source.seed.unwrap_or(0)),
            "friction": { "value": self.source.friction, "range": FRICTION },
            "gravity": { "value": -scene.gravity[1], "range": [-GRAVITY, GRAVITY] },
            "limits": pane.limits(),
            "phases": Phase::ALL.map(Phase::name),
            "panes": self.panes.iter().map(setting).collect::<Vec<_>>(),
        })
        .to_string()
    }
}

/// The setting of a pane, with what can be changed.
fn setting(pane: &Pane) -> Value {
    let settings = &pane.world.settings;
    let solver = settings.solver;
    let record = pane.record();
    let parameters = solver.parameters.iter().zip(settings.parameters).map(|(p, value)| {
        json!({
            "name": p.name, "unit": p.unit, "range": p.range.map(decimal), "value": decimal(value),
            "default": decimal(p.default), "meaning": p.meaning,
        })
    });
    let box2d = Freezing::Within(FreezeLimits::BOX2D);
    let frozen = [("the solver's own", Freezing::Own), ("off", Freezing::Off), ("as in Box2D", box2d)];
    json!({
        "solver": solver.name,
        "color": Style::of(solver.name).color.to_string(),
        "setting": record.budget_text,
        "budget": settings.budget,
        "sweeps": budget::kinds(&settings.budget, solver).map(|(kind, _)| kind).collect::<Vec<_>>(),
        "parameters": parameters.collect::<Vec<_>>(),
        "frozen": { "value": settings.frozen, "choices": frozen },
        "impacts": { "value": settings.impacts, "choices": Impacts::ALL.map(|i| (i.name(), i)) },
    })
}

/// Lines of Rust that make the settings of a pane.
fn rust(pane: &Pane) -> String {
    let s = &pane.world.settings;
    let solver = s.solver;
    let mut text = format!(
        "use simpulse::engine::{{params::Budget, solvers, world::{{Settings, World}}}};\n\n\
         let solver = solvers::find({:?})?;\nlet mut settings = Settings {{\n    budget: Budget {{ substeps: {}",
        solver.name, s.budget.substeps
    );
    for (kind, count) in budget::kinds(&s.budget, solver) {
        text += &format!(", {kind}_iterations: {count}");
    }
    text += ", ..solver.budget },\n";
    text += &format!("    gravity: {:?},\n    dt: {:?},\n", s.gravity, s.dt);
    if s.length_unit != 1.0 {
        text += &format!("    length_unit: {:?},\n", s.length_unit);
    }
    if s.continuous != solver.continuous {
        text += &format!("    continuous: {},\n", s.continuous);
    }
    if s.impacts != Impacts::Own {
        text += &format!("    impacts: simpulse::engine::constraints::Impacts::{:?},\n", s.impacts);
    }
    let frozen = "simpulse::engine::narrowphase::frozen::";
    text += &match s.frozen {
        Freezing::Own => String::new(),
        Freezing::Off => format!("    frozen: {frozen}Freezing::Off,\n"),
        Freezing::Within(FreezeLimits { distance, turn, loaded_only }) => format!(
            "    frozen: {frozen}Freezing::Within({frozen}FreezeLimits {{ distance: {distance:?}, turn: {turn:?}, \
             loaded_only: {loaded_only} }}),\n"
        ),
    };
    text += "    ..Settings::new(solver)\n};\n";
    for (p, value) in solver.parameters.iter().zip(&s.parameters).filter(|(p, value)| p.default != **value) {
        text += &format!("solver.set(&mut settings.parameters, {:?}, {value:?})?;\n", p.name);
    }
    text + "let mut world = World::new(settings);\n"
}
