//! Option values. An option means the same in every command; help and error messages list all its values.

use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width, target_features};
use crate::engine::narrowphase::frozen::{FreezeLimits, Freezing};
use crate::engine::params::{Budget, Parameters, Without};
use crate::engine::solvers::{DEFAULT, VARIANTS, Variant, find};
use crate::engine::workers::MOST_THREADS;
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::overrides::{self, Override};
use crate::lab::scenes::CATALOG;
use crate::lab::study::{self, DEFAULT_SCENES, DEFAULT_SOLVERS, budget, default_solvers};
use crate::lab::units::{self, quantity};
use clap::Args;
use clap::builder::{NonEmptyStringValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};

/// An element of `--solvers`.
#[derive(Clone, Debug)]
pub enum Choice {
    /// `all`
    All,
    /// The solver of this name.
    One(&'static Variant),
}

/// `--solvers`
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Solver and setting")]
pub struct Solvers {
    /// Solvers to run
    #[arg(long, value_delimiter = ',', value_name = "SOLVER,…", value_parser = choice(), help = solvers_help())]
    pub solvers: Vec<Choice>,
}

fn solvers_help() -> String {
    format!("Solvers, or `all` of them [default: {}]", DEFAULT_SOLVERS.join(","))
}

impl Solvers {
    /// Each solver once, in the order given; the default list if none are given.
    pub fn chosen(&self) -> Vec<&'static Variant> {
        if self.solvers.is_empty() {
            return default_solvers();
        }
        let mut chosen: Vec<&'static Variant> = Vec::new();
        for choice in &self.solvers {
            let more = match choice {
                Choice::All => VARIANTS.to_vec(),
                Choice::One(variant) => vec![*variant],
            };
            for variant in more {
                if chosen.iter().all(|v| v.name != variant.name) {
                    chosen.push(variant);
                }
            }
        }
        chosen
    }
}

/// A line with the solvers that did not run; used to note what the default list leaves out.
pub fn left_out(ran: &[&'static Variant]) -> String {
    let ran: Vec<&str> = ran.iter().map(|v| v.name).collect();
    match study::left_out(&ran).as_slice() {
        [] => String::new(),
        names => format!("not run (--solvers all runs every solver): {}\n", names.join(", ")),
    }
}

/// The parser of scenes: a name, or a path.
pub fn scene() -> impl TypedValueParser<Value = String> {
    NonEmptyStringValueParser::new()
}

/// Help for one scene.
pub fn scene_help() -> String {
    format!("Scene, with an optional size after a colon, or a .json file: {}", scene_names())
}

/// Help for several scenes.
pub fn scenes_help() -> String {
    let default = DEFAULT_SCENES.join(",");
    let names = scene_names();
    format!("Scenes, with a size after a colon, or .json files [default: {default}] [scenes: {names}]")
}

fn scene_names() -> String {
    CATALOG.iter().map(|e| e.name).collect::<Vec<_>>().join(", ")
}

fn described() -> impl Iterator<Item = PossibleValue> {
    VARIANTS.iter().map(|v| PossibleValue::new(v.name))
}

pub fn choice() -> impl TypedValueParser<Value = Choice> {
    let all = std::iter::once(PossibleValue::new("all"));
    PossibleValuesParser::new(described().chain(all)).try_map(|name| match name.as_str() {
        "all" => Ok(Choice::All),
        name => find(name).map(Choice::One),
    })
}

/// The parser of `--solver`.
pub fn solver() -> impl TypedValueParser<Value = &'static Variant> {
    PossibleValuesParser::new(described()).try_map(|name| find(&name))
}

/// The parser of `--lanes`.
pub fn lanes() -> impl TypedValueParser<Value = LaneWidth> {
    PossibleValuesParser::new(["1", "4", "8", "16"]).try_map(|text| {
        let width = text.parse().ok().and_then(LaneWidth::from_lanes);
        width.filter(|width| LaneWidth::ALL.contains(width)).ok_or_else(|| {
            let (features, widest) = (target_features(), LaneWidth::WIDEST.lanes());
            let message = format!(
                "{text}: this build is for {features}, with at most {widest} lanes; the feature `emulated` has 16"
            );
            Error::invalid("lanes", message)
        })
    })
}

