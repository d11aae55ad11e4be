//! The command line: commands and their options.

use super::advise::AdviseArgs;
use super::compare::CompareArgs;
use super::converge::ConvergeArgs;
use super::list::ListArgs;
use super::profile::ProfileArgs;
use super::run::RunArgs;
use super::study::{EXAMPLES as STUDY_EXAMPLES, StudyArgs};
use super::verify::VerifyArgs;
use super::view::ViewArgs;
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

const EXAMPLES: &str = "\
Examples:
  simpulse                                       the default study, into results/
  simpulse --quick                               a look at everything, in seconds
  simpulse study --scenes stack:40,arch --solvers soft_step,pgs --lanes 1,8 --substeps 2,4,8
  simpulse run pyramid:50 --solver soft_step --lanes 16
  simpulse view stack:20 --solvers soft_step,shim      drag bodies in a browser
  simpulse list arch --json > my.json            a scene to edit …
  simpulse run my.json --state out.csv --every 10     … and to run";

const COMPLETION_EXAMPLES: &str = "\
Examples:
  simpulse completions bash > ~/.local/share/bash-completion/completions/simpulse
  simpulse completions zsh > ~/.zfunc/_simpulse
  simpulse completions fish > ~/.config/fish/completions/simpulse.fish";

/// A laboratory for 2D contact solvers: how fast are they, and how wrong?
///
/// Without a command, runs the default study: a solver of every family on scenes that are hard or
/// whose reference value is known, at lane widths 1, 4, 8 and 16 and up to five budgets each. It prints
/// the cheapest setting that is good enough on each scene and a ranking, and writes report.html,
/// tables.txt, study.csv and study.json.
#[derive(Parser, Debug)]
#[command(version, after_help = EXAMPLES, max_term_width = 100, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// The command; a study if none is given.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Options of the study that runs without a command.
    #[command(flatten)]
    pub study: StudyArgs,
}

/// Commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Compare solvers, budgets and lane widths by time and by error
    #[command(after_help = STUDY_EXAMPLES)]
    Study(Box<StudyArgs>),
    Compare(CompareArgs),
    Run(RunArgs),
    View(ViewArgs),
    Advise(AdviseArgs),
    Converge(ConvergeArgs),
    Verify(VerifyArgs),
    Profile(ProfileArgs),
    List(ListArgs),
    /// Print shell completions
    #[command(after_help = COMPLETION_EXAMPLES)]
    Completions(CompletionArgs),
}

/// Arguments of `simpulse completions`.
#[derive(Args, Debug)]
pub struct CompletionArgs {
    /// Which one
    pub shell: Shell,
}
