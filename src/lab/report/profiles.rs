//! `profiles.svg`: solvers compared over all scenes.

use super::style::{LEGEND_ROW, legend_places, solver_color, solver_legend};
use super::table::{finish, table};
use crate::lab::error::Error;
use crate::lab::picture::axes::{Area, Drawn, GRID, INK, LogScale, with_dark, write, write_upwards};
use crate::lab::study::Record;
use crate::lab::study::curve::{ErrorAxis, solvers_of};
use crate::lab::study::profile::Profile;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const PANEL_WIDTH: i32 = 400;
const PANEL_HEIGHT: i32 = 270;
/// Lines of the heading.
const HEADING: [&str; 2] = [
    "Share of scenes solved within a factor of the fastest solver",
    "Upper left is better; lines that coincide are drawn side by side",
];
const HEADING_LINE: i32 = 20;
const TOP: i32 = 28;
const LEFT: i32 = 70;
const RIGHT: i32 = 24;
const BOTTOM: i32 = 56;

/// Factors in the table. The last column is the fraction of scenes that the solver solves at all.
const FACTORS: [f64; 3] = [1.0, 1.5, 4.0];

fn profiles(records: &[Record]) -> Vec<Profile> {
    let profile = |axis| Profile::of(records, axis);
    ErrorAxis::ALL.into_iter().map(profile).filter(|p| p.scenes > 0).collect()
}

/// Condition on an axis for counting a scene as solved.
fn tolerance(axis: ErrorAxis) -> String {
    format!("{} in tolerance", axis.name())
}

/// The picture as SVG text.
pub fn svg(records: &[Record]) -> Result<String, Error> {
    let mut text = String::new();
    draw(records, &mut text).map_err(|e| Error::invalid("profiles.svg", e.to_string()))?;
    Ok(with_dark(&text))
}

fn draw(records: &[Record], text: &mut String) -> Drawn {
    let (solvers, profiles) = (solvers_of(records), profiles(records));
    let rows = legend_places(&solvers, PANEL_WIDTH).last().map_or(0, |place| place.1 + 1);
    let head = HEADING_LINE * (HEADING.len() as i32 + 1) + LEGEND_ROW * rows;
    // Panels are stacked vertically, so that they are large enough on a narrow screen.
    let size = (PANEL_WIDTH as u32, (head + PANEL_HEIGHT * profiles.len() as i32) as u32);
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    for (i, line) in (0..).zip(HEADING) {
        write(&root, line, (8, 18 + HEADING_LINE * i), 14, HPos::Left)?;
    }
    solver_legend(&root, &solvers, 18 + HEADING_LINE * HEADING.len() as i32, PANEL_WIDTH)?;
    for (i, profile) in (0..).zip(&profiles) {
        panel(&root, head + PANEL_HEIGHT * i, profile)?;
    }
    root.present()?;
    Ok(())
}

fn panel(area: &Area, top: i32, profile: &Profile) -> Drawn {
    let (left, right, bottom) = (LEFT, PANEL_WIDTH - RIGHT, top + PANEL_HEIGHT - BOTTOM);
    let top = top + TOP;
    let all = || profile.ratios.iter().flat_map(|(_, r)| r.iter().copied());
    let most = all().fold(2.0, f64::max);
    let mut scale = LogScale::of([1.0, most].into_iter(), 5);
    scale.limits[0] = 1.0;
    // Margin at both ends for steps drawn next to each other.
    let room = profile.ratios.len() as i32 + 2;
    let y = |share: f64| bottom - room - (share * (bottom - top - 2 * room) as f64).round() as i32;
    for &tick in &scale.ticks {
        let x = scale.pixel(tick, left, right);
        area.draw(&PathElement::new(vec![(x, top), (x, bottom)], GRID))?;
        write(area, &format!("{}×", (10.0 * tick).round() / 10.0), (x, bottom + 12), 12, HPos::Center)?;
    }
    for quarter in 0..=4 {
        let share = 0.25 * f64::from(quarter);
        area.draw(&PathElement::new(vec![(left, y(share)), (right, y(share))], GRID))?;
        write(area, &format!("{:.0} %", 100.0 * share), (left - 6, y(share)), 12, HPos::Right)?;
    }
    area.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write_upwards(area, &format!("share of {} scenes", profile.scenes), (14, (top + bottom) / 2), 12)?;
    write(area, "time relative to the fastest solver", ((left + right) / 2, bottom + 30), 13, HPos::Center)?;
    write(area, &tolerance(profile.axis), ((left + right) / 2, top - 14), 13, HPos::Center)?;
    for (i, (solver, ratios)) in profile.ratios.iter().enumerate() {
        // Steps that coincide are shifted so that all remain visible.
        let shift = 2 * i as i32 - profile.ratios.len() as i32;
        let at = |factor: f64, share: f64| (scale.pixel(factor, left, right), y(share) + shift);
        let mut line = vec![at(1.0, profile.share(i, 1.0))];
        for &ratio in ratios.iter().filter(|&&r| r > 1.0) {
            line.push((at(ratio, 0.0).0, line[line.len() - 1].1));
            line.push(at(ratio, profile.share(i, ratio)));
        }
        line.push((right, line[line.len() - 1].1));
        area.draw(&PathElement::new(line, solver_color(solver).stroke_width(2)))?;
    }
    Ok(())
}

/// The profiles as a table: fractions of scenes, a line per solver and error.
pub fn profile_table(records: &[Record]) -> String {
    let profiles = profiles(records);
    let mut rows = table(&[
        "solved if",
        "scenes",
        "solver",
        "fastest or tied",
        "within 1.5×",
        "within 4×",
        "in any time",
    ]);
    for profile in &profiles {
        for (i, (solver, _)) in profile.ratios.iter().enumerate() {
            let share = |factor: f64| format!("{:.0} %", 100.0 * profile.share(i, factor));
            let mut cells = vec![tolerance(profile.axis)];
            cells.extend([format!("{} of {}", profile.solvable, profile.scenes), solver.to_string()]);
            cells.extend(FACTORS.map(share));
            cells.push(share(f64::INFINITY));
            rows.add_row(cells);
        }
    }
    if profiles.is_empty() {
        return String::new();
    }
    "Performance profiles: share of scenes that each solver solves within a factor of the fastest;\n\
     scenes: how many of them at least one solver solves\n"
        .to_string()
        + &finish(rows, 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::record;

    fn two_solvers() -> Vec<Record> {
        let soft = |substeps, time, error| Record { solver: "soft_step", ..record(8, substeps, time, error) };
        vec![record(8, 1, 10.0, 0.1), record(8, 2, 20.0, 0.001), soft(1, 10.1, 0.1), soft(2, 20.2, 0.001)]
    }

    #[test]
    fn the_profile_has_its_table_and_its_picture() {
        let text = profile_table(&two_solvers());
        assert!(text.contains("penetration in tolerance") && text.contains("1 of 1"), "{text}");
        assert_eq!(text.matches("100 %").count(), 16, "{text}");
        let picture = svg(&two_solvers()).unwrap();
        assert!(picture.contains("share of 1 scenes") && !picture.to_lowercase().contains("nan"));
        assert_eq!(profile_table(&[]), "");
        assert!(svg(&[]).is_ok());
    }
}
