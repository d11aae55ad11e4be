//! `simpulse view`: a page on this machine that shows up to four solvers on one scene, side by side and in step.
//!
//! Three kinds of threads: the main one steps the [`Session`]; `server` accepts connections and answers requests, a
//! short thread each; the one `socket` that is open has a reader, which passes requests on, and a writer. A frame is
//! made only when the page is ready for one, and holds the newest state, so a slow page sees fewer frames and delays
//! nothing.

mod hub;
mod server;
mod setting;
mod socket;

use super::output::note;
use super::values::{self, SettingArgs, scene_help};
use crate::lab::error::Error;
use crate::lab::view::{Request, Session, Source};
use clap::Args;
use hub::{Event, Hub, Playback};
use serde_json::json;
use server::Door;
use setting::PaneArg;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Watch a scene under several solvers side by side, and play with it
///
/// Prints the address of a page; open it in a browser on this machine. The panes run the same scene in step. Drag a
/// body, drop a box, throw a ball or cut a joint: it happens in all panes. Below each pane are its errors with the
/// limits of the scene, the time of a step by phase, and whether the run is good enough. Settings change while it runs.
/// Nothing leaves this machine; the program ends with Ctrl-C, or when the page has been closed for a minute.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  simpulse view stack:20 --solvers soft_step,shim            drag a crate: which stack survives?
  simpulse view large_pyramid --solvers soft_step,box2d      5000 bodies
  simpulse view arch --solvers soft_step,soft_step:substeps=8,soft_step:contact_hertz=60
  simpulse view my.json --poke 1 --seed 3 --port 8000")]
pub struct ViewArgs {
    /// Scene
    #[arg(value_name = "SCENE", value_parser = values::scene(), help = scene_help())]
    pub scene: String,
    /// Solvers of the panes, at most four, each with settings of its own:
    /// SOLVER[:NAME=VALUE…] with substeps, velocity, relax, position (sweeps), frozen, impacts or a parameter
    #[arg(help_heading = "Solver and setting", long, value_name = "SOLVER,…", value_delimiter = ',', value_parser = setting::pane(), conflicts_with = "solver")]
    pub solvers: Vec<PaneArg>,
    /// Settings of all panes
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Random seed of scenes that have one
    #[arg(help_heading = "Scene and time", long)]
    pub seed: Option<u64>,
    /// Step in seconds [default: that of the scene]
    #[arg(help_heading = "Scene and time", long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub dt: Option<f64>,
    /// Give random pushes, as a player would; the seed decides which and when
    #[arg(help_heading = "Scene and time", long, value_name = "SEED")]
    pub poke: Option<u64>,
    /// Pause after this many steps
    #[arg(help_heading = "Scene and time", long, value_name = "N")]
    pub steps: Option<u64>,
    /// Port on 127.0.0.1 [default: a free one]
    #[arg(help_heading = "Page", long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    pub port: u16,
    /// End when no page has been open for this long
    #[arg(help_heading = "Page", long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    pub patience: u32,
}

/// Longest time between two looks at the clock.
const MOMENT: Duration = Duration::from_millis(50);
/// A session that is this much too slow does not try to catch up.
const TOO_LATE: Duration = Duration::from_millis(100);

/// Runs the session until nobody looks at it any more.
pub fn run(args: &ViewArgs) -> Result<ExitCode, Error> {
    let settings = match args.solvers.is_empty() {
        true => vec![args.setting.settings()?],
        false => {
            args.solvers.iter().map(|pane| pane.settings(&args.setting)).collect::<Result<_, Error>>()?
        }
    };
    let source = Source { seed: args.seed, dt: args.dt, ..Source::named(&args.scene) };
    let session = Session::new(source, settings, args.poke)?;
    let (sender, events) = channel();
    let hub = Hub::new(sender);
    let door = Door::open(args.port, hub.clone())?;
    note(&format!("{}\nOpen this address in a browser on this machine; Ctrl-C ends.\n", door.address()));
    door.listen();
    Show { session, hub, play: Playback::default(), until: args.steps, said: String::new() }
        .run(&events, Duration::from_secs(args.patience.into()))
}

/// A session with its clock and its page.
struct Show {
    session: Session,
    hub: Hub,
    play: Playback,
    /// Step before which the session pauses.
    until: Option<u64>,
    /// What the page is told about its last request.
    said: String,
}

impl Show {
    fn run(mut self, events: &Receiver<Event>, patience: Duration) -> Result<ExitCode, Error> {
        let (mut due, mut is_new) = (Instant::now(), true);
        let mut stage = 0;
        loop {
            let plays = self.play.on && self.hub.is_watched();
            let wait = if plays { due.saturating_duration_since(Instant::now()).min(MOMENT) } else { MOMENT };
            match events.recv_timeout(wait) {
                Ok(event) => {
                    is_new |= self.on(event);
                    // All that has arrived counts before the next step.
                    while let Ok(event) = events.try_recv() {
                        is_new |= self.on(event);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(ExitCode::SUCCESS),
            }
            if self.hub.is_left_for(patience) {
                note("the page is closed\n");
                return Ok(ExitCode::SUCCESS);
            }
            let now = Instant::now();
            if plays && self.play.on && now >= due {
                self.step();
                is_new = true;
                let pause = Duration::from_secs_f64(self.session.seconds() / self.play.speed);
                due = (due + pause).max(now.checked_sub(TOO_LATE).unwrap_or(now));
            } else if !plays {
                due = now;
            }
            if self.session.version() != stage || self.play.is_opened {
                (stage, self.play.is_opened) = (self.session.version(), false);
                self.hub.tell(self.session.stage_text());
            }
            if is_new && self.hub.is_ready() {
                is_new = false;
                let Playback { on, speed, .. } = self.play;
                let own = json!({ "playing": on, "speed": speed, "said": self.said });
                self.hub.show(self.session.frame(own));
            }
        }
    }

    /// Carries out an event. Returns whether the page has to be drawn again.
    fn on(&mut self, event: Event) -> bool {
        match event {
            Event::Opened => self.play.is_opened = true,
            Event::Ready => return false,
            Event::Play(playback) => {
                self.play.on = playback.on;
                self.play.speed = playback.speed;
                self.until = None;
            }
            Event::Step => {
                self.play.on = false;
                self.step();
            }
            Event::Session(request) => {
                let changes_setting = matches!(
                    request,
                    Request::Budget { .. } | Request::Parameter { .. } | Request::Treatment { .. }
                );
                let had_page = self.session.replay().map(str::len);
                match self.session.act(&request) {
                    Ok(text) => {
                        self.said.clear();
                        text.into_iter().for_each(|text| self.hub.tell(json!({ "text": text }).to_string()));
                    }
                    Err(error) => self.said = error.to_string(),
                }
                // The page shows the setting that is in force.
                self.play.is_opened |= changes_setting;
                let page = self.session.replay();
                if page.map(str::len) != had_page {
                    self.hub.keep_replay(page);
                }
            }
        }
        true
    }

    fn step(&mut self) {
        if let Err(error) = self.session.step() {
            self.said = error.to_string();
            let _ = self.session.act(&Request::Record { on: false });
            self.hub.keep_replay(self.session.replay());
        }
        if self.until.is_some_and(|steps| self.session.step_index() >= steps) {
            self.play.on = false;
        }
    }
}