/// The parser of constraint orders.
pub fn order() -> impl TypedValueParser<Value = Order> {
    // The names in files of results are accepted as well.
    let names = Order::ALL.map(|order| match order {
        Order::Colored => PossibleValue::new(units::order(order)).aliases(["colored", "coloured"]),
        order => PossibleValue::new(units::order(order)).alias(order.name()),
    });
    PossibleValuesParser::new(names).map(|name| {
        let is_it = |order: &Order| [order.name(), units::order(*order)].contains(&name.as_str());
        Order::ALL.into_iter().find(is_it).unwrap_or(Order::Colored)
    })
}

/// The parser of `--threads`.
pub fn threads() -> impl TypedValueParser<Value = usize> {
    clap::value_parser!(u64).range(1..=MOST_THREADS as u64).map(|threads| threads as usize)
}

/// The parser of `--impacts`.
pub fn impacts() -> impl TypedValueParser<Value = Impacts> {
    let names = Impacts::ALL.map(|i| PossibleValue::new(i.name()));
    PossibleValuesParser::new(names)
        .map(|name| Impacts::ALL.into_iter().find(|i| i.name() == name).unwrap_or_default())
}

/// `--impacts` of commands that take one treatment.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Solver and setting")]
pub struct ImpactArgs {
    /// Impact law: own is the solver's, waves solves impacts in waves before the step, none turns bouncing off
    #[arg(long, default_value = "own", value_name = "TREATMENT", value_parser = impacts())]
    pub impacts: Impacts,
}

/// `--frozen` of commands that take one choice.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Solver and setting")]
pub struct FrozenArgs {
    /// Contacts that keep their normal and lever arms while bodies hardly move: own is the solver's choice, off is
    /// never, DISTANCE,TURN within such a motion (1mm,0.01: meters and radians), and DISTANCE,TURN,loaded only where
    /// both points of a contact bear load
    #[arg(long, default_value = "own", value_name = "LIMITS", value_parser = frozen)]
    pub frozen: Freezing,
}

/// The parser of `--frozen`. Errors: a word that is none of them, a distance or turn that is not positive.
pub(super) fn frozen(text: &str) -> Result<Freezing, Error> {
    let refused = |why: &str| Error::invalid("frozen", format!("'{text}' {why}"));
    let positive = |what: &str, text: &str, unit: &str| {
        let value = quantity("frozen", text, unit)?;
        if value > 0.0 {
            Ok(value as f32)
        } else {
            Err(refused(&format!("has a {what} that is not positive")))
        }
    };
    match text.split(',').collect::<Vec<_>>()[..] {
        ["own"] => Ok(Freezing::Own),
        ["off"] => Ok(Freezing::Off),
        [distance, turn] | [distance, turn, "loaded"] => Ok(Freezing::Within(FreezeLimits {
            distance: positive("distance", distance, "m")?,
            turn: positive("turn", turn, "rad")?,
            loaded_only: text.ends_with(",loaded"),
        })),
        _ => Err(refused("is none of own, off, DISTANCE,TURN and DISTANCE,TURN,loaded")),
    }
}

/// `--without` of commands that run a solver.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Solver and setting")]
pub struct WithoutArgs {
    /// Mechanisms of the solver to leave out (`simpulse verify --without all` shows what each is for)
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", value_parser = NonEmptyStringValueParser::new())]
    pub without: Vec<String>,
}

impl WithoutArgs {
    /// The mechanisms to leave out of `solver`. Errors: a mechanism that the solver does not have.
    pub fn of(&self, solver: &Variant) -> Result<Without, Error> {
        self.without.iter().try_fold(Without::default(), |all, name| Ok(all.and(solver.mechanism(name)?)))
    }
}

/// Each width once, in ascending order; `own` if none are given.
pub fn widths(given: &[LaneWidth], own: Vec<LaneWidth>) -> Vec<LaneWidth> {
    if given.is_empty() {
        return own;
    }
    let mut widths = given.to_vec();
    widths.sort();
    widths.dedup();
    widths
}

/// The budget and the parameters of a setting.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Solver and setting")]
pub struct BudgetArgs {
    /// Substeps [default: the solver's]
    #[arg(long, value_name = "N")]
    pub substeps: Option<u32>,
    /// Velocity sweeps per substep [default: the solver's]
    #[arg(long, value_name = "N")]
    pub velocity_iterations: Option<u32>,
    /// Relaxation sweeps per substep [default: the solver's]
    #[arg(long, value_name = "N")]
    pub relax_iterations: Option<u32>,
    /// Position sweeps per substep [default: the solver's]
    #[arg(long, value_name = "N")]
    pub position_iterations: Option<u32>,
    /// Solver parameters, such as `contact_hertz=60` (`simpulse list solvers` lists them)
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
}

