//! Values of a record that the page needs.

use crate::lab::study::curve::{ERROR_FLOOR, ErrorAxis};
use crate::lab::study::{Record, answer};
use crate::lab::units::lanes;

/// Values of a setting. A setting is represented by its record at the fastest lane width.
pub trait Setting {
    /// Time of a step (s).
    fn time(&self) -> Option<f64>;
    /// An error, with a floor so that it can be drawn on a logarithmic axis.
    fn drawn(&self, axis: ErrorAxis) -> Option<f64>;
    /// The tolerance of an error.
    fn tolerance(&self, axis: ErrorAxis) -> Option<f64>;
    /// Whether no other setting beats it in both time and this error.
    fn on_front(&self, axis: ErrorAxis) -> bool;
    /// The failure and its step; `None` if the run holds.
    fn broke(&self) -> Option<String>;
    /// Whether it runs in a serial order instead of by colors.
    fn is_natural(&self) -> bool;
    /// The largest of its errors ÷ tolerance; `None` if it does not hold or did not reach its reference
    /// value.
    fn worst(&self) -> Option<f64>;
    /// Budget, and order or lane width, as text.
    fn words(&self) -> String;
    /// The same, abbreviated.
    fn label(&self) -> String;
}

impl Setting for Record {
    fn time(&self) -> Option<f64> {
        self.sample.as_ref().map(|sample| 1e-9 * sample.cost_ns())
    }

    fn drawn(&self, axis: ErrorAxis) -> Option<f64> {
        axis.of(self).map(|error| error.max(ERROR_FLOOR))
    }

    fn tolerance(&self, axis: ErrorAxis) -> Option<f64> {
        axis.tolerance(&self.tolerances).map(|t| t.value)
    }

    fn on_front(&self, axis: ErrorAxis) -> bool {
        match axis {
            ErrorAxis::Penetration => self.front.penetration,
            ErrorAxis::Law => self.front.law,
            ErrorAxis::Truth => self.front.truth,
            ErrorAxis::Rest => false,
        }
    }

    fn broke(&self) -> Option<String> {
        let step = self.broken.map(|b| b.step).or(self.failure.map(|f| f.step));
        self.mark().zip(step).map(|(mark, step)| format!("{} at step {step}", mark.word()))
    }

    fn is_natural(&self) -> bool {
        self.order.is_serial()
    }

    fn worst(&self) -> Option<f64> {
        Some(self.excess()).filter(|x| x.is_finite())
    }

    fn words(&self) -> String {
        match self.is_natural() {
            true => format!("{}, {} order", self.budget_text, self.order.name()),
            false => format!("{}, {}", self.budget_text, lanes(self.lanes)),
        }
    }

    fn label(&self) -> String {
        let numbers: Vec<&str> = self.budget_text.split(' ').filter(|w| w.parse::<u32>().is_ok()).collect();
        let width = if self.is_natural() { "nat".into() } else { self.lanes.to_string() };
        format!("{}@{width}", numbers.join("·"))
    }
}

/// The records of each scene.
pub fn scenes(records: &[Record]) -> Vec<&[Record]> {
    records.chunk_by(|a, b| a.scene == b.scene).collect()
}

/// Every setting of a scene at its fastest width. For settings that failed, the width is arbitrary.
pub fn fastest(scene: &[Record]) -> Vec<&Record> {
    let mut kept: Vec<&Record> = Vec::new();
    for record in scene {
        match kept.iter_mut().find(|k| answer::same(k, record)) {
            Some(other) => {
                if record.time().unwrap_or(f64::INFINITY) < other.time().unwrap_or(f64::INFINITY) {
                    *other = record;
                }
            }
            None => kept.push(record),
        }
    }
    kept
}

/// The middle one of a solver's settings; of those in colored order if there are any.
pub fn standard<'a>(scene: &'a [Record], solver: &str) -> Option<&'a Record> {
    let own: Vec<&Record> = fastest(scene).into_iter().filter(|r| r.solver == solver).collect();
    let colored: Vec<&Record> = own.iter().copied().filter(|r| !r.is_natural()).collect();
    let own = if colored.is_empty() { own } else { colored };
    own.get(own.len() / 2).copied()
}
