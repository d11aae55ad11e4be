//! The session behind `simpulse view`: one scene in up to four worlds under different settings, stepped together, and
//! what a player does to all of them.
//!
//! A session has no clock and no network: [`Session::act`] takes a [`Request`] of the page, [`Session::step`] steps all
//! panes, [`Session::frame`] is their state in bytes. The same requests at the same steps give the same bits.
//!
//! ```
//! use simpulse::{solvers, world::Settings};
//! use simpulse::lab::view::{Request, Session, Source};
//!
//! let settings = ["pgs", "shim"].map(|name| solvers::find(name).map(Settings::new));
//! let settings = settings.into_iter().collect::<Result<Vec<_>, _>>()?;
//! let mut session = Session::new(Source::named("stack:3"), settings, None)?;
//! // The lowest crate of the left pane is pulled to the right, in both panes.
//! session.act(&Request::Grab { pane: 0, at: [0.0, 1.5] })?;
//! session.act(&Request::Move { at: [3.0, 1.5] })?;
//! for _ in 0..60 {
//!     session.step()?;
//! }
//! assert!(session.panes().iter().all(|pane| pane.world.bodies.center(1)[0] > 0.5));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod frame;
mod pane;
mod player;
mod request;
mod scene;
mod text;

use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::picture::frame::Stage;
use crate::lab::recording::page::{self, RecordingPanel};
use crate::lab::recording::record::Recorder;
use crate::lab::report::style::Style;
pub use pane::Pane;
use player::Grab;
pub use request::{Request, What};
pub use scene::Source;

/// Largest number of panes.
pub const MOST_PANES: usize = page::MOST;

/// Largest number of bodies, in all panes together, whose errors are measured in every step; of more, the errors of
/// [`AT_A_TIME`] bodies per step are measured on average.
const MEASURED_BODIES: usize = 1500;
const AT_A_TIME: usize = 500;

/// Overlays whose data are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Shown {
    depths: bool,
    points: bool,
    islands: bool,
}

/// Worlds of one scene, stepped together.
pub struct Session {
    source: Source,
    panes: Vec<Pane>,
    stage: Stage,
    /// Number of the stage, which grows when bodies or joints change.
    version: u32,
    grab: Option<Grab>,
    /// Number of [`Request::Grab`]s so far.
    grabs: u32,
    poke: Option<u64>,
    shown: Shown,
    /// Steps since the start of the scene.
    step: u64,
    recorders: Vec<Recorder>,
    replay: Option<String>,
}

impl Session {
    /// A session at the start of its scene, with a pane for each of the settings, and pokes by the seed `poke`.
    ///
    /// Errors: no settings or too many; a scene that cannot be read or built; a solver that cannot run it.
    pub fn new(source: Source, settings: Vec<Settings>, poke: Option<u64>) -> Result<Self, Error> {
        if !(1..=MOST_PANES).contains(&settings.len()) {
            return Err(Error::invalid(
                "--solvers",
                format!("{} panes, 1 to {MOST_PANES} fit", settings.len()),
            ));
        }
        let panes = open(&source, settings, poke)?;
        let stage = Stage::of(&panes[0].world);
        let shown = Shown { depths: true, points: true, islands: false };
        Ok(Session {
            source,
            panes,
            stage,
            version: 1,
            grab: None,
            grabs: 0,
            poke,
            shown,
            step: 0,
            recorders: Vec::new(),
            replay: None,
        })
    }

    /// The panes, from left to right.
    pub fn panes(&self) -> &[Pane] {
        &self.panes
    }

    /// Steps since the start of the scene.
    pub fn step_index(&self) -> u64 {
        self.step
    }

    /// Length of a step (s).
    pub fn seconds(&self) -> f64 {
        self.stage.dt
    }

    /// Number of the current stage; see [`Self::stage_text`].
    pub fn version(&self) -> u32 {
        self.version
    }

    /// The page that plays what was recorded last; `None` if nothing was.
    pub fn replay(&self) -> Option<&str> {
        self.replay.as_deref()
    }

    /// Errors are measured every this many steps.
    fn measured_every(&self) -> u64 {
        match self.stage.kinds.len() * self.panes.len() {
            few if few <= MEASURED_BODIES => 1,
            many => many.div_ceil(AT_A_TIME) as u64,
        }
    }

