//! The files of `simpulse run`: trajectories, contact points and joints as CSV.

use super::run::RunArgs;
use crate::engine::constraints::records::rows::RowLaw;
use crate::engine::world::{SolvedBlock, World};
use crate::lab::error::Error;
use crate::lab::files::Pending;
use crate::lab::metrics::state::Angles;
use crate::lab::report::columns::{self, Sheet};
use crate::lab::scenes::Scene;
use std::collections::BTreeMap;
use std::path::Path;

/// The files that were asked for. They appear when all are complete.
pub struct Sheets {
    state: Option<CsvFile>,
    contacts: Option<CsvFile>,
    joints: Option<CsvFile>,
    every: Option<u32>,
    angles: Option<Angles>,
    /// Centers of mass before the next step, for contact points.
    starts: Vec<glam::Vec2>,
}

impl Sheets {
    /// Opens the files. Errors: one cannot be written.
    pub fn new(args: &RunArgs) -> Result<Self, Error> {
        let open = |path: &Option<_>, sheet: &Sheet| {
            path.as_deref().map(|path| CsvFile::new(path, sheet)).transpose()
        };
        Ok(Sheets {
            state: open(&args.state, &columns::STATE)?,
            contacts: open(&args.contacts, &columns::CONTACTS)?,
            joints: open(&args.joints, &columns::JOINTS)?,
            every: args.every,
            angles: None,
            starts: Vec::new(),
        })
    }

    /// Observes the world at its start and after every step, and writes what is due. Errors: a file cannot be
    /// written.
    pub fn add(&mut self, world: &World, scene: &Scene) -> Result<(), Error> {
        let (step, last) = (world.step_index(), u64::from(scene.steps));
        let due = |step: u64| self.every.map_or(step == last, |every| step.is_multiple_of(u64::from(every)));
        if let Some(sheet) = &mut self.state {
            let new = || Angles::new(world, scene.bodies.iter().map(|b| b.angle));
            let angles = self.angles.get_or_insert_with(new);
            if step > 0 {
                angles.add(world);
            }
            if step > 0 && due(step) {
                write_state(sheet, world, angles, scene.dt)?;
            }
        }
        if let Some(sheet) = &mut self.contacts {
            if step > 0 && due(step) {
                write_contacts(sheet, world, &self.starts)?;
            }
            if due(step + 1) {
                self.starts.clear();
                self.starts.extend((0..world.bodies.len()).map(|i| world.bodies.pose(i).position));
            }
        }
        if let Some(sheet) = self.joints.as_mut().filter(|_| step > 0 && due(step)) {
            write_joints(sheet, world)?;
        }
        Ok(())
    }

    /// Gives the files their names; returns a line for each.
    pub fn commit(self) -> Result<String, Error> {
        let mut written = String::new();
        for sheet in [self.state, self.contacts, self.joints].into_iter().flatten() {
            written += &format!("wrote {}\n", sheet.path);
            sheet.commit()?;
        }
        Ok(written)
    }
}

/// A CSV file that appears under its name only when it is complete.
struct CsvFile {
    writer: csv::Writer<Pending>,
    path: String,
}

impl CsvFile {
    fn new(path: &Path, sheet: &Sheet) -> Result<Self, Error> {
        let path_text = path.display().to_string();
        let mut file = CsvFile { writer: csv::Writer::from_writer(Pending::new(path)?), path: path_text };
        file.row(sheet.names())?;
        Ok(file)
    }

    fn row(&mut self, row: impl serde::Serialize) -> Result<(), Error> {
        self.writer.serialize(row).map_err(|e| Error::Io { path: (&self.path).into(), source: e.into() })
    }

    fn commit(self) -> Result<(), Error> {
        let CsvFile { writer, path } = self;
        let pending = writer.into_inner().map_err(|e| Error::io(&path)(e.into_error()))?;
        pending.commit()
    }
}

/// Writes a line per body: origin, angle including whole turns since the start, velocity of the center of
/// mass.
fn write_state(sheet: &mut CsvFile, world: &World, angles: &Angles, dt: f64) -> Result<(), Error> {
    let time = world.step_index() as f64 * dt;
    for i in 0..world.bodies.len() {
        let (origin, velocity) = (world.bodies.origin(i), world.bodies.velocity(i));
        let omega = world.bodies.angular_velocity[i];
        let pose = (origin[0], origin[1], angles.of(i));
        sheet.row((world.step_index(), time, i, pose, velocity.x, velocity.y, omega))?;
    }
    Ok(())
}

/// Writes a line per contact point: geometry at the start of the step, when the centers of mass were at
/// `starts`, and the impulses on body b over the step.
fn write_contacts(sheet: &mut CsvFile, world: &World, starts: &[glam::Vec2]) -> Result<(), Error> {
    for contact in &world.contacts {
        let normal = contact.manifold.normal;
        for (point, impulse) in contact.manifold.points().iter().zip(contact.step_impulse) {
            let at = starts[contact.body_b as usize] + point.anchor_b;
            let names = (world.step_index(), contact.body_a, contact.body_b, point.feature_id);
            let geometry = (at.x, at.y, normal.x, normal.y, point.separation);
            sheet.row((names, geometry, impulse))?;
        }
    }
    Ok(())
}

/// Impulse columns of a joint: rigid rows (two along lines, one of the angle), spring rows likewise, motor,
/// two limits.
const ROWS_OF_LINE: usize = 9;

/// Writes a line per joint.
fn write_joints(sheet: &mut CsvFile, world: &World) -> Result<(), Error> {
    let mut lines: BTreeMap<usize, [Option<f32>; ROWS_OF_LINE]> = BTreeMap::new();
    for SolvedBlock { joint, block, step_impulses, .. } in world.solved_blocks() {
        let Some(joint) = joint else { continue };
        let impulses = lines.entry(joint.index()).or_default();
        for (j, impulse) in block.jacobians.iter().zip(step_impulses).take(block.size) {
            let is_angular = usize::from(j.axis == [0.0; 2]);
            let mut place = match block.law {
                RowLaw::Rigid => 2 * is_angular,
                RowLaw::Spring { .. } => 3 + 2 * is_angular,
                RowLaw::Motor { .. } => 6,
                RowLaw::Limit => 7,
            };
            // The next column, for the second row along a line or for the upper limit.
            place += usize::from(impulses[place].is_some());
            impulses[place] = Some(impulse);
        }
    }
    for (handle, joint) in world.joints() {
        let state = world.joint_state(handle)?;
        let impulses = lines.get(&handle.index()).copied().unwrap_or_default();
        let names = (world.step_index(), handle.index(), joint.kind.name(), joint.a.index(), joint.b.index());
        let errors = (state.gap, state.lean, state.angle, state.translation, state.excess);
        sheet.row((names, errors, impulses, state.load(), state.breaks))?;
    }
    Ok(())
}
