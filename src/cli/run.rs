//! `simpulse run`: one scene, one solver; times per phase, errors, and what happened as CSV.

use super::args::{RunArgs, order, width_or_native};
use crate::engine::clock::{Phase, Timings};
use crate::engine::lanes::LaneWidth;
use crate::engine::params::Budget;
use crate::engine::solvers::find;
use crate::engine::world::{Order, Settings, World};
use crate::lab::error::Error;
use crate::lab::files::{Pending, same_file};
use crate::lab::metrics::Observation;
use crate::lab::metrics::state::Angles;
use crate::lab::overrides;
use crate::lab::report::table::error_list;
use crate::lab::report::units::{digits, lanes, si};
use crate::lab::scenes::holds::Watch;
use crate::lab::study::{Failure, TruthError, budget, interleave, open_scene};
use std::path::Path;

/// How a run ended.
pub enum Ending {
    /// With this report.
    Finished(String),
    /// Before its time.
    Diverged(Failure),
}

/// Runs the scene that was asked for; writes its files once all of it has run.
pub fn run(args: &RunArgs) -> Result<Ending, Error> {
    let settings = settings(args)?;
    for (name, value) in [("steps", args.steps), ("every", args.every)] {
        if value == Some(0) {
            return Err(Error::invalid(name, "0 is too few: at least 1 is needed"));
        }
    }
    if args.every.is_some() && args.state.is_none() && args.contacts.is_none() {
        return Err(Error::invalid("every", "needs --state or --contacts"));
    }
    if let (Some(state), Some(contacts)) = (&args.state, &args.contacts)
        && same_file(state, contacts)
    {
        let message = format!("'{}' is the same file as --state; give another name", contacts.display());
        return Err(Error::invalid("--contacts", message));
    }
    let mut loaded = open_scene(&args.scene, args.seed, args.steps, args.dt)?;
    let scene = &loaded.scene;
    let mut world = scene.build(settings)?;
    let mut state = args.state.as_deref().map(|path| Sheet::new(path, &STATE)).transpose()?;
    let mut contacts = args.contacts.as_deref().map(|path| Sheet::new(path, &CONTACTS)).transpose()?;

    let mut observation = Observation::new(&world);
    let mut watch = Watch::new(&world, loaded.demands);
    let mut angles = Angles::new(&world, scene.bodies.iter().map(|b| b.angle));
    let mut times = Times::default();
    for step in 1..=scene.steps {
        let due = args.every.map_or(step == scene.steps, |every| step % every == 0);
        let starts: Vec<_> = match (&contacts, due) {
            (Some(_), true) => (0..world.bodies.len()).map(|i| world.bodies.pose(i).position).collect(),
            _ => Vec::new(),
        };
        if let Err(divergence) = world.step() {
            return Ok(Ending::Diverged(divergence.into()));
        }
        times.add(&world.timings);
        observation.observe(&world);
        watch.observe(&world);
        angles.add(&world);
        if let Some(blow_up) = observation.blown_up() {
            return Ok(Ending::Diverged(blow_up.into()));
        }
        if let Some(truth) = &mut loaded.truth {
            truth.observer.observe(&world);
        }
        if due && let Some(sheet) = &mut state {
            write_state(sheet, &world, &angles, scene.dt)?;
        }
        if due && let Some(sheet) = &mut contacts {
            write_contacts(sheet, &world, &starts)?;
        }
    }
    let mut text = head(&world, scene);
    text += &times.table();
    text += &counts(&world);
    text += "\nerrors\n";
    text += &error_list(&observation.errors());
    if let Some(truth) = &loaded.truth {
        text += &truth_line(&TruthError::of(truth));
    }
    text += &match watch.broken() {
        Some(broken) => format!("  does not hold: {broken}\n"),
        None => "  holds\n".to_string(),
    };
    for sheet in [state, contacts].into_iter().flatten() {
        text += &format!("wrote {}\n", sheet.path.clone());
        sheet.commit()?;
    }
    Ok(Ending::Finished(text))
}

fn settings(args: &RunArgs) -> Result<Settings, Error> {
    let solver = find(&args.solver)?;
    let order = order(&args.order)?;
    let lanes = match (order, args.lanes) {
        (Order::Natural, None) => LaneWidth::W1,
        (Order::Natural, Some(lanes)) if lanes != 1 => {
            return Err(Error::invalid("lanes", format!("{lanes}, but natural order has 1 lane")));
        }
        (_, lanes) => width_or_native(lanes)?,
    };
    let own = solver.budget;
    let chosen = Budget {
        substeps: args.substeps.unwrap_or(own.substeps),
        velocity_iterations: args.velocity_iterations.unwrap_or(own.velocity_iterations),
        relax_iterations: args.relax_iterations.unwrap_or(own.relax_iterations),
        position_iterations: args.position_iterations.unwrap_or(own.position_iterations),
    };
    budget::check(&chosen, solver)?;
    overrides::check(&[solver], &args.set)?;
    Ok(Settings {
        width: lanes,
        order,
        budget: chosen,
        parameters: overrides::values(solver, &args.set)?,
        record_impulses: true,
        timed: true,
        ..Settings::new(solver)
    })
}

