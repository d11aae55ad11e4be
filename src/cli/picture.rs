//! `simpulse run SCENE --picture FILE.svg`: draws one frame of a scene.

use super::output::print_beside;
use super::run::{RunArgs, how, settings};
use crate::lab::error::Error;
use crate::lab::files::{self, is_standard_output};
use crate::lab::metrics::overlaps::Overlaps;
use crate::lab::overrides;
use crate::lab::picture::draw::{WIDTHS, draw};
use crate::lab::picture::frame::{Frame, Stage};
use crate::lab::study::{check_seed, open_scene};
use crate::lab::units::{quantity, si};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Options of a picture.
#[derive(Args, Debug)]
pub struct PictureArgs {
    /// Draw one frame instead of measuring: bodies colored by their deepest overlap; every contact point with its
    /// normal and an arrow for the impulse of the step on the upper body; `-` is standard output
    #[arg(help_heading = "Output", long, value_name = "FILE.svg", conflicts_with_all = ["record", "state", "contacts", "joints", "steps", "every", "all", "json"])]
    pub picture: Option<PathBuf>,
    /// Step after which the picture is taken; 0 is the start [default: 60]
    #[arg(help_heading = "Output", long, value_name = "N", requires = "picture")]
    pub step: Option<u32>,
    /// Width of the picture in pixels [default: 1200]
    #[arg(help_heading = "Output", long, value_name = "PIXELS", requires = "picture")]
    pub width: Option<u32>,
    /// Penetration that has the darkest color, the same in every picture, so that they compare [default: 10mm]
    #[arg(help_heading = "Output", long, value_name = "LENGTH", requires = "picture")]
    pub scale: Option<String>,
}

/// Draws the picture into the file.
pub fn run(args: &RunArgs, path: &Path) -> Result<ExitCode, Error> {
    let is_svg = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    if !is_svg && !is_standard_output(path) {
        return Err(Error::invalid("--picture", format!("'{}' does not end in .svg", path.display())));
    }
    let PictureArgs { step, width, scale, .. } = &args.picture;
    let (step, width) = (step.unwrap_or(60), width.unwrap_or(1200));
    let [least, most] = WIDTHS;
    if !(least..=most).contains(&width) {
        return Err(Error::invalid("width", format!("{width} is not from {least} to {most}")));
    }
    let scale = scale.as_deref().unwrap_or("10mm");
    let darkest = quantity("scale", scale, "m")?;
    if !(darkest > 0.0 && darkest.is_finite()) {
        return Err(Error::invalid("--scale", format!("{scale} is no positive length")));
    }
    check_seed(&args.scene, args.seed)?;
    let scene = open_scene(&args.scene, args.seed, None, args.dt)?.scene;
    let mut world = scene.build(settings(args, args.setting.settings()?)?)?;
    for _ in 0..step {
        world.step().map_err(|divergence| Error::invalid("step", divergence.to_string()))?;
    }
    let stage = Stage::of(&world);
    let frame = Frame::of(&world, &stage, Some(&mut Overlaps::default()));
    let title = format!("{} · step {step} ({})", scene.name, si(f64::from(step) * scene.dt, "s"));
    let s = &world.settings;
    let changed = overrides::brief(s.solver, &s.parameters);
    let subtitle = format!(
        "{}, {}{}{changed} · {} contact points, deepest overlap {}",
        s.solver.name,
        how(&world),
        if changed.is_empty() { "" } else { " · " },
        frame.points.len(),
        si(frame.deepest(), "m")
    );
    files::write(path, draw(&stage, &frame, &title, &subtitle, width, darkest).as_bytes())?;
    print_beside([path], &format!("{title}: {subtitle}\nwrote {}\n", path.display()))
}
