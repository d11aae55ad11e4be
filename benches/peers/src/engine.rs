//! The interface of an engine for the race and the check, and the settings it runs with.

use simpulse::engine::broadphase::BroadPhaseKind;
use simpulse::engine::lanes::{LaneWidth, native_width};

/// A scene inside an engine: one thread, no sleeping.
pub trait Engine {
    /// Advances by the scene's step. Errors: the engine reports that it diverged.
    fn step(&mut self) -> Result<(), String>;

    /// State of a body, by its index in the scene.
    fn state(&self, body: usize) -> State;

    /// Number of bodies in the engine.
    fn bodies(&self) -> usize;

    /// Number of contact points that the engine currently solves.
    fn points(&self) -> usize;

    /// Times of the last step (ms), by [`Stage`]; `None` where the engine does not report one.
    fn stages(&self) -> [Option<f64>; Stage::ALL.len()];

    /// Turns the clocks inside the step on or off, where that is possible.
    fn set_timed(&mut self, on: bool);
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

/// Parts of a step that all three engines have in some form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Bounds and new pairs. Box2D: `pairs`, `transforms` (poses and bounds), `refit`.
    Pairs,
    /// Narrow phase and impulse matching.
    Collide,
    /// Colors, lanes or islands. Box2D: `solverSetup`; its colors are maintained in `Collide`.
    Color,
    /// Constraint records.
    Prepare,
    /// Warm starting.
    WarmStart,
    /// Sweeps with position feedback.
    Solve,
    /// Sweeps without position feedback, and restitution.
    Relax,
    /// Velocities and positions of bodies.
    Integrate,
    /// The four stages above together: rapier reports only their sum.
    Stages,
    /// Storing impulses, writing poses back.
    Store,
}

impl Stage {
    /// Every stage, in the order of a step.
    pub const ALL: [Stage; 10] = [
        Stage::Pairs,
        Stage::Collide,
        Stage::Color,
        Stage::Prepare,
        Stage::WarmStart,
        Stage::Solve,
        Stage::Relax,
        Stage::Integrate,
        Stage::Stages,
        Stage::Store,
    ];

    /// Column header.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Pairs => "pairs",
            Stage::Collide => "collide",
            Stage::Color => "color",
            Stage::Prepare => "prepare",
            Stage::WarmStart => "warm start",
            Stage::Solve => "solve",
            Stage::Relax => "relax",
            Stage::Integrate => "integrate",
            Stage::Stages => "= stages",
            Stage::Store => "store",
        }
    }
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
}

impl Contender {
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
        format!("n = {}{against_static}{anew}", self.substeps)
    }
}

/// All contenders: every engine at its defaults (n = 4) and, unless `quick`, at 2 and 8 substeps, and at 8
/// substeps with contacts twice as stiff, the stiffest that Box2D's clamp allows there. The other widths and
/// broad phase of this crate run too, and the other engines without contact recycling.
pub fn contenders(quick: bool) -> Vec<Contender> {
    let ours = |width| Maker::Simpulse(width, BroadPhaseKind::default());
    let mut all = Vec::new();
    let mut add = |maker, settings: &[(u32, f32)]| {
        let contender =
            |&(substeps, hertz)| Contender { maker, substeps, hertz, recycling: true, continuous: false };
        all.extend(settings.iter().map(contender));
    };
    let default = [(4, 30.0)];
    let every = [(2, 30.0), (4, 30.0), (8, 30.0), (8, 60.0)];
    let main = if quick { &default[..] } else { &every[..] };
    add(Maker::Box2d, main);
    add(Maker::Rapier, main);
    let native = native_width();
    add(ours(native), main);
    let widths = if quick { &default[..] } else { &every[..3] };
    for width in [LaneWidth::W16, LaneWidth::W8, LaneWidth::W4].into_iter().filter(|&w| w != native) {
        add(ours(width), widths);
    }
    add(Maker::Simpulse(native, BroadPhaseKind::HashGrid), &default);
    // `shim` sets its contact frequencies itself. `box2d` and `rapier` are this crate's versions of those
    // engines' methods.
    add(Maker::Solver("shim"), &[(14, 30.0), (8, 30.0), (3, 30.0)]);
    add(Maker::Solver("box2d"), &default);
    add(Maker::Solver("rapier"), &default);
    let anew = |maker| Contender { maker, substeps: 4, hertz: 30.0, recycling: false, continuous: false };
    all.extend([Maker::Box2d, Maker::Rapier].map(anew));
    all
}