fn head(world: &World, scene: &crate::lab::scenes::Scene) -> String {
    let s = &world.settings;
    let order = match s.order {
        Order::Natural => "natural order".to_string(),
        Order::Colored => lanes(s.width.lanes()),
    };
    format!(
        "{}: {} bodies, {} steps of {} · {}, {}, {order}\n\n",
        scene.name,
        scene.bodies.len(),
        scene.steps,
        si(scene.dt, "s"),
        s.solver.name,
        budget::brief(&s.budget, s.solver),
    )
}

fn counts(world: &World) -> String {
    let c = &world.counts;
    format!(
        "\nlast step: {} pairs, {} contacts, {} points, {} rows, {} sweeps, {} colours, {} overflowing, \
         {:.0} % of lanes filled, {} bytes of records\n",
        c.pairs,
        c.contacts,
        c.points,
        c.rows,
        c.sweeps,
        c.colors,
        c.overflow,
        100.0 * c.contacts as f64 / c.lane_slots.max(1) as f64,
        c.constraint_bytes
    )
}

fn truth_line(truth: &TruthError) -> String {
    let known = format!("{} = {}", truth.quantity, si(truth.expected, truth.unit));
    match truth.error {
        Some(error) => format!("  distance to truth: {} ({known})\n", si(error, truth.unit)),
        None => format!("  distance to truth: not reached in this run ({known})\n"),
    }
}

/// Times of every step.
#[derive(Default)]
struct Times {
    phases: [Vec<f64>; Phase::ALL.len()],
    steps: Vec<f64>,
}

impl Times {
    fn add(&mut self, timings: &Timings) {
        for (times, &ns) in self.phases.iter_mut().zip(&timings.phase_ns) {
            times.push(ns as f64);
        }
        self.steps.push(timings.step_ns as f64);
    }

    /// Mean and median per step; phases that the solver does not have are left out.
    fn table(&self) -> String {
        let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
        let whole = mean(&self.steps);
        let line = |name: &str, times: &[f64]| {
            let (mean, median) = (mean(times), interleave::median(times));
            let share = if whole > 0.0 { 100.0 * mean / whole } else { 0.0 };
            format!("  {name:<12}{:>12}{:>12}{share:>9.1} %\n", digits(mean / 1e3), digits(median / 1e3))
        };
        let mut text = format!("  {:<12}{:>12}{:>12}{:>11}\n", "µs per step", "mean", "median", "share");
        for (phase, times) in Phase::ALL.iter().zip(&self.phases) {
            if times.iter().any(|&t| t > 0.0) {
                text += &line(phase.name(), times);
            }
        }
        text + &line("whole step", &self.steps)
    }
}

const STATE: [&str; 9] = ["step", "time", "body", "x", "y", "angle", "vx", "vy", "omega"];
const CONTACTS: [&str; 11] = [
    "step",
    "body_a",
    "body_b",
    "feature",
    "px",
    "py",
    "nx",
    "ny",
    "separation",
    "normal_impulse",
    "tangent_impulse",
];

/// A CSV file that appears when it is whole.
struct Sheet {
    writer: csv::Writer<Pending>,
    path: String,
}

impl Sheet {
    fn new(path: &Path, header: &[&str]) -> Result<Self, Error> {
        let path_text = path.display().to_string();
        let mut sheet = Sheet { writer: csv::Writer::from_writer(Pending::new(path)?), path: path_text };
        sheet.row(header)?;
        Ok(sheet)
    }

    fn row(&mut self, row: impl serde::Serialize) -> Result<(), Error> {
        self.writer.serialize(row).map_err(|e| Error::Io { path: (&self.path).into(), source: e.into() })
    }

    fn commit(self) -> Result<(), Error> {
        let Sheet { writer, path } = self;
        let pending = writer.into_inner().map_err(|e| Error::io(&path)(e.into_error()))?;
        pending.commit()
    }
}

/// A line per body: origin, angle with all turns since the start, velocity of the centre of mass.
fn write_state(sheet: &mut Sheet, world: &World, angles: &Angles, dt: f64) -> Result<(), Error> {
    let time = world.step_index as f64 * dt;
    for i in 0..world.bodies.len() {
        let (origin, velocity) = (world.bodies.origin(i), world.bodies.velocity(i));
        let omega = world.bodies.angular_velocity[i];
        let pose = (origin[0], origin[1], angles.of(i));
        sheet.row((world.step_index, time, i, pose, velocity.x, velocity.y, omega))?;
    }
    Ok(())
}

/// A line per contact point: geometry at the start of the step, where the centres of mass
/// were at `starts`; impulses on body b over the step.
fn write_contacts(sheet: &mut Sheet, world: &World, starts: &[glam::Vec2]) -> Result<(), Error> {
    for contact in &world.contacts {
        let normal = contact.manifold.normal;
        for (point, impulse) in contact.manifold.points().iter().zip(contact.step_impulse) {
            let at = starts[contact.body_b as usize] + point.anchor_b;
            let names = (world.step_index, contact.body_a, contact.body_b, point.feature_id);
            let geometry = (at.x, at.y, normal.x, normal.y, point.separation);
            sheet.row((names, geometry, impulse))?;
        }
    }
    Ok(())
}