    /// Steps all panes; one that diverged stays as it is. Errors: the recording has become too large.
    pub fn step(&mut self) -> Result<(), Error> {
        let every = self.measured_every();
        self.step += 1;
        for (k, pane) in self.panes.iter_mut().enumerate() {
            if let Some(grab) = &self.grab {
                pane.pull(grab, self.stage.origin)?;
            }
            // Not all panes in the same step, so that the longest step is shorter.
            let turn = self.step + k as u64 * every / MOST_PANES as u64;
            pane.step((every > 1).then(|| turn.is_multiple_of(every)))?;
        }
        for (recorder, pane) in self.recorders.iter_mut().zip(&self.panes) {
            if pane.failure.is_none() {
                recorder.add(&pane.world)?;
            }
        }
        Ok(())
    }

    /// Carries out a request. Returns text that the page asked for. Errors: a value that is out of range; nothing has
    /// changed then.
    pub fn act(&mut self, request: &Request) -> Result<Option<String>, Error> {
        match request {
            Request::Reset => self.restart(self.source.clone())?,
            Request::Scene(change) => self.restart(self.source.changed(change))?,
            Request::Poke { seed } => {
                self.poke = *seed;
                self.panes.iter_mut().for_each(|pane| pane.poke(*seed));
            }
            Request::Show { depths, points, islands } => {
                self.shown = Shown { depths: *depths, points: *points, islands: *islands };
            }
            Request::Budget { pane, budget } => self.pane(*pane)?.set_budget(*budget)?,
            Request::Parameter { pane, name, value } => self.pane(*pane)?.set_parameter(name, *value)?,
            Request::Treatment { pane, frozen, impacts, threads } => {
                self.pane(*pane)?.treat(*frozen, *impacts, *threads);
            }
            Request::Grab { pane, at } => self.grab(*pane, *at)?,
            Request::Move { at } => self.move_to(*at)?,
            Request::Release => self.grab = None,
            Request::Drop { at } => self.drop_box(*at)?,
            Request::Throw { at, velocity } => self.throw_ball(*at, *velocity)?,
            Request::Cut { pane, at, reach } => self.cut(*pane, *at, *reach)?,
            Request::Record { on } => self.record(*on)?,
            Request::Text { what, pane } => return self.text(*what, *pane).map(Some),
        }
        Ok(None)
    }

    fn pane(&mut self, pane: usize) -> Result<&mut Pane, Error> {
        let count = self.panes.len();
        self.panes.get_mut(pane).ok_or_else(|| Error::invalid("pane", format!("{pane} of {count}")))
    }

    /// Starts again with a scene; the panes keep their settings.
    fn restart(&mut self, source: Source) -> Result<(), Error> {
        let settings = self.panes.iter().map(|pane| pane.world.settings.clone()).collect();
        let panes = open(&source, settings, self.poke)?;
        self.finish_recording()?;
        (self.source, self.panes, self.step, self.grab) = (source, panes, 0, None);
        self.set_stage();
        Ok(())
    }

    fn set_stage(&mut self) {
        // Positions that the page has sent stay valid.
        let origin = self.stage.origin;
        self.stage = Stage::of(&self.panes[0].world);
        if self.step > 0 {
            self.stage.origin = origin;
        }
        self.version += 1;
    }

    /// Starts a recording of all panes, or ends it.
    fn record(&mut self, on: bool) -> Result<(), Error> {
        if !on {
            return self.finish_recording();
        }
        let caption = |pane: &Pane| text::caption(&self.source, pane);
        self.recorders =
            self.panes.iter().map(|pane| Recorder::new(&pane.world, caption(pane), 1, true)).collect();
        Ok(())
    }

    /// Ends the recording, if there is one, and makes its page.
    fn finish_recording(&mut self) -> Result<(), Error> {
        if self.recorders.is_empty() {
            return Ok(());
        }
        let mut panels = Vec::new();
        for (recorder, pane) in std::mem::take(&mut self.recorders).into_iter().zip(&self.panes) {
            let (bytes, header) = recorder.finish(&pane.outcome())?;
            let color = Style::of(pane.world.settings.solver.name).color.to_string();
            panels.push(RecordingPanel { bytes, header, color });
        }
        self.replay = Some(page::page(&panels));
        Ok(())
    }
}

/// The panes of a scene at its start.
fn open(source: &Source, settings: Vec<Settings>, poke: Option<u64>) -> Result<Vec<Pane>, Error> {
    settings.into_iter().map(|settings| Pane::new(source.open()?, settings, poke)).collect()
}
