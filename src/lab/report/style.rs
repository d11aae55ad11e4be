//! The style of each solver: first the solvers of [`DEFAULT_SOLVERS`], which therefore differ in color, then the
//! others of [`VARIANTS`].

use crate::engine::solvers::VARIANTS;
pub use crate::lab::chart::style::Style;
use crate::lab::study::DEFAULT_SOLVERS;

impl Style {
    /// Style of the solver of this name. A name that this program does not have gets a style computed from
    /// its letters.
    pub fn of(solver: &str) -> Style {
        let others = VARIANTS.iter().map(|v| v.name).filter(|name| !DEFAULT_SOLVERS.contains(name));
        let known = DEFAULT_SOLVERS.into_iter().chain(others).position(|name| name == solver);
        Style::at(known.unwrap_or_else(|| solver.bytes().fold(7, |sum, b| (sum * 31 + b as usize) % 64)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solvers_look_different_and_those_of_the_default_study_in_color() {
        let styles: Vec<Style> = VARIANTS.iter().map(|v| Style::of(v.name)).collect();
        assert!((0..styles.len()).all(|i| !styles[..i].contains(&styles[i])));
        let colors = DEFAULT_SOLVERS.map(|name| Style::of(name).color);
        assert!((0..colors.len()).all(|i| !colors[..i].contains(&colors[i])), "{colors:?}");
        assert_eq!(Style::of("somebody_elses"), Style::of("somebody_elses"));
    }
}
