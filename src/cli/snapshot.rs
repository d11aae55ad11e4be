//! `simpulse snapshot`: draws one frame of a scene.

use super::output::print_beside;
use super::run::settings;
use super::values::{self, SettingArgs, scene_help};
use crate::engine::lanes::LaneWidth;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::files::{self, is_standard_output};
use crate::lab::metrics::overlaps::Overlaps;
use crate::lab::picture::draw::{WIDTHS, draw};
use crate::lab::picture::frame::{Frame, Stage};
use crate::lab::picture::{Picture, png, raster, svg};
use crate::lab::study::{budget, open_scene};
use crate::lab::units::{lanes, quantity, si};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Draw one frame of a scene as SVG or PNG
///
/// Bodies are colored by their deepest overlap. Every contact point has its normal and an arrow for the impulse of
/// the step on the upper of its two bodies; poses, points and overlaps are those after the step.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  simpulse snapshot pyramid:20 --step 120 -o pyramid.svg
  simpulse snapshot arch --step 60 --solver pgs --velocity-iterations 4 -o arch.png --width 1600")]
pub struct SnapshotArgs {
    /// Scene
    #[arg(value_name = "SCENE", value_parser = values::scene(), help = scene_help())]
    pub scene: String,
    /// Step after which the frame is taken; 0 is the start
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub step: u32,
    /// File to write: .svg or .png; `-` is standard output, as SVG
    #[arg(short, long = "out", alias = "output", value_name = "FILE")]
    pub output: PathBuf,
    /// Width of the picture in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1200)]
    pub width: u32,
    /// Penetration that has the darkest color; the same in every picture, so that they compare
    #[arg(long, value_name = "LENGTH", default_value = "10mm")]
    pub scale: String,
    /// Solver, budget and parameters
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Lanes per instruction [default: as `simpulse run`]
    #[arg(long, value_name = "N", value_parser = values::lanes())]
    pub lanes: Option<LaneWidth>,
    /// Constraint order
    #[arg(long, default_value = "colored", value_name = "ORDER", value_parser = values::order())]
    pub order: Order,
    /// Step in seconds [default: that of the scene]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub dt: Option<f64>,
    /// Random seed of scenes that have one
    #[arg(long)]
    pub seed: Option<u64>,
}

/// The encoder for a file name.
fn encoder(path: &Path) -> Result<fn(&Picture) -> Vec<u8>, Error> {
    if is_standard_output(path) {
        return Ok(|picture| svg::svg(picture).into_bytes());
    }
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("svg") => Ok(|picture| svg::svg(picture).into_bytes()),
        Some("png") => Ok(|picture| png::png(picture.size, &raster::pixels(picture))),
        _ => Err(Error::invalid("--out", format!("'{}' ends neither in .svg nor in .png", path.display()))),
    }
}

/// Runs the command.
pub fn run(args: &SnapshotArgs) -> Result<ExitCode, Error> {
    let encode = encoder(&args.output)?;
    if !(WIDTHS[0]..=WIDTHS[1]).contains(&args.width) {
        let [least, most] = WIDTHS;
        return Err(Error::invalid("width", format!("{} is not from {least} to {most}", args.width)));
    }
    let darkest = quantity("scale", &args.scale, "m")?;
    if !(darkest > 0.0 && darkest.is_finite()) {
        return Err(Error::invalid("--scale", format!("{} is no positive length", args.scale)));
    }
    let settings = settings(&args.setting, args.order, args.lanes)?;
    let loaded = open_scene(&args.scene, args.seed, None, args.dt)?;
    let mut world = loaded.scene.build(settings)?;
    for _ in 0..args.step {
        world.step().map_err(|divergence| Error::invalid("step", divergence.to_string()))?;
    }
    let stage = Stage::of(&world);
    let frame = Frame::of(&world, &stage, Some(&mut Overlaps::default()));
    let s = &world.settings;
    let order = match s.order {
        Order::Colored => lanes(world.lane_width().lanes()),
        order => format!("{} order", order.name()),
    };
    let time = si(f64::from(args.step) * loaded.scene.dt, "s");
    let title = format!("{} · step {} ({time})", loaded.scene.name, args.step);
    let budget = budget::with_impacts(budget::brief(&s.budget, s.solver), s.impacts);
    let changed = crate::lab::overrides::brief(s.solver, &s.parameters);
    let changed = if changed.is_empty() { changed } else { format!(" · {changed}") };
    let points = frame.points.len();
    let subtitle = format!(
        "{} · {budget} · {order}{changed} · {points} contact points, deepest overlap {}",
        s.solver.name,
        si(frame.deepest(), "m")
    );
    let picture = draw(&stage, &frame, &title, &subtitle, args.width, darkest);
    files::write(&args.output, &encode(&picture))?;
    let text = format!("{title}: {subtitle}\nwrote {}\n", args.output.display());
    print_beside([args.output.as_path()], &text)
}
