//! The random scenes of `simpulse torture` under the other engines, with the same checks.

use crate::engine::{Contender, Engine, Maker};
use crate::race::build;
use simpulse::lab::torture::{self, Campaign, CaseOutcome, TortureCase, TortureRow, table};

/// Another engine, behind the interface of the checks.
struct Judged(Box<dyn Engine>);

impl torture::Engine for Judged {
    fn step(&mut self) -> Result<(), String> {
        self.0.step()
    }

    fn pose(&self, body: usize) -> [[f64; 2]; 2] {
        let state = self.0.state(body);
        [state.position.map(f64::from), state.rotation.map(f64::from)]
    }
}

/// An engine with this number of substeps and otherwise at its defaults, but for continuous collision.
pub const fn contender(maker: Maker, substeps: u32, continuous: bool) -> Contender {
    Contender { maker, substeps, hertz: 30.0, recycling: true, continuous }
}

/// Every engine at its defaults, and with the opposite setting of continuous collision.
const ENGINES: [(&str, Contender); 4] = [
    ("Box2D", contender(Maker::Box2d, 4, true)),
    ("Box2D, not continuous", contender(Maker::Box2d, 4, false)),
    ("rapier", contender(Maker::Rapier, 4, false)),
    ("rapier, continuous", contender(Maker::Rapier, 4, true)),
];

/// The engine with the scene and the number of substeps of a case. Errors: a part of the scene that the engine does
/// not support.
pub fn start(case: &TortureCase, contender: &Contender) -> Result<Box<dyn Engine>, String> {
    let substeps = case.substeps.unwrap_or(contender.substeps);
    build(&Contender { substeps, ..*contender }, &case.scene)
}

/// Runs one case in one engine. Errors: as above.
fn one(case: &TortureCase, contender: &Contender) -> Result<CaseOutcome, String> {
    torture::run(case, &mut Judged(start(case, contender)?)).map_err(|e| e.to_string())
}

/// Prints the table by family. Runs on one thread, because Box2D keeps its worlds in a list without a lock.
/// Errors: none from an engine; scenes that it does not support are counted.
pub fn run(campaign: &Campaign) -> Result<(), String> {
    let (seed, mut rows, mut refused) = (campaign.seed, Vec::new(), 0);
    for (family, number) in campaign.list() {
        let case = family.case(seed, number);
        for (name, contender) in &ENGINES {
            let (family, solver) = (family.name.to_string(), name.to_string());
            match one(&case, contender) {
                Ok(outcome) => rows.push(TortureRow { seed, family, number, solver, outcome }),
                Err(message) => {
                    eprintln!("{}, {name}: {message}", case.scene.name);
                    refused += 1;
                }
            }
        }
    }
    let names: Vec<String> = ENGINES.iter().map(|(name, _)| name.to_string()).collect();
    println!("{}{refused} runs refused", table::text(&table::lines(&rows, &names)));
    Ok(())
}
