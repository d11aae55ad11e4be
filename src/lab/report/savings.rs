//! Savings from specialization as a table.

use super::table::{finish, table};
use super::units::{digits, lanes};
use crate::lab::study::savings::Saving;

const LEGEND: &str = "\
Savings from specialization: what a kernel gains by dropping a feature that its scene does not use.
bytes, ns: per prepared contact, and per contact and sweep, with only the features of the scene; saved: how much
larger they are with this feature. frictionless: the scene with every friction coefficient zero.
same bits: whether both kernels give the same state.
";

/// Table of the savings, one per line.
pub fn savings_table(savings: &[Saving]) -> String {
    let mut text = LEGEND.to_string();
    if savings.is_empty() {
        return text + "\nno scene lacks a feature and has 100 contacts or more\n";
    }
    for own in savings.chunk_by(|a, b| (a.solver, a.lanes) == (b.solver, b.lanes)) {
        text += &format!("\n{}, {}\n", own[0].solver, lanes(own[0].lanes));
        let mut rows = table(&["scene", "feature", "bytes", "saved", "ns", "saved", "same bits"]);
        for saving in own {
            rows.add_row([
                saving.scene.clone(),
                saving.feature.to_string(),
                format!("{:.0}", saving.bytes),
                format!("{:.0}", saving.bytes_saved),
                digits(saving.ns),
                digits(saving.ns_saved),
                if saving.bits_equal { "yes" } else { "NO" }.to_string(),
            ]);
        }
        text += &finish(rows, 2);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_names_its_scene() {
        let saving = |feature| Saving {
            scene: "pile".to_string(),
            solver: "pgs",
            lanes: 1,
            feature,
            bytes: 28.0,
            bytes_saved: 27.0,
            ns: 2.5,
            ns_saved: -0.5,
            bits_equal: false,
        };
        let text = savings_table(&[saving("friction"), saving("all")]);
        assert_eq!(text.matches("\npile ").count(), 2, "{text}");
        assert!(text.contains("pgs, 1 lane\n") && text.contains("-0.50") && text.contains("NO"), "{text}");
        assert!(savings_table(&[]).contains("no scene lacks"));
    }
}
