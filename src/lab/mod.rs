#![doc = include_str!("README.md")]
//! # From code
//!
//! Run a scene from JSON under a solver, measure its errors, and add your own metric:
//!
//! ```
//! use simpulse::{solvers, world::Settings};
//! use simpulse::lab::{metrics::Observation, scenes::Scene};
//!
//! let text = r#"{ "name": "drop", "steps": 60, "bodies": [
//!     { "type": "static", "position": [0, -1], "shapes": [{ "box": { "half": [20, 1] } }] },
//!     { "type": "dynamic", "position": [0, 0.6], "shapes": [{ "circle": { "radius": 0.5 } }] }
//! ] }"#;
//! let scene = Scene::from_json(text, "drop.json".as_ref())?;
//! let mut settings = Settings::new(solvers::find("soft_step")?);
//! settings.record_impulses = true;
//! settings.budget.substeps = 8;
//! let mut world = scene.build(settings)?;
//! let mut observation = Observation::new(&world);
//! let mut highest_load = 0.0_f32;
//! for _ in 0..scene.steps {
//!     world.step()?;
//!     observation.observe(&world);
//!     let impulses = world.contacts.iter().map(|c| c.step_impulse[0][0] + c.step_impulse[1][0]);
//!     highest_load = highest_load.max(impulses.sum::<f32>() / world.settings.dt);
//! }
//! assert!(observation.errors().penetration_max() < 0.02 && highest_load > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Run a study and read its CSV:
//!
//! ```
//! use simpulse::solvers::find;
//! use simpulse::lab::report::columns::study_csv;
//! use simpulse::lab::report::environment::Environment;
//! use simpulse::lab::study::{self, StudyPlan};
//!
//! let plan = StudyPlan {
//!     scenes: vec!["stack:3".into()],
//!     solvers: vec![find("pgs")?, find("soft_step")?],
//!     ..StudyPlan::quick()
//! };
//! let records = study::run(&plan, &|_| (), &mut |_, _| Ok(()))?;
//! let text = String::from_utf8(study_csv(&records, &Environment::current())?)?;
//! let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
//! let head = rows.next().ok_or("no header")?;
//! let solver = head.iter().position(|&name| name == "solver").ok_or("no solver")?;
//! assert!(rows.all(|row| ["pgs", "soft_step"].contains(&row[solver])));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Freeze the contact problem of one step and solve it exactly:
//!
//! ```
//! use simpulse::{solvers, world::Settings};
//! use simpulse::lab::{capture::capture, reference::certify, scenes};
//!
//! let mut world = scenes::load("pyramid:3")?.scene.build(Settings::new(solvers::find("pgs")?))?;
//! for _ in 0..10 {
//!     world.step()?;
//! }
//! let problem = capture(&mut world, "step 10 of a small pyramid");
//! let exact = certify::reference(&problem).map_err(|_| "no method certifies it")?;
//! assert!(exact.certificate.natural_map < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Save a world as JSON and load it; the copy continues bit-identically:
//!
//! ```
//! use simpulse::{solvers, world::{Settings, World}};
//! use simpulse::lab::scenes;
//!
//! let mut world = scenes::load("stack:3")?.scene.build(Settings::new(solvers::find("soft_step")?))?;
//! world.step()?;
//! let mut copy: World = serde_json::from_str(&serde_json::to_string(&world)?)?;
//! world.step()?;
//! copy.step()?;
//! assert_eq!(copy.state_hash(), world.state_hash());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Layers
//!
//! Each module imports only from those above it:
//!
//! ```text
//! error                          what can go wrong
//! files  overrides  interned     result files; parameters by name; names read from files
//! units  memory  parallel        human-readable numbers; what fits in memory; jobs on threads
//! reference  metrics             certified solutions; errors read from states
//! scenes  capture  picture       what is simulated, and its known truth; frozen problems; frames drawn
//! pokes                          random pushes
//! trial  copies                  one run to its verdict; many copies as one batch
//! recording  chart               whole runs in a file, and the page that plays them; charts as SVG
//! study  converge  verify        solver × scene × budget; iterations to a tolerance; hard cases
//! report                         tables, plots, records
//! profile  compare               phases against the roofline, cost by size; two studies side by side
//! ablate                         what each mechanism of a solver is for
//! view                           worlds side by side, and what a player does to them
//! torture                        scenes at random, and what no solver may do in them
//! ```

pub mod ablate;
pub mod capture;
#[doc(hidden)]
pub mod chart;
pub mod compare;
pub mod converge;
pub mod copies;
pub mod error;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod interned;
#[doc(hidden)]
pub mod memory;
pub mod metrics;
pub mod overrides;
#[doc(hidden)]
pub mod parallel;
pub mod picture;
pub mod pokes;
pub mod profile;
pub mod recording;
pub mod reference;
pub mod report;
pub mod scenes;
pub mod study;
pub mod torture;
pub mod trial;
#[doc(hidden)]
pub mod units;
pub mod verify;
pub mod view;