/// The solver, its budget and its parameters, for commands that run one setting.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Solver and setting")]
pub struct SettingArgs {
    /// Solver
    #[arg(long, default_value = DEFAULT, value_name = "SOLVER", value_parser = solver())]
    pub solver: &'static Variant,
    /// Budget and parameters
    #[command(flatten)]
    pub work: BudgetArgs,
    /// Impacts
    #[command(flatten)]
    pub impacts: ImpactArgs,
    /// Frozen contacts
    #[command(flatten)]
    pub frozen: FrozenArgs,
    /// Mechanisms
    #[command(flatten)]
    pub without: WithoutArgs,
}

impl SettingArgs {
    /// The default solver at its standard setting.
    pub fn standard() -> Result<Self, Error> {
        Ok(SettingArgs {
            solver: find(DEFAULT)?,
            work: BudgetArgs::default(),
            impacts: ImpactArgs::default(),
            frozen: FrozenArgs::default(),
            without: WithoutArgs::default(),
        })
    }

    /// The solver with its budget, parameters, mechanisms and treatments of impacts and frozen contacts.
    /// Errors: as [`Self::budget`] and [`Self::parameters`].
    pub fn settings(&self) -> Result<Settings, Error> {
        let (budget, parameters) = (self.budget()?, self.parameters()?);
        let (impacts, without) = (self.impacts.impacts, self.without.of(self.solver)?);
        let frozen = self.frozen.frozen;
        Ok(Settings { budget, parameters, impacts, frozen, without, ..Settings::new(self.solver) })
    }

    /// The budget. Errors: one that the solver cannot run with; sweeps of a kind that it does not have.
    pub fn budget(&self) -> Result<Budget, Error> {
        let (own, work) = (self.solver.budget, &self.work);
        let given = [
            ("velocity-iterations", work.velocity_iterations),
            ("relax-iterations", work.relax_iterations),
            ("position-iterations", work.position_iterations),
        ];
        for (option, _) in given.iter().filter(|(_, count)| count.is_some()) {
            budget::check_used(option, &[self.solver])?;
        }
        let chosen = Budget {
            substeps: work.substeps.unwrap_or(own.substeps),
            velocity_iterations: work.velocity_iterations.unwrap_or(own.velocity_iterations),
            relax_iterations: work.relax_iterations.unwrap_or(own.relax_iterations),
            position_iterations: work.position_iterations.unwrap_or(own.position_iterations),
        };
        budget::check(&chosen, self.solver)?;
        Ok(chosen)
    }

    /// The solver's parameters. Errors: a parameter that it does not have, a value out of its range.
    pub fn parameters(&self) -> Result<Parameters, Error> {
        overrides::check(&[self.solver], &self.work.set)?;
        overrides::values(self.solver, &self.work.set)
    }
}

/// `--lanes` of commands that run at one width.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Solver and setting")]
pub struct LaneArgs {
    /// Lanes per instruction [default: the widest that this build has instructions for; wider ones
    /// are emulated]
    #[arg(long, value_name = "N", value_parser = lanes())]
    pub lanes: Option<LaneWidth>,
}

impl LaneArgs {
    /// The width given, or the widest native one.
    pub fn or_native(&self) -> LaneWidth {
        self.lanes.unwrap_or(native_width())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_each_once_and_all_means_all() {
        let names = |list: &[&str]| -> Vec<&str> {
            let choice = |&name: &&str| find(name).map_or(Choice::All, Choice::One);
            let solvers = Solvers { solvers: list.iter().map(choice).collect() };
            solvers.chosen().iter().map(|v| v.name).collect()
        };
        assert_eq!(names(&["soft_step", "pgs", "soft_step"]), ["soft_step", "pgs"]);
        assert_eq!(names(&["pgs", "all"]).len(), VARIANTS.len());
        assert_eq!(names(&[]), DEFAULT_SOLVERS);
        assert_eq!(left_out(VARIANTS.as_slice()), "");
        let (w1, w8) = (LaneWidth::W1, LaneWidth::W8);
        assert_eq!(widths(&[w8, w1, w8], vec![]), [w1, w8]);
    }
}
