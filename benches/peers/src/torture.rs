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

/// Every engine at its defaults, and with the opposite setting of continuous collision.
fn engines() -> Vec<(&'static str, Contender)> {
    let own = |maker, continuous| Contender { maker, substeps: 4, hertz: 30.0, recycling: true, continuous };
    vec![
        ("Box2D", own(Maker::Box2d, true)),
        ("Box2D, not continuous", own(Maker::Box2d, false)),
        ("rapier", own(Maker::Rapier, false)),
        ("rapier, continuous", own(Maker::Rapier, true)),
    ]
}

/// Runs one case in one engine. Errors: a part of the scene that the engine does not support.
fn one(case: &TortureCase, contender: &Contender) -> Result<CaseOutcome, String> {
    let contender = Contender { substeps: case.substeps.unwrap_or(contender.substeps), ..*contender };
    let mut engine = Judged(build(&contender, &case.scene)?);
    torture::run(case, &mut engine).map_err(|e| e.to_string())
}

/// Prints the table by family. Runs on one thread, because Box2D keeps its worlds in a list without a lock.
/// Errors: none from an engine; scenes that it does not support are counted.
pub fn run(campaign: &Campaign) -> Result<(), String> {
    let (engines, seed, mut rows, mut refused) = (engines(), campaign.seed, Vec::new(), 0);
    for (family, number) in campaign.list() {
        let case = family.case(seed, number);
        for (name, contender) in &engines {
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
    let names: Vec<String> = engines.iter().map(|(name, _)| name.to_string()).collect();
    println!("{}{refused} runs refused", table::text(&table::lines(&rows, &names)));
    Ok(())
}
