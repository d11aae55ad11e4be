//! The phases of every step as a Chrome trace, the JSON that Perfetto and `chrome://tracing` show.
//!
//! Steps follow each other without a gap, and so do the phases of a step, in the order of [`Phase::ALL`]: a phase that
//! returns in every substep is one block. Counters hold what a step had to do.

use super::times::Times;
use crate::engine::clock::Phase;
use crate::engine::world::StepCounts;
use crate::lab::error::Error;
use serde_json::{Value, json};

/// The process and the thread of all events.
const TRACK: [(&str, u32); 2] = [("pid", 1), ("tid", 1)];

/// The trace of a run. Errors: a time that JSON cannot express.
pub fn text(scene: &str, solver: &str, times: &Times) -> Result<String, Error> {
    let mut events = vec![event(json!({
        "ph": "M", "name": "process_name", "args": { "name": format!("simpulse {scene}, {solver}") },
    }))];
    let mut now = 0.0;
    for (i, counts) in times.counts.iter().enumerate() {
        let own = Phase::ALL.map(|phase| 1e-3 * times.phases[phase as usize][i]);
        let StepCounts { contacts, points, sweeps, row_updates, colors, overflow, impact_visits, .. } =
            *counts;
        events.push(event(json!({
            "ph": "X", "name": format!("step {}", i + 1), "ts": now, "dur": own.iter().sum::<f64>(),
            "args": {
                "contacts": contacts, "points": points, "sweeps": sweeps, "row_updates": row_updates,
                "colors": colors, "overflow": overflow, "impact_visits": impact_visits,
            },
        })));
        events.push(event(
            json!({ "ph": "C", "name": "contacts", "ts": now, "args": { "contacts": contacts } }),
        ));
        for (phase, time) in Phase::ALL.iter().zip(own).filter(|(_, time)| *time > 0.0) {
            events.push(event(json!({ "ph": "X", "name": phase.name(), "ts": now, "dur": time })));
            now += time;
        }
    }
    let trace = json!({ "displayTimeUnit": "ns", "traceEvents": events });
    serde_json::to_string(&trace).map_err(|e| Error::invalid("trace", e.to_string()))
}

/// An event on the one track. Times are in microseconds.
fn event(mut event: Value) -> Value {
    TRACK.iter().for_each(|(name, value)| event[*name] = (*value).into());
    event
}
