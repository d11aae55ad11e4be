//! The interface of an engine for the race and the check, and the settings it runs with.

use crate::box2d::Box2d;
use crate::ours::Simpulse;
use crate::rapier::Rapier;
use simpulse::engine::broadphase::BroadPhaseKind;
use simpulse::engine::lanes::{LaneWidth, native_width};
use simpulse::lab::scenes::Scene;

/// A scene inside an engine, without sleeping.
pub trait Engine {
    /// Advances by the scene's step. Errors: the engine reports that it diverged.
    fn step(&mut self) -> Result<(), String>;

    /// State of a body, by its index in the scene.
    fn state(&self, body: usize) -> State;

    /// Number of bodies in the engine.
    fn bodies(&self) -> usize;

    /// Number of contact points that the engine currently solves.
    fn points(&self) -> usize;
}

/// A body after a step, in the precision of the engine.
pub struct State {
    /// Center of mass (m).
    pub position: [f32; 2],
    /// (cos θ, sin θ)
    pub rotation: [f32; 2],
    /// Velocity of the center of mass (m/s).
    pub velocity: [f32; 2],
    /// Angular velocity (rad/s).
    pub angular_velocity: f32,
}

/// Which engine, and its lane width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Maker {
    /// Eight lanes (AVX2).
    Box2d,
    /// Eight lanes.
    Rapier,
    /// `soft_step` of this crate at this width, with this broad phase.
    Simpulse(LaneWidth, BroadPhaseKind),
    /// Another solver of this crate at its own settings.
    Solver(&'static str),
}

/// An engine and its settings. Everything else is at its defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// Which engine.
    pub maker: Maker,
    /// Substeps, which rapier calls solver iterations.
    pub substeps: u32,
    /// Stiffness of contacts (Hz); 30 is the default of all three.
    pub hertz: f32,
    /// Whether manifolds whose bodies hardly moved are kept. This is the default of engines that support it;
    /// simpulse does not.
    pub recycling: bool,
    /// Whether continuous collision is on.
    pub continuous: bool,
    /// Threads. rapier has them with the feature `parallel` of this program.
    pub threads: usize,
}

impl Contender {
    /// An engine with this number of substeps and otherwise at its defaults, but for continuous collision.
    pub const fn new(maker: Maker, substeps: u32, continuous: bool) -> Self {
        Contender { maker, substeps, hertz: 30.0, recycling: true, continuous, threads: 1 }
    }

    /// Whether this is an engine at its defaults in the race.
    pub fn is_default(&self) -> bool {
        *self == Contender { threads: self.threads, ..Contender::new(self.maker, 4, false) }
    }

    /// Builds the scene in the engine. Errors: a part of the scene that the engine does not support.
    pub fn build(&self, scene: &Scene) -> Result<Box<dyn Engine>, String> {
        Ok(match self.maker {
            Maker::Box2d => Box::new(Box2d::new(scene, self)?),
            Maker::Rapier => Box::new(Rapier::new(scene, self)?),
            Maker::Simpulse(..) | Maker::Solver(_) => Box::new(Simpulse::new(scene, self)?),
        })
    }

    /// Name in tables.
    pub fn name(&self) -> String {
        match self.maker {
            Maker::Box2d => "Box2D x8".into(),
            Maker::Rapier => "rapier x8".into(),
            Maker::Solver(name) => format!("our {name}"),
            Maker::Simpulse(width, BroadPhaseKind::HashGrid) => format!("simpulse x{} grid", width.lanes()),
            Maker::Simpulse(width, _) => format!("simpulse x{}", width.lanes()),
        }
    }

    /// Settings in tables.
    pub fn setting(&self) -> String {
        let against_static = if self.hertz == 30.0 { String::new() } else { format!(", {} Hz", self.hertz) };
        let anew = if self.recycling { "" } else { ", no recycling" };
        let threads = match (self.threads, self.maker) {
            (1, _) => String::new(),
            (_, Maker::Rapier) if cfg!(not(feature = "parallel")) => ", 1 thread".into(),
            (threads, _) => format!(", {threads} threads"),
        };
        format!("n = {}{against_static}{anew}{threads}", self.substeps)
    }
}

/// All contenders: every engine at its defaults (n = 4) and, unless `quick`, at 2 and 8 substeps, and at 8 and 14
/// substeps with contacts of 60 and 105 Hz, the stiffest that Box2D's clamp allows there. The other widths and
/// broad phase of this crate run too, and the other engines without contact recycling. With several `threads` each also runs
/// with one at its defaults.
pub fn contenders(quick: bool, threads: usize) -> Vec<Contender> {
    let ours = |width| Maker::Simpulse(width, BroadPhaseKind::default());
    let native = native_width();
    let default = [(4, 30.0)];
    let all_settings = [(2, 30.0), (4, 30.0), (8, 30.0), (8, 60.0), (14, 105.0)];
    let every = if quick { &default[..] } else { &all_settings[..] };
    let mut all = Vec::new();
    let mut add = |maker, settings: &[(u32, f32)]| {
        let of = |&(substeps, hertz)| Contender { hertz, ..Contender::new(maker, substeps, false) };
        all.extend(settings.iter().map(of));
    };
    for maker in [Maker::Box2d, Maker::Rapier, ours(native)] {
        add(maker, every);
    }
    for width in [LaneWidth::W16, LaneWidth::W8, LaneWidth::W4].into_iter().filter(|&w| w != native) {
        add(ours(width), &every[..every.len().min(3)]);
    }
    add(Maker::Simpulse(native, BroadPhaseKind::HashGrid), &default);
    // `shim` sets its contact frequencies itself. `box2d` and `rapier` are this crate's versions of those
    // engines' methods.
    add(Maker::Solver("shim"), &[(14, 30.0), (8, 30.0), (3, 30.0)]);
    for name in ["box2d", "rapier"] {
        add(Maker::Solver(name), &default);
    }
    if !quick {
        add(Maker::Solver("tgs_ngs"), &all_settings[1..3]);
    }
    let anew = |maker| Contender { recycling: false, ..Contender::new(maker, 4, false) };
    all.extend([Maker::Box2d, Maker::Rapier].map(anew));
    if threads > 1 {
        let alone: Vec<Contender> = all.iter().filter(|contender| contender.is_default()).copied().collect();
        all.iter_mut().for_each(|contender| contender.threads = threads);
        all.extend(alone);
    }
    all
}
